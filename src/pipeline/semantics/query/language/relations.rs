//! Relations between things in space, judged from points of their surfaces: left of, on, near.
//!
//! A relation holds for a share of a thing, 0 to 1. Sides are those of the current view: left and right as in its
//! picture, near and far along its level direction.

use glam::DVec3;

use super::expression::Relation;
use crate::scene::shapes::{SampledShape, SeenShapes};
use crate::scene::{Identities, IdentityId, Level};

/// Share from which a relation holds for sure, and from which it is a guess (docs/notes/queries.md).
pub(crate) const HOLDS: [f64; 2] = [0.9, 0.75];

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

/// Shapes of a scene with the view and the objects that carry others.
pub(crate) struct Space<'a> {
    pub(crate) identities: &'a Identities,
    pub(crate) shapes: &'a SeenShapes,
    pub(crate) view: Viewpoint,
    axes: UprightAxes,
}

impl<'a> Space<'a> {
    pub(crate) fn new(identities: &'a Identities, view: Viewpoint) -> Self {
        Self { identities, shapes: &identities.shapes, view, axes: view.frame() }
    }

    pub(crate) fn axes(&self) -> &UprightAxes {
        &self.axes
    }

    /// Share of `thing` for which a relation to `anchor` holds; `None` without Gaussians, or for a thing and its own
    /// piece where a relation says nothing of them.
    pub(crate) fn share(&self, relation: Relation, thing: IdentityId, anchor: IdentityId) -> Option<f64> {
        if thing == anchor {
            return None;
        }
        let is_piece = self.identities.is_piece(thing, anchor);
        let is_whole = self.identities.is_piece(anchor, thing);
        match relation {
            Relation::PartOf => return Some(if is_piece { 1.0 } else { 0.0 }),
            Relation::On | Relation::In if is_piece => return Some(1.0),
            _ if is_piece || is_whole => return None,
            _ => {}
        }
        let (t, a) = (self.shapes.get(thing)?, self.shapes.get(anchor)?);
        let (right, up, ahead) = (self.axes.right, self.axes.up, self.axes.ahead);
        Some(match relation {
            Relation::LeftOf => self.beside(t, a, right),
            Relation::RightOf => self.beside(t, a, -right),
            Relation::InFrontOf => before(t, a, |p| p.dot(ahead)),
            Relation::Behind => before(t, a, |p| -p.dot(ahead)),
            Relation::On => f64::from(u8::from(self.rests(thing, anchor, 4))),
            Relation::Above => {
                let lifted = (self.over(t, a, 0.5).max(self.over(a, t, 0.0))) >= 0.5;
                if lifted { before(t, a, |p| -p.dot(up)) } else { 0.0 }
            }
            Relation::Under => {
                let lifted = self.over(t, a, 0.0).max(self.over(a, t, 0.0)) >= 0.5;
                let carried = self.rests(anchor, thing, 1);
                if carried {
                    1.0
                } else if lifted {
                    before(t, a, |p| p.dot(up))
                } else {
                    0.0
                }
            }
            Relation::In => self.inside(t, a).max(self.heaped(thing, t, anchor, a)),
            Relation::Near => near(t, a, 1.0),
            Relation::Around => near(t, a, 1.6),
            Relation::Touching => {
                let size = t.bounds.radius().min(a.bounds.radius());
                let touches = t.gap(a) <= 0.02 * size + 1e-9 || self.carries(t, a) || self.carries(a, t);
                f64::from(u8::from(touches))
            }
            Relation::PartOf => 0.0,
        })
    }

    /// Share of a thing that is left of another, seen from the camera: in the picture and in space.
    fn beside(&self, t: &SampledShape, a: &SampledShape, right: DVec3) -> f64 {
        let eye = self.view.eye;
        let in_space = before(t, a, |p| (p - eye).dot(right));
        let depth =
            |s: &SampledShape| s.points().iter().map(|p| (*p - eye).dot(self.axes.ahead)).fold(f64::INFINITY, f64::min);
        // What is behind the camera has no side in its picture.
        if depth(t).min(depth(a)) <= 1e-6 {
            return 0.0;
        }
        let in_picture = before(t, a, |p| (p - eye).dot(right) / (p - eye).dot(self.axes.ahead));
        0.5 * (in_space + in_picture)
    }

