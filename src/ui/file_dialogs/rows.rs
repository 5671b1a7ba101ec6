//! The list of a folder's content: names, sizes and dates in columns.

use egui::text::LayoutJob;
use egui::{
    Align, Color32, CornerRadius, Frame, Margin, Rect, Role, ScrollArea, Sense, TextStyle, Ui, WidgetInfo, pos2, vec2,
};

use super::listing::FolderEntry;
use crate::math::format;
use crate::ui::short_names::fitted;
use crate::ui::theme;

/// Height of a row and widths of the columns at the right, points.
const ROW_PT: f32 = 24.0;
const SIZE_PT: f32 = 74.0;
const DATE_PT: f32 = 92.0;

/// Act of the user on the list.
pub(super) enum RowAct {
    Select(usize),
    Open(usize),
}

/// Content of the list and what is marked in it.
pub(super) struct RowList<'a> {
    pub(super) entries: &'a [&'a FolderEntry],
    pub(super) selected: Option<usize>,
    /// True if the list scrolls to the selected row.
    pub(super) follows: bool,
    /// True if files cannot be chosen.
    pub(super) folders_only: bool,
    /// Text in place of an empty list.
    pub(super) empty: &'a str,
    pub(super) height: f32,
}

impl RowList<'_> {
    pub(super) fn show(&self, ui: &mut Ui) -> Option<RowAct> {
        header(ui);
        let frame = Frame::new().fill(theme::canvas()).stroke(ui.visuals().window_stroke).corner_radius(6);
        frame
            .inner_margin(Margin::same(4))
            .show(ui, |ui| {
                ui.spacing_mut().item_spacing.y = 0.0;
                let scroll = ScrollArea::vertical().auto_shrink([false, false]);
                let scroll = scroll.max_height(self.height).min_scrolled_height(self.height);
                if self.entries.is_empty() {
                    scroll.show(ui, |ui| ui.centered_and_justified(|ui| ui.weak(self.empty)));
                    return None;
                }
                scroll
                    .show_rows(ui, ROW_PT, self.entries.len(), |ui, range| {
                        if let Some(at) = self.selected.filter(|_| self.follows) {
                            let top = ui.max_rect().top() + (at as f32 - range.start as f32) * ROW_PT;
                            let row = Rect::from_min_size(pos2(ui.max_rect().left(), top), vec2(1.0, ROW_PT));
                            ui.scroll_to_rect(row, None);
                        }
                        range.filter_map(|i| self.row(ui, i)).last()
                    })
                    .inner
            })
            .inner
    }

    fn row(&self, ui: &mut Ui, i: usize) -> Option<RowAct> {
        let entry = self.entries.get(i)?;
        // The scroll bar floats over the right edge.
        let size = vec2(ui.available_width() - 10.0, ROW_PT);
        let can_choose = entry.is_folder || !self.folders_only;
        // The name field has the keys: rows are not stops of the Tab key.
        let (rect, row) = ui.allocate_exact_size(size, if can_choose { Sense::CLICK } else { Sense::hover() });
        let is_selected = self.selected == Some(i);
        row.widget_info(|| WidgetInfo::selected(Role::ListBoxOption, can_choose, is_selected, &entry.name));
        let visuals = ui.visuals();
        if is_selected {
            ui.painter().rect_filled(rect, 4, visuals.selection.bg_fill);
        } else if row.hovered() && can_choose {
            ui.painter().rect_filled(rect, 4, visuals.widgets.hovered.bg_fill);
        }
        let color = if can_choose { theme::text() } else { theme::weak() };
        let left = rect.left() + 6.0;
        if entry.is_folder {
            folder_mark(ui, pos2(left, rect.center().y));
        }
        let width = size.x - SIZE_PT - DATE_PT - 30.0;
        let name = fitted(ui, &entry.name, &TextStyle::Body.resolve(ui.style()), width);
        cell(ui, &name, color, Rect::from_min_size(pos2(left + 22.0, rect.top()), vec2(width, ROW_PT)), Align::Min);
        let [size_at, date_at] = [DATE_PT + SIZE_PT, DATE_PT].map(|from| pos2(rect.right() - from, rect.top()));
        if !entry.is_folder {
            let at = Rect::from_min_size(size_at, vec2(SIZE_PT, ROW_PT));
            cell(ui, &format::bytes(entry.bytes), theme::weak(), at, Align::Max);
        }
        if let Some(changed) = entry.changed {
            let at = Rect::from_min_size(date_at, vec2(DATE_PT - 6.0, ROW_PT));
            cell(ui, &format::date(changed), theme::weak(), at, Align::Max);
        }
        let row = if name == entry.name { row } else { row.on_hover_text(&entry.name) };
        match (row.double_clicked(), row.clicked()) {
            (true, _) => Some(RowAct::Open(i)),
            (_, true) => Some(RowAct::Select(i)),
            _ => None,
        }
    }
}

fn header(ui: &mut Ui) {
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 18.0), Sense::hover());
    let right = rect.right() - 14.0;
    let at = |left: f32, width: f32| Rect::from_min_size(pos2(left, rect.top()), vec2(width, rect.height()));
    cell(ui, "Name", theme::weak(), at(rect.left() + 32.0, 200.0), Align::Min);
    cell(ui, "Size", theme::weak(), at(right - DATE_PT - SIZE_PT, SIZE_PT), Align::Max);
    cell(ui, "Modified", theme::weak(), at(right - DATE_PT, DATE_PT - 6.0), Align::Max);
}

/// Draws a text on one line of a rectangle.
fn cell(ui: &Ui, text: &str, color: Color32, rect: Rect, align: Align) {
    let mut job = LayoutJob::simple_singleline(text.to_owned(), TextStyle::Body.resolve(ui.style()), color);
    job.wrap.max_width = rect.width();
    job.wrap.max_rows = 1;
    job.wrap.break_anywhere = true;
    let galley = ui.painter().layout_job(job);
    let left = if align == Align::Max { rect.right() - galley.size().x } else { rect.left() };
    ui.painter().galley(pos2(left, rect.center().y - 0.5 * galley.size().y), galley, color);
}

/// Draws a small folder, its left edge at `at`.
fn folder_mark(ui: &Ui, at: egui::Pos2) {
    let color = theme::accent().gamma_multiply(0.8);
    let tab = Rect::from_min_size(at + vec2(0.0, -6.0), vec2(6.0, 4.0));
    ui.painter().rect_filled(tab, CornerRadius::same(1), color);
    let body = Rect::from_min_size(at + vec2(0.0, -4.0), vec2(14.0, 10.0));
    ui.painter().rect_filled(body, CornerRadius::same(2), color);
}
