//! Key bindings, derived from the actions.

use std::collections::BTreeSet;

use egui::{Event, Id, InputState, Key, KeyboardShortcut, Modifiers};

use crate::ui::actions::{Action, Shortcut};

/// Mouse gestures and held keys in the viewport for the shortcut sheet; they are no actions.
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

/// The binding as egui's type; `None` if egui has no key of that name.
pub(crate) fn binding(shortcut: Shortcut) -> Option<KeyboardShortcut> {
    let modifiers = if shortcut.ctrl { Modifiers::COMMAND } else { Modifiers::NONE };
    Some(KeyboardShortcut::new(modifiers, Key::from_name(shortcut.key)?))
}

/// The action's key as text, "Ctrl+P"; empty if it has none.
pub(crate) fn label(ctx: &egui::Context, action: &Action) -> String {
    let Some(shortcut) = action.shortcut() else { return String::new() };
    // Symbols such as "[" read better than egui's names for them.
    if shortcut.key.len() == 1 && !shortcut.ctrl {
        return shortcut.key.to_owned();
    }
    binding(shortcut).map_or_else(String::new, |b| ctx.format_shortcut(&b))
}

/// Time after a text field lost the focus in which letters are still typing and no shortcuts, s.
const TYPING_SECS: f64 = 1.0;

/// State of typing.
#[derive(Clone, Copy, Default)]
struct Typing {
    /// Window time until which letters are no shortcuts, s.
    until: f64,
    /// The same for letters typed while a dialog is open that has no field for them.
    in_dialog_until: f64,
    /// The focused field, if text was typed into it since Enter; undo and redo then belong to it.
    unsent: Option<Id>,
    /// True if a field has the focus; `leaves` if Escape now ends that, so Escape is no shortcut.
    in_field: bool,
    leaves: bool,
    /// True if a disabled field is open that discards typed text.
    in_vain: bool,
}

/// Updates the state of typing; once per frame, before other code takes keys. Space and Enter of text that is typed
/// while a dialog without a field for it is open press none of its buttons.
pub(crate) fn watch_typing(ctx: &egui::Context, has_dialog: bool) {
    let field = ctx.memory(|m| m.focused()).filter(|_| ctx.text_edit_focused());
    let typing = typing(ctx);
    let typing = ctx.input(|i| {
        let is_text = |e: &Event| matches!(e, Event::Text(_) | Event::Paste(_));
        let typed = i.events.iter().any(is_text);
        let goes_on = field.is_some() || (typed && i.time < typing.until);
        let unsent = field.filter(|id| typed || typing.unsent == Some(*id)).filter(|_| !i.key_pressed(Key::Enter));
        let until = match goes_on {
            true => i.time + TYPING_SECS,
            // A click or Escape ends typing.
            false if i.pointer.any_pressed() || i.key_pressed(Key::Escape) => 0.0,
            false => typing.until,
        };
        let leaves = typing.in_field && i.key_pressed(Key::Escape);
        let is_letter = |e: &Event| matches!(e, Event::Text(text) if !text.trim().is_empty());
        let in_dialog_until = match has_dialog && field.is_none() {
            true if i.events.iter().any(is_letter) => i.time + TYPING_SECS,
            true if !i.pointer.any_pressed() && !i.key_pressed(Key::Tab) => typing.in_dialog_until,
            _ => 0.0,
        };
        Typing { until, in_dialog_until, unsent, in_field: field.is_some(), leaves, ..typing }
    });
    if ctx.input(|i| i.time) < typing.in_dialog_until {
        let presses = |e: &Event| matches!(e, Event::Key { key: Key::Space | Key::Enter, pressed: true, .. });
        ctx.input_mut(|i| i.events.retain(|e| !presses(e)));
    }
    ctx.data_mut(|d| d.insert_temp(Id::NULL, typing));
}

/// Reserves letters for a field that opens in this frame, before it is drawn.
pub(crate) fn begin_typing(ctx: &egui::Context) {
    let until = ctx.input(|i| i.time) + TYPING_SECS;
    ctx.data_mut(|d| d.get_temp_mut_or_default::<Typing>(Id::NULL).until = until);
}