    /// Share of a thing that is over the footprint of another, widened on each side by a share of its size.
    fn over(&self, t: &SampledShape, a: &SampledShape, widened: f64) -> f64 {
        let sides = [self.axes.right, self.axes.ahead].map(|axis| (axis, a.span(axis)));
        let is_over = |p: &&DVec3| {
            sides.iter().all(|(axis, (low, high))| {
                let (x, more) = (p.dot(*axis), widened * (high - low));
                x >= low - more && x <= high + more
            })
        };
        share_of(t, is_over)
    }

    /// Share of a thing inside another one's footprint, if its bottom is below the other's rim.
    fn inside(&self, t: &SampledShape, a: &SampledShape) -> f64 {
        let (own, rim) = (t.span(self.axes.up), a.span(self.axes.up));
        let height = rim.1 - rim.0;
        let is_low = own.0 < rim.1 - 0.1 * height && own.0 > rim.0 - 0.1 * height && own.1 < rim.1 + 2.0 * height;
        if is_low && t.bounds.radius() < a.bounds.radius() { self.over(t, a, 0.0) } else { 0.0 }
    }

    /// Returns 1 for a piece that lies on another piece inside: the pear on the apple in the bowl.
    fn heaped(&self, thing: IdentityId, t: &SampledShape, anchor: IdentityId, a: &SampledShape) -> f64 {
        let parent = self.identities.get(thing).map(|i| i.parent);
        let siblings =
            self.identities.iter().filter(|(id, i)| Some(i.parent) == parent && ![thing, anchor].contains(id));
        let is_under = |b: &SampledShape| self.inside(b, a) >= HOLDS[0] && self.carries(t, b);
        let small = t.bounds.radius() < a.bounds.radius();
        let lies = small
            && siblings.filter(|(_, i)| i.level == Level::Part).filter_map(|(id, _)| self.shapes.get(id)).any(is_under);
        f64::from(u8::from(lies))
    }

    /// Returns whether `t` stands or lies on top of `a` itself.
    fn carries(&self, t: &SampledShape, a: &SampledShape) -> bool {
        let up = self.axes.up;
        let (top, bottom) = (a.span(up), t.span(up));
        let (height, under) = (bottom.1 - bottom.0, top.1 - top.0);
        let gap = bottom.0 - top.1;
        // A table is not on the ball under it: both stand on the floor.
        let is_higher = bottom.0 - top.0 > 0.25 * under && bottom.1 > top.1;
        is_higher
            && gap >= -0.35 * height - 0.05 * under
            && gap <= 0.3 * height + 0.02 * under
            && self.over(t, a, 0.02) >= 0.4
    }

    /// Returns whether `thing` rests on `anchor`, on a piece of it, or on something that does and carries little else.
    pub(crate) fn rests(&self, thing: IdentityId, anchor: IdentityId, depth: usize) -> bool {
        let Some(t) = self.shapes.get(thing) else { return false };
        let pieces = self.identities.children(anchor).chain([anchor]);
        let mut shapes = pieces.filter_map(|id| self.shapes.get(id));
        if shapes.any(|a| self.carries(t, a)) {
            return true;
        }
        if depth <= 1 {
            return false;
        }
        let stages = self.stages();
        let between = self
            .identities
            .iter()
            .filter(|(id, i)| i.level == Level::Object && *id != thing && *id != anchor && !stages.contains(id));
        between
            .filter(|(id, _)| self.shapes.get(*id).is_some_and(|b| self.carries(t, b)))
            .any(|(id, _)| self.rests(id, anchor, depth - 1))
    }

