//! Figures of an answer: share, IoU and time in a line over its view, all others where that is pointed at.

use egui::{Label, RichText, Ui};

use super::Compared;
use crate::jobs::compare::answer::PhraseAnswer;
use crate::pipeline::semantics::query::foreign::own_rules::ForeignMask;
use crate::scene::{Mask, text};
use crate::ui::theme;

/// Width of a card with figures at most, points.
const MOST_PT: f32 = 300.0;

/// Figures of an answer, in a line; all of them are made only where they are looked at.
pub(in crate::ui::viewport) struct AnswerFigures<'a> {
    text: String,
    of: FiguresOf<'a>,
}

/// Subject of a line of figures.
enum FiguresOf<'a> {
    Nothing,
    /// A scene with neither objects nor embeddings.
    Silent,
    /// A reason, which the line says in full.
    Problem,
    /// An answer with the mask that is shown, and the true mask of the view.
    Answer(&'a PhraseAnswer, &'a Mask, Option<&'a Mask>),
}

impl AnswerFigures<'_> {
    pub(in crate::ui::viewport) fn show(&self, ui: &mut Ui) {
        let is_problem = matches!(self.of, FiguresOf::Silent | FiguresOf::Problem);
        let color = if is_problem { theme::warning() } else { theme::text() };
        // Of a long reason all is shown, in lines.
        ui.set_max_width(MOST_PT);
        let label = ui.add(Label::new(RichText::new(&self.text).small().color(color)).wrap());
        match self.of {
            FiguresOf::Nothing | FiguresOf::Problem => {}
            FiguresOf::Silent => drop(label.on_hover_text("It has neither objects nor embeddings.")),
            FiguresOf::Answer(answer, shown, truth) => {
                label.on_hover_ui(|ui| drop(ui.label(all_figures(answer, shown, truth))));
            }
        }
    }
}

/// All figures of an answer, a line each.
fn all_figures(answer: &PhraseAnswer, shown: &Mask, truth: Option<&Mask>) -> String {
    let rule = |what: &str, found: &ForeignMask| {
        let iou = iou(&found.mask, truth).map(|iou| format!(", IoU {iou:.3}")).unwrap_or_default();
        format!("{what} ({}): {} px, level {}{iou}", found.rule, found.mask.area(), found.level + 1)
    };
    let mut lines = vec![format!("Mask covers {:.2} % of the view.", share(shown))];
    lines.extend(answer.own.as_ref().map(|own| rule("Own rule", own)));
    lines.push(rule("Common rule", &answer.common));
    lines.push(format!("Largest relevancy {:.3}", answer.raw.iter().copied().fold(0.0, f32::max)));
    let ms = answer.ms;
    lines.push(format!(
        "Encoding {:.1} ms, rendering {:.1} ms once a view, relevancy {:.1} ms",
        ms.encode, ms.blend, ms.decode
    ));
    lines.join("\n")
}

impl Compared {
    /// Figures of the answer in a view, or why there is none; `None` if nothing is asked. `name` is that of the scene in
    /// the first view.
    pub(in crate::ui::viewport) fn figures<'a>(
        &'a self,
        index: usize,
        name: &str,
        truth: Option<&'a Mask>,
    ) -> Option<AnswerFigures<'a>> {
        if !self.is_on || !self.asks() {
            return None;
        }
        if self.waits(index) {
            return Some(AnswerFigures { text: "asking\u{2026}".into(), of: FiguresOf::Nothing });
        }
        Some(match self.answer(index).map(|answer| &**answer) {
            None => AnswerFigures { text: "cannot be asked".into(), of: FiguresOf::Silent },
            Some(Err(why)) => AnswerFigures { text: why.clone(), of: FiguresOf::Problem },
            Some(Ok(answer)) => {
                let shown = &self.choices.mask(answer).mask;
                let ms = answer.ms.encode + answer.ms.blend + answer.ms.decode;
                let iou = iou(shown, truth).map(|iou| format!(" \u{b7} IoU {iou:.3}")).unwrap_or_default();
                let figures = format!("{:.1} %{iou} \u{b7} {ms:.0} ms", share(shown));
                // The first view has no card with its name.
                let is_first = index == 0 && self.scenes.len() > 1;
                let text = if is_first { format!("{} \u{b7} {figures}", text::elided(name, 30)) } else { figures };
                AnswerFigures { text, of: FiguresOf::Answer(answer, shown, truth) }
            }
        })
    }
}

/// Share of a view that a mask covers, percent.
fn share(mask: &Mask) -> f64 {
    100.0 * mask.area() as f64 / (mask.width_px() * mask.height_px()).max(1) as f64
}

/// IoU with a true mask of the view, if there is one.
fn iou(mask: &Mask, truth: Option<&Mask>) -> Option<f64> {
    truth.map(|truth| mask.iou(&truth.resized(mask.width_px(), mask.height_px())))
}
