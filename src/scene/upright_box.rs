//! Upright boxes around things: one edge along the up direction, with the smallest footprint.

use glam::DVec3;

/// Angle between the orientations that are tried, degrees.
const STEP_DEG: f64 = 3.0;

/// A box in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct UprightBox {
    pub(crate) corner: DVec3,
    /// The two level edges, longer first, and the one upwards.
    pub(crate) edges: [DVec3; 3],
}

/// Returns two level unit axes and the unit up direction: the same for every view.
pub(super) fn upright_axes(up: DVec3) -> Option<[DVec3; 3]> {
    let up = up.try_normalize().unwrap_or(DVec3::Z);
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter();
    let level = axes.min_by(|a, b| a.dot(up).abs().total_cmp(&b.dot(up).abs()))?;
    let first = (level - up * level.dot(up)).try_normalize()?;
    Some([first, up.cross(first), up])
}

impl UprightBox {
    /// Fits the box. It depends on the points and the up direction alone, never on a view. `None` without finite points.
    pub(crate) fn fit(points: &[DVec3], up: DVec3) -> Option<Self> {
        let [first, second, up] = upright_axes(up)?;
        let span = |axis: DVec3| {
            let ends = (f64::INFINITY, f64::NEG_INFINITY);
            points.iter().map(|p| p.dot(axis)).fold(ends, |(low, high), x| (low.min(x), high.max(x)))
        };
        let length = |axis: DVec3| {
            let (low, high) = span(axis);
            high - low
        };
        let mut best: Option<(f64, [DVec3; 2])> = None;
        for i in 0..(90.0 / STEP_DEG) as u32 {
            let (sin, cos) = (f64::from(i) * STEP_DEG).to_radians().sin_cos();
            let [a, b] = [first * cos + second * sin, second * cos - first * sin];
            let footprint = length(a) * length(b);
            // The margin keeps rounding errors from changing the choice.
            if best.is_none_or(|(least, _)| footprint < least * (1.0 - 1e-9)) {
                best = Some((footprint, if length(a) >= length(b) { [a, b] } else { [b, a] }));
            }
        }
        let [a, b] = best?.1;
        let axes = [a, b, up];
        let corner = axes.iter().map(|axis| *axis * span(*axis).0).sum::<DVec3>();
        let fitted = Self { corner, edges: axes.map(|axis| axis * length(axis)) };
        (corner.is_finite() && fitted.edges.iter().all(|edge| edge.is_finite())).then_some(fitted)
    }

    /// Lengths of its edges.
    pub(crate) fn size(&self) -> [f64; 3] {
        self.edges.map(DVec3::length)
    }

    /// The box with this corner and the ends of its three edges.
    pub(crate) fn of_ends([corner, a, b, c]: [DVec3; 4]) -> Self {
        Self { corner, edges: [a - corner, b - corner, c - corner] }
    }

    /// The same four points of it.
    pub(crate) fn ends(&self) -> [DVec3; 4] {
        let [a, b, c] = self.edges;
        [self.corner, self.corner + a, self.corner + b, self.corner + c]
    }

    /// True if it contains a point, with a margin of this share of its edges.
    pub(crate) fn contains(&self, point: DVec3, margin: f64) -> bool {
        let from_corner = point - self.corner;
        self.edges.iter().all(|edge| {
            let along = from_corner.dot(*edge);
            let length = edge.length_squared();
            along >= -margin * length && along <= (1.0 + margin) * length
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    #[test]
    fn a_turned_box_is_found_with_its_place_and_its_points() {
        let (size, up) = (DVec3::new(2.0, 1.0, 0.5), DVec3::Z);
        for degrees in [0.0_f64, 9.0, 33.0, 120.0] {
            let turn = DQuat::from_axis_angle(up, degrees.to_radians());
            let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * size;
            let points: Vec<DVec3> = (0..8).map(|i| turn * corner(i) + DVec3::new(5.0, -3.0, 2.0)).collect();
            let found = UprightBox::fit(&points, up).expect("a box");
            let [length, width, height] = found.size();
            assert!((length - 2.0).abs() < 1e-9 && (width - 1.0).abs() < 1e-9 && (height - 0.5).abs() < 1e-9);
            assert!(points.iter().all(|p| found.contains(*p, 1e-6)), "{degrees}");
            assert!(!found.contains(points[0] - DVec3::Z * 0.1, 1e-6), "control: below it");
            assert_eq!(UprightBox::of_ends(found.ends()).ends(), found.ends());
        }
    }

    #[test]
    fn nothing_and_no_numbers_have_no_box() {
        assert_eq!(UprightBox::fit(&[], DVec3::Z), None);
        assert_eq!(UprightBox::fit(&[DVec3::splat(f64::INFINITY)], DVec3::Z), None);
        // Control: one point is a box without size.
        assert_eq!(UprightBox::fit(&[DVec3::ONE], DVec3::Z).map(|b| b.size()), Some([0.0; 3]));
    }
}
