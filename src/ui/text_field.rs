//! Where the cursor is in a text field that is filled by something else than typing.

use egui::text::{CCursor, CCursorRange};
use egui::{Context, Id, TextEdit};

/// Puts the cursor behind the last character of `text`, which the field now holds.
pub(super) fn cursor_to_end(ctx: &Context, field: Id, text: &str) {
    set_range(ctx, field, CCursorRange::one(CCursor::new(text.chars().count())));
}

/// Selects all of `text`, which the field now holds.
pub(super) fn select_all(ctx: &Context, field: Id, text: &str) {
    set_range(ctx, field, CCursorRange::two(CCursor::new(0), CCursor::new(text.chars().count())));
}

fn set_range(ctx: &Context, field: Id, range: CCursorRange) {
    let mut state = TextEdit::load_state(ctx, field).unwrap_or_default();
    state.cursor.set_char_range(Some(range));
    state.store(ctx, field);
}
