//! Spatial relations between things, judged from their bounding boxes: left of, on, under, near. Pure geometry, in
//! the frame of the current view and of the up direction of the scene.
//!
//! The size of a thing is that of its own upright box, whatever the view.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::scene::Bounds;

/// Relation of one thing to another, the anchor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Relation {
    /// A part of it, by the hierarchy of identities, not by boxes.
    #[default]
    PartOf,
    /// To its left in the current view.
    LeftOf,
    /// To its right in the current view.
    RightOf,
    /// Between it and the camera.
    InFrontOf,
    /// Beyond it.
    Behind,
    /// Standing or lying on it.
    On,
    /// Higher than it, over its footprint.
    Above,
    /// Lower than it, within its footprint.
    Under,
    /// With its center inside its box, and smaller.
    In,
    /// Close to it.
    Near,
}

impl Relation {
    /// All relations.
    pub const ALL: [Self; 10] = [
        Self::PartOf,
        Self::LeftOf,
        Self::RightOf,
        Self::InFrontOf,
        Self::Behind,
        Self::On,
        Self::Above,
        Self::Under,
        Self::In,
        Self::Near,
    ];

    /// Words that stand between the two things: "a mug ... the laptop".
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::PartOf => "part of",
            Self::LeftOf => "left of",
            Self::RightOf => "right of",
            Self::InFrontOf => "in front of",
            Self::Behind => "behind",
            Self::On => "on",
            Self::Above => "above",
            Self::Under => "under",
            Self::In => "in",
            Self::Near => "near",
        }
    }
}

/// Camera position, view direction and up direction of the scene, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Camera position.
    pub eye: DVec3,
    /// View direction; of any length.
    pub forward: DVec3,
    /// Up direction of the scene; of any length.
    pub up: DVec3,
}

/// Upright unit axes of a view: right, up and ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UprightAxes {
    /// Right.
    pub right: DVec3,
    /// Up direction of the scene.
    pub up: DVec3,
    /// Ahead, parallel to the ground.
    pub ahead: DVec3,
}

impl Viewpoint {
    /// Upright axes of the view. For a view straight up or down, or without a direction, the level axes are arbitrary.
    pub fn frame(&self) -> UprightAxes {
        let up = self.up.try_normalize().unwrap_or(DVec3::Z);
        let level = self.forward.try_normalize().map(|f| f - up * f.dot(up)).filter(|l| l.length() > 1e-3);
        let ahead = level.and_then(DVec3::try_normalize).unwrap_or_else(|| up.any_orthonormal_vector());
        UprightAxes { right: ahead.cross(up), up, ahead }
    }
}

/// Interval of a box along a unit axis.
pub(crate) fn span(bounds: &Bounds, axis: DVec3) -> (f64, f64) {
    let (middle, reach) = (bounds.center().dot(axis), (bounds.size() * 0.5).dot(axis.abs()));
    (middle - reach, middle + reach)
}

/// Edges of a thing's own upright box, in scene units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Longer horizontal edge.
    pub(crate) length: f64,
    /// Shorter horizontal edge.
    pub(crate) width: f64,
    /// Edge along the up direction of the scene.
    pub(crate) height: f64,
}

impl Extent {
    /// Fits the upright box with the smallest footprint to the points of a thing, without outliers. It depends on the
    /// points and the up direction alone, never on a view.
    pub(crate) fn new(points: &[DVec3], up: DVec3) -> Option<Self> {
        const STEP_DEG: f64 = 3.0;
        let up = up.try_normalize().unwrap_or(DVec3::Z);
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter();
        let level = axes.min_by(|a, b| a.dot(up).abs().total_cmp(&b.dot(up).abs()))?;
        let first = (level - up * level.dot(up)).try_normalize()?;
        let second = up.cross(first);
        let mut best: Option<DVec3> = None;
        for i in 0..(90.0 / STEP_DEG) as u32 {
            let (sin, cos) = (f64::from(i) * STEP_DEG).to_radians().sin_cos();
            let (a, b) = (first * cos + second * sin, second * cos - first * sin);
            let size = Bounds::robust(points.iter().map(|p| DVec3::new(p.dot(a), p.dot(b), p.dot(up))))?.size();
            // The margin keeps rounding errors from changing the choice.
            if best.is_none_or(|k| size.x * size.y < k.x * k.y * (1.0 - 1e-9)) {
                best = Some(size);
            }
        }
        best.map(|s| Self { length: s.x.max(s.y), width: s.x.min(s.y), height: s.z })
    }

