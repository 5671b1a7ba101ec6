//! Lines drawn in the view, and the pixels that they cover or enclose.

use egui::{Pos2, Rect, Ui, Vec2, vec2};

use super::{MINUS, PLUS};
use crate::scene::{Camera, Mask};
use crate::ui::select_shape::SelectShape;

/// Line drawn with a shape.
#[derive(Clone, Debug)]
pub(super) struct DrawnLine {
    pub(super) shape: SelectShape,
    /// Window positions along the line.
    pub(super) at: Vec<Pos2>,
    pub(super) takes_away: bool,
    pub(super) radius_pt: f32,
}

impl DrawnLine {
    /// The pixels that it covers or encloses in a view of the frame in `shown`.
    pub(super) fn pixels(&self, shown: Rect, camera: &Camera) -> Mask {
        let (w, h) = (camera.width_px as usize, camera.height_px as usize);
        let scale = w as f32 / shown.width().max(1.0);
        let at: Vec<Vec2> = self.at.iter().map(|p| (*p - shown.min) * scale).collect();
        let pixel = |i: usize| vec2((i % w) as f32 + 0.5, (i / w) as f32 + 0.5);
        match self.shape {
            SelectShape::Lasso => Mask::from_fn(w, h, |i| is_inside(&at, pixel(i))),
            SelectShape::Rectangle => {
                let [a, b] = self.corners(&at);
                Mask::from_fn(w, h, |i| {
                    let p = pixel(i);
                    p.x >= a.x.min(b.x) && p.x <= a.x.max(b.x) && p.y >= a.y.min(b.y) && p.y <= a.y.max(b.y)
                })
            }
            _ => {
                // One pixel at least, wherever its center is.
                let radius = (self.radius_pt * scale).max(std::f32::consts::FRAC_1_SQRT_2);
                let pairs: Vec<&[Vec2]> = if at.len() > 1 { at.windows(2).collect() } else { vec![&at] };
                let mut covered = vec![false; w * h];
                for pair in pairs.into_iter().filter(|pair| !pair.is_empty()) {
                    let [a, b] = [pair[0], pair[pair.len() - 1]];
                    // Pixels are tested in the box of each piece only: a line may have hundreds in a large view.
                    let span = |a: f32, b: f32, n: usize| {
                        let end = |v: f32| (v.max(0.0) as usize).min(n);
                        end(a.min(b) - radius - 1.0)..end(a.max(b) + radius + 2.0)
                    };
                    for y in span(a.y, b.y, h) {
                        for i in span(a.x, b.x, w).map(|x| y * w + x) {
                            covered[i] |= is_near(pair, pixel(i), radius);
                        }
                    }
                }
                Mask::from_fn(w, h, |i| covered[i])
            }
        }
    }

    fn corners<T: Copy + Default>(&self, at: &[T]) -> [T; 2] {
        [at.first().copied().unwrap_or_default(), at.last().copied().unwrap_or_default()]
    }

    /// Draws the line into the view in `shown`.
    pub(super) fn paint(&self, ui: &Ui, shown: Rect) {
        let painter = ui.painter_at(shown);
        let color = if self.takes_away { MINUS } else { PLUS };
        let thin = egui::Stroke::new(2.0, color);
        match self.shape {
            SelectShape::Lasso => {
                painter.line(self.at.clone(), thin);
                let [first, last] = self.corners(&self.at);
                painter.line_segment([last, first], egui::Stroke::new(1.0, color.gamma_multiply(0.6)));
            }
            SelectShape::Rectangle => {
                let [a, b] = self.corners(&self.at);
                let rect = Rect::from_two_pos(a, b);
                painter.rect(rect, 0.0, color.gamma_multiply(0.12), thin, egui::StrokeKind::Middle);
            }
            _ => {
                let ink = color.gamma_multiply(0.6);
                let line = egui::Stroke::new(2.0 * self.radius_pt, ink);
                self.at.windows(2).for_each(|pair| {
                    painter.line_segment([pair[0], pair[1]], line);
                });
                if let Some(pos) = self.at.first() {
                    painter.circle_filled(*pos, self.radius_pt, ink);
                }
            }
        }
    }
}

