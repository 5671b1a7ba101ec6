//! The command palette and the shortcut sheet: two loops over the actions.

use egui::{Align2, Key, Modifiers, RichText, ScrollArea, TextEdit};

use super::keys;
use super::layout::Layout;
use super::object_menu::{self, MenuThing};
use super::theme;
use crate::ui::actions::Action;

/// What is to be done before an action on an object can be.
const SELECT_FIRST: &str = "Select an object first: click it in the view, or press N.";

#[derive(Default)]
pub(crate) struct Palette {
    open: bool,
    query: String,
    selected: usize,
    /// True if the action that was chosen last needs an object, and none is selected.
    needs_object: bool,
}

/// An action that is found.
#[derive(Clone, Debug, PartialEq)]
struct PaletteRow {
    action: Action,
    title: String,
    /// True if it needs an object, and none is selected.
    needs_object: bool,
}

impl Palette {
    /// Opens the palette with an empty query, or closes it.
    pub(crate) fn toggle(&mut self) {
        *self = Self { open: !self.open, ..Self::default() };
    }

    /// True if the palette is open.
    pub(crate) fn is_open(&self) -> bool {
        self.open
    }

    /// Draws the palette; returns the chosen action. Actions on the selection come first.
    pub(crate) fn show(
        &mut self,
        ctx: &egui::Context,
        layout: &Layout,
        selection: Option<MenuThing<'_>>,
    ) -> Option<Action> {
        if !self.open {
            return None;
        }
        let step = |key| ctx.input_mut(|i| i.consume_key(Modifiers::NONE, key));
        if step(Key::ArrowDown) {
            self.selected += 1;
        }
        if step(Key::ArrowUp) {
            self.selected = self.selected.saturating_sub(1);
        }
        let entered = step(Key::Enter);
        let mut chosen = None;
        let field = egui::Id::unique("palette query");
        // Before drawing: text typed in this frame belongs to the field.
        ctx.memory_mut(|m| m.request_focus(field));
        let area = theme::dialog_area("palette").anchor(Align2::CENTER_TOP, [0.0, 90.0]);
        let response = theme::dialog("palette").area(area).show(ctx, |ui| {
            ui.set_width(520.0);
            let edit = TextEdit::singleline(&mut self.query)
                .id(field)
                .hint_text("Type an action, or a path to open")
                .desired_width(f32::INFINITY);
            let edit = ui.add(edit).accessible_name("Search actions");
            if edit.changed() {
                (self.selected, self.needs_object) = (0, false);
            }
            let found = matches(&self.query, layout, selection);
            self.selected = self.selected.min(found.len().saturating_sub(1));
            let mut taken = found.get(self.selected).filter(|_| entered);
            ui.add_space(4.0);
            // The window remembers its last height, which the list must not be held to.
            let height = (ctx.content_rect().height() - 220.0).clamp(120.0, 380.0);
            let list = ScrollArea::vertical().max_height(height).min_scrolled_height(height);
            list.auto_shrink([false, true]).show(ui, |ui| {
                if found.is_empty() {
                    ui.weak("No matching action.");
                }
                for (i, found) in found.iter().enumerate() {
                    let PaletteRow { action, title, needs_object } = found;
                    let keyed = selection.and_then(|thing| object_menu::keyed(thing, action));
                    let title = match needs_object {
                        true => RichText::new(format!("{title}  \u{b7}  select an object first")).color(theme::weak()),
                        false => RichText::new(title),
                    };
                    let row = egui::Button::selectable(i == self.selected, title)
                        .shortcut_text(keys::label(ui.ctx(), keyed.as_ref().unwrap_or(action)))
                        .min_size(egui::vec2(ui.available_width(), 28.0));
                    let row = ui.add(row).on_hover_text(action.tooltip());
                    if i == self.selected && (entered || edit.changed() || step_keys(ui)) {
                        row.scroll_to_me(None);
                    }
                    if row.clicked() {
                        taken = Some(found);
                    }
                }
            });
            if let Some(PaletteRow { action, needs_object, .. }) = taken {
                self.needs_object = *needs_object;
                chosen = Some(action.clone()).filter(|_| !needs_object);
            }
            if self.needs_object {
                ui.add_space(4.0);
                ui.label(RichText::new(SELECT_FIRST).color(theme::warning()));
            }
        });
        if chosen.is_some() || response.should_close() {
            self.open = false;
        }
        chosen
    }
}