    /// Objects that directly or indirectly carry at least half of the others: floor, table.
    pub(crate) fn stages(&self) -> Vec<IdentityId> {
        self.shapes.stages(self.axes.up, || self.find_stages())
    }

    fn find_stages(&self) -> Vec<IdentityId> {
        /// Largest footprints that are tried, and most things that are tried with them.
        const TRIED: [usize; 2] = [12, 400];
        let objects = self.identities.iter().filter(|(_, i)| i.level == Level::Object);
        let objects: Vec<(IdentityId, &SampledShape)> =
            objects.filter_map(|(id, _)| Some((id, self.shapes.get(id)?))).collect();
        let footprint = |s: &SampledShape| {
            let [a, b] = [self.axes.right, self.axes.ahead].map(|axis| s.span(axis));
            (a.1 - a.0) * (b.1 - b.0)
        };
        let mut widest = objects.clone();
        widest.sort_by(|a, b| footprint(b.1).total_cmp(&footprint(a.1)));
        widest.truncate(TRIED[0]);
        let every = objects.len().div_ceil(TRIED[1]).max(1);
        let tried: Vec<_> = objects.iter().step_by(every).collect();
        let direct = |id: IdentityId, t: &SampledShape, on: IdentityId, a: &SampledShape| {
            id != on
                && (self.carries(t, a)
                    || self.identities.children(on).filter_map(|p| self.shapes.get(p)).any(|a| self.carries(t, a)))
        };
        let mut carried: Vec<(IdentityId, Vec<IdentityId>)> = Vec::new();
        for (on, a) in &widest {
            let all = tried.iter().filter(|(id, t)| direct(*id, t, *on, a)).map(|(id, _)| *id).collect();
            carried.push((*on, all));
        }
        let total = |on: IdentityId| {
            let (mut seen, mut open) = (vec![on], vec![on]);
            while let Some(next) = open.pop() {
                let more = carried.iter().find(|(id, _)| *id == next).map(|(_, all)| all.clone()).unwrap_or_default();
                more.into_iter().filter(|id| !seen.contains(id)).collect::<Vec<_>>().into_iter().for_each(|id| {
                    seen.push(id);
                    open.push(id);
                });
            }
            seen.len() - 1
        };
        let half = (tried.len() as f64 * 0.5).max(2.5);
        widest.iter().map(|(id, _)| *id).filter(|id| total(*id) as f64 >= half - 0.5).collect()
    }

    /// Share of a thing that lies between two others.
    pub(crate) fn between(&self, thing: IdentityId, a: IdentityId, b: IdentityId) -> Option<f64> {
        if [a, b].contains(&thing) || a == b {
            return None;
        }
        let [t, a, b] = [thing, a, b].map(|id| self.shapes.get(id));
        let (t, from, to) = (t?, a?.center(), b?.center());
        let way = to - from;
        let level = |v: DVec3| v - self.axes.up * v.dot(self.axes.up);
        // Of things one above the other, the way is upright.
        let (way, flat) = if level(way).length() > 0.3 * way.length() { (level(way), true) } else { (way, false) };
        let length = way.length().max(1e-12);
        let reach = |s: &SampledShape| {
            let [x, y] = [self.axes.right, self.axes.ahead].map(|axis| s.span(axis));
            0.25 * (x.1 - x.0 + y.1 - y.0)
        };
        let room = (0.5 * (reach(a?) + reach(b?)) + 0.18 * length).min(0.5 * length);
        let is_between = |p: &&DVec3| {
            let off = if flat { level(**p - from) } else { **p - from };
            let along = off.dot(way) / length;
            (0.0..=length).contains(&along) && (off - way * (along / length)).length() <= room
        };
        Some(share_of(t, is_between))
    }

    /// Distance between two things; 0 if they touch.
    pub(crate) fn gap(&self, a: IdentityId, b: IdentityId) -> Option<f64> {
        Some(self.shapes.get(a)?.gap(self.shapes.get(b)?))
    }
}

