//! Text fields whose text is set by code: their cursor, and names that are typed in place of a label.

use egui::text::{CCursor, CCursorRange};
use egui::{Context, Event, Id, Key, TextEdit, Ui};

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

/// Name that is typed in place of a label.
pub(super) struct NameField<T> {
    /// Owner of the name.
    pub(super) of: T,
    text: String,
    /// Frames since it opened, up to 2.
    frames: u8,
}

/// State of a typed name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum TypedName {
    Open,
    Kept(String),
    Dropped,
}

impl<T> NameField<T> {
    pub(super) fn new(of: T, text: String) -> Self {
        Self { of, text, frames: 0 }
    }

    /// True until it is drawn.
    pub(super) fn is_new(&self) -> bool {
        self.frames == 0
    }

    /// Draws the field with all of the name selected. Enter or losing the focus keeps the name, Escape does not.
    pub(super) fn show(&mut self, ui: &mut Ui, field: Id) -> TypedName {
        let begins = self.frames < 2;
        if begins {
            // Twice: the selection of the first frame does not last.
            take_keyboard(ui.ctx(), field, &mut self.text);
            self.frames += 1;
        }
        let edit = TextEdit::singleline(&mut self.text).id(field).char_limit(80).desired_width(f32::INFINITY);
        let edit = ui.add(edit).accessible_name("New name");
        if edit.changed() {
            self.frames = 2;
        }
        if begins {
            edit.scroll_to_me(None);
            return TypedName::Open;
        }
        match (edit.has_focus(), ui.input(|i| i.key_pressed(Key::Escape))) {
            (true, _) => TypedName::Open,
            (false, true) => TypedName::Dropped,
            (false, false) => TypedName::Kept(std::mem::take(&mut self.text)),
        }
    }
}

fn set_range(ctx: &Context, field: Id, range: CCursorRange) {
    let mut state = TextEdit::load_state(ctx, field).unwrap_or_default();
    state.cursor.set_char_range(Some(range));
    state.store(ctx, field);
}
