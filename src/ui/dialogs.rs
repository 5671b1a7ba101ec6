//! Dialogs: errors, and questions before a loss.

use egui::RichText;

use super::state::{ErrorBox, Tone};
use super::theme;
use crate::scene::text;
use crate::ui::actions::Action;

/// A question before data or a running job is lost.
pub(crate) struct Question {
    pub(crate) text: String,
    /// Button to proceed.
    pub(crate) yes: &'static str,
    /// Button of an alternative, with its action.
    pub(crate) other: Option<(&'static str, Action)>,
    /// Button to decline.
    pub(crate) no: &'static str,
    pub(crate) action: Action,
}

/// Shows an error until it is read. Returns whether it was; if a scene could not be opened, others are offered.
pub(crate) fn show_error(ctx: &egui::Context, error: &ErrorBox, has_scene: bool, actions: &mut Vec<Action>) -> bool {
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
        if has_scene {
            ui.weak("The open scene is unchanged.");
        }
        ui.add_space(12.0);
        ui.horizontal(|ui| {
            let mut close = ui.add(theme::primary_button("Close")).clicked();
            if error.doing.starts_with("Opening") && ui.button("Open another\u{2026}").clicked() {
                actions.push(Action::OpenFile);
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
    /// Shows the question. `Some` once it is answered, with the action to carry out.
    pub(crate) fn show(&self, ctx: &egui::Context) -> Option<Option<Action>> {
        let response = theme::dialog("dialog question").show(ctx, |ui| {
            ui.set_width(420.0);
            egui::ScrollArea::vertical().max_height(260.0).show(ui, |ui| ui.label(text::lines(&self.text)));
            ui.add_space(12.0);
            ui.horizontal(|ui| {
                let mut answer = ui.add(theme::primary_button(self.yes)).clicked().then(|| Some(self.action.clone()));
                if let Some((other, action)) = &self.other
                    && ui.button(*other).clicked()
                {
                    answer = Some(Some(action.clone()));
                }
                if ui.button(self.no).clicked() { Some(None) } else { answer }
            })
            .inner
        });
        let closed = response.should_close();
        response.inner.or_else(|| closed.then_some(None))
    }
}

/// Shows a question. `Some(true)` to proceed, `Some(false)` to decline, `None` without an answer.
pub(crate) fn show_question(ctx: &egui::Context, text: &str, yes: &str, no: &str) -> Option<bool> {
    let response = theme::dialog("dialog question").show(ctx, |ui| {
        ui.set_width(420.0);
        ui.label(text);
        ui.add_space(12.0);
        ui.horizontal(|ui| {
            let yes = ui.add(theme::primary_button(yes)).clicked();
            let no = ui.button(no).clicked();
            if yes { Some(true) } else { no.then_some(false) }
        })
        .inner
    });
    response.inner.or_else(|| response.should_close().then_some(false))
}

/// Draws a hint over the window that the dragged files can be dropped.
pub(super) fn drop_hint(ctx: &egui::Context) {
    let painter = ctx.layer_painter(egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("drop")));
    let rect = ctx.content_rect();
    painter.rect_filled(rect, 0.0, egui::Color32::from_black_alpha(170));
    painter.rect_stroke(rect.shrink(24.0), 12.0, egui::Stroke::new(2.0, theme::accent()), egui::StrokeKind::Inside);
    let font = egui::FontId::proportional(24.0);
    painter.text(rect.center(), egui::Align2::CENTER_CENTER, "Drop to open", font, theme::text());
}