/// Returns whether `p` is within `radius` of the line between the ends of `pair`.
fn is_near(pair: &[Vec2], p: Vec2, radius: f32) -> bool {
    let (a, b) = (pair[0], pair[pair.len() - 1]);
    let along = if a == b { 0.0 } else { ((p - a).dot(b - a) / (b - a).length_sq()).clamp(0.0, 1.0) };
    (p - a - along * (b - a)).length() <= radius
}

/// Returns whether `p` is in a closed loop, by the even-odd rule.
fn is_inside(around: &[Vec2], p: Vec2) -> bool {
    let sides = around.iter().zip(around.iter().cycle().skip(1));
    let crosses =
        |(a, b): &(&Vec2, &Vec2)| (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
    sides.filter(crosses).count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use egui::pos2;
    use glam::DVec3;

    use super::*;

    fn area(shape: SelectShape, at: &[(f32, f32)]) -> Mask {
        let camera = Camera::look_at(DVec3::new(0.0, -4.0, 0.0), DVec3::ZERO, DVec3::Z, 0.8, 100, 50).expect("valid");
        // Two points of the window per pixel.
        let shown = Rect::from_min_size(pos2(10.0, 20.0), vec2(200.0, 100.0));
        let at = at.iter().map(|(x, y)| pos2(10.0 + 2.0 * x, 20.0 + 2.0 * y)).collect();
        DrawnLine { shape, at, takes_away: false, radius_pt: 4.0 }.pixels(shown, &camera)
    }

    #[test]
    fn each_shape_takes_the_pixels_it_covers_or_encloses() {
        let has = |mask: &Mask, x: usize, y: usize| mask.contains(y * 100 + x);
        let corners = [(60.0, 40.0), (20.0, 10.0)];
        let rectangle = area(SelectShape::Rectangle, &corners);
        assert_eq!(rectangle.area(), 40 * 30, "from any corner to the opposite one");
        assert!(has(&rectangle, 20, 10) && has(&rectangle, 59, 39) && !has(&rectangle, 60, 20));
        // An open loop is closed, and its inner side follows a dent.
        let lasso = area(SelectShape::Lasso, &[(10.0, 5.0), (50.0, 5.0), (50.0, 45.0), (30.0, 20.0), (10.0, 45.0)]);
        assert!(has(&lasso, 15, 30) && has(&lasso, 45, 30) && has(&lasso, 30, 10) && !has(&lasso, 30, 35));
        let brush = area(SelectShape::Brush, &corners);
        assert!(has(&brush, 40, 25) && has(&brush, 20, 10) && !has(&brush, 25, 35) && brush.area() < 400);
        // A point encloses nothing, but is brushed over.
        assert_eq!(
            area(SelectShape::Lasso, &corners[..1]).area() + area(SelectShape::Rectangle, &corners[..1]).area(),
            0
        );
        assert!(area(SelectShape::Brush, &corners[..1]).area() > 4);
        assert_eq!(area(SelectShape::Lasso, &[]).area() + area(SelectShape::Brush, &[]).area(), 0);
    }

    #[test]
    fn a_line_has_its_width_and_no_gaps() {
        let camera = Camera::look_at(DVec3::new(0.0, -4.0, 0.0), DVec3::ZERO, DVec3::Z, 0.8, 100, 50).expect("valid");
        let shown = Rect::from_min_size(pos2(10.0, 20.0), vec2(100.0, 50.0));
        let line = |width_px: f32, ends: [(f32, f32); 2]| {
            let at = ends.map(|(x, y)| pos2(10.0 + x, 20.0 + y)).to_vec();
            let line = DrawnLine { shape: SelectShape::Click, at, takes_away: false, radius_pt: 0.5 * width_px };
            line.pixels(shown, &camera)
        };
        let level = [(20.0, 25.5), (80.0, 25.5)];
        let rows = |mask: &Mask| (0..50).filter(|y| mask.contains(y * 100 + 50)).count();
        assert_eq!([1.0, 3.0, 9.0, 21.0].map(|width| rows(&line(width, level))), [1, 3, 9, 21]);
        // The thinnest one goes through every column, whatever its slope, and a click has a pixel wherever it is.
        let slanted = line(1.0, [(20.3, 10.9), (80.7, 33.2)]);
        assert!((21..80).all(|x| (0..50).any(|y| slanted.contains(y * 100 + x))));
        for at in [(30.0, 30.0), (30.5, 30.5), (30.99, 30.01)] {
            assert!((1..5).contains(&line(1.0, [at, at]).area()), "{at:?}");
        }
    }
}
