//! Key bindings, read off the actions.

use egui::{Event, Id, Key, KeyboardShortcut, Modifiers};

use crate::ui::actions::{Action, Shortcut};

/// Mouse gestures and held keys in the viewport, which are no actions: for the shortcut sheet.
pub(crate) const GESTURES: [(&str, &str); 14] = [
    ("W A S D", "Fly forward, left, back, right"),
    ("Q  E", "Fly down, up"),
    ("Shift  Alt", "Fly faster, slower (held)"),
    ("Left drag", "Orbit the pivot"),
    ("Right drag", "Pan"),
    ("Wheel", "Zoom toward the cursor"),
    ("Double click", "Set the pivot to what is under the cursor"),
    ("Click", "Select the part; again, or with Alt, its object"),
    ("Right click", "Context menu"),
    ("Shift drag", "Erase, while painting"),
    ("Click in a view", "Work there, in a split view"),
    ("Click on a camera", "Look through it"),
    ("Tab  Shift+Tab", "Next, previous button or field"),
    ("Space  Arrows", "Press it, change it"),
];

/// The binding in the window toolkit's terms; `None` if it has no key of that name.
pub(crate) fn binding(shortcut: Shortcut) -> Option<KeyboardShortcut> {
    let modifiers = if shortcut.ctrl { Modifiers::COMMAND } else { Modifiers::NONE };
    Some(KeyboardShortcut::new(modifiers, Key::from_name(shortcut.key)?))
}

/// The action's key for the user: "Ctrl+P"; empty if it has none.
pub(crate) fn label(ctx: &egui::Context, action: &Action) -> String {
    let Some(shortcut) = action.shortcut() else { return String::new() };
    // Symbols such as "[" read better as they stand on the key than by the toolkit's name.
    if shortcut.key.len() == 1 && !shortcut.ctrl {
        return shortcut.key.to_owned();
    }
    binding(shortcut).map_or_else(String::new, |b| ctx.format_shortcut(&b))
}

/// How long keys belong to a text field that has lost the keyboard, seconds: whoever types on means no shortcuts.
const TYPING_SECS: f64 = 1.0;

/// Who typed where, and when.
#[derive(Clone, Copy, Default)]
struct Typing {
    /// Until when letters are no shortcuts.
    until: f64,
    /// The field with the keyboard, if something was typed into it since Enter: undo belongs to it then.
    unsent: Option<Id>,
    /// Whether a field has the keyboard, and whether it loses it by Escape now, which is then no shortcut.
    in_field: bool,
    leaves: bool,
}

/// Looks who types; once per frame, before anybody takes keys.
pub(crate) fn watch_typing(ctx: &egui::Context) {
    let field = ctx.memory(|m| m.focused()).filter(|_| ctx.text_edit_focused());
    let typing = typing(ctx);
    let typing = ctx.input(|i| {
        let is_text = |e: &Event| matches!(e, Event::Text(_) | Event::Paste(_));
        let typed = i.events.iter().any(is_text);
        let goes_on = field.is_some() || (typed && i.time < typing.until);
        let unsent = field.filter(|id| typed || typing.unsent == Some(*id)).filter(|_| !i.key_pressed(Key::Enter));
        let until = match goes_on {
            true => i.time + TYPING_SECS,
            // Whoever clicks somewhere or cancels has ended typing.
            false if i.pointer.any_pressed() || i.key_pressed(Key::Escape) => 0.0,
            false => typing.until,
        };
        let leaves = typing.in_field && i.key_pressed(Key::Escape);
        Typing { until, unsent, in_field: field.is_some(), leaves }
    });
    ctx.data_mut(|d| d.insert_temp(Id::NULL, typing));
}

fn typing(ctx: &egui::Context) -> Typing {
    ctx.data(|d| d.get_temp(Id::NULL)).unwrap_or_default()
}

/// Whether letters belong to a text field: it has the keyboard, or lost it while it was typed into.
pub(crate) fn is_typing(ctx: &egui::Context) -> bool {
    ctx.text_edit_focused() || ctx.input(|i| i.time) < typing(ctx).until
}

/// Takes every bound key that was pressed off the input, as often as it was pressed, unless it belongs to a text
/// field.
pub(crate) fn pressed(ctx: &egui::Context) -> Vec<Action> {
    let (has_field, is_typing) = (ctx.text_edit_focused(), is_typing(ctx));
    let has_focus = ctx.memory(|m| m.focused()).is_some();
    let unsent = has_field && typing(ctx).unsent.is_some();
    let is_fields = |action: &Action, shortcut: Shortcut| match shortcut {
        Shortcut { ctrl: true, .. } => unsent && matches!(action, Action::Undo | Action::Redo),
        // What a field does not take: F1 to F12.
        Shortcut { key, .. } if key.len() > 1 && key.starts_with('F') => false,
        // Space presses the button that has the focus.
        Shortcut { key: "Space", .. } => has_focus || is_typing,
        Shortcut { key: "Escape", .. } => has_field || typing(ctx).leaves,
        Shortcut { key, .. } => has_field || is_typing && key.len() == 1,
    };
    let mut found = Vec::new();
    for action in Action::all() {
        let Some(shortcut) = action.shortcut().filter(|s| !is_fields(&action, *s)) else { continue };
        let Some(key) = binding(shortcut) else { continue };
        let times = ctx.input_mut(|i| i.count_and_consume_key(key.modifiers, key.logical_key));
        found.extend(std::iter::repeat_n(action, times));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_guide_lists_every_key() {
        let guide = include_str!("../../docs/guide.md");
        let table = guide.split("\n## ").find(|section| section.starts_with("Keys\n")).expect("a section of keys");
        let listed = |key: &str| table.contains(&format!("`{key}`"));
        for action in Action::all() {
            if let Some(Shortcut { ctrl, key }) = action.shortcut() {
                assert!(listed(&format!("{}{key}", if ctrl { "Ctrl+" } else { "" })), "{action:?}: {key}");
            }
        }
        assert!(!listed("Ctrl+J"), "no action has it");
    }

    #[test]
    fn every_shortcut_names_a_real_key() {
        for action in Action::all() {
            if let Some(s) = action.shortcut() {
                assert!(binding(s).is_some(), "{action:?}: no key '{}'", s.key);
            }
        }
    }
}
