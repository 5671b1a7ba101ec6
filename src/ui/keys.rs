//! Key bindings, read off the actions.

use egui::{Key, KeyboardShortcut, Modifiers};

use crate::ui::actions::{Action, Shortcut};

/// Mouse gestures and held keys in the viewport, which are no actions: for the shortcut sheet.
pub(crate) const GESTURES: [(&str, &str); 8] = [
    ("W A S D", "Fly forward, left, back, right"),
    ("Q  E", "Fly down, up"),
    ("Shift  Alt", "Fly faster, slower (held)"),
    ("Left drag", "Orbit the pivot"),
    ("Right drag", "Pan"),
    ("Wheel", "Zoom toward the cursor"),
    ("Double click", "Set the pivot to what is under the cursor"),
    ("Click on a camera", "Look through it"),
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

/// Takes every bound key that was pressed off the input, as often as it was pressed. Plain keys
/// belong to a text field while one has the focus.
pub(crate) fn pressed(ctx: &egui::Context) -> Vec<Action> {
    let typing = ctx.text_edit_focused();
    let mut found = Vec::new();
    for action in Action::all() {
        let Some(shortcut) = action.shortcut().filter(|s| s.ctrl || !typing) else { continue };
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
    fn every_shortcut_names_a_real_key() {
        for action in Action::all() {
            if let Some(s) = action.shortcut() {
                assert!(binding(s).is_some(), "{action:?}: no key '{}'", s.key);
            }
        }
    }
}