fn step_keys(ui: &egui::Ui) -> bool {
    ui.input(|i| i.key_down(Key::ArrowDown) || i.key_down(Key::ArrowUp))
}

/// Title of an action; a switch of a visible pane can only hide it.
fn title(action: &Action) -> String {
    match action {
        Action::TogglePane(pane) => format!("Hide the {} pane", pane.text().to_lowercase()),
        other => other.text(),
    }
}

/// Actions whose titles hold every word of the query: those that begin with it, then those with words that begin so, then
/// those with the letters anywhere. A query that looks like a path gives only the action that opens it. Without a
/// selection, actions on one are found by their names, too.
fn matches(query: &str, layout: &Layout, selection: Option<MenuThing<'_>>) -> Vec<PaletteRow> {
    let path = query.trim();
    if path.starts_with(['/', '.', '~']) || path.contains(":\\") {
        let home = path.strip_prefix("~/").and_then(|rest| Some(std::env::home_dir()?.join(rest)));
        let open = Action::Open(home.unwrap_or_else(|| path.into()));
        let title = title(&open);
        return vec![PaletteRow { action: open, title, needs_object: false }];
    }
    let query = path.to_lowercase();
    let words: Vec<&str> = query.split_whitespace().collect();
    let can_be_done = |a: &Action| !matches!(a, Action::TogglePane(pane) if !layout.shows(*pane));
    let is_asked_for = |PaletteRow { action, title, .. }: &PaletteRow| {
        let title = format!("{} {}", title.to_lowercase(), other_words(action));
        words.iter().all(|w| title.contains(w))
    };
    let row = |needs_object| move |(action, title)| PaletteRow { action, title, needs_object };
    let of_selection = selection.map(object_menu::named_actions).unwrap_or_default();
    let of_window = Action::all().into_iter().filter(can_be_done).map(|action| {
        let needs_object = selection.is_none() && acts_on_selection(&action);
        PaletteRow { title: title(&action), action, needs_object }
    });
    let of_none = if selection.is_none() && !words.is_empty() { object_menu::unnamed_actions() } else { Vec::new() };
    let mut found: Vec<PaletteRow> = of_selection.into_iter().map(row(false)).filter(is_asked_for).collect();
    let selected = found.len();
    found.extend(of_window.filter(is_asked_for));
    found.extend(of_none.into_iter().map(row(true)).filter(is_asked_for));
    // The name of a pane is most likely a request for that pane.
    let is_pane = |a: &Action| match a {
        Action::ShowPane(pane) | Action::TogglePane(pane) => pane.text().to_lowercase().starts_with(&query),
        _ => false,
    };
    let rank = |(at, PaletteRow { action, title, .. }): &(usize, PaletteRow)| {
        let title = title.to_lowercase();
        if title.starts_with(&query) || is_pane(action) {
            return 0;
        }
        let text = format!("{title} {}", other_words(action));
        match words.iter().all(|word| begins_a_word(&text, word)) {
            // "delete" is more likely said of what is selected than of the scene.
            true => usize::from(*at >= selected),
            false => 2,
        }
    };
    let mut found: Vec<_> = found.into_iter().enumerate().collect();
    found.sort_by_key(rank);
    found.into_iter().map(|(_, found)| found).collect()
}

/// True if a plain action does something to the selected object.
fn acts_on_selection(action: &Action) -> bool {
    matches!(action, Action::IsolateSelected | Action::HideSelected | Action::GoToSelected | Action::Rename)
}

/// True if one of the words of a text begins with these letters.
fn begins_a_word(text: &str, letters: &str) -> bool {
    let is_begin = |at: usize| !text[..at].ends_with(char::is_alphanumeric);
    text.match_indices(letters).any(|(at, _)| is_begin(at))
}