/// Sets whether letters are discarded because a disabled field is open.
pub(crate) fn type_in_vain(ctx: &egui::Context, in_vain: bool) {
    ctx.data_mut(|d| d.get_temp_mut_or_default::<Typing>(Id::NULL).in_vain = in_vain);
}

fn typing(ctx: &egui::Context) -> Typing {
    ctx.data(|d| d.get_temp(Id::NULL)).unwrap_or_default()
}

/// True if letters belong to a text field: one has the focus, or lost it during typing.
pub(crate) fn is_typing(ctx: &egui::Context) -> bool {
    let typing = typing(ctx);
    ctx.text_edit_focused() || typing.in_vain || ctx.input(|i| i.time) < typing.until
}

/// True if the action opens a text field, which gets all later keys.
pub(crate) fn opens_field(action: &Action) -> bool {
    matches!(action, Action::TypeQuery | Action::Palette | Action::StartChat | Action::Rename)
}

/// Updates the held keys that move the camera: those pressed without Control or Command.
pub(crate) fn follow_held(held: &mut BTreeSet<Key>, input: &InputState) {
    for event in &input.events {
        if let Event::Key { key, pressed: true, repeat: false, modifiers, .. } = event
            && !modifiers.command
            && !modifiers.ctrl
        {
            held.insert(*key);
        }
    }
    held.retain(|key| input.key_down(*key));
}

/// Takes the pressed bound keys off the input, in order and with repeats, unless they belong to a text field. Stops
/// after an action that opens such a field: keys pressed later in a slow frame belong to it.
pub(crate) fn pressed(ctx: &egui::Context) -> Vec<Action> {
    let (has_field, is_typing) = (ctx.text_edit_focused() || typing(ctx).in_vain, is_typing(ctx));
    let has_focus = ctx.memory(|m| m.focused()).is_some();
    let unsent = has_field && typing(ctx).unsent.is_some();
    let is_fields = |action: &Action, shortcut: Shortcut| match shortcut {
        Shortcut { ctrl: true, .. } => unsent && matches!(action, Action::Undo | Action::Redo),
        // Text fields do not use F1 to F12.
        Shortcut { key, .. } if key.len() > 1 && key.starts_with('F') => false,
        // Space presses the focused button.
        Shortcut { key: "Space", .. } => has_focus || is_typing,
        Shortcut { key: "Escape", .. } => has_field || typing(ctx).leaves,
        Shortcut { key, .. } => has_field || is_typing && key.len() == 1,
    };
    let keys = |action: Action| {
        let shortcut = action.shortcut().filter(|s| !is_fields(&action, *s))?;
        Some((binding(shortcut)?, action))
    };
    let bound: Vec<(KeyboardShortcut, Action)> = Action::all().into_iter().filter_map(keys).collect();
    ctx.input_mut(|i| {
        let (mut found, mut left) = (Vec::new(), Vec::new());
        let mut events = std::mem::take(&mut i.events).into_iter().peekable();
        while let Some(event) = events.next() {
            let Some(action) = bound_to(&bound, &event) else {
                left.push(event);
                continue;
            };
            let opens = opens_field(action);
            found.push(action.clone());
            if opens {
                left.retain(|e| !matches!(e, Event::Key { .. } | Event::Text(_)));
                // The letter of the shortcut itself is not part of the typed text.
                events.next_if(|e| matches!(e, Event::Text(text) if action.shortcut().is_some_and(|s| s.key == text)));
                break;
            }
        }
        i.events = left.into_iter().chain(events).collect();
        found
    })
}

/// The action bound to the key of an event.
fn bound_to<'a>(bound: &'a [(KeyboardShortcut, Action)], event: &Event) -> Option<&'a Action> {
    let Event::Key { key, pressed: true, modifiers, .. } = event else { return None };
    let is_pressed = |b: &KeyboardShortcut| b.logical_key == *key && modifiers.matches_logically(b.modifiers);
    bound.iter().find(|(b, _)| is_pressed(b)).map(|(_, action)| action)
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
