//! The list of formats beside a name.

use egui::{ComboBox, RichText, Ui};

use super::request::FileRequest;
use crate::ui::theme;

/// Width of the list, points.
pub(super) const WIDTH_PT: f32 = 214.0;

/// Draws the list of a request's formats, for opening with one more for all files.
pub(super) fn show(ui: &mut Ui, request: &FileRequest, format: &mut usize) {
    let formats = &request.formats;
    let name = |i: usize| formats.get(i).map_or("All files", |format| format.name);
    match formats.len() + usize::from(!request.saves()) {
        _ if formats.is_empty() => {}
        1 => {
            ui.label(RichText::new(name(0)).color(theme::weak()));
        }
        all => {
            let list = ComboBox::from_id_salt("file format").selected_text(name(*format)).width(WIDTH_PT).truncate();
            let list = list.height(320.0).show_ui(ui, |ui| {
                (0..all).for_each(|i| {
                    ui.selectable_value(format, i, name(i));
                });
            });
            list.response.accessible_name("Format");
        }
    }
}