    /// Fits an upright box to the corners of an axis-aligned box.
    pub(crate) fn of_box(bounds: &Bounds, up: DVec3) -> Option<Self> {
        let corner = |i: u32| {
            let pick = |bit: u32, low: f64, high: f64| if i & bit == 0 { low } else { high };
            let (low, high) = (bounds.min, bounds.max);
            DVec3::new(pick(1, low.x, high.x), pick(2, low.y, high.y), pick(4, low.z, high.z))
        };
        Self::new(&std::array::from_fn::<_, 8, _>(|i| corner(i as u32)), up)
    }
}

/// Distance between two boxes; 0 if they touch or overlap.
pub(crate) fn gap(a: &Bounds, b: &Bounds) -> f64 {
    (a.min - b.max).max(b.min - a.max).max(DVec3::ZERO).length()
}

/// Distance between `thing` and `anchor` if `relation` holds, else `None`; a smaller distance is a better fit.
/// [`Relation::PartOf`] never holds here.
pub(crate) fn fit(relation: Relation, thing: &Bounds, anchor: &Bounds, frame: &UprightAxes) -> Option<f64> {
    let distance = gap(thing, anchor);
    let holds = match relation {
        Relation::PartOf => false,
        Relation::LeftOf => beside(thing, anchor, -frame.right, [frame.ahead, frame.up]),
        Relation::RightOf => beside(thing, anchor, frame.right, [frame.ahead, frame.up]),
        Relation::InFrontOf => beside(thing, anchor, -frame.ahead, [frame.right, frame.up]),
        Relation::Behind => beside(thing, anchor, frame.ahead, [frame.right, frame.up]),
        Relation::On => is_on(thing, anchor, frame),
        Relation::Above => {
            let (t, a) = (span(thing, frame.up), span(anchor, frame.up));
            (is_over(thing, anchor, frame, 0.5) || is_over(anchor, thing, frame, 0.0))
                && t.0 >= a.1 - 0.25 * (t.1 - t.0)
        }
        Relation::Under => {
            let (t, a) = (span(thing, frame.up), span(anchor, frame.up));
            let lower = t.1 <= a.1 - 0.2 * (a.1 - a.0) && t.0 + t.1 < a.0 + a.1 + 0.2 * (a.1 - a.0);
            let in_place = is_over(thing, anchor, frame, 0.0) || is_over(anchor, thing, frame, 0.0);
            in_place && (lower || t.1 <= a.0 + 0.25 * (t.1 - t.0))
        }
        Relation::In => {
            let middle = thing.center();
            let inside = middle.cmpge(anchor.min).all() && middle.cmple(anchor.max).all();
            inside && thing.radius() < anchor.radius()
        }
        Relation::Near => distance <= 1.5 * anchor.radius().max(thing.radius()) && thing != anchor,
    };
    holds.then_some(distance)
}

/// Returns whether a thing lies to one side: past most of the anchor, and not much farther off along another axis.
fn beside(thing: &Bounds, anchor: &Bounds, side: DVec3, across: [DVec3; 2]) -> bool {
    let (t, a) = (span(thing, side), span(anchor, side));
    let middle = 0.5 * (t.0 + t.1);
    let offset = middle - 0.5 * (a.0 + a.1);
    let apart = |axis: DVec3| {
        let (t, a) = (span(thing, axis), span(anchor, axis));
        (t.0 - a.1).max(a.0 - t.1).max(0.0)
    };
    // A thing that reaches back past the anchor's middle, such as the table under it, is not beside it.
    let past = middle > a.1 - 0.25 * (a.1 - a.0) && t.0 >= 0.5 * (a.0 + a.1);
    past && offset > 0.0 && across.iter().all(|axis| apart(*axis) <= 1.5 * offset)
}

