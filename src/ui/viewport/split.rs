//! Views side by side, with the same camera: two of the scene, each with its own colors and queries, or up to four of
//! several scenes. The active view is the one that was pressed last.

use egui::{Order, Pos2, Rect, Stroke, StrokeKind, Ui, pos2, vec2};

use crate::jobs::compare::MOST_SCENES;
use crate::ui::theme;

/// Gap between the views, points.
const GAP: f32 = 2.0;

/// Rectangles of the views, all of one size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Views {
    pub(super) first: Rect,
    rects: [Rect; MOST_SCENES],
    count: usize,
}

/// A view, and the frame in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ViewArea {
    /// Number of the view, from 0.
    pub(super) index: usize,
    /// Rectangle of the view.
    pub(super) rect: Rect,
    /// Rectangle of the frame in it.
    pub(super) shown: Rect,
    /// True if it is not the first view.
    pub(super) second: bool,
    /// True if it shows another scene.
    pub(super) is_other: bool,
}

impl Views {
    /// `count` views in all of `whole`, one to four: side by side along its longer side, or in two rows of two where
    /// that makes larger views.
    pub(super) fn of(whole: Rect, count: usize) -> Self {
        let count = count.clamp(1, MOST_SCENES);
        let cell = |columns: usize, rows: usize| {
            let side = |all: f32, n: usize| ((all - GAP * (n - 1) as f32) / n as f32).floor();
            vec2(side(whole.width(), columns), side(whole.height(), rows))
        };
        let row = if whole.width() >= whole.height() { (count, 1) } else { (1, count) };
        // A view counts by its shorter side.
        let (columns, rows) = match (count, cell(row.0, row.1).min_elem() < cell(2, 2).min_elem()) {
            (1 | 2, _) | (_, false) => row,
            (_, true) => (2, 2),
        };
        let size = if count == 1 { whole.size() } else { cell(columns, rows) };
        let at = |k: usize| {
            // The last column and row end where all ends.
            let place = |from: f32, to: f32, side: f32, k: usize, n: usize| {
                if k > 0 && k + 1 == n { to - side } else { from + k as f32 * (side + GAP) }
            };
            let (x, y) = (k % columns, (k / columns).min(rows - 1));
            let left = place(whole.left(), whole.right(), size.x, x, columns);
            Rect::from_min_size(pos2(left, place(whole.top(), whole.bottom(), size.y, y, rows)), size)
        };
        let rects = std::array::from_fn(at);
        Self { first: rects[0], rects, count }
    }

    pub(super) fn is_split(&self) -> bool {
        self.count > 1
    }

    /// All views, each with its number.
    pub(super) fn each(self) -> impl Iterator<Item = (usize, Rect)> {
        self.rects.into_iter().take(self.count).enumerate()
    }

    /// All views, with their frames: `shown` is that of the first. With `has_other`, all but the first show other
    /// scenes.
    pub(super) fn areas(self, shown: Rect, has_other: bool) -> impl Iterator<Item = ViewArea> {
        self.each().map(move |(index, rect)| self.area(index, rect, shown, has_other))
    }

    /// The view under the pointer; while a button is down, the one in which it was pressed.
    pub(super) fn area_under_pointer(self, ui: &Ui, shown: Rect, has_other: bool) -> ViewArea {
        let (index, rect) = self.at(ui.input(|i| i.pointer.press_origin().or(i.pointer.latest_pos())));
        self.area(index, rect, shown, has_other)
    }

    /// All views have the same size, so positions in the first carry over.
    fn area(self, index: usize, rect: Rect, shown: Rect, has_other: bool) -> ViewArea {
        let (second, shown) = (index > 0, shown.translate(rect.min - self.first.min));
        ViewArea { index, rect, shown, second, is_other: second && has_other }
    }

    /// The view to work in after a press, also one through a card over it: `true` for another than the first.
    pub(super) fn pressed(self, ui: &Ui) -> Option<bool> {
        if !self.is_split() {
            return Some(false);
        }
        let pressed = ui.input(|i| i.pointer.interact_pos().filter(|_| i.pointer.any_pressed()))?;
        let is_ours = ui.layer_id_at(pressed).is_none_or(|layer| layer.order <= Order::Middle);
        let (index, rect) = self.at(Some(pressed));
        (is_ours && rect.contains(pressed)).then_some(index > 0)
    }

    /// The view at a position, else the first.
    fn at(&self, pos: Option<Pos2>) -> (usize, Rect) {
        let here = pos.and_then(|pos| self.each().find(|(_, rect)| rect.contains(pos)));
        here.unwrap_or((0, self.first))
    }
}

/// Frames the active view.
pub(super) fn mark_worked_in(ui: &Ui, rect: Rect) {
    ui.painter().rect_stroke(rect, 0.0, Stroke::new(1.5, theme::accent()), StrokeKind::Inside);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_have_the_same_size_and_lie_along_the_longer_side() {
        let wide = Rect::from_min_size(pos2(10.0, 20.0), vec2(801.0, 400.0));
        assert_eq!(Views::of(wide, 1).each().collect::<Vec<_>>(), [(0, wide)]);
        for whole in [wide, Rect::from_min_size(pos2(10.0, 20.0), vec2(300.0, 700.0))] {
            let views = Views::of(whole, 2);
            let rects: Vec<Rect> = views.each().map(|v| v.1).collect();
            assert_eq!(rects[0].size(), rects[1].size());
            assert!(!rects[0].intersects(rects[1]) && rects.iter().all(|r| whole.contains_rect(*r)));
            assert_eq!(rects[0].left() == rects[1].left(), whole.height() > whole.width());
            assert_eq!(views.at(Some(rects[1].center())), (1, rects[1]));
            assert_eq!((views.at(None), views.at(Some(pos2(0.0, 0.0)))), ((0, rects[0]), (0, rects[0])));
        }
    }

    #[test]
    fn three_and_four_views_fill_a_grid_or_a_row_whichever_shows_more() {
        let sized = |w: f32, h: f32| Rect::from_min_size(pos2(5.0, 7.0), vec2(w, h));
        for (whole, count, columns) in [
            (sized(1000.0, 700.0), 4, 2),
            (sized(1000.0, 700.0), 3, 2),
            (sized(2400.0, 500.0), 4, 4),
            (sized(400.0, 1600.0), 3, 1),
        ] {
            let rects: Vec<Rect> = Views::of(whole, count).each().map(|v| v.1).collect();
            assert_eq!(rects.len(), count);
            assert!(rects.iter().all(|r| whole.contains_rect(*r) && r.size() == rects[0].size()), "{rects:?}");
            let apart = |i: usize, k: usize| i == k || !rects[i].intersects(rects[k]);
            assert!((0..count).all(|i| (0..count).all(|k| apart(i, k))), "{rects:?}");
            let mut lefts: Vec<i32> = rects.iter().map(|r| r.left() as i32).collect();
            lefts.dedup();
            lefts.sort_unstable();
            lefts.dedup();
            assert_eq!(lefts.len(), columns, "{rects:?}");
        }
    }
}
