//! The query field: typing, completion from known names, history.

use egui::{Color32, Event, Id, InputState, Key, Modifiers, RichText, TextEdit, TextStyle, Ui};

use super::Queries;
use crate::scene::SemanticMap;
use crate::ui::text_field::{cursor_to_end, take_keyboard};
use crate::ui::theme;

/// Draws the field. Returns true if it has the focus, and the completions of its text.
pub(super) fn show(ui: &mut Ui, queries: &mut Queries, width: f32, semantics: &SemanticMap) -> (bool, Vec<String>) {
    let is_second = queries.is_second();
    // The same id in a folded and an unfolded card.
    let id = Id::unique(("query", is_second));
    let side = queries.side_mut();
    // Taken before the field, which would move its cursor.
    if side.focus > 0 {
        // Twice: the selection of the first frame does not last.
        side.focus -= 1;
        leave_out_slashes(ui);
        take_keyboard(ui.ctx(), id, &mut side.typed);
    }
    let focused = ui.memory(|m| m.has_focus(id));
    side.begun |= !focused;
    if focused && (!side.begun || side.typed.is_empty()) {
        // Repeats of the shortcut "/" that opened the field are not text.
        leave_out_slashes(ui);
    }
    queries.wanted |= focused;
    if focused {
        recall(ui, queries, id, semantics);
    }
    let side = queries.side_mut();
    let offered = side.offered(semantics);
    let complete = focused && !offered.is_empty() && ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Tab));
    let edit = TextEdit::singleline(&mut side.typed)
        .id(id)
        .hint_text(hint(ui, width))
        .char_limit(2_000)
        // Tab completes, if there is a completion.
        .lock_focus(!offered.is_empty())
        .desired_width(width);
    let name = if is_second { "Query of the second view" } else { "Query" };
    let response = ui.add(edit).accessible_name(name);
    if complete {
        response.request_focus();
        side.typed.clone_from(&offered[0]);
        cursor_to_end(ui.ctx(), id, &side.typed);
    }
    side.begun |= response.changed() || ui.input(goes_on);
    if response.changed() || complete {
        queries.ask_typed(ui.input(|i| i.time), semantics);
    }
    if response.lost_focus() {
        queries.settle();
        if ui.input(|i| i.key_pressed(Key::Enter)) {
            queries.side_mut().start_typing();
        }
    }
    (focused, offered)
}

/// Hints of the empty field, the longest first.
const HINTS: [&str; 5] = [
    "Find an object or part, e.g. \u{201c}the button of the red controller\u{201d}  ( / )",
    "Find an object or part, e.g. \u{201c}kettle lid\u{201d}  ( / )",
    "Find an object or part  ( / )",
    "Find an object or part",
    "Find  ( / )",
];

/// The longest hint that a field of this width shows whole.
fn hint(ui: &Ui, width: f32) -> &'static str {
    /// Margins of the field, points.
    const MARGINS: f32 = 10.0;
    let font = TextStyle::Body.resolve(ui.style());
    let fits = |hint: &&&str| {
        let galley = ui.painter().layout_no_wrap((**hint).to_owned(), font.clone(), Color32::WHITE);
        galley.size().x <= width - MARGINS
    };
    HINTS.iter().find(fits).or(HINTS.last()).copied().unwrap_or_default()
}

/// Draws buttons of the completions, unless the first is already typed.
pub(super) fn show_offered(ui: &mut Ui, queries: &mut Queries, offered: &[String], semantics: &SemanticMap) {
    if offered.first().is_none_or(|first| *first == queries.side().typed) {
        return;
    }
    let label = RichText::new("Tab:").small().color(theme::weak());
    theme::hanging(ui, label, |ui| show_names(ui, queries, offered, semantics));
}

/// Draws buttons that query these names.
pub(super) fn show_names(ui: &mut Ui, queries: &mut Queries, names: &[String], semantics: &SemanticMap) {
    for text in names {
        if ui.small_button(text).clicked() {
            queries.ask(text, semantics);
            queries.start_typing();
        }
    }
}

/// Recalls earlier queries with the arrow keys.
fn recall(ui: &Ui, queries: &mut Queries, field: Id, semantics: &SemanticMap) {
    let pressed = |key| ui.input_mut(|i| i.consume_key(Modifiers::NONE, key));
    let n = queries.history.len();
    let next = match queries.side().recalled {
        _ if n == 0 => return,
        None if pressed(Key::ArrowUp) => Some(n - 1),
        Some(at) if pressed(Key::ArrowUp) => Some(at.saturating_sub(1)),
        Some(at) if pressed(Key::ArrowDown) => (at + 1 < n).then_some(at + 1),
        _ => return,
    };
    let text = next.and_then(|i| queries.history.get(i)).cloned().unwrap_or_default();
    queries.ask(&text, semantics);
    cursor_to_end(ui.ctx(), field, &text);
    let side = queries.side_mut();
    (side.recalled, side.focus) = (next, 0);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_shows_the_longest_hint_that_it_has_room_for() {
        let mut shown = Vec::new();
        let mut harness =
            egui_kittest::Harness::new_ui(|ui| shown = [900.0, 240.0, 20.0].map(|width| hint(ui, width)).to_vec());
        harness.run_steps(2);
        drop(harness);
        assert_eq!((shown[0], shown[2]), (HINTS[0], HINTS[4]));
        assert!(HINTS[1..4].contains(&shown[1]), "{}", shown[1]);
    }
}
