//! The window's own dialog for a path. The name field has the keyboard, the arrows choose in the list, `Enter` goes into
//! a folder or ends the dialog, `Alt+Up` leads to the folder above.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use crossbeam_channel::Receiver;
use egui::{Checkbox, Context, Id, Key, Modifiers, Order, TextEdit, Ui};

use super::format_list;
use super::listing::{self, FolderEntry, FolderListing, expanded};
use super::place::{PlaceAct, PlaceRow};
use super::request::{FileRequest, PathPurpose};
use super::rows::{RowAct, RowList};
use super::verdict::{NameVerdict, judge};
use crate::scene::text;
use crate::ui::dialogs::show_question;
use crate::ui::text_field::{cursor_to_end, select_start};
use crate::ui::theme;
use crate::worker::Repaint;

/// Rows that Page Up and Page Down go.
const PAGE: usize = 10;
/// Frames in which the name field takes the keyboard: the first measures the dialog, and a newly focused field loses its
/// selection.
const FOCUS_FRAMES: u8 = 3;

/// Obstacle to the choice.
enum Obstacle {
    Text(String),
    /// A folder that would have to be made.
    Missing {
        folder: PathBuf,
        /// True if the name asks for it.
        for_name: bool,
    },
}

/// An open dialog.
pub(super) struct OwnDialog {
    request: FileRequest,
    repaint: Repaint,
    folder: PathBuf,
    listing: Rc<FolderListing>,
    /// The folder that is being read.
    reading: Option<Receiver<FolderListing>>,
    place: PlaceRow,
    name: String,
    /// Name without its ending, last time it had one.
    stem: String,
    /// Chosen format; one more than there are for all files.
    format: usize,
    selected: Option<PathBuf>,
    /// True if the list scrolls to what is selected.
    follows: bool,
    shows_hidden: bool,
    obstacle: Option<Obstacle>,
    /// Frames in which the name field still takes the keyboard.
    takes_keys: u8,
    /// An existing file that is replaced if the user confirms.
    replaces: Option<PathBuf>,
}

impl OwnDialog {
    pub(super) fn new(request: FileRequest, folder: PathBuf, repaint: Repaint) -> Self {
        let name = request.proposed();
        let stem = match &request.purpose {
            PathPurpose::Save(stem) => stem.clone(),
            _ => String::new(),
        };
        let mut dialog = Self {
            format: request.format,
            request,
            repaint,
            folder: PathBuf::new(),
            listing: Rc::default(),
            reading: None,
            place: PlaceRow::default(),
            name,
            stem,
            selected: None,
            follows: false,
            shows_hidden: false,
            obstacle: None,
            takes_keys: 0,
            replaces: None,
        };
        dialog.enter(folder);
        dialog
    }

    /// Asks at once whether an existing file may be replaced.
    pub(super) fn replacing(mut self, path: PathBuf) -> Self {
        self.replaces = Some(path);
        self
    }

    /// Shows another folder.
    fn enter(&mut self, folder: PathBuf) {
        if !self.request.saves() {
            self.name.clear();
        }
        (self.selected, self.obstacle, self.place) = (None, None, PlaceRow::default());
        (self.listing, self.takes_keys) = (Rc::default(), FOCUS_FRAMES);
        // Parts such as ".." are not shown.
        self.folder = std::path::absolute(&folder).ok().and_then(|f| f.canonicalize().ok()).unwrap_or(folder);
        self.read();
    }

    fn read(&mut self) {
        match listing::begin(&self.folder, &self.repaint) {
            Ok(reading) => self.reading = Some(reading),
            Err(e) => self.obstacle = Some(Obstacle::Text(format!("This folder cannot be read: {e}."))),
        }
    }

