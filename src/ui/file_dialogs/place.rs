//! The row of the folder: the one above, a field to type one in, a new one.

use std::path::Path;

use egui::{
    Align2, Button, CompletionPopup, CompletionQuery, Id, Key, Modifiers, RectAlign, Suggestion, TextEdit, TextStyle,
    Ui,
};

use super::listing::completions;
use crate::ui::short_names::fitted;

/// Room at both ends of the field, points.
const PADDING_PT: f32 = 10.0;

/// Wish of the user.
pub(super) enum PlaceAct {
    Above,
    /// A typed folder.
    Enter(String),
    /// Name of a folder to make.
    Make(String),
    /// Nothing more is typed here.
    Leave,
}

/// Texts of the row while they are typed.
#[derive(Default)]
pub(super) struct PlaceRow {
    folder: Option<String>,
    new_folder: Option<String>,
}

impl PlaceRow {
    pub(super) fn show(&mut self, ui: &mut Ui, folder: &Path, creates: bool) -> Option<PlaceAct> {
        let act = ui.horizontal(|ui| {
            let up = ui.add_enabled(folder.parent().is_some(), Button::new("\u{2191}"));
            let up = up.on_hover_text("Folder above  Alt+Up").accessible_name("Folder above");
            let above = up.clicked() || ui.input_mut(|i| i.consume_key(Modifiers::ALT, Key::ArrowUp));
            let entered = self.field(ui, folder, if creates { 97.0 } else { 0.0 });
            if creates && ui.button("New folder").clicked() {
                self.new_folder = Some(String::new());
            }
            above.then_some(PlaceAct::Above).or(entered.map(PlaceAct::Enter))
        });
        act.inner.or_else(|| self.new_folder(ui))
    }

    /// The folder's field; returns what was typed, at `Enter`.
    fn field(&mut self, ui: &mut Ui, folder: &Path, aside_pt: f32) -> Option<String> {
        let (id, width) = (Id::unique("file dialog folder"), ui.available_width() - aside_pt);
        let shown = folder.display().to_string();
        let is_typed = ui.memory(|m| m.has_focus(id));
        let text = match is_typed {
            true => self.folder.get_or_insert_with(|| shown.clone()),
            // As much as has room, with both ends.
            false => &mut fitted(ui, &shown, &TextStyle::Body.resolve(ui.style()), width - PADDING_PT),
        };
        let edit = TextEdit::singleline(text).desired_width(width).align(Align2::LEFT_CENTER);
        let offered = |query: &CompletionQuery<'_>| match is_typed && query.text != shown {
            true => completions(query.text).into_iter().take(12).map(Suggestion::new).collect(),
            false => Vec::new(),
        };
        let popup = CompletionPopup::new(id).align(RectAlign::BOTTOM_START);
        let popup = popup.word_boundary(|_| false).accept_keys([Key::Tab]);
        let edit = popup.show(ui, edit, offered).text_edit.response.response.accessible_name("Folder");
        if !edit.lost_focus() {
            return None;
        }
        self.folder.take().filter(|_| ui.input(|i| i.key_pressed(Key::Enter)))
    }

    /// The name of a new folder, while one is typed.
    fn new_folder(&mut self, ui: &mut Ui) -> Option<PlaceAct> {
        let name = self.new_folder.as_mut()?;
        let [makes, leaves] = ui
            .horizontal(|ui| {
                ui.label("New folder");
                let edit = TextEdit::singleline(name).desired_width(240.0).align(Align2::LEFT_CENTER);
                let edit = ui.add(edit).accessible_name("Name of the new folder");
                let enters = edit.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
                if name.is_empty() && !edit.has_focus() && !edit.lost_focus() {
                    edit.request_focus();
                }
                [ui.button("Make").clicked() || enters, ui.button("Discard").clicked()]
            })
            .inner;
        let name = name.trim().to_owned();
        if !makes && !leaves {
            return None;
        }
        self.new_folder = None;
        Some(if leaves || name.is_empty() { PlaceAct::Leave } else { PlaceAct::Make(name) })
    }
}
