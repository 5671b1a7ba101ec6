//! Relations between things in space, judged from points of their surfaces: left of, on, near.
//!
//! A relation holds for a share of a thing, 0 to 1. Sides are those of the current view: left and right as in its
//! picture, near and far along its level direction.

use std::cell::{OnceCell, RefCell};
use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;

use glam::DVec3;

use super::expression::Relation;
use super::viewpoint::{UprightAxes, Viewpoint};
use crate::scene::shapes::{SampledShape, SeenShapes};
use crate::scene::support::Support;
use crate::scene::{Identities, IdentityId, Level};

/// Share from which a relation holds for sure, and from which it is a guess (docs/notes/queries.md).
pub(crate) const HOLDS: [f64; 2] = [0.9, 0.75];

/// Shapes of a scene with the view and what carries what. What is computed of a shape is kept.
pub(crate) struct Space<'a> {
    pub(crate) identities: &'a Identities,
    pub(crate) shapes: &'a SeenShapes,
    pub(crate) view: Viewpoint,
    axes: UprightAxes,
    support: OnceCell<Arc<Support>>,
    along: RefCell<HashMap<(Along, IdentityId), Rc<Values>>>,
}

/// Value of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Along {
    Right,
    Up,
    Ahead,
    /// Place in the picture, to the right; there is none behind the camera.
    Picture,
}

/// Values of a shape's points.
struct Values {
    /// Coordinates of the points on its surface, the least first.
    sorted: Vec<f64>,
    /// Least and greatest of all.
    span: (f64, f64),
}

impl Values {
    /// Share of the values that are less than most of another's; with `reverse`, greater.
    fn before(&self, other: &Self, reverse: bool) -> f64 {
        /// Share of an anchor that may come before a thing that is before it.
        const OVERLAP: f64 = 0.25;
        let (own, n) = (&self.sorted, other.sorted.len());
        let at = (OVERLAP * n as f64) as usize;
        let Some(limit) = other.sorted.get(if reverse { n.wrapping_sub(at + 1) } else { at }) else { return 0.0 };
        let less =
            if reverse { own.len() - own.partition_point(|v| v <= limit) } else { own.partition_point(|v| v < limit) };
        less as f64 / own.len().max(1) as f64
    }
}

impl<'a> Space<'a> {
    pub(crate) fn new(identities: &'a Identities, view: Viewpoint) -> Self {
        let (support, along) = (OnceCell::new(), RefCell::default());
        Self { identities, shapes: &identities.shapes, view, axes: view.frame(), support, along }
    }

    pub(crate) fn axes(&self) -> &UprightAxes {
        &self.axes
    }

    fn support(&self) -> &Support {
        self.support.get_or_init(|| self.shapes.support(self.identities, self.axes.up))
    }

    /// Objects that directly or indirectly carry at least half of the others: floor, table.
    pub(crate) fn stages(&self) -> &[IdentityId] {
        &self.support().stages
    }

    /// Returns whether `thing` rests on `anchor`, by way of at most `depth` things, the anchor included.
    pub(crate) fn rests(&self, thing: IdentityId, anchor: IdentityId, depth: usize) -> bool {
        self.support().rests(self.identities, thing, anchor, depth)
    }

    /// Values of a shape's points.
    fn values(&self, along: Along, id: IdentityId) -> Option<Rc<Values>> {
        if let Some(known) = self.along.borrow().get(&(along, id)) {
            return Some(Rc::clone(known));
        }
        let (shape, axes) = (self.shapes.get(id)?, &self.axes);
        let ahead = |p: &DVec3| (*p - self.view.eye).dot(axes.ahead);
        let values: Vec<f64> = match along {
            Along::Right => shape.points().iter().map(|p| (*p - self.view.eye).dot(axes.right)).collect(),
            Along::Up => shape.points().iter().map(|p| p.dot(axes.up)).collect(),
            Along::Ahead => shape.points().iter().map(ahead).collect(),
            Along::Picture if shape.points().iter().any(|p| ahead(p) <= 1e-6) => Vec::new(),
            Along::Picture => shape.points().iter().map(|p| (*p - self.view.eye).dot(axes.right) / ahead(p)).collect(),
        };
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let span = values.iter().fold(ends, |(low, high), x| (low.min(*x), high.max(*x)));
        let mut sorted = values;
        sorted.truncate(shape.spread().len());
        sorted.sort_by(f64::total_cmp);
        let values = Rc::new(Values { sorted, span });
        self.along.borrow_mut().insert((along, id), Rc::clone(&values));
        Some(values)
    }