/// Synonyms in an action's title.
fn other_words(action: &Action) -> &'static str {
    match action {
        Action::ShowPane(_) => "open",
        Action::LookFrom(_) => "view",
        Action::Remove(_) => "delete",
        Action::TogglePane(_) => "close",
        Action::Guide | Action::News | Action::About => "help",
        Action::ExportPly => "save",
        _ => "",
    }
}

/// Draws the shortcut sheet while `open`.
pub(crate) fn shortcut_sheet(ctx: &egui::Context, open: &mut bool) {
    if !*open {
        return;
    }
    let response = theme::dialog("shortcuts").show(ctx, |ui| {
        ui.set_width((ctx.content_rect().width() - 80.0).min(760.0));
        ui.heading("Keyboard and mouse");
        ui.add_space(8.0);
        // A small window cannot fit all rows.
        let height = (ctx.content_rect().height() - 150.0).max(200.0);
        ScrollArea::vertical().max_height(height).auto_shrink([false, true]).show(ui, |ui| {
            ui.columns_const(|[left, right]| {
                let bound: Vec<(String, String)> = Action::all()
                    .into_iter()
                    .filter(|a| a.shortcut().is_some())
                    .map(|a| (keys::label(left.ctx(), &a), a.text()))
                    .collect();
                let gestures = keys::GESTURES.map(|(k, t)| (k.to_owned(), t.to_owned()));
                // Both columns get the same height.
                let (first, second) = bound.split_at(bound.len().min((bound.len() + gestures.len()).div_ceil(2)));
                sheet_grid(left, "Actions", first);
                sheet_grid(right, "In the viewport", &gestures);
                sheet_grid(right, "More actions", second);
            });
        });
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            ui.weak("While a text field is focused, single keys type into it.");
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| ui.button("Close").clicked()).inner
        })
        .inner
    });
    if response.inner || response.should_close() {
        *open = false;
    }
}

