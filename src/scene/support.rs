//! Support between things: what stands or lies on what, for one up direction and whatever the view.

use glam::DVec3;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use super::{Identities, IdentityId, Level};

/// Number of the largest footprints among which the things that carry most others are.
const WIDEST: usize = 12;
/// Share of a footprint by which it is widened on each side.
const WIDENED: f64 = 0.02;
/// Share of a thing over the footprint of what carries it.
const OVER: f64 = 0.4;

/// Things that carry others.
#[derive(Debug, Default)]
pub(crate) struct Support {
    /// By number, what carries a thing directly: objects and parts.
    carriers: Vec<Vec<IdentityId>>,
    /// Objects that directly or indirectly carry at least half of the others: floor, table.
    pub(crate) stages: Vec<IdentityId>,
}

/// Upright box of a thing with its points on the ground.
pub(super) struct Standing {
    /// Lowest and highest value along two level axes and upward.
    spans: [(f64, f64); 3],
    flat: Vec<[f64; 2]>,
}

impl Standing {
    /// Takes the points of a surface and its lowest and highest values along two level axes and upward.
    pub(super) fn of(points: &[DVec3], spans: [(f64, f64); 3], axes: &[DVec3; 3]) -> Self {
        Self { spans, flat: points.iter().map(|p| [p.dot(axes[0]), p.dot(axes[1])]).collect() }
    }

    /// Rectangle on the ground, widened on each side by a share of its size.
    fn footprint(&self, widened: f64) -> [(f64, f64); 2] {
        let wide = |(low, high): (f64, f64)| (low - widened * (high - low), high + widened * (high - low));
        [wide(self.spans[0]), wide(self.spans[1])]
    }

    fn area(&self) -> f64 {
        let [a, b] = self.footprint(0.0);
        (a.1 - a.0) * (b.1 - b.0)
    }

    /// Returns whether `t` stands or lies on top of it.
    fn carries(&self, t: &Self) -> bool {
        let (top, bottom) = (self.spans[2], t.spans[2]);
        let (height, under) = (bottom.1 - bottom.0, top.1 - top.0);
        let gap = bottom.0 - top.1;
        // A table is not on the ball under it: both stand on the floor.
        let is_higher = bottom.0 - top.0 > 0.25 * under && bottom.1 > top.1;
        let [x, y] = self.footprint(WIDENED);
        let is_over = |p: &&[f64; 2]| (x.0..=x.1).contains(&p[0]) && (y.0..=y.1).contains(&p[1]);
        is_higher
            && gap >= -0.35 * height - 0.05 * under
            && gap <= 0.3 * height + 0.02 * under
            && t.flat.iter().filter(is_over).count() as f64 >= OVER * t.flat.len().max(1) as f64
    }
}

impl Support {
    /// Computes what carries what of these things, by number from 0.
    pub(super) fn of(standing: &[Option<Standing>], identities: &Identities) -> Self {
        let there = || standing.iter().enumerate().filter_map(|(id, s)| Some((id as IdentityId, s.as_ref()?)));
        let corners = |[x, y]: [(f64, f64); 2]| ([x.0, y.0], [x.1, y.1]);
        let placed =
            there().filter(|(_, s)| s.spans.iter().all(|(a, b)| a.is_finite() && b.is_finite())).map(|(id, s)| {
                let (low, high) = corners(s.footprint(WIDENED));
                GeomWithData::new(Rectangle::from_corners(low, high), id)
            });
        let tree = RTree::bulk_load(placed.collect());
        let mut carriers = vec![Vec::new(); standing.len()];
        for (id, t) in there() {
            let (low, high) = corners(t.footprint(0.0));
            let near = tree.locate_in_envelope_intersecting(AABB::from_corners(low, high)).map(|found| found.data);
            let is_carrier = |a: &IdentityId| standing[*a as usize].as_ref().is_some_and(|s| *a != id && s.carries(t));
            carriers[id as usize] = near.filter(is_carrier).collect();
            carriers[id as usize].sort_unstable();
        }
        let mut objects: Vec<(IdentityId, f64)> = there()
            .filter(|(id, _)| identities.get(*id).is_some_and(|i| i.level == Level::Object))
            .map(|(id, s)| (id, s.area()))
            .collect();
        let half = (objects.len() as f64 * 0.5).max(2.5) - 0.5;
        objects.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut found = Self { carriers, stages: Vec::new() };
        let carried: Vec<(IdentityId, Vec<IdentityId>)> = objects
            .iter()
            .take(WIDEST)
            .map(|(on, _)| {
                let all = objects.iter().map(|(id, _)| *id);
                (*on, all.filter(|id| id != on && found.carries(identities, *on, *id)).collect())
            })
            .collect();
        let total = |on: IdentityId| {
            let (mut seen, mut open) = (vec![false; standing.len()], vec![on]);
            while let Some(next) = open.pop() {
                if !std::mem::replace(&mut seen[next as usize], true) {
                    open.extend(carried.iter().filter(|(id, _)| *id == next).flat_map(|(_, all)| all));
                }
            }
            seen.iter().filter(|s| **s).count() - 1
        };
        found.stages = carried.iter().map(|(on, _)| *on).filter(|on| total(*on) as f64 >= half).collect();
        found
    }