    /// Share of a thing that comes before most of another.
    fn before(&self, along: Along, thing: IdentityId, anchor: IdentityId, reverse: bool) -> Option<f64> {
        Some(self.values(along, thing)?.before(&*self.values(along, anchor)?, reverse))
    }

    fn span(&self, along: Along, id: IdentityId) -> Option<(f64, f64)> {
        Some(self.values(along, id)?.span)
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
        let is_over = || Some(self.over(thing, anchor, 0.0)?.max(self.over(anchor, thing, 0.0)?) >= 0.5);
        Some(match relation {
            Relation::LeftOf => self.beside(thing, anchor, false)?,
            Relation::RightOf => self.beside(thing, anchor, true)?,
            Relation::InFrontOf => self.before(Along::Ahead, thing, anchor, false)?,
            Relation::Behind => self.before(Along::Ahead, thing, anchor, true)?,
            Relation::On => share_if(self.rests(thing, anchor, 4)),
            Relation::Above => {
                let lifted = self.over(thing, anchor, 0.5)?.max(self.over(anchor, thing, 0.0)?) >= 0.5;
                if lifted { self.before(Along::Up, thing, anchor, true)? } else { 0.0 }
            }
            Relation::Under if self.rests(anchor, thing, 1) => 1.0,
            Relation::Under if is_over()? => self.before(Along::Up, thing, anchor, false)?,
            Relation::Under => 0.0,
            Relation::In => self.inside(thing, anchor)?.max(share_if(self.is_heaped(thing, anchor))),
            Relation::Near => near(t, a, 1.0),
            Relation::Around => near(t, a, 1.6),
            Relation::Touching => {
                let (size, support) = (t.bounds.radius().min(a.bounds.radius()), self.support());
                let carried = support.carries_itself(anchor, thing) || support.carries_itself(thing, anchor);
                share_if(carried || t.gap(a) <= 0.02 * size + 1e-9)
            }
            Relation::PartOf => 0.0,
        })
    }

    /// Share of a thing that is left of another, seen from the camera: in the picture and in space.
    fn beside(&self, thing: IdentityId, anchor: IdentityId, right: bool) -> Option<f64> {
        let both = [thing, anchor].map(|id| self.values(Along::Picture, id));
        // What is behind the camera has no side in its picture.
        if both.iter().flatten().any(|v| v.sorted.is_empty()) {
            return Some(0.0);
        }
        let [in_picture, in_space] = [Along::Picture, Along::Right].map(|a| self.before(a, thing, anchor, right));
        Some(0.5 * (in_picture? + in_space?))
    }

    /// Share of a thing that is over the footprint of another, widened on each side by a share of its size.
    fn over(&self, thing: IdentityId, anchor: IdentityId, widened: f64) -> Option<f64> {
        let wide = |along| {
            let (low, high) = self.span(along, anchor)?;
            let more = widened * (high - low);
            Some((low - more, high + more))
        };
        let (right, ahead) = (wide(Along::Right)?, wide(Along::Ahead)?);
        let (x, y) = (self.span(Along::Right, thing)?, self.span(Along::Ahead, thing)?);
        if x.1 < right.0 || x.0 > right.1 || y.1 < ahead.0 || y.0 > ahead.1 {
            return Some(0.0);
        }
        let is_over = |p: &&DVec3| {
            let p = **p - self.view.eye;
            (right.0..=right.1).contains(&p.dot(self.axes.right))
                && (ahead.0..=ahead.1).contains(&p.dot(self.axes.ahead))
        };
        Some(share_of(self.shapes.get(thing)?, is_over))
    }

    /// Share of a thing inside another one's footprint, if its bottom is below the other's rim.
    fn inside(&self, thing: IdentityId, anchor: IdentityId) -> Option<f64> {
        let (own, rim) = (self.span(Along::Up, thing)?, self.span(Along::Up, anchor)?);
        let height = rim.1 - rim.0;
        let is_low = own.0 < rim.1 - 0.1 * height && own.0 > rim.0 - 0.1 * height && own.1 < rim.1 + 2.0 * height;
        if is_low && self.is_smaller(thing, anchor) { self.over(thing, anchor, 0.0) } else { Some(0.0) }
    }

