//! Display of the conversation: the user's sentences, the agent's steps, folded once they are answered, and the answers
//! with their candidates.

use egui::{Button, CollapsingHeader, Id, Label, RichText, TextStyle, Ui};

use super::keys;
use super::panes::object_thumbnails::ObjectThumbnails;
use super::state::Tone;
use super::theme;
use crate::agent::{Refusal, RefusalKind};
use crate::math::format::things;
use crate::scene::{IdentityId, text};
use crate::ui::actions::Action;

/// Side of a candidate's thumbnail, points.
const THUMBNAIL_PX: f32 = 34.0;
/// Candidates that are shown.
const CANDIDATES: usize = 8;

/// Candidates that are always shown.
const FEW_CANDIDATES: usize = 2;
/// Width of the button that shows the others, points.
const MORE_PT: f32 = 70.0;

/// A line of the conversation.
pub(super) enum Line {
    Said(String),
    Did(String, Option<bool>),
    Answer(ChatAnswer),
    /// Another scene was opened.
    Opened(String),
}

/// Answer of the agent.
#[derive(Default)]
pub(super) struct ChatAnswer {
    pub(super) text: String,
    pub(super) candidates: Vec<(IdentityId, String)>,
    pub(super) refused: Option<Refusal>,
    /// True if it is a question to be answered by yes or no.
    pub(super) asks: bool,
    /// Actions that do what the chat does not do, with their names.
    pub(super) offers: Vec<(Action, String)>,
}

/// Click on a line of the conversation.
pub(super) enum ChatClick {
    /// A sentence to be said.
    Say(String),
    Do(Action),
}

impl ChatAnswer {
    /// An answer in words; they may come from a model.
    pub(super) fn new(said: &str) -> Self {
        Self { text: text::lines(said).into_owned(), ..Self::default() }
    }
}

/// A step of the agent; its words may come from a model.
pub(super) fn did(line: &str, done: Option<bool>) -> Line {
    Line::Did(text::line(line).into_owned(), done)
}

/// Draws all lines; returns what was clicked.
pub(super) fn show(ui: &mut Ui, lines: &[Line], object_thumbnails: &ObjectThumbnails) -> Option<ChatClick> {
    let mut clicked = None;
    let mut rest = lines;
    let opened = lines.iter().rposition(|line| matches!(line, Line::Opened(_))).unwrap_or(0);
    while let Some(first) = rest.first() {
        let at = lines.len() - rest.len();
        // Things of an earlier scene cannot be chosen, and only the last question can be answered.
        let can =
            CanAnswer { choose: at >= opened, confirm: !lines[at + 1..].iter().any(|l| matches!(l, Line::Said(_))) };

        let steps = rest.iter().take_while(|line| matches!(line, Line::Did(..))).count();
        match (steps, rest.get(steps)) {
            (0, _) => {
                clicked = show_line(ui, first, object_thumbnails, can).or(clicked);
                rest = &rest[1..];
            }
            (_, Some(Line::Answer(answer))) => {
                clicked = rest.get(steps).and_then(|line| show_line(ui, line, object_thumbnails, can)).or(clicked);
                // What the answer says already is no step, and neither is what it refuses.
                let refused = answer.refused.as_ref().map_or("", |r| r.text.as_str());
                let is_new = |line: &&Line| match line {
                    Line::Did(text, done) => {
                        *done != Some(false) && ![&answer.text, refused].iter().any(|t| t.contains(text.trim()))
                    }
                    _ => true,
                };
                let told: Vec<&Line> = rest[..steps].iter().filter(is_new).collect();
                let calls = told.iter().filter(|line| matches!(line, Line::Did(_, None))).count();
                if calls > 0 {
                    let header = RichText::new(things(calls, "step")).small().color(theme::weak());
                    CollapsingHeader::new(header)
                        .id_salt((at, "steps"))
                        .show(ui, |ui| told.iter().for_each(|line| _ = show_line(ui, line, object_thumbnails, can)));
                }
                rest = &rest[steps + 1..];
            }
            _ => {
                rest[..steps].iter().for_each(|line| _ = show_line(ui, line, object_thumbnails, can));
                rest = &rest[steps..];
            }
        }
    }
    clicked
}

/// Number of candidates that fit in one row beside a button for the others; at least one.
fn fitting(ui: &Ui, candidates: &[(IdentityId, String)], with_thumbnails: bool) -> usize {
    let (font, spacing) = (TextStyle::Button.resolve(ui.style()), ui.spacing());
    let thumbnail = if with_thumbnails { THUMBNAIL_PX + spacing.item_spacing.x } else { 0.0 };
    let beside = thumbnail + 2.0 * spacing.button_padding.x + spacing.item_spacing.x;
    let mut room = ui.available_width() - MORE_PT;
    let fits = candidates.iter().take_while(|(_, name)| {
        room -= ui.painter().layout_no_wrap(name.clone(), font.clone(), theme::text()).size().x + beside;
        room >= 0.0
    });
    fits.count().max(1)
}

/// Ways in which a line can be answered by a click.
#[derive(Clone, Copy)]
struct CanAnswer {
    choose: bool,
    confirm: bool,
}

/// Draws one line; returns what was clicked.
fn show_line(ui: &mut Ui, line: &Line, object_thumbnails: &ObjectThumbnails, can: CanAnswer) -> Option<ChatClick> {
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
        Line::Opened(name) => {
            ui.add_space(6.0);
            ui.separator();
            ui.label(RichText::new(format!("{} opened", text::elided(name, 48))).small().color(theme::weak()));
        }
        Line::Answer(ChatAnswer { text, candidates, refused, asks, offers }) => {
            // Top-aligned and one label: all lines have the same leading.
            ui.horizontal_top(|ui| {
                // What the user stopped is no failure.
                if refused.as_ref().is_some_and(|r| r.kind != RefusalKind::Stopped) {
                    theme::mark(ui, Tone::Warning, 16.0);
                }
                ui.add(Label::new(text.trim_end()).wrap());
            });
            for (action, name) in offers {
                let button = Button::new(name).shortcut_text(keys::label(ui.ctx(), action));
                if ui.add_enabled(can.choose, button).on_hover_text(action.tooltip()).clicked() {
                    clicked = Some(ChatClick::Do(action.clone()));
                }
            }
            if *asks && can.confirm {
                ui.horizontal(|ui| {
                    for answer in ["Yes", "No"] {
                        if ui.button(answer).clicked() {
                            clicked = Some(ChatClick::Say(answer.to_lowercase()));
                        }
                    }
                });
            }
            if !candidates.is_empty() {
                // One row: many chips would push the answer out of sight.
                let all = Id::unique("all candidates").with((text, candidates));
                let shows_all = ui.data(|d| d.get_temp::<bool>(all)).unwrap_or(candidates.len() <= FEW_CANDIDATES);
                ui.horizontal_wrapped(|ui| {
                    let n = if shows_all { CANDIDATES } else { fitting(ui, candidates, can.choose) };
                    for (id, name) in candidates.iter().take(n) {
                        if can.choose {
                            object_thumbnails.show(ui, *id, THUMBNAIL_PX);
                        }
                        if ui.add_enabled(can.choose, Button::new(name).small()).clicked() {
                            clicked = Some(ChatClick::Say(name.clone()));
                        }
                    }
                    let more = candidates.len().min(CANDIDATES).saturating_sub(n);
                    if more > 0 && ui.button(RichText::new(format!("{more} more")).small()).clicked() {
                        ui.data_mut(|d| d.insert_temp(all, true));
                    }
                });
            }
        }
    }
    clicked
}