fn share_of(shape: &SampledShape, fits: impl Fn(&&DVec3) -> bool) -> f64 {
    let all = shape.spread();
    all.iter().filter(fits).count() as f64 / all.len().max(1) as f64
}

/// Share of the points of `t` that come before most of `a`.
fn before(t: &SampledShape, a: &SampledShape, value: impl Fn(DVec3) -> f64) -> f64 {
    /// Share of an anchor that may come before a thing that is before it.
    const OVERLAP: f64 = 0.25;
    let mut after: Vec<f64> = a.spread().iter().map(|p| value(*p)).collect();
    after.sort_by(f64::total_cmp);
    let limit = after.get((OVERLAP * after.len() as f64) as usize).copied().unwrap_or(f64::NEG_INFINITY);
    share_of(t, |p| value(**p) < limit)
}

/// Nearness of two things, 1 within half of `reach` times the size of the smaller one, falling to 0 at twice of it.
fn near(t: &SampledShape, a: &SampledShape, reach: f64) -> f64 {
    let size = reach * (t.bounds.radius() + a.bounds.radius()).min(3.0 * t.bounds.radius().min(a.bounds.radius()));
    let boxes = (t.bounds.min - a.bounds.max).max(a.bounds.min - t.bounds.max).max(DVec3::ZERO).length();
    if boxes > 2.0 * size {
        return 0.0;
    }
    (1.0 - (t.gap(a) / size.max(1e-12) - 0.6) / 1.2).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Bounds, NO_IDENTITY};

    fn scene(boxes: &[([f64; 3], [f64; 3])]) -> Identities {
        let mut all = Identities::objects(boxes.len());
        let cube = |(c, s): &([f64; 3], [f64; 3])| {
            let (c, h) = (DVec3::from(*c), DVec3::from(*s) * 0.5);
            Some(Bounds { min: c - h, max: c + h })
        };
        all.set_boxes(&[None].into_iter().chain(boxes.iter().map(cube)).collect::<Vec<_>>());
        all
    }

    fn share(all: &Identities, view: Viewpoint, relation: Relation, thing: IdentityId, anchor: IdentityId) -> f64 {
        Space::new(all, view).share(relation, thing, anchor).unwrap_or(-1.0)
    }

    #[test]
    fn sides_are_those_of_the_view() {
        let view = Viewpoint { eye: DVec3::new(0.0, -3.0, 1.0), forward: DVec3::new(0.0, 1.0, -0.3), up: DVec3::Z };
        assert!((view.frame().right - DVec3::X).length() < 1e-9);
        let all =
            scene(&[([0.0; 3], [0.4, 0.3, 0.2]), ([-0.4, 0.0, 0.0], [0.1; 3]), ([-0.15, 0.0, 0.0], [0.3, 0.3, 0.1])]);
        let (laptop, mug, mat) = (1, 2, 3);
        assert_eq!(share(&all, view, Relation::LeftOf, mug, laptop), 1.0);
        assert_eq!(share(&all, view, Relation::RightOf, mug, laptop), 0.0);
        assert_eq!(share(&all, view, Relation::RightOf, laptop, mug), 1.0);
        // Half over it: neither sure nor wrong.
        let half = share(&all, view, Relation::LeftOf, mat, laptop);
        assert!((0.3..1.0).contains(&half), "{half}");
        let turned = Viewpoint { eye: -view.eye, forward: -view.forward, ..view };
        assert_eq!(share(&all, turned, Relation::RightOf, mug, laptop), 1.0, "seen from the other side");
        let from_left = Viewpoint { eye: DVec3::new(-3.0, 0.0, 1.0), forward: DVec3::X, ..view };
        assert_eq!(share(&all, from_left, Relation::InFrontOf, mug, laptop), 1.0);
        assert_eq!(share(&all, from_left, Relation::Behind, laptop, mug), 1.0);
    }

    #[test]
    fn above_and_below_follow_the_scenes_up() {
        let view = Viewpoint { eye: DVec3::ZERO, forward: DVec3::Z, up: DVec3::NEG_Y };
        // y points down: the table's top is at y = 0, its feet at y = 0.8.
        let all = scene(&[
            ([0.0, 0.4, 2.0], [1.6, 0.8, 0.8]),
            ([0.3, -0.05, 2.1], [0.1; 3]),
            ([0.3, -1.0, 2.1], [0.2; 3]),
            ([0.0, 0.7, 2.0], [0.2; 3]),
            ([2.0, 0.3, 2.0], [0.5, 1.0, 0.5]),
            ([0.3, -0.12, 2.1], [0.08, 0.04, 0.08]),
        ]);
        let (table, mug, lamp, ball, chair, lid) = (1, 2, 3, 4, 5, 6);
        let holds = |relation, thing, anchor| share(&all, view, relation, thing, anchor) >= HOLDS[0];
        assert!(holds(Relation::On, mug, table) && !holds(Relation::On, lamp, table));
        assert!(holds(Relation::On, lid, mug) && holds(Relation::On, lid, table), "by way of the mug");
        assert!(!holds(Relation::On, ball, table) && !holds(Relation::On, chair, table));
        assert!(holds(Relation::Above, lamp, table) && holds(Relation::Above, lamp, mug));
        assert!(holds(Relation::Under, table, mug) && holds(Relation::Under, mug, lamp));
        assert!(!holds(Relation::Under, mug, table) && holds(Relation::Touching, mug, table));
        assert!(holds(Relation::Near, mug, lid) && !holds(Relation::Near, mug, chair));
        assert!(!holds(Relation::Touching, chair, table) && share(&all, view, Relation::Near, mug, mug) < 0.0);
    }

    #[test]
    fn pieces_are_on_and_in_their_wholes_and_things_lie_between_others() {
        let mut all = scene(&[([-1.0, 0.0, 0.0], [0.2; 3]), ([1.0, 0.0, 0.0], [0.2; 3]), ([0.1, 0.05, 0.0], [0.2; 3])]);
        let knob = all.add(Level::Part, 1, vec![]);
        let view = Viewpoint { eye: DVec3::new(0.0, -3.0, 0.0), forward: DVec3::Y, up: DVec3::Z };
        assert_eq!(share(&all, view, Relation::On, knob, 1), 1.0);
        assert_eq!(
            (share(&all, view, Relation::PartOf, knob, 2), share(&all, view, Relation::LeftOf, 1, knob)),
            (0.0, -1.0)
        );
        let space = Space::new(&all, view);
        assert_eq!(
            (space.between(3, 1, 2), space.between(1, 3, 2), space.between(1, 1, 2)),
            (Some(1.0), Some(0.0), None)
        );
        assert!((space.gap(1, 2).unwrap_or(0.0) - 1.8).abs() < 1e-9 && space.stages().is_empty());
        assert_eq!(all.get(knob).map(|k| k.parent == NO_IDENTITY), Some(false));
    }

    #[test]
    fn what_most_things_stand_on_is_a_stage() {
        let mug = |x: f64| ([x, 0.0, 0.85], [0.1, 0.1, 0.1]);
        let all = scene(&[
            ([0.0, 0.0, -0.05], [9.0, 9.0, 0.1]),
            ([0.0, 0.0, 0.4], [2.0, 1.0, 0.8]),
            mug(-0.5),
            mug(0.0),
            mug(0.5),
        ]);
        let view = Viewpoint { eye: DVec3::new(0.0, -3.0, 1.0), forward: DVec3::Y, up: DVec3::Z };
        assert_eq!(Space::new(&all, view).stages(), [1, 2]);
        // Control: a tray with one of three things on it is none.
        let all = scene(&[([0.0, 0.0, 0.4], [0.3, 0.3, 0.02]), ([0.0, 0.0, 0.46], [0.1; 3]), mug(3.0), mug(5.0)]);
        assert!(Space::new(&all, view).stages().is_empty());
    }
}
