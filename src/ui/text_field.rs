//! Where the cursor is in a text field that is filled by something else than typing.

use egui::text::{CCursor, CCursorRange};
use egui::{Context, Event, Id, TextEdit};

/// Puts the cursor behind the last character of `text`, which the field now holds.
pub(super) fn cursor_to_end(ctx: &Context, field: Id, text: &str) {
    set_range(ctx, field, CCursorRange::one(CCursor::new(text.chars().count())));
}

/// Selects all of `text`, which the field now holds.
pub(super) fn select_all(ctx: &Context, field: Id, text: &str) {
    set_range(ctx, field, CCursorRange::two(CCursor::new(0), CCursor::new(text.chars().count())));
}

/// Gives a field that is yet to be drawn the keyboard, all of its text selected: what is typed in this very frame takes
/// its place.
pub(super) fn take_keyboard(ctx: &Context, field: Id, text: &mut String) {
    ctx.memory_mut(|m| m.request_focus(field));
    // A field that has just got the keyboard forgets its selection.
    if ctx.input(|i| i.events.iter().any(|e| matches!(e, Event::Text(_) | Event::Paste(_)))) {
        text.clear();
    }
    select_all(ctx, field, text);
    ctx.request_repaint();
}

fn set_range(ctx: &Context, field: Id, range: CCursorRange) {
    let mut state = TextEdit::load_state(ctx, field).unwrap_or_default();
    state.cursor.set_char_range(Some(range));
    state.store(ctx, field);
}