/// Returns whether the thing's center is over the anchor's footprint, widened on each side by a share of its length.
fn is_over(thing: &Bounds, anchor: &Bounds, frame: &UprightAxes, widened: f64) -> bool {
    [frame.right, frame.ahead].iter().all(|axis| {
        let (t, a) = (span(thing, *axis), span(anchor, *axis));
        let (middle, more) = (0.5 * (t.0 + t.1), widened * (a.1 - a.0));
        middle >= a.0 - more && middle <= a.1 + more
    })
}

/// Returns whether the thing rests on the anchor: over it, with its bottom near the anchor's top.
fn is_on(thing: &Bounds, anchor: &Bounds, frame: &UprightAxes) -> bool {
    let (t, a) = (span(thing, frame.up), span(anchor, frame.up));
    let (height, under) = (t.1 - t.0, a.1 - a.0);
    let gap = t.0 - a.1;
    // A table is not on the ball under it: both stand on the floor.
    let higher = t.0 - a.0 > 0.25 * under;
    higher
        && is_over(thing, anchor, frame, 0.0)
        && gap >= -0.35 * height - 0.05 * under
        && gap <= 0.3 * height + 0.02 * under
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(center: [f64; 3], size: [f64; 3]) -> Bounds {
        let (c, h) = (DVec3::from(center), DVec3::from(size) * 0.5);
        Bounds { min: c - h, max: c + h }
    }

    fn holds(relation: Relation, thing: &Bounds, anchor: &Bounds, view: &Viewpoint) -> bool {
        fit(relation, thing, anchor, &view.frame()).is_some()
    }

    #[test]
    fn sides_are_those_of_the_view() {
        let view = Viewpoint { eye: DVec3::new(0.0, -3.0, 1.0), forward: DVec3::new(0.0, 1.0, -0.3), up: DVec3::Z };
        assert!((view.frame().right - DVec3::X).length() < 1e-9);
        let (laptop, mug) = (cube([0.0; 3], [0.4, 0.3, 0.2]), cube([-0.4, 0.0, 0.0], [0.1; 3]));
        assert!(holds(Relation::LeftOf, &mug, &laptop, &view) && !holds(Relation::RightOf, &mug, &laptop, &view));
        assert!(holds(Relation::RightOf, &laptop, &mug, &view) && !holds(Relation::InFrontOf, &mug, &laptop, &view));
        let turned = Viewpoint { forward: -view.forward, ..view };
        assert!(holds(Relation::RightOf, &mug, &laptop, &turned), "seen from the other side");
        let from_left = Viewpoint { forward: DVec3::X, ..view };
        assert!(holds(Relation::InFrontOf, &mug, &laptop, &from_left));
        assert!(holds(Relation::Behind, &laptop, &mug, &from_left));
        let far = cube([-0.4, 9.0, 0.0], [0.1; 3]);
        assert!(!holds(Relation::LeftOf, &far, &laptop, &view), "more behind than left");
        assert!(fit(Relation::PartOf, &mug, &laptop, &view.frame()).is_none());
    }

    #[test]
    fn above_and_below_follow_the_scenes_up() {
        let view = Viewpoint { eye: DVec3::ZERO, forward: DVec3::Z, up: DVec3::NEG_Y };
        // y points down: the table's top is at y = 0, its feet at y = 0.8.
        let table = cube([0.0, 0.4, 2.0], [1.6, 0.8, 0.8]);
        let mug = cube([0.3, -0.05, 2.1], [0.1, 0.1, 0.1]);
        let lamp = cube([0.3, -1.0, 2.1], [0.2, 0.2, 0.2]);
        let ball = cube([0.0, 0.7, 2.0], [0.2, 0.2, 0.2]);
        let chair = cube([2.0, 0.3, 2.0], [0.5, 1.0, 0.5]);
        assert!(holds(Relation::On, &mug, &table, &view) && !holds(Relation::On, &lamp, &table, &view));
        assert!(!holds(Relation::On, &ball, &table, &view) && !holds(Relation::On, &chair, &table, &view));
        assert!(holds(Relation::Above, &lamp, &table, &view) && holds(Relation::Above, &lamp, &mug, &view));
        assert!(holds(Relation::Under, &ball, &table, &view) && holds(Relation::Under, &table, &mug, &view));
        assert!(!holds(Relation::Under, &mug, &table, &view) && holds(Relation::Under, &mug, &lamp, &view));
        assert!(holds(Relation::Near, &mug, &lamp, &view) || gap(&mug, &lamp) > 0.0);
        assert!(!holds(Relation::Near, &mug, &chair, &view));
        let spoon = cube([0.3, -0.05, 2.1], [0.02, 0.02, 0.02]);
        assert!(holds(Relation::In, &spoon, &mug, &view) && !holds(Relation::In, &mug, &spoon, &view));
        assert!(!holds(Relation::Near, &mug, &mug, &view));
    }

    #[test]
    fn a_things_size_is_its_own_however_it_is_turned() {
        let mut points = Vec::new();
        for (x, y, z) in (0..21).flat_map(|x| (0..11).flat_map(move |y| (0..6).map(move |z| (x, y, z)))) {
            points.push(DVec3::new(f64::from(x) * 0.1, f64::from(y) * 0.1, f64::from(z) * 0.1));
        }
        let straight = Extent::new(&points, DVec3::Z).expect("an extent");
        // The outermost layer of the finest points may count as outliers.
        assert!((straight.length - 2.0).abs() < 0.11 && (straight.width - 1.0).abs() < 0.11, "{straight:?}");
        for degrees in [10.0_f64, 34.0, 80.0, 120.0] {
            let turn = glam::DQuat::from_axis_angle(DVec3::Z, degrees.to_radians());
            let turned: Vec<DVec3> = points.iter().map(|p| turn * *p + DVec3::splat(3.0)).collect();
            let extent = Extent::new(&turned, DVec3::Z).expect("an extent");
            assert!((extent.length - straight.length).abs() < 0.1 && (extent.width - straight.width).abs() < 0.1);
            assert!((extent.height - straight.height).abs() < 1e-9, "{degrees}");
            // Control: a box along the world axes is larger.
            let world = Bounds::robust(turned).expect("a box").size();
            assert!(world.x * world.y > 1.05 * extent.length * extent.width, "{degrees}: {world}");
        }
        let own = Extent::of_box(&cube([1.0; 3], [2.2, 0.9, 0.75]), DVec3::Z).expect("an extent");
        assert!((own.length - 2.2).abs() < 1e-9 && (own.width - 0.9).abs() < 1e-9 && (own.height - 0.75).abs() < 1e-9);
        assert!(Extent::new(&[], DVec3::Z).is_none());
    }

    #[test]
    fn broken_views_and_boxes_give_no_nonsense() {
        let view = Viewpoint { eye: DVec3::ZERO, forward: DVec3::Z, up: DVec3::Z };
        let frame = view.frame();
        assert!(frame.right.is_normalized() && frame.ahead.is_normalized());
        let nothing = Viewpoint { eye: DVec3::ZERO, forward: DVec3::ZERO, up: DVec3::ZERO }.frame();
        assert!(nothing.right.is_normalized());
        let point = cube([0.0; 3], [0.0; 3]);
        for relation in Relation::ALL {
            let found = fit(relation, &point, &point, &frame);
            assert!(found.is_none_or(f64::is_finite), "{relation:?}");
        }
        let lost = Bounds { min: DVec3::NAN, max: DVec3::NAN };
        assert!(fit(Relation::LeftOf, &lost, &point, &frame).is_none());
    }
}
