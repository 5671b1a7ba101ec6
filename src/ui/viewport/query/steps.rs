//! Steps of an answer: what each part of the sentence did and how many were left, the answer in words, and the words
//! that were not understood.

use egui::text::LayoutJob;
use egui::{FontId, RichText, Stroke, TextFormat, Ui};

use super::{Asked, Queries};
use crate::pipeline::semantics::query::language::Understood;
use crate::pipeline::semantics::query::language::outcome::{QueryStep, Why};
use crate::scene::{SemanticMap, text};
use crate::ui::theme;

/// Most letters of a line.
const LONGEST: usize = 160;

/// Draws the answer in words and the remarks on it.
pub(super) fn show_said(ui: &mut Ui, asked: &Asked) {
    let Some(understood) = &asked.answered.understood else { return };
    if let Some(said) = &understood.said {
        ui.label(RichText::new(text::shortened_at_word(said, LONGEST)).strong());
    }
    for note in &understood.notes {
        ui.label(RichText::new(text::shortened_at_word(note, LONGEST)).small().color(theme::weak()));
    }
}

/// Draws the sentence with what was not understood underlined, or the reason that nothing is so.
pub(super) fn show_misunderstood(ui: &mut Ui, asked: &Asked) {
    let unmet = asked.answered.understood.as_ref().and_then(|u| u.unmet.as_ref());
    let said = &asked.reading.text;
    let Some(unmet) = unmet.filter(|u| !u.text.is_empty()) else { return };
    let low = said.to_lowercase();
    let words = unmet.words.iter().filter_map(|w| low.find(w.as_str()).map(|at| at..at + w.len()));
    // Lower case may have another length in some scripts.
    let mut spans: Vec<_> = words.filter(|at| said.get(at.clone()).is_some()).collect();
    if spans.is_empty() && said.get(unmet.at.clone()).is_some_and(|s| !s.is_empty()) {
        spans.push(unmet.at.clone());
    }
    spans.sort_by_key(|at| at.start);
    let plain = TextFormat::simple(FontId::proportional(12.5), theme::weak());
    let marked = TextFormat { color: theme::warning(), underline: Stroke::new(1.5, theme::warning()), ..plain.clone() };
    let (mut job, mut from) = (LayoutJob::default(), 0);
    for at in spans.into_iter().filter(|at| at.end <= said.len()) {
        if at.start >= from {
            job.append(&said[from..at.start], 0.0, plain.clone());
            job.append(&said[at.clone()], 0.0, marked.clone());
            from = at.end;
        }
    }
    job.append(&said[from..], 0.0, plain);
    if said.contains(' ') {
        ui.add(egui::Label::new(job).wrap());
    }
    if unmet.why == Why::Nothing {
        ui.label(RichText::new(text::shortened_at_word(&unmet.text, LONGEST)).small().color(theme::weak()));
    }
}

/// Draws the steps. A click on one asks again without its words.
pub(super) fn show_steps(ui: &mut Ui, queries: &mut Queries, asked: &Asked, semantics: &SemanticMap) {
    let Some(Understood { steps, readings, .. }) = &asked.answered.understood else { return };
    if steps.len() < 2 {
        return;
    }
    let mut relaxed = None;
    for step in steps {
        let indent = "\u{2003}".repeat(step.depth.min(4));
        let told = format!("{indent}{}", text::shortened_at_word(step.text.trim(), LONGEST));
        let row = egui::Sides::new().shrink_left().truncate();
        let what = |ui: &mut Ui| ui.label(told);
        let effect = |ui: &mut Ui| {
            let without = without(&asked.reading.text, step);
            let button = egui::Button::new("\u{2715}").small();
            let hover = without.as_ref().map(|text| format!("Leave out: asks \u{201c}{text}\u{201d}"));
            // A noun has no button, but the numbers stay in line.
            let button = ui.add_visible(without.is_some(), button).on_hover_text(hover.unwrap_or_default());
            button.clicked().then(|| relaxed = without);
            let color = if step.guess { theme::warning() } else { theme::weak() };
            let left = format!("{} left{}", step.left, if step.guess { ", a guess" } else { "" });
            ui.colored_label(color, left).on_hover_text("Things that are left after this step");
        };
        row.show(ui, what, effect);
    }
    if *readings > 1 {
        ui.label(RichText::new(format!("Of {readings} readings of the sentence.")).small().color(theme::weak()));
    }
    if let Some(text) = relaxed {
        queries.ask(&text, semantics);
    }
}

/// Sentence without the words of a step; `None` for a noun, and if nothing, or all of it, would be left out.
fn without(said: &str, step: &QueryStep) -> Option<String> {
    if step.is_noun {
        return None;
    }
    let (before, after) = (said.get(..step.at.start)?, said.get(step.at.end..)?);
    let words = [before, after].join(" ");
    let left = words.split_whitespace().collect::<Vec<_>>().join(" ");
    let says =
        left.split(' ').any(|w| w.chars().count() > 3 || !["the", "a", "an", "of", "on", "in", "is"].contains(&w));
    (!left.is_empty() && says && left.len() < said.len()).then_some(left)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_left_out_with_its_words() {
        let step = |at| QueryStep { at, text: String::new(), left: 1, guess: false, depth: 0, is_noun: false };
        let said = "the mug left of the lamp";
        assert_eq!(without(said, &step(7..24)).as_deref(), Some("the mug"));
        assert_eq!(without(said, &QueryStep { is_noun: true, ..step(4..7) }), None, "left of the lamp is no thing");
        assert_eq!(
            (without(said, &step(0..24)), without(said, &step(4..24)), without(said, &step(4..99))),
            (None, None, None)
        );
    }
}
