//! Width of lines, and radius of brush and ball: a circle at the pointer.

use std::ops::RangeInclusive;

use egui::{Color32, Rect, Stroke as Line, Ui};

use crate::ui::select_shape::SelectShape;

/// Widths of a line, px of the view in the window.
pub(super) const WIDTHS_PX: RangeInclusive<f32> = 1.0..=64.0;
/// Radii of brush and ball, points.
pub(super) const RADII_PT: RangeInclusive<f32> = 2.0..=120.0;
/// Factor by which a key makes it wider.
const STEP: f32 = 1.25;

/// Size of what a pointer draws with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SelectTip {
    /// Width of lines, px of the view in the window.
    pub(crate) line_width_px: f32,
    /// Radius of brush and ball, points.
    pub(super) brush_pt: f32,
}

impl Default for SelectTip {
    fn default() -> Self {
        Self { line_width_px: 10.0, brush_pt: 18.0 }
    }
}

impl SelectTip {
    /// Radius with a shape, points.
    pub(super) fn radius_pt(&self, shape: SelectShape) -> f32 {
        if shape == SelectShape::Click { 0.5 * self.line_width_px } else { self.brush_pt }
    }

    /// Makes it one step wider or narrower, with shapes that have a size.
    pub(crate) fn step(&mut self, shape: SelectShape, is_wider: bool) {
        let (size, range) = match shape {
            SelectShape::Click => (&mut self.line_width_px, WIDTHS_PX),
            SelectShape::Brush | SelectShape::Sphere => (&mut self.brush_pt, RADII_PT),
            _ => return,
        };
        let next = if is_wider { (*size * STEP).max(*size + 1.0) } else { (*size / STEP).min(*size - 1.0) };
        *size = next.round().clamp(*range.start(), *range.end());
    }

    /// Draws the circle at the pointer, with shapes that have one.
    pub(super) fn paint(&self, ui: &Ui, shown: Rect, shape: SelectShape, color: Color32) {
        let has_tip = matches!(shape, SelectShape::Click | SelectShape::Brush | SelectShape::Sphere);
        if let Some(pos) = ui.input(|i| i.pointer.hover_pos()).filter(|pos| has_tip && shown.contains(*pos)) {
            ui.painter_at(shown).circle_stroke(pos, self.radius_pt(shape), Line::new(1.5, color));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_reach_every_size_up_to_both_ends_and_change_that_of_the_shape_alone() {
        let first = SelectTip::default();
        let mut tip = first;
        assert_eq!(tip.radius_pt(SelectShape::Click), 5.0, "half of the width");
        let mut widths = vec![tip.line_width_px];
        for _ in 0..20 {
            tip.step(SelectShape::Click, true);
            widths.push(tip.line_width_px);
        }
        assert!(widths.windows(2).all(|w| w[1] > w[0] || w[1] == 64.0) && tip.line_width_px == 64.0, "{widths:?}");
        (0..40).for_each(|_| tip.step(SelectShape::Click, false));
        assert_eq!((tip.line_width_px, tip.brush_pt), (1.0, first.brush_pt), "the brush has a radius of its own");
        tip.step(SelectShape::Click, true);
        assert_eq!(tip.line_width_px, 2.0, "a whole pixel at least");
        tip.step(SelectShape::Brush, true);
        assert!(tip.brush_pt > first.brush_pt && tip.line_width_px == 2.0);
        let before = tip;
        tip.step(SelectShape::Rectangle, true);
        assert_eq!(tip, before, "a rectangle has no tip");
    }
}
