//! Two views of the scene side by side, with the same camera, each with its own colors and queries. The active view is
//! the one that was pressed last.

use egui::{Order, Pos2, Rect, Stroke, StrokeKind, Ui, vec2};

use crate::ui::theme;

/// Gap between the views, points.
const GAP: f32 = 2.0;

/// Rectangles of the views.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Views {
    pub(super) first: Rect,
    second: Option<Rect>,
}

/// A view, and the frame in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ViewArea {
    /// Rectangle of the view.
    pub(super) rect: Rect,
    /// Rectangle of the frame in it.
    pub(super) shown: Rect,
    /// True for the second of two views.
    pub(super) second: bool,
    /// True if it shows another scene.
    pub(super) is_other: bool,
}

impl Views {
    /// One view in all of `whole`, or two of the same size along its longer side.
    pub(super) fn of(whole: Rect, split: bool) -> Self {
        let half = match whole.width() >= whole.height() {
            true => vec2(((whole.width() - GAP) / 2.0).floor(), whole.height()),
            false => vec2(whole.width(), ((whole.height() - GAP) / 2.0).floor()),
        };
        let (first, second) = (Rect::from_min_size(whole.min, half), Rect::from_min_size(whole.max - half, half));
        match split {
            true => Self { first, second: Some(second) },
            false => Self { first: whole, second: None },
        }
    }

    pub(super) fn is_split(&self) -> bool {
        self.second.is_some()
    }

    /// All views, each with whether it is the second.
    pub(super) fn each(self) -> impl Iterator<Item = (bool, Rect)> {
        std::iter::once((false, self.first)).chain(self.second.map(|rect| (true, rect)))
    }

    /// All views, with their frames: `shown` is that of the first. With `has_other`, the second shows another scene.
    pub(super) fn areas(self, shown: Rect, has_other: bool) -> impl Iterator<Item = ViewArea> {
        self.each().map(move |(second, rect)| self.area(second, rect, shown, has_other))
    }

    /// The view under the pointer; while a button is down, the one in which it was pressed.
    pub(super) fn area_under_pointer(self, ui: &Ui, shown: Rect, has_other: bool) -> ViewArea {
        let (second, rect) = self.at(ui.input(|i| i.pointer.press_origin().or(i.pointer.latest_pos())));
        self.area(second, rect, shown, has_other)
    }

    /// All views have the same size, so positions in the first carry over.
    fn area(self, second: bool, rect: Rect, shown: Rect, has_other: bool) -> ViewArea {
        ViewArea { rect, shown: shown.translate(rect.min - self.first.min), second, is_other: second && has_other }
    }

    /// The view to work in after a press, also one through a card over it: `true` for the second.
    pub(super) fn pressed(self, ui: &Ui) -> Option<bool> {
        if !self.is_split() {
            return Some(false);
        }
        let pressed = ui.input(|i| i.pointer.interact_pos().filter(|_| i.pointer.any_pressed()))?;
        let is_ours = ui.layer_id_at(pressed).is_none_or(|layer| layer.order <= Order::Middle);
        let (second, rect) = self.at(Some(pressed));
        (is_ours && rect.contains(pressed)).then_some(second)
    }

    /// The view at a position, else the first.
    fn at(&self, pos: Option<Pos2>) -> (bool, Rect) {
        let here = pos.and_then(|pos| self.each().find(|(_, rect)| rect.contains(pos)));
        here.unwrap_or((false, self.first))
    }
}

/// Frames the active view.
pub(super) fn mark_worked_in(ui: &Ui, rect: Rect) {
    ui.painter().rect_stroke(rect, 0.0, Stroke::new(1.5, theme::accent()), StrokeKind::Inside);
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    #[test]
    fn views_have_the_same_size_and_lie_along_the_longer_side() {
        let wide = Rect::from_min_size(pos2(10.0, 20.0), vec2(801.0, 400.0));
        assert_eq!(Views::of(wide, false).each().collect::<Vec<_>>(), [(false, wide)]);
        for whole in [wide, Rect::from_min_size(pos2(10.0, 20.0), vec2(300.0, 700.0))] {
            let views = Views::of(whole, true);
            let rects: Vec<Rect> = views.each().map(|v| v.1).collect();
            assert_eq!(rects[0].size(), rects[1].size());
            assert!(!rects[0].intersects(rects[1]) && rects.iter().all(|r| whole.contains_rect(*r)));
            assert_eq!(rects[0].left() == rects[1].left(), whole.height() > whole.width());
            assert_eq!(views.at(Some(rects[1].center())), (true, rects[1]));
            assert_eq!((views.at(None), views.at(Some(pos2(0.0, 0.0)))), ((false, rects[0]), (false, rects[0])));
        }
    }
}
