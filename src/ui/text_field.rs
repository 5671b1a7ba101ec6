//! Cursor of a text field whose text is set by code.

use egui::text::{CCursor, CCursorRange};
use egui::{Context, Event, Id, TextEdit};

/// Moves the cursor to the end of `text`, which the field now holds.
pub(super) fn cursor_to_end(ctx: &Context, field: Id, text: &str) {
    set_range(ctx, field, CCursorRange::one(CCursor::new(text.chars().count())));
}

/// Selects all of `text`, which the field now holds.
pub(super) fn select_all(ctx: &Context, field: Id, text: &str) {
    set_range(ctx, field, CCursorRange::two(CCursor::new(0), CCursor::new(text.chars().count())));
}

/// Selects the first `letters` of the text that the field now holds.
pub(super) fn select_start(ctx: &Context, field: Id, letters: usize) {
    set_range(ctx, field, CCursorRange::two(CCursor::new(0), CCursor::new(letters)));
}

/// Focuses a field that is yet to be drawn, with all of its text selected: text typed in this frame replaces it.
pub(super) fn take_keyboard(ctx: &Context, field: Id, text: &mut String) {
    ctx.memory_mut(|m| m.request_focus(field));
    // A newly focused field loses its selection.
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
