//! Actions on one object or part: the menu of its row and of its place in the view, and their names for the palette.

use egui::{Button, RichText, ScrollArea, Ui};

use super::ctx::Ctx;
use super::keys;
use crate::navigate::target::Side;
use crate::pipeline::semantics::lifting::edit::Edit;
use crate::scene::{Identities, IdentityId, NO_IDENTITY, text};
use crate::ui::actions::Action;

/// Row of the menu.
enum Row {
    /// Action with its name. If the thing is selected, another action does the same and has a key.
    Do(Action, &'static str, Option<Action>),
    /// Submenu of the things that it may be merged into.
    MergeInto,
    /// Line between groups.
    Line,
}

/// A thing that a menu acts on.
#[derive(Clone, Copy)]
pub(crate) struct MenuThing<'a> {
    pub(crate) all: &'a Identities,
    pub(crate) id: IdentityId,
    /// True if none of it is drawn.
    pub(crate) is_hidden: bool,
}

fn rows(MenuThing { all, id, is_hidden }: MenuThing<'_>) -> [Row; 17] {
    let plain = |action, name| Row::Do(action, name, None);
    [
        Row::Do(Action::GoToTarget(id, Side::Best), "Go there", Some(Action::GoToSelected)),
        plain(Action::Turntable(Some(id)), "Turntable"),
        plain(Action::Ask(all.full_name(id)), "Ask for this"),
        Row::Do(Action::Isolate(Some(id)), "Isolate", Some(Action::IsolateSelected)),
        Row::Do(Action::Hide(id), if is_hidden { "Show" } else { "Hide" }, Some(Action::HideSelected)),
        Row::Line,
        Row::Do(Action::RenameThis(id), "Rename\u{2026}", Some(Action::Rename)),
        Row::MergeInto,
        plain(Action::Change(Edit::Split(id)), "Split"),
        plain(Action::Change(Edit::Dissolve(id)), "Dissolve"),
        plain(Action::Correct(id), "Correct by clicks\u{2026}"),
        plain(Action::SegmentNew(Some(id)), "New part\u{2026}"),
        Row::Line,
        plain(Action::Transform(id), "Move, turn or recolor\u{2026}"),
        plain(Action::Remove(id), "Remove and fill"),
        Row::Line,
        plain(Action::ExportTarget(id), "Export Gaussians\u{2026}"),
    ]
}

/// Actions on a thing with their names, as they are searched: "Remove and fill: mug".
pub(crate) fn named_actions(thing: MenuThing<'_>) -> Vec<(Action, String)> {
    let name = thing.all.full_name(thing.id);
    let named = |row| match row {
        Row::Do(action, text, _) => Some((action, format!("{}: {name}", text.trim_end_matches('\u{2026}')))),
        Row::MergeInto | Row::Line => None,
    };
    rows(thing).into_iter().filter_map(named).collect()
}

/// Actions on a thing as they are listed while none is chosen: "Remove and fill".
pub(crate) fn unnamed_actions() -> Vec<(Action, String)> {
    let all = Identities::default();
    let named = |row| match row {
        Row::Do(action, text, _) => Some((action, text.trim_end_matches('\u{2026}').to_owned())),
        Row::MergeInto | Row::Line => None,
    };
    rows(MenuThing { all: &all, id: NO_IDENTITY, is_hidden: false }).into_iter().filter_map(named).collect()
}

/// The action with a key that does the same as this one of the selected thing.
pub(crate) fn keyed(thing: MenuThing<'_>, action: &Action) -> Option<Action> {
    rows(thing).into_iter().find_map(|row| match row {
        Row::Do(own, _, keyed) if own == *action => keyed,
        _ => None,
    })
}

/// Draws the menu under the thing's name. `is_hidden`: none of the thing is drawn.
pub(crate) fn show(ui: &mut Ui, all: &Identities, id: IdentityId, is_hidden: bool, cx: &mut Ctx<'_>) {
    ui.label(RichText::new(text::elided(&cx.state.labels.full_name(all, id), 48)).strong());
    ui.separator();
    for row in rows(MenuThing { all, id, is_hidden }) {
        match row {
            Row::Line => drop(ui.separator()),
            Row::MergeInto => drop(ui.menu_button("Merge into", |ui| merge_into(ui, all, id, cx))),
            Row::Do(action, name, keyed) => {
                let button = match keyed {
                    Some(keyed) => Button::new(name).shortcut_text(keys::label(ui.ctx(), &keyed)),
                    None => Button::new(name),
                };
                if ui.add(button).on_hover_text(action.tooltip()).clicked() {
                    cx.ask(action);
                    ui.close();
                }
            }
        }
    }
}

/// Draws the things of the same level.
fn merge_into(ui: &mut Ui, all: &Identities, id: IdentityId, cx: &mut Ctx<'_>) {
    let Some(own) = all.get(id) else { return };
    ScrollArea::vertical().max_height(300.0).show(ui, |ui| {
        for (other, identity) in all.iter().filter(|(other, i)| *other != id && i.level == own.level) {
            // Parts of the same whole have short labels; others need the name of their whole.
            let text = if own.parent == identity.parent { all.label(other) } else { all.full_name(other) };
            if ui.button(text).clicked() {
                cx.ask(Action::Change(Edit::Merge(id, other)));
                ui.close();
            }
        }
    });
}
