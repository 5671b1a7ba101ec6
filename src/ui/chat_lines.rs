//! Display of the conversation: the user's sentences, the agent's steps, folded once they are answered, and the answers
//! with their candidates.

use egui::{Button, CollapsingHeader, RichText, Ui};

use super::panes::object_thumbnails::ObjectThumbnails;
use super::state::Tone;
use super::theme;
use crate::agent::Refusal;
use crate::math::format::things;
use crate::scene::{IdentityId, text};

/// Side of a candidate's thumbnail, points.
const THUMBNAIL_PX: f32 = 34.0;
/// Candidates that are shown.
const CANDIDATES: usize = 8;

/// A line of the conversation.
pub(super) enum Line {
    Said(String),
    Did(String, Option<bool>),
    Answer { text: String, candidates: Vec<(IdentityId, String)>, refused: Option<Refusal> },
}

/// A step of the agent; its words may come from a model.
pub(super) fn did(line: &str, done: Option<bool>) -> Line {
    Line::Did(text::line(line).into_owned(), done)
}

/// Draws all lines; returns the candidate that was clicked.
pub(super) fn show(ui: &mut Ui, lines: &[Line], object_thumbnails: &ObjectThumbnails) -> Option<String> {
    let mut clicked = None;
    let mut rest = lines;
    while let Some(first) = rest.first() {
        let steps = rest.iter().take_while(|line| matches!(line, Line::Did(..))).count();
        match (steps, rest.get(steps)) {
            (0, _) => {
                clicked = show_line(ui, first, object_thumbnails).or(clicked);
                rest = &rest[1..];
            }
            // The answer repeats the steps, so they are folded.
            (_, Some(Line::Answer { refused, .. })) => {
                clicked = rest.get(steps).and_then(|line| show_line(ui, line, object_thumbnails)).or(clicked);
                let calls = rest[..steps].iter().filter(|line| matches!(line, Line::Did(_, None))).count();
                let header = RichText::new(things(calls.max(1), "step")).small().color(theme::weak());
                CollapsingHeader::new(header)
                    .id_salt((lines.len() - rest.len(), "steps"))
                    .default_open(refused.is_some())
                    .show(ui, |ui| rest[..steps].iter().for_each(|line| _ = show_line(ui, line, object_thumbnails)));
                rest = &rest[steps + 1..];
            }
            _ => {
                rest[..steps].iter().for_each(|line| _ = show_line(ui, line, object_thumbnails));
                rest = &rest[steps..];
            }
        }
    }
    clicked
}

/// Draws one line; returns the candidate that was clicked.
fn show_line(ui: &mut Ui, line: &Line, object_thumbnails: &ObjectThumbnails) -> Option<String> {
    let mut clicked = None;
    match line {
        Line::Said(text) => {
            ui.add_space(4.0);
            ui.label(RichText::new(text).strong());
        }
        Line::Did(text, done) => {
            let color = if *done == Some(false) { theme::warning() } else { theme::weak() };
            ui.label(RichText::new(format!("    {text}")).small().color(color));
        }
        Line::Answer { text, candidates, refused } => {
            ui.horizontal_wrapped(|ui| {
                if refused.is_some() {
                    theme::mark(ui, Tone::Warning, 16.0);
                }
                ui.label(text);
            });
            ui.horizontal_wrapped(|ui| {
                for (id, name) in candidates.iter().take(CANDIDATES) {
                    object_thumbnails.show(ui, *id, THUMBNAIL_PX);
                    if ui.add(Button::new(name).small()).clicked() {
                        clicked = Some(name.clone());
                    }
                }
            });
        }
    }
    clicked
}
