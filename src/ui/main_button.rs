//! The main button of a dialog: it has the focus, so that `Enter` presses it, and the arrows step through a choice.

use egui::{Context, EventFilter, Id, Key, Modifiers, Response, Ui};

use super::theme::primary_button;

/// True in the first frame of a dialog; to be asked once in each of its frames.
pub(crate) fn has_just_opened(ctx: &Context, name: &'static str) -> bool {
    let (id, now) = (Id::unique(name).with("last frame"), ctx.cumulative_frame_nr());
    let last: Option<u64> = ctx.data(|d| d.get_temp(id));
    ctx.data_mut(|d| d.insert_temp(id, now));
    last.is_none_or(|last| last + 1 < now)
}

/// The main button of a dialog whose choice the arrows step through: it has the focus until another field takes it, so
/// that `Enter` presses it. Returns its response and the number of steps.
pub(crate) fn stepping_button(ui: &mut Ui, name: &'static str, text: &str, enabled: bool) -> (Response, isize) {
    let is_new = has_just_opened(ui.ctx(), name);
    let button = ui.add_enabled(enabled, primary_button(text));
    if is_new || ui.memory(|m| m.focused().is_none()) {
        button.request_focus();
    }
    if !ui.memory(|m| m.has_focus(button.id)) {
        return (button, 0);
    }
    let arrows = EventFilter { vertical_arrows: true, horizontal_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|m| m.set_focus_lock_filter(button.id, arrows));
    let count = |key| ui.input_mut(|i| i.count_and_consume_key(Modifiers::NONE, key)) as isize;
    let steps = count(Key::ArrowDown) + count(Key::ArrowRight) - count(Key::ArrowUp) - count(Key::ArrowLeft);
    (button, steps)
}

/// The entry of a list that is some steps from another, within its ends.
pub(crate) fn stepped<T: Copy + PartialEq>(all: &[T], from: T, steps: isize) -> T {
    let at = all.iter().position(|one| *one == from).unwrap_or(0);
    all.get(at.saturating_add_signed(steps).min(all.len().saturating_sub(1))).copied().unwrap_or(from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_end_at_the_ends() {
        assert_eq!([-9, -1, 0, 1, 9].map(|steps| stepped(&[1, 2, 3], 2, steps)), [1, 1, 2, 3, 3]);
        assert_eq!(stepped(&[], 2, 1), 2, "of nothing");
        assert_eq!(stepped(&[1, 3], 2, 1), 3, "one that is not in the list counts as the first");
    }

    #[test]
    fn a_dialog_has_just_opened_in_its_first_frame_alone() {
        let ctx = Context::default();
        let frame = |is_open: bool| {
            let mut is_new = None;
            let run = |ui: &mut Ui| is_new = is_open.then(|| has_just_opened(ui.ctx(), "question"));
            ctx.run_ui(egui::RawInput::default(), run).textures_delta.clear();
            is_new
        };
        let opened = [true, true, false, true, true].map(frame);
        assert_eq!(opened, [Some(true), Some(false), None, Some(true), Some(false)]);
    }
}
