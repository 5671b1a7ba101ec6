//! A histogram with a range that can be dragged.

use egui::{Pos2, Rect, Sense, Stroke, Ui, pos2, vec2};

use super::super::theme;
use crate::math::format;

const BINS: usize = 60;
const HEIGHT: f32 = 70.0;

/// Counts of values in equal bins.
#[derive(Clone, Debug, Default)]
pub(super) struct Histogram {
    counts: Vec<usize>,
    /// Minimum and maximum.
    ends: [f32; 2],
    /// True if the axis is logarithmic.
    logarithmic: bool,
}

impl Histogram {
    pub(super) fn new(values: &[f32], logarithmic: bool) -> Self {
        let usable = |v: &&f32| v.is_finite() && (!logarithmic || **v > 0.0);
        let (least, most) =
            values.iter().filter(usable).fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        if least > most {
            return Self::default();
        }
        let mut new = Self { counts: vec![0; BINS], ends: [least, most], logarithmic };
        for v in values.iter().filter(usable) {
            let bin = (new.along(*v) * BINS as f32) as usize;
            new.counts[bin.min(BINS - 1)] += 1;
        }
        new
    }

    pub(super) fn ends(&self) -> [f32; 2] {
        self.ends
    }

    /// Position of a value on the axis, 0 to 1.
    fn along(&self, v: f32) -> f32 {
        let [a, b] = self.ends.map(|e| self.scaled(e));
        if b > a { ((self.scaled(v) - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The value at a position, 0 to 1.
    fn value(&self, along: f32) -> f32 {
        let [a, b] = self.ends.map(|e| self.scaled(e));
        match along {
            // Exactly the end, so that values there are in the range.
            ..=0.0 => self.ends[0],
            1.0.. => self.ends[1],
            _ if self.logarithmic => (a + along * (b - a)).exp(),
            _ => a + along * (b - a),
        }
    }

    fn scaled(&self, v: f32) -> f32 {
        if self.logarithmic { v.max(f32::MIN_POSITIVE).ln() } else { v }
    }

    /// Draws the histogram; dragging over it sets the range.
    pub(super) fn show(&self, ui: &mut Ui, range: &mut Option<[f32; 2]>) {
        let (whole, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::click_and_drag());
        let response = response.on_hover_text("Drag to choose a range; click to choose none. Heights are logarithmic.");
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Histogram"));
        let at = |pos: Pos2| ((pos.x - whole.left()) / whole.width().max(1.0)).clamp(0.0, 1.0);
        let origin = ui.input(|i| i.pointer.press_origin());
        if let (true, Some(from), Some(to)) = (response.dragged(), origin, response.interact_pointer_pos()) {
            let (a, b) = (at(from), at(to));
            *range = Some([self.value(a.min(b)), self.value(a.max(b))]);
        } else if response.clicked() {
            *range = None;
        }
        let painter = ui.painter_at(whole);
        painter.rect_filled(whole, 3.0, theme::canvas());
        let highest = self.counts.iter().max().map_or(1.0, |n| (*n as f32).ln_1p()).max(1e-3);
        let width = whole.width() / BINS as f32;
        let inside = |bin: usize| {
            let middle = self.value((bin as f32 + 0.5) / BINS as f32);
            range.is_some_and(|[from, to]| (from..=to).contains(&middle))
        };
        for (bin, count) in self.counts.iter().enumerate().filter(|(_, n)| **n > 0) {
            let height = (*count as f32).ln_1p() / highest * (HEIGHT - 4.0);
            let left = whole.left() + bin as f32 * width;
            let bar = Rect::from_min_max(pos2(left, whole.bottom() - height), pos2(left + width - 1.0, whole.bottom()));
            painter.rect_filled(bar, 0.0, if inside(bin) { theme::warning() } else { theme::accent() });
        }
        if let Some(range) = range {
            for end in *range {
                let x = whole.left() + self.along(end) * whole.width();
                painter.vline(x, whole.y_range(), Stroke::new(1.0, theme::text()));
            }
        }
        ui.horizontal(|ui| {
            let text = |v: f32| egui::RichText::new(format::short(f64::from(v))).small().color(theme::weak());
            ui.label(text(self.ends[0]));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| ui.label(text(self.ends[1])));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_counted_where_they_lie() {
        let linear = Histogram::new(&[0.0, 0.5, 1.0, 1.0, f32::NAN], false);
        assert_eq!((linear.ends(), linear.counts.iter().sum::<usize>()), ([0.0, 1.0], 4));
        assert_eq!((linear.counts[0], linear.counts[30], linear.counts[BINS - 1]), (1, 1, 2));
        let factors = Histogram::new(&[0.0, 0.01, 1.0, 100.0], true);
        assert_eq!((factors.ends(), factors.counts[30]), ([0.01, 100.0], 1), "1 is in the middle");
        assert!((factors.value(0.5) - 1.0).abs() < 1e-5);
        assert_eq!([factors.value(0.0), factors.value(1.0)], [0.01, 100.0], "the ends belong to it");
        let one = Histogram::new(&[3.0, 3.0], false);
        assert_eq!((one.ends(), one.counts[0]), ([3.0, 3.0], 2));
        assert_eq!(Histogram::new(&[f32::INFINITY], true).ends(), [0.0, 0.0]);
    }
}