    fn is_smaller(&self, thing: IdentityId, than: IdentityId) -> bool {
        let radius = |id| self.shapes.get(id).map(|s| s.bounds.radius());
        radius(thing).zip(radius(than)).is_some_and(|(a, b)| a < b)
    }

    /// Returns whether a piece lies on another piece inside: the pear on the apple in the bowl.
    fn is_heaped(&self, thing: IdentityId, anchor: IdentityId) -> bool {
        let of = |id| self.identities.get(id).filter(|i| i.level == Level::Part).map(|i| i.parent);
        let parent = self.identities.get(thing).map(|i| i.parent);
        let is_under = |b: &&IdentityId| {
            of(**b).is_some_and(|of| Some(of) == parent)
                && **b != anchor
                && self.inside(**b, anchor).is_some_and(|share| share >= HOLDS[0])
        };
        self.is_smaller(thing, anchor) && self.support().carriers(thing).iter().any(|b| is_under(&b))
    }

    /// Way between two things.
    pub(crate) fn way(&self, a: IdentityId, b: IdentityId) -> Option<Way> {
        if a == b {
            return None;
        }
        let reach = |id| {
            let (x, y) = (self.span(Along::Right, id)?, self.span(Along::Ahead, id)?);
            Some(0.25 * (x.1 - x.0 + y.1 - y.0))
        };
        let [from, to] = [a, b].map(|id| self.shapes.get(id).map(SampledShape::center));
        let (from, way) = (from?, to? - from?);
        let level = way - self.axes.up * way.dot(self.axes.up);
        // Of things one above the other, the way is upright.
        let flat = (level.length() > 0.3 * way.length()).then_some(self.axes.up);
        let way = if flat.is_some() { level } else { way };
        let length = way.length().max(1e-12);
        // People draw it hardly wider than the two things: of two sets of questions, four more are right than at 0.18.
        let room = (0.5 * (reach(a)? + reach(b)?) + 0.08 * length).min(0.5 * length);
        Some(Way { ends: [a, b], from, direction: way / length, length, flat, room })
    }

    /// Share of a thing that lies on the way between two others.
    pub(crate) fn between(&self, thing: IdentityId, way: &Way) -> Option<f64> {
        let shape = self.shapes.get(thing).filter(|_| !way.ends.contains(&thing))?;
        let is_near = way.has(shape.center(), shape.bounds.radius());
        Some(if is_near { share_of(shape, |p| way.has(**p, 0.0)) } else { 0.0 })
    }

    /// Distance between two things; 0 if they touch.
    pub(crate) fn gap(&self, a: IdentityId, b: IdentityId) -> Option<f64> {
        Some(self.shapes.get(a)?.gap(self.shapes.get(b)?))
    }
}

/// Way between two things, with the room at its sides.
pub(crate) struct Way {
    ends: [IdentityId; 2],
    from: DVec3,
    direction: DVec3,
    length: f64,
    /// Up direction, if heights do not count.
    flat: Option<DVec3>,
    room: f64,
}

impl Way {
    /// Returns whether a point is on it, or nearer to it than `slack`.
    fn has(&self, point: DVec3, slack: f64) -> bool {
        let off = point - self.from;
        let off = self.flat.map_or(off, |up| off - up * off.dot(up));
        let along = off.dot(self.direction);
        (-slack..=self.length + slack).contains(&along) && (off - self.direction * along).length() <= self.room + slack
    }
}

fn share_if(holds: bool) -> f64 {
    if holds { 1.0 } else { 0.0 }
}

fn share_of(shape: &SampledShape, fits: impl Fn(&&DVec3) -> bool) -> f64 {
    let all = shape.spread();
    all.iter().filter(fits).count() as f64 / all.len().max(1) as f64
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
    use crate::scene::NO_IDENTITY;
    use crate::scene::identity::of_boxes as scene;

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
        let between = |thing, a, b| space.between(thing, &space.way(a, b)?);
        assert_eq!(
            (between(3, 1, 2), between(1, 3, 2), between(1, 1, 2), between(1, 2, 2)),
            (Some(1.0), Some(0.0), None, None)
        );
        assert!((space.gap(1, 2).unwrap_or(0.0) - 1.8).abs() < 1e-9 && space.stages().is_empty());
        assert_eq!(all.get(knob).map(|k| k.parent == NO_IDENTITY), Some(false));
    }
}
