//! Sizes: the smallest box around points that stands upright, turned about the vertical.

use glam::{DVec2, DVec3};

use crate::scene::Bounds;

/// Volume of things without thickness, in cubic scene units.
const LEAST_VOLUME: f64 = 1e-12;

/// Size and place of a thing.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshShape {
    /// Box along the world's axes.
    pub(super) bounds: Bounds,
    /// Longer side of the smallest rectangle around its footprint.
    pub(super) length: f64,
    /// Shorter side of that rectangle.
    pub(super) width: f64,
    pub(super) height: f64,
}

impl MeshShape {
    /// Measures points; `None` if there are none.
    pub(super) fn of(points: &[DVec3]) -> Option<Self> {
        let bounds = Bounds::of(points.iter().copied())?;
        let [length, width] = rectangle(&hull(points));
        Some(Self { bounds, length, width, height: bounds.size().y })
    }

    pub(super) fn volume(&self) -> f64 {
        (self.length * self.width * self.height).max(LEAST_VOLUME)
    }

    /// Longest of all sides.
    pub(super) fn longest(&self) -> f64 {
        self.length.max(self.height)
    }

    pub(super) fn diagonal(&self) -> f64 {
        DVec3::new(self.length, self.width, self.height).length()
    }
}

/// Convex hull of the footprint, counterclockwise.
fn hull(points: &[DVec3]) -> Vec<DVec2> {
    let mut sorted: Vec<DVec2> = points.iter().map(|p| DVec2::new(p.x, p.z)).collect();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    let mut hull: Vec<DVec2> = Vec::new();
    for _side in 0..2 {
        let first = hull.len();
        for &p in &sorted {
            while hull.len() >= first + 2 {
                let [a, b] = [hull[hull.len() - 2], hull[hull.len() - 1]];
                if (b - a).perp_dot(p - a) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(p);
        }
        // The last point begins the other side.
        hull.pop();
        sorted.reverse();
    }
    hull
}

/// Sides of the smallest rectangle around a convex polygon, the longer one first.
fn rectangle(hull: &[DVec2]) -> [f64; 2] {
    let edges = (0..hull.len()).map(|i| (hull[(i + 1) % hull.len()] - hull[i]).normalize_or_zero());
    let sides = |along: DVec2| {
        let side = |axis: DVec2| {
            let (low, high) = hull.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
                (low.min(p.dot(axis)), high.max(p.dot(axis)))
            });
            high - low
        };
        let (a, b) = (side(along), side(along.perp()));
        [a.max(b), a.min(b)]
    };
    let all = edges.filter(|e| *e != DVec2::ZERO).map(sides);
    all.min_by(|a, b| (a[0] * a[1]).total_cmp(&(b[0] * b[1]))).unwrap_or([0.0; 2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_box_keeps_its_sides() {
        let turn = glam::DQuat::from_rotation_y(0.6);
        let corner = |i: u32| {
            let at = [0, 1, 2].map(|axis| f64::from(i >> axis & 1) - 0.5);
            turn * (DVec3::from_array(at) * DVec3::new(3.0, 0.5, 2.0)) + DVec3::new(9.0, 4.0, -7.0)
        };
        let corners: Vec<DVec3> = (0..8).map(corner).collect();
        let shape = MeshShape::of(&corners).unwrap();
        for (found, exact) in [(shape.length, 3.0), (shape.width, 2.0), (shape.height, 0.5), (shape.volume(), 3.0)] {
            assert!((found - exact).abs() < 1e-9, "{found} {exact}");
        }
        assert!((shape.longest() - 3.0).abs() < 1e-9 && (shape.diagonal() - 13.25_f64.sqrt()).abs() < 1e-9);
        // Control: the box along the axes is larger.
        let axes = shape.bounds.size();
        assert!(axes.x * axes.z > 1.3 * 6.0, "{axes}");
    }

    #[test]
    fn points_lines_and_nothing_have_shapes_too() {
        assert!(MeshShape::of(&[]).is_none());
        let point = MeshShape::of(&[DVec3::ONE, DVec3::ONE]).unwrap();
        assert_eq!((point.length, point.width, point.height), (0.0, 0.0, 0.0));
        let line = MeshShape::of(&[DVec3::ZERO, DVec3::new(3.0, 1.0, 4.0)]).unwrap();
        assert!((line.length - 5.0).abs() < 1e-12 && line.width.abs() < 1e-12 && line.volume() > 0.0);
    }
}
