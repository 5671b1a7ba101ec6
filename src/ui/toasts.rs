//! Messages on one line of the status bar: the newest one, which disappears by itself. The log keeps all.

use std::collections::HashMap;

use egui::{Align, Align2, Area, Button, Frame, Id, Label, Layout, Margin, Order, RichText, Ui, vec2};

use super::state::{AppState, Toast, Tone};
use super::theme;

/// Display time of a message, s; longer for results, warnings, figures and long texts, which take time to read. Errors
/// stay.
const STAY_SECS: f64 = 4.0;
const STAY_LONG_SECS: f64 = 9.0;
/// Width of the line where it floats over a view that fills the window, points.
const FLOATING_PT: f32 = 560.0;

/// Answer of the user to a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ToastClick {
    Dismiss,
    OpenLog,
}

/// Characters from which on a message is long.
const LONG: usize = 60;

/// Time at which each message was first seen.
#[derive(Default)]
pub(crate) struct Toasts {
    since: HashMap<u64, f64>,
}

impl Toasts {
    /// Drops messages whose time is over. An error stays until it is dismissed, or read in the log. The time of a result
    /// begins once no other message covers it and the user is back: a long job may end while nobody looks.
    pub(crate) fn update(&mut self, ctx: &egui::Context, state: &mut AppState, log_is_open: bool) {
        let (now, is_there) = ctx.input(|i| (i.time, !i.events.is_empty()));
        let newest = state.toasts.last().map(|t| t.id);
        let mut next = f64::INFINITY;
        state.toasts.retain(|toast| {
            if toast.is_result && newest != Some(toast.id) {
                self.since.remove(&toast.id);
                return true;
            }
            if toast.is_result && !is_there && !self.since.contains_key(&toast.id) {
                return true;
            }
            let is_short = toast.text.len() < LONG && !toast.text.contains(|c: char| c.is_ascii_digit());
            let left = match toast.tone {
                Tone::Info | Tone::Good if is_short && !toast.is_result => STAY_SECS,
                Tone::Info | Tone::Good => STAY_LONG_SECS,
                Tone::Warning => STAY_LONG_SECS,
                Tone::Error => return !log_is_open,
            } - (now - *self.since.entry(toast.id).or_insert(now));
            next = next.min(if left > 0.0 { left } else { f64::INFINITY });
            left > 0.0
        });
        self.since.retain(|id, _| state.toasts.iter().any(|t| t.id == *id));
        if next.is_finite() {
            ctx.request_repaint_after_secs(next.max(0.05) as f32);
        }
    }
}

/// Draws the newest message in the room that is left in a row.
pub(crate) fn show(ui: &mut Ui, toasts: &[Toast]) -> Option<ToastClick> {
    let newest = toasts.last()?;
    let color = theme::tone_color(newest.tone);
    let frame = Frame::new().fill(color.gamma_multiply(0.12)).corner_radius(6).inner_margin(Margin::symmetric(8, 0));
    let mut clicked = None;
    frame.show(ui, |ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let close = ui.add(Button::new("\u{d7}").small().frame(false)).on_hover_text("Dismiss");
            if close.accessible_name("Dismiss the message").clicked() {
                clicked = Some(ToastClick::Dismiss);
            }
            let others = toasts.len() - 1;
            if others > 0 {
                let link = ui.link(RichText::new(format!("{others} more in the log")).small());
                if link.on_hover_text("Messages that came before").clicked() {
                    clicked = Some(ToastClick::OpenLog);
                }
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                theme::mark(ui, newest.tone, 16.0);
                let text = newest.text.replace('\n', " ");
                ui.add(Label::new(text).truncate());
            });
        });
    });
    clicked
}