    /// Draws the dialog. `Some(None)` once it is closed without a path.
    pub(super) fn show(&mut self, ctx: &Context) -> Option<Option<PathBuf>> {
        if let Some(path) = &self.replaces {
            let text = format!("{} already exists. Replace it?", text::path(path));
            let replace = show_question(ctx, &text, "Replace", "Choose another name")?;
            let path = self.replaces.take();
            if replace {
                return Some(path);
            }
            self.takes_keys = FOCUS_FRAMES;
        }
        if let Some(listing) = self.reading.as_ref().and_then(|r| r.try_recv().ok()) {
            (self.listing, self.reading) = (Rc::new(listing), None);
        }
        // Another program may have written files meanwhile.
        if ctx.input(|i| i.events.contains(&egui::Event::WindowFocused(true))) {
            self.read();
        }
        let room = ctx.content_rect().size();
        // Lists of formats open above it.
        let area = theme::dialog_area("files").order(Order::Foreground);
        let mut ends = None;
        let response = theme::dialog("files").area(area).show(ctx, |ui| {
            ui.set_width((room.x - 80.0).min(680.0));
            ends = self.contents(ui, (room.y - 330.0).clamp(120.0, 320.0));
        });
        let closes = response.is_top_modal
            && !response.any_popup_open
            && ctx.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Escape));
        ends.or_else(|| closes.then_some(None))
    }

    /// Draws the dialog's content. `Some(None)` once it is closed without a path.
    fn contents(&mut self, ui: &mut Ui, list_pt: f32) -> Option<Option<PathBuf>> {
        ui.heading(&self.request.title);
        ui.add_space(4.0);
        self.place_row(ui);
        let listing = Rc::clone(&self.listing);
        let entries = self.listed(&listing);
        let mut wanted = self.arrows(ui, &entries);
        let selected = self.selected.as_ref().and_then(|path| entries.iter().position(|e| e.path == *path));
        let empty = match (&self.reading, &self.listing.problem) {
            (Some(_), _) => "Reading\u{2026}".to_owned(),
            (None, Some(problem)) => problem.clone(),
            (None, None) => "Nothing to choose here.".to_owned(),
        };
        let list = RowList {
            entries: &entries,
            selected,
            follows: std::mem::take(&mut self.follows),
            folders_only: self.request.is_folder(),
            empty: &empty,
            height: list_pt,
        };
        let mut decided = false;
        match list.show(ui) {
            Some(RowAct::Select(i)) => wanted = Some(i),
            Some(RowAct::Open(i)) => (wanted, decided) = (Some(i), true),
            None => {}
        }
        if let Some(entry) = wanted.and_then(|i| entries.get(i)) {
            self.select(entry);
        }
        decided |= self.name_row(ui, &entries);
        let made = self.obstacle_row(ui);
        ui.add_space(4.0);
        let (mut pressed, mut close) = (false, false);
        ui.horizontal(|ui| {
            pressed = ui.add(theme::primary_button(self.button())).clicked();
            close = ui.button("Cancel").clicked();
            ui.add_space(8.0);
            ui.add(Checkbox::new(&mut self.shows_hidden, "Hidden files"));
        });
        if close {
            return Some(None);
        }
        (decided || pressed || made).then(|| self.decide(pressed)).flatten().map(Some)
    }

    /// Text of the main button.
    fn button(&self) -> &'static str {
        match (&self.request.purpose, self.request.kind.is_scene()) {
            (PathPurpose::Save(_), _) => "Save",
            (PathPurpose::Folder { creates: true }, _) => "Save here",
            (PathPurpose::Folder { .. }, false) => "Choose",
            _ => "Open",
        }
    }

    /// Entries that are listed.
    fn listed<'a>(&self, listing: &'a FolderListing) -> Vec<&'a FolderEntry> {
        let format = self.request.formats.get(self.format);
        let fits = |e: &&FolderEntry| {
            (self.shows_hidden || !e.is_hidden()) && (e.is_folder || format.is_none_or(|format| format.fits(&e.name)))
        };
        listing.entries.iter().filter(fits).collect()
    }

    /// The row of the folder, and where it leads.
    fn place_row(&mut self, ui: &mut Ui) {
        match self.place.show(ui, &self.folder, self.request.creates()) {
            None => {}
            Some(PlaceAct::Above) => self.enter_above(),
            Some(PlaceAct::Enter(typed)) => self.enter_typed(&typed),
            Some(PlaceAct::Make(name)) => {
                let folder = self.folder.join(name);
                if self.make(&folder) {
                    self.enter(folder);
                }
            }
            Some(PlaceAct::Leave) => self.takes_keys = FOCUS_FRAMES,
        }
    }

    /// Goes to a typed folder, if it is there.
    fn enter_typed(&mut self, typed: &str) {
        let folder = self.folder.join(expanded(typed.trim()));
        if folder.is_dir() {
            return self.enter(folder);
        }
        self.obstacle = Some(match self.request.creates() && !folder.exists() {
            true => Obstacle::Missing { folder, for_name: false },
            false => Obstacle::Text(format!("There is no folder {}.", text::path(&folder))),
        });
    }

    fn enter_above(&mut self) {
        let Some(parent) = self.folder.parent().map(Path::to_path_buf) else { return };
        let child = std::mem::take(&mut self.folder);
        self.enter(parent);
        (self.selected, self.follows) = (Some(child), true);
    }

    /// Makes a folder; returns whether it is there now.
    fn make(&mut self, folder: &Path) -> bool {
        let made = std::fs::create_dir_all(folder);
        let text = |e| format!("{} cannot be made: {e}. Choose another place.", text::path(folder));
        self.obstacle = made.as_ref().err().map(text).map(Obstacle::Text);
        made.is_ok()
    }

    /// The row that the arrows lead to, while the name field has the keyboard.
    fn arrows(&mut self, ui: &Ui, entries: &[&FolderEntry]) -> Option<usize> {
        if !ui.memory(|m| m.has_focus(name_field())) {
            return None;
        }
        let count = |key| ui.input_mut(|i| i.count_and_consume_key(Modifiers::NONE, key));
        let down = count(Key::ArrowDown) + PAGE * count(Key::PageDown);
        let up = count(Key::ArrowUp) + PAGE * count(Key::PageUp);
        if down == up {
            return None;
        }
        let can_choose = |i: &usize| entries.get(*i).is_some_and(|e| e.is_folder || !self.request.is_folder());
        let last = (0..entries.len()).rfind(can_choose)?;
        let at = entries.iter().position(|e| Some(&e.path) == self.selected.as_ref());
        self.follows = true;
        Some(at.map_or(0, |at| (at + down).saturating_sub(up)).min(last))
    }

    /// Selects an entry; a file lends its name.
    fn select(&mut self, entry: &FolderEntry) {
        self.selected = Some(entry.path.clone());
        self.obstacle = None;
        if !entry.is_folder {
            self.name.clone_from(&entry.name);
            self.follow_ending();
        }
        self.takes_keys = FOCUS_FRAMES;
    }

    /// Chooses the format that the name's ending asks for.
    fn follow_ending(&mut self) {
        if let Some(format) = self.request.format_of(&self.name).filter(|_| self.format < self.request.formats.len()) {
            self.format = format;
        }
        if let Some(stem) = self.request.stem(&self.name) {
            self.stem = stem.to_owned();
        }
    }

    /// The field of the name and the list of formats; returns true at `Enter`.
    fn name_row(&mut self, ui: &mut Ui, entries: &[&FolderEntry]) -> bool {
        let before = self.format;
        let saves = self.request.saves();
        ui.add_space(4.0);
        let edit = ui.horizontal(|ui| {
            ui.label("Name");
            let formats = if self.request.formats.is_empty() { 0.0 } else { format_list::WIDTH_PT + 8.0 };
            if self.takes_keys > 0 {
                self.takes_keys -= 1;
                ui.memory_mut(|m| m.request_focus(name_field()));
                let stem = self.request.stem(&self.name).map_or(0, |stem| stem.chars().count());
                select_start(ui.ctx(), name_field(), if saves { stem } else { self.name.chars().count() });
                ui.ctx().request_repaint();
            }
            let hint = if self.request.is_folder() { "This folder" } else { "" };
            // Tab completes the name; it leaves the field once there is nothing to complete.
            let more = listing::continued(entries, &self.name, self.request.is_folder()).filter(|_| !saves);
            let has_more = more.is_some();
            let is_here = ui.memory(|m| m.has_focus(name_field()));
            let tab = |ui: &Ui| ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Tab));
            let completed = more.filter(|_| is_here && tab(ui));
            let is_completed = completed.is_some();
            if let Some(name) = completed {
                self.name = name;
                cursor_to_end(ui.ctx(), name_field(), &self.name);
            }
            let edit = TextEdit::singleline(&mut self.name).id(name_field()).hint_text(hint).lock_focus(has_more);
            let edit = edit.desired_width(ui.available_width() - formats).align(egui::Align2::LEFT_CENTER);
            let edit = ui.add(edit).accessible_name("File name");
            format_list::show(ui, &self.request, &mut self.format);
            (edit, is_completed)
        });
        let (edit, is_completed) = edit.inner;
        if edit.changed() || is_completed {
            (self.obstacle, self.selected, self.takes_keys) = (None, None, 0);
            self.follow_ending();
            if !saves && !self.name.is_empty() {
                let named = listing::named(entries, &self.name, self.request.is_folder());
                self.selected = named.map(|e| e.path.clone());
                self.follows = true;
            }
        }
        if self.format != before && saves && !edit.changed() {
            self.name = self.request.named(&self.stem, self.format);
        }
        let enters = edit.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
        self.takes_keys = if enters { FOCUS_FRAMES } else { self.takes_keys };
        enters
    }

    /// Shows the obstacle, and offers to make a missing folder; returns true once the name has one.
    fn obstacle_row(&mut self, ui: &mut Ui) -> bool {
        let mut made = None;
        ui.horizontal_wrapped(|ui| {
            ui.set_min_height(26.0);
            match &self.obstacle {
                None => {}
                Some(Obstacle::Text(text)) => {
                    ui.colored_label(theme::warning(), text);
                }
                Some(Obstacle::Missing { folder, for_name }) => {
                    let shown = text::elided(&folder.display().to_string(), 64);
                    ui.colored_label(theme::warning(), format!("{shown} does not exist."));
                    let button = ui.button("Make this folder").on_hover_text(text::path(folder));
                    made = button.clicked().then(|| (folder.clone(), *for_name));
                }
            }
        });
        let Some((folder, for_name)) = made.filter(|(folder, _)| self.make(folder)) else { return false };
        if !for_name {
            self.enter(folder);
        }
        for_name
    }

    /// Ends the dialog with a path, if the choice can be made.
    fn decide(&mut self, by_button: bool) -> Option<PathBuf> {
        let listing = Rc::clone(&self.listing);
        let entry = listing.entries.iter().find(|e| Some(&e.path) == self.selected.as_ref());
        match entry {
            // The button chooses the folder that is selected.
            Some(entry) if entry.is_folder && by_button && self.request.is_folder() => return Some(entry.path.clone()),
            Some(entry) if entry.is_folder && !(self.request.saves() && by_button) => self.enter(entry.path.clone()),
            Some(entry) if !entry.is_folder && !self.request.saves() => return Some(entry.path.clone()),
            _ => match judge(&self.request, &self.folder, &self.name, self.format) {
                NameVerdict::Chosen(path) => return Some(path),
                NameVerdict::Replaces(path) => self.replaces = Some(path),
                NameVerdict::Enter(folder) => {
                    self.name = self.request.clone().with_format(self.format).proposed();
                    self.enter(folder);
                }
                NameVerdict::Missing(folder) => self.obstacle = Some(Obstacle::Missing { folder, for_name: true }),
                NameVerdict::Refused(text) => self.obstacle = Some(Obstacle::Text(text)),
            },
        }
        None
    }
}

fn name_field() -> Id {
    Id::unique("file dialog name")
}
