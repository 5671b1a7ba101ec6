//! The query field: typing, completion from known names, history.

use egui::{Event, Id, InputState, Key, Modifiers, RichText, TextEdit, Ui};

use super::Queries;
use crate::pipeline::semantics::names;
use crate::scene::SemanticMap;
use crate::ui::text_field::{cursor_to_end, take_keyboard};
use crate::ui::theme;

/// Number of completions.
const OFFERED: usize = 5;

/// Pause and least number of characters before "not found" is shown.
const PAUSE_SECS: f64 = 0.6;
const SHORTEST: usize = 3;

impl Queries {
    /// Draws the field. Returns whether it has the focus, and the completions of its text.
    pub(super) fn show_field(&mut self, ui: &mut Ui, width: f32, semantics: &SemanticMap) -> (bool, Vec<String>) {
        // The same id in a folded and an unfolded card.
        let id = Id::unique(("query", self.is_second));
        // Taken before the field, which would move its cursor.
        if self.side.focus > 0 {
            // Twice: the selection of the first frame does not last.
            self.side.focus -= 1;
            leave_out_slashes(ui);
            take_keyboard(ui.ctx(), id, &mut self.side.typed);
        }
        let focused = ui.memory(|m| m.has_focus(id));
        self.side.begun |= !focused;
        if focused && (!self.side.begun || self.side.typed.is_empty()) {
            // Repeats of the shortcut "/" that opened the field are not text.
            leave_out_slashes(ui);
        }
        self.wanted |= focused;
        if focused {
            self.recall(ui, id, semantics);
        }
        let offered = self.offered(semantics);
        let complete = focused && !offered.is_empty() && ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Tab));
        let edit = TextEdit::singleline(&mut self.side.typed)
            .id(id)
            .hint_text("Find an object or part, e.g. \u{201c}the button of the red controller\u{201d}  ( / )")
            .char_limit(2_000)
            // Tab completes, if there is a completion.
            .lock_focus(!offered.is_empty())
            .desired_width(width);
        let name = if self.is_second { "Query of the second view" } else { "Query" };
        let response = ui.add(edit).accessible_name(name);
        if complete {
            response.request_focus();
            self.side.typed.clone_from(&offered[0]);
            cursor_to_end(ui.ctx(), id, &self.side.typed);
        }
        self.side.begun |= response.changed() || ui.input(goes_on);
        if response.changed() || complete {
            (self.side.recalled, self.side.focus) = (None, 0);
            self.side.typed_at = Some(ui.input(|i| i.time));
            let typed = self.side.typed.clone();
            self.side.live = self.asked(&typed, semantics);
        }
        if response.lost_focus() {
            self.settle();
            if ui.input(|i| i.key_pressed(Key::Enter)) {
                self.side.start_typing();
            }
        }
        (focused, offered)
    }

    /// Completions of the typed text from known names.
    fn offered(&self, semantics: &SemanticMap) -> Vec<String> {
        let typed = self.side.typed.trim();
        match typed.is_empty() || self.side.typed_at.is_none() {
            true => Vec::new(),
            false => names::completions(&semantics.identities, typed, OFFERED),
        }
    }

    /// Draws buttons of the completions, unless the first is already typed.
    pub(super) fn show_offered(&mut self, ui: &mut Ui, offered: &[String], semantics: &SemanticMap) {
        if offered.first().is_none_or(|first| *first == self.side.typed) {
            return;
        }
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new("Tab:").small().color(theme::weak()));
            self.show_names(ui, offered, semantics);
        });
    }

    /// Draws buttons that query these names.
    pub(super) fn show_names(&mut self, ui: &mut Ui, names: &[String], semantics: &SemanticMap) {
        for text in names {
            if ui.small_button(text).clicked() {
                self.ask(text, semantics);
                self.start_typing();
            }
        }
    }

    /// Recalls earlier queries with the arrow keys.
    fn recall(&mut self, ui: &Ui, field: Id, semantics: &SemanticMap) {
        let pressed = |key| ui.input_mut(|i| i.consume_key(Modifiers::NONE, key));
        let n = self.history.len();
        let next = match self.side.recalled {
            _ if n == 0 => return,
            None if pressed(Key::ArrowUp) => Some(n - 1),
            Some(at) if pressed(Key::ArrowUp) => Some(at.saturating_sub(1)),
            Some(at) if pressed(Key::ArrowDown) => (at + 1 < n).then_some(at + 1),
            _ => return,
        };
        let text = next.and_then(|i| self.history.get(i)).cloned().unwrap_or_default();
        self.ask(&text, semantics);
        cursor_to_end(ui.ctx(), field, &text);
        (self.side.recalled, self.side.focus) = (next, 0);
    }

    /// Marks the typed query as complete: it enters the history and keeps its color.
    pub(super) fn settle(&mut self) {
        self.side.typed_at = None;
        self.keep_color();
        let Some(text) = self.side.live.as_ref().map(|q| q.text.clone()) else { return };
        self.history.retain(|t| *t != text);
        self.history.push(text);
        self.side.recalled = Some(self.history.len() - 1);
    }

    /// True if "not found" may be shown: not while the user types.
    pub(super) fn is_settled(&self, ui: &Ui) -> bool {
        let Some(at) = self.side.typed_at else { return true };
        let wait = PAUSE_SECS - (ui.input(|i| i.time) - at);
        let is_word = self.side.typed.trim().chars().count() >= SHORTEST;
        if is_word && wait > 0.0 {
            ui.ctx().request_repaint_after_secs(wait as f32);
        }
        is_word && wait <= 0.0
    }
}

/// Removes slashes before any other typed text.
fn leave_out_slashes(ui: &Ui) {
    ui.input_mut(|i| {
        let mut has_begun = false;
        i.events.retain(|event| match event {
            Event::Text(text) if !has_begun && text == "/" => false,
            event => {
                has_begun |= matches!(event, Event::Text(_) | Event::Paste(_));
                true
            }
        });
    });
}

/// True if the input does not replace the selected text.
fn goes_on(input: &InputState) -> bool {
    let is_key = |e: &Event| matches!(e, Event::Key { key, pressed: true, .. } if *key != Key::Slash);
    input.pointer.any_pressed() || input.events.iter().any(is_key)
}
