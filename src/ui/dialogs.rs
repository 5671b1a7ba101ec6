//! Dialogs: errors, and questions before a loss.

use egui::{Button, RichText};

use super::ctx::Ctx;
use super::state::{ErrorBox, Tone};
use super::{main_button, theme};
use crate::scene::text;
use crate::ui::actions::Action;

/// A question before data or a running job is lost. Declining is the safe answer: its button has the focus, and `Enter`.
pub(crate) struct Question {
    pub(crate) text: String,
    /// Button to proceed.
    pub(crate) yes: &'static str,
    /// Button of an alternative.
    pub(crate) other: Option<&'static str>,
    /// Button to decline.
    pub(crate) no: &'static str,
    /// True if `yes` deletes or replaces something for good: its button is red.
    pub(crate) deletes: bool,
}

impl Question {
    /// A question before something is deleted for good.
    pub(crate) fn deletion(text: String) -> Self {
        Self { text, yes: "Delete", other: None, no: "Cancel", deletes: true }
    }
}

/// Answer to a [`Question`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DialogAnswer {
    Yes,
    Other,
    No,
}

/// Shows an error; returns true once it is closed. If a scene could not be opened, others are offered.
pub(crate) fn show_error(ctx: &egui::Context, error: &ErrorBox, cx: &mut Ctx<'_>) -> bool {
    let response = theme::dialog("error").show(ctx, |ui| {
        ui.set_width(480.0);
        ui.horizontal(|ui| {
            theme::mark(ui, Tone::Error, 24.0);
            ui.heading(format!("{} failed", error.doing));
        });
        ui.add_space(8.0);
        egui::ScrollArea::vertical().max_height(220.0).show(ui, |ui| ui.label(&error.failure.message));
        if !error.failure.remedy.is_empty() {
            ui.add_space(6.0);
            ui.label(RichText::new(&error.failure.remedy).color(theme::text()).strong());
        }
        ui.add_space(6.0);
        if cx.state.scene.is_some() {
            ui.weak("The open scene is unchanged.");
        }
        ui.add_space(12.0);
        ui.horizontal(|ui| {
            let mut close = ui.add(theme::primary_button("Close")).clicked();
            if error.doing.starts_with("Opening") && ui.button("Open another\u{2026}").clicked() {
                cx.ask(Action::OpenFile);
                close = true;
            }
            if ui.button("Copy message").clicked() {
                let f = &error.failure;
                ui.ctx().copy_text(format!("{}: {}\n{}", error.doing, f.message, f.remedy));
            }
            close
        })
        .inner
    });
    response.inner || response.should_close()
}

impl Question {
    /// Shows the question; returns the answer, once there is one.
    pub(crate) fn show(&self, ctx: &egui::Context) -> Option<DialogAnswer> {
        let is_new = main_button::has_just_opened(ctx, "dialog question");
        let response = theme::dialog("dialog question").show(ctx, |ui| {
            ui.set_width(420.0);
            egui::ScrollArea::vertical().max_height(260.0).show(ui, |ui| ui.label(text::lines(&self.text)));
            ui.add_space(12.0);
            ui.horizontal(|ui| {
                let yes = if self.deletes { theme::delete_button(self.yes) } else { Button::new(self.yes) };
                let yes = ui.add(yes).clicked();
                let other = self.other.is_some_and(|other| ui.button(other).clicked());
                let no = ui.add(theme::primary_button(self.no));
                if is_new {
                    no.request_focus();
                }
                let answers =
                    [(yes, DialogAnswer::Yes), (other, DialogAnswer::Other), (no.clicked(), DialogAnswer::No)];
                answers.into_iter().find(|(is_clicked, _)| *is_clicked).map(|(_, answer)| answer)
            })
            .inner
        });
        response.inner.or_else(|| response.should_close().then_some(DialogAnswer::No))
    }
}

/// Shows a question of two answers, the first of which replaces or deletes something. `Some(true)` to proceed,
/// `Some(false)` to decline, `None` without an answer.
pub(crate) fn show_question(ctx: &egui::Context, text: &str, yes: &'static str, no: &'static str) -> Option<bool> {
    let question = Question { text: text.to_owned(), yes, other: None, no, deletes: true };
    question.show(ctx).map(|answer| answer == DialogAnswer::Yes)
}

/// Draws a hint over the window that the dragged files can be dropped.
pub(super) fn drop_hint(ctx: &egui::Context, text: &str) {
    let painter = ctx.layer_painter(egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("drop")));
    let rect = ctx.content_rect();
    painter.rect_filled(rect, 0.0, egui::Color32::from_black_alpha(170));
    painter.rect_stroke(rect.shrink(24.0), 12.0, egui::Stroke::new(2.0, theme::accent()), egui::StrokeKind::Inside);
    let font = egui::FontId::proportional(24.0);
    painter.text(rect.center(), egui::Align2::CENTER_CENTER, text, font, theme::text());
}