/// Draws it over a view that fills the window, which has no status bar.
pub(crate) fn float(ctx: &egui::Context, toasts: &[Toast]) -> Option<ToastClick> {
    let width = FLOATING_PT.min(ctx.content_rect().width() - 40.0);
    let area = Area::new(Id::unique("message")).order(Order::Foreground);
    // Above the cards at the bottom of the view.
    let area = area.anchor(Align2::CENTER_BOTTOM, vec2(0.0, -64.0));
    let row = |ui: &mut Ui| {
        let size = vec2(width, ui.spacing().interact_size.y);
        ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| show(ui, toasts)).inner
    };
    (!toasts.is_empty()).then(|| theme::card(ctx, area, row).inner).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texts that are left after the window has run until `secs`.
    fn left(toasts: &mut Toasts, state: &mut AppState, secs: f64, log_is_open: bool) -> Vec<String> {
        let ctx = egui::Context::default();
        let input = egui::RawInput { time: Some(secs), ..egui::RawInput::default() };
        ctx.run_ui(input, |ui| toasts.update(ui.ctx(), state, log_is_open)).textures_delta.clear();
        state.toasts.iter().map(|t| t.text.clone()).collect()
    }

    #[test]
    fn past_events_are_replaced_and_warnings_are_kept_for_their_time() {
        let (mut toasts, mut state) = (Toasts::default(), AppState::default());
        state.toast(Tone::Warning, "17 photos are missing");
        state.toast(Tone::Info, "Showed only the mug");
        state.toast(Tone::Good, "Showed everything");
        assert_eq!(left(&mut toasts, &mut state, 1.0, false), ["17 photos are missing", "Showed everything"]);
        state.toast(Tone::Info, "Undone: showed everything");
        state.toast(Tone::Info, "Undone: showed everything");
        assert_eq!(left(&mut toasts, &mut state, 2.0, false), ["17 photos are missing", "Undone: showed everything"]);
        assert_eq!(left(&mut toasts, &mut state, 6.5, false), ["17 photos are missing"]);
        assert!(left(&mut toasts, &mut state, 10.5, false).is_empty());
        // Control: the log keeps every one of them.
        assert_eq!(state.log.len(), 5);
    }

    #[test]
    fn a_message_with_figures_stays_longer_and_in_the_log() {
        let (mut toasts, mut state) = (Toasts::default(), AppState::default());
        state.toast(Tone::Good, "Held-out PSNR 26.56 dB, SSIM 0.812");
        assert_eq!(left(&mut toasts, &mut state, 1.0, false).len(), 1);
        assert_eq!(left(&mut toasts, &mut state, 8.0, false).len(), 1);
        assert!(left(&mut toasts, &mut state, 10.5, false).is_empty());
        assert_eq!(state.log.len(), 1);
        // Control: one without figures is gone by then.
        state.toast(Tone::Good, "Showed everything");
        assert_eq!(left(&mut toasts, &mut state, 11.0, false).len(), 1);
        assert!(left(&mut toasts, &mut state, 18.0, false).is_empty());
    }

    #[test]
    fn results_are_not_replaced_and_wait_for_the_user() {
        let (mut toasts, mut state) = (Toasts::default(), AppState::default());
        let mut left = |state: &mut AppState, secs: f64, is_there: bool| -> Vec<String> {
            let ctx = egui::Context::default();
            let events = if is_there { vec![egui::Event::PointerMoved(egui::Pos2::ZERO)] } else { Vec::new() };
            let input = egui::RawInput { time: Some(secs), events, ..egui::RawInput::default() };
            ctx.run_ui(input, |ui| toasts.update(ui.ctx(), state, false)).textures_delta.clear();
            state.toasts.iter().map(|t| t.text.clone()).collect()
        };
        state.result("Saved to mug.spz");
        state.result("Saved to mug.mp4");
        state.toast(Tone::Info, "Showed everything");
        assert_eq!(left(&mut state, 1.0, true), ["Saved to mug.spz", "Saved to mug.mp4", "Showed everything"]);
        // Control: what is no result goes after its time.
        assert_eq!(left(&mut state, 6.0, true), ["Saved to mug.spz", "Saved to mug.mp4"]);
        assert_eq!(left(&mut state, 100.0, false), ["Saved to mug.spz", "Saved to mug.mp4"], "nobody was there");
        assert_eq!(left(&mut state, 101.0, true).len(), 2);
        assert_eq!(left(&mut state, 105.0, false).len(), 2);
        assert_eq!(left(&mut state, 111.0, false), ["Saved to mug.spz"]);
        assert_eq!(left(&mut state, 112.0, true).len(), 1);
        assert!(left(&mut state, 122.0, false).is_empty());
    }

    #[test]
    fn an_error_stays_until_it_is_read() {
        let (mut toasts, mut state) = (Toasts::default(), AppState::default());
        state.toast(Tone::Error, "The disk is full");
        state.toast(Tone::Info, "Showed RGB");
        assert_eq!(left(&mut toasts, &mut state, 1.0, false).len(), 2);
        assert_eq!(left(&mut toasts, &mut state, 1e4, false), ["The disk is full"]);
        assert!(left(&mut toasts, &mut state, 1e4, true).is_empty());
        // Control: what is no error does not stay, and is not ended by the log.
        state.toast(Tone::Warning, "a.jpg is empty");
        assert_eq!(left(&mut toasts, &mut state, 1e4 + 1.0, true).len(), 1);
        assert!(left(&mut toasts, &mut state, 2e4, false).is_empty());
    }
}