fn sheet_grid(ui: &mut egui::Ui, title: &str, rows: &[(String, String)]) {
    theme::section(ui, title);
    // Text wider than its column wraps.
    let grid = egui::Grid::new(title).num_columns(2).spacing([16.0, 5.0]).min_col_width(70.0);
    grid.max_col_width(ui.available_width() - 110.0).show(ui, |ui| {
        for (key, text) in rows {
            ui.label(RichText::new(key).monospace().color(theme::accent()));
            ui.label(text);
            ui.end_row();
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Identities, IdentityId, Level, NO_IDENTITY};
    use crate::ui::actions::Pane;

    fn thing(all: &Identities, id: IdentityId, is_hidden: bool) -> MenuThing<'_> {
        MenuThing { all, id, is_hidden }
    }

    fn found(query: &str) -> Vec<Action> {
        matches(query, &Layout::default(), None).into_iter().map(|row| row.action).collect()
    }

    #[test]
    fn actions_on_the_selection_come_first_under_its_name() {
        let mut all = Identities::default();
        let mug = all.add(Level::Object, NO_IDENTITY, vec!["mug".into()]);
        let titles = |query: &str| {
            let found = matches(query, &Layout::default(), Some(thing(&all, mug, false)));
            found.into_iter().map(|row| row.title).collect::<Vec<_>>()
        };
        assert_eq!(titles("")[0], "Go there: mug");
        assert_eq!(titles("").len(), found("").len() + object_menu::named_actions(thing(&all, mug, false)).len());
        for (query, title) in [
            ("move", "Move, turn or recolor: mug"),
            ("recolor", "Move, turn or recolor: mug"),
            ("fill mug", "Remove and fill: mug"),
            ("correct", "Correct by clicks: mug"),
            ("new part", "New part: mug"),
            ("dissolve", "Dissolve: mug"),
        ] {
            assert_eq!(titles(query)[0], title, "{query}");
        }
        let hides = |is_hidden| matches("mug", &Layout::default(), Some(thing(&all, mug, is_hidden))).into_iter();
        let title = |is_hidden| hides(is_hidden).find(|row| row.action == Action::Hide(mug)).expect("there").title;
        assert_eq!([title(false), title(true)], ["Hide: mug", "Show: mug"], "what it does now");
    }

    #[test]
    fn without_a_selection_what_needs_one_is_found_but_cannot_be_done() {
        let first = |query: &str| matches(query, &Layout::default(), None).swap_remove(0);
        for (query, title) in
            [("move", "Move, turn or recolor"), ("recolor", "Move, turn or recolor"), ("dissolve", "Dissolve")]
        {
            let row = first(query);
            assert_eq!((row.title.as_str(), row.needs_object), (title, true), "{query}");
        }
        assert!(matches("hide selection", &Layout::default(), None).iter().all(|row| row.needs_object));
        // Controls: what needs none, and a selection.
        assert!(!first("undo").needs_object);
        let mut all = Identities::default();
        let mug = all.add(Level::Object, NO_IDENTITY, vec!["mug".into()]);
        for query in ["move", "hide selection", ""] {
            let found = matches(query, &Layout::default(), Some(thing(&all, mug, false)));
            assert!(found.iter().all(|row| !row.needs_object), "{query}");
        }
    }

    #[test]
    fn an_empty_query_lists_everything_that_can_be_done() {
        let hidden = Layout::default().hidden.len();
        assert_eq!(found("").len(), Action::all().len() - hidden);
    }

    #[test]
    fn every_word_counts_and_a_beginning_wins() {
        assert_eq!(found("train start"), vec![Action::StartTraining]);
        assert_eq!(found("open").first(), Some(&Action::OpenFolder));
        assert!(found("no such thing").is_empty());
    }

    #[test]
    fn the_beginning_of_a_word_beats_letters_within_one() {
        let mut all = Identities::default();
        let mug = all.add(Level::Object, NO_IDENTITY, vec!["mug".into()]);
        let first =
            |query: &str| matches(query, &Layout::default(), Some(thing(&all, mug, false))).swap_remove(0).title;
        for (query, title) in [
            ("top", "Look from the top"),
            ("help", "Guide"),
            ("move", "Move, turn or recolor: mug"),
            ("export", "Export Gaussians: mug"),
            ("crop", "Crop box"),
            ("dark", "Dark theme"),
            ("ortho", "Orthographic view"),
            ("undo", "Undo"),
            ("video", "Export video\u{2026}"),
            ("mask", "Find objects with other masks\u{2026}"),
            ("photo", "Show the photos pane"),
            ("delete", "Remove and fill: mug"),
            ("view top", "Look from the top"),
        ] {
            assert_eq!(first(query), title, "{query}");
        }
        let of = |query: &str| matches(query, &Layout::default(), Some(thing(&all, mug, false)));
        assert!(of("delete").iter().any(|row| row.action == Action::Remove(mug)));
        // Control: letters within words are found, too, at the end.
        assert_eq!(of("top").last().map(|row| &row.action), Some(&Action::EndComparison));
    }

    #[test]
    fn rows_of_the_selection_have_the_keys_of_the_menu() {
        let mut all = Identities::default();
        let mug = all.add(Level::Object, NO_IDENTITY, vec!["mug".into()]);
        let keyed = |action| object_menu::keyed(thing(&all, mug, false), &action);
        assert_eq!(keyed(Action::Hide(mug)), Some(Action::HideSelected));
        assert_eq!(keyed(Action::RenameThis(mug)), Some(Action::Rename));
        assert_eq!([keyed(Action::Transform(mug)), keyed(Action::Hide(mug + 1))], [None, None]);
    }

    #[test]
    fn what_is_to_be_shown_is_not_hidden() {
        assert_eq!(found("show scene plan"), vec![Action::ShowPane(Pane::Plan)]);
        assert_eq!(found("hide scene plan"), vec![Action::TogglePane(Pane::Plan)]);
        assert!(found("hide camera path").is_empty(), "it is hidden already");
        assert_eq!(found("close scene plan"), vec![Action::TogglePane(Pane::Plan)]);
        assert_eq!(found("camera path").first(), Some(&Action::ShowPane(Pane::Camera)), "before what plays it");
    }

    #[test]
    fn a_path_can_be_opened() {
        assert_eq!(found(" /data/My Fox "), vec![Action::Open("/data/My Fox".into())]);
    }
}