    /// Direct supports of a thing.
    pub(crate) fn carriers(&self, thing: IdentityId) -> &[IdentityId] {
        self.carriers.get(thing as usize).map(Vec::as_slice).unwrap_or_default()
    }

    /// Returns whether a thing itself carries another one.
    pub(crate) fn carries_itself(&self, carrier: IdentityId, thing: IdentityId) -> bool {
        self.carriers(thing).contains(&carrier)
    }

    /// Returns whether a thing or a child of it carries another one.
    fn carries(&self, identities: &Identities, carrier: IdentityId, thing: IdentityId) -> bool {
        let is_of = |id: &IdentityId| *id == carrier || identities.get(*id).is_some_and(|i| i.parent == carrier);
        self.carriers(thing).iter().any(is_of)
    }

    /// Returns whether `thing` rests on `anchor`, on a piece of it, or on something that does and carries little else,
    /// by way of at most `depth` things, the anchor included.
    pub(crate) fn rests(&self, identities: &Identities, thing: IdentityId, anchor: IdentityId, depth: usize) -> bool {
        if self.carries(identities, anchor, thing) {
            return true;
        }
        let is_between = |id: &IdentityId| {
            let is_object = identities.get(*id).is_some_and(|i| i.level == Level::Object);
            is_object && *id != thing && *id != anchor && !self.stages.contains(id)
        };
        let mut between = self.carriers(thing).iter().filter(|id| is_between(id));
        depth > 1 && between.any(|id| self.rests(identities, *id, anchor, depth - 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::NO_IDENTITY;
    use crate::scene::identity::of_boxes as scene;

    #[test]
    fn things_rest_on_what_carries_them_by_way_of_others() {
        // A table; on it a box, on that a book, on that a cup; a ball under the table. Others, so that the box does not
        // carry most of them.
        let all = scene(&[
            ([0.0, 0.0, 0.4], [1.6, 0.8, 0.8]),
            ([0.0, 0.0, 0.9], [0.3, 0.3, 0.2]),
            ([0.0, 0.0, 1.02], [0.2, 0.2, 0.04]),
            ([0.0, 0.0, 1.09], [0.1; 3]),
            ([0.0, 0.0, 0.1], [0.2; 3]),
            ([0.5, 0.0, 0.85], [0.1; 3]),
            ([0.6, 0.2, 0.85], [0.1; 3]),
            ([0.7, 0.0, 0.85], [0.1; 3]),
        ]);
        let (table, case, book, cup, ball) = (1, 2, 3, 4, 5);
        let support = all.shapes.support(&all, DVec3::Z);
        assert!(support.carries_itself(table, case) && support.carries_itself(case, book));
        assert!(!support.carries_itself(table, book) && !support.carries_itself(book, case));
        let rests = |thing, on, depth| support.rests(&all, thing, on, depth);
        assert!(rests(cup, case, 2) && !rests(cup, case, 1) && rests(cup, table, 3));
        assert!(!rests(table, cup, 9) && !rests(ball, table, 9) && !rests(99, table, 9) && !rests(cup, 99, 9));
        // Turned upside down, nothing stands as it did.
        let turned = all.shapes.support(&all, DVec3::NEG_Z);
        assert!(!turned.carries_itself(table, case) && !turned.carries_itself(book, cup));
        assert!(all.shapes.support(&all, DVec3::NAN).stages.len() <= 5);
    }

    #[test]
    fn what_most_things_stand_on_is_a_stage() {
        let mug = |x: f64| ([x, 0.0, 0.85], [0.1, 0.1, 0.1]);
        let floor = ([0.0, 0.0, -0.05], [9.0, 9.0, 0.1]);
        let all = scene(&[floor, ([0.0, 0.0, 0.4], [2.0, 1.0, 0.8]), mug(-0.5), mug(0.0), mug(0.5)]);
        assert_eq!(all.shapes.support(&all, DVec3::Z).stages, [1, 2]);
        // Control: a tray with one of three things on it is none.
        let all = scene(&[([0.0, 0.0, 0.4], [0.3, 0.3, 0.02]), ([0.0, 0.0, 0.46], [0.1; 3]), mug(3.0), mug(5.0)]);
        assert!(all.shapes.support(&all, DVec3::Z).stages.is_empty());
        assert_eq!(all.get(1).map(|i| i.parent), Some(NO_IDENTITY));
    }
}
