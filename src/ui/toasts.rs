//! Messages that disappear by themselves.

use std::collections::HashMap;

use egui::{Align2, Area, Id, Order};

use super::state::{AppState, Tone};
use super::theme;

/// Display time of a message, s; longer for warnings and errors.
const STAY_SECS: f64 = 4.0;
const STAY_LONG_SECS: f64 = 9.0;
/// Largest number of messages on screen.
const MOST: usize = 4;

#[derive(Default)]
pub(crate) struct Toasts {
    since: HashMap<u64, f64>,
}

impl Toasts {
    /// Draws the newest messages at the lower right of `area` and drops expired ones.
    pub(crate) fn show(&mut self, ctx: &egui::Context, state: &mut AppState, area: egui::Rect) {
        let now = ctx.input(|i| i.time);
        let stay = |tone| if matches!(tone, Tone::Info | Tone::Good) { STAY_SECS } else { STAY_LONG_SECS };
        state.toasts.retain(|t| now - *self.since.entry(t.id).or_insert(now) < stay(t.tone));
        self.since.retain(|id, _| state.toasts.iter().any(|t| t.id == *id));
        let mut dismissed = None;
        let mut y = area.bottom() - 14.0;
        for toast in state.toasts.iter().rev().take(MOST) {
            let shown = Area::new(Id::unique(("toast", toast.id)))
                .order(Order::Foreground)
                .sense(egui::Sense::click())
                .pivot(Align2::RIGHT_BOTTOM)
                .fixed_pos(egui::pos2(area.right() - 14.0, y))
                .show(ctx, |ui| {
                    ui.set_max_width(420.0);
                    let color = theme::tone_color(toast.tone);
                    theme::overlay().stroke(egui::Stroke::new(1.0, color.gamma_multiply(0.6))).inner_margin(12).show(
                        ui,
                        |ui| {
                            ui.horizontal(|ui| {
                                theme::mark(ui, toast.tone, 18.0);
                                ui.label(&toast.text);
                            });
                        },
                    );
                });
            if shown.response.clone().on_hover_text("Click to dismiss").clicked() {
                dismissed = Some(toast.id);
            }
            y -= shown.response.rect.height() + 8.0;
            let left = stay(toast.tone) - (now - self.since.get(&toast.id).copied().unwrap_or(now));
            ctx.request_repaint_after_secs(left.max(0.05) as f32);
        }
        state.toasts.retain(|t| Some(t.id) != dismissed);
    }
}
