//! Relations of things in space, each with a margin between yes and no.
//!
//! Left, right, front and behind are the viewer's, along level axes. A relation of places has two readings, along the
//! axes and in the picture (by angle or distance); it is clear where both agree.

use glam::{DVec2, DVec3};

use super::clarity::Clarity;
use super::facts::{MeshFacts, MeshSpan, ViewReading};
use crate::scene::Bounds;

/// Share of the narrower span by which spans may overlap, and share of B's span that A's middle must have passed to be
/// surely not before B.
const OVERLAP: f64 = 0.05;
const PASSED: f64 = 0.25;
/// Distances in sizes of the smaller thing: touching, apart; next to, far.
const TOUCHES: f64 = 0.01;
const APART: f64 = 0.07;
const NEXT: f64 = 0.7;
const FAR: f64 = 2.0;
/// Ratio of lengths that are surely different.
const LONGER: f64 = 1.1;

impl MeshFacts {
    pub(super) fn left(&self, a: usize, b: usize) -> Clarity {
        self.both(a, b, [ViewReading::Right, ViewReading::Angle], false)
    }

    pub(super) fn right(&self, a: usize, b: usize) -> Clarity {
        self.both(a, b, [ViewReading::Right, ViewReading::Angle], true)
    }

    pub(super) fn front(&self, a: usize, b: usize) -> Clarity {
        self.both(a, b, [ViewReading::Ahead, ViewReading::Distance], false)
    }

    pub(super) fn behind(&self, a: usize, b: usize) -> Clarity {
        self.both(a, b, [ViewReading::Ahead, ViewReading::Distance], true)
    }

    /// Answers whether `a` stands on `b` itself; unclear if something is between them.
    pub(super) fn on(&self, a: usize, b: usize) -> Clarity {
        match self.stands(a, b) {
            Clarity::No if self.rests(a, b) => Clarity::Unclear,
            direct => direct,
        }
    }

    /// Answers whether `a` is above `b`, with a gap (unless both are parts of one thing).
    pub(super) fn above(&self, a: usize, b: usize) -> Clarity {
        let [above, below] = [a, b].map(|i| &self.shapes[i].bounds);
        let [up, down] = [a, b].map(|i| self.span(i, ViewReading::Up));
        let overlaps = above.min.x < below.max.x
            && below.min.x < above.max.x
            && above.min.z < below.max.z
            && below.min.z < above.max.z;
        let higher = up.low >= down.high - 0.1 * up.width().min(down.width());
        if !overlaps || up.middle() <= down.middle() {
            return Clarity::of(false, !higher || overlaps);
        }
        let covers = |outer: &Bounds, p: DVec3| {
            (outer.min.x..outer.max.x).contains(&p.x) && (outer.min.z..outer.max.z).contains(&p.z)
        };
        let aligned = covers(below, above.center()) || covers(above, below.center());
        let is_carried = self.wholes[a].is_none() && (self.stands(a, b) != Clarity::No || self.rests(a, b));
        Clarity::of(higher && aligned && !is_carried, false)
    }

    /// Answers whether `a` is under `b`: `b` stands on it or is above it.
    pub(super) fn under(&self, a: usize, b: usize) -> Clarity {
        let above = self.above(b, a);
        if self.wholes[a].is_some() {
            return above;
        }
        match (self.on(b, a), above) {
            (Clarity::Yes, _) | (_, Clarity::Yes) => Clarity::Yes,
            (Clarity::No, Clarity::No) => Clarity::No,
            _ => Clarity::Unclear,
        }
    }

    /// Answers whether `a` is in the hollow thing `b`.
    pub(super) fn inside(&self, a: usize, b: usize) -> Clarity {
        if self.wholes[a] == Some(b) {
            return Clarity::Yes;
        }
        let (points, hollow) = (&self.solids[a].points, &self.shapes[b].bounds);
        let holds = |p: &&DVec3| p.cmpge(hollow.min).all() && p.cmple(hollow.max).all();
        let share = points.iter().filter(holds).count() as f64 / points.len().max(1) as f64;
        Clarity::of(share >= 0.9, share <= 0.05)
    }

    pub(super) fn touching(&self, a: usize, b: usize) -> Clarity {
        let Some(gap) = self.gap(a, b) else { return Clarity::Unclear };
        let size = self.smaller(a, b);
        Clarity::of(gap <= TOUCHES * size, gap >= APART * size && !self.stacked(a, b))
    }

    /// Answers whether `a` is next to `b`, not on it or below it.
    pub(super) fn beside(&self, a: usize, b: usize) -> Clarity {
        self.near(a, b, [NEXT, FAR], self.smaller(a, b))
    }

    /// Answers whether `a` is one of the things around `b`.
    pub(super) fn around(&self, a: usize, b: usize) -> Clarity {
        self.near(a, b, [0.8, FAR], self.shapes[b].longest())
    }

    /// Answers whether `a` is between `b` and `c`: its middle is in a corridor that joins their middles.
    pub(super) fn between(&self, a: usize, b: usize, c: usize) -> Clarity {
        let middle = |i: usize| {
            let p = self.shapes[i].bounds.center();
            DVec2::new(p.x, p.z)
        };
        let (from, way) = (middle(b), middle(c) - middle(b));
        let length = way.length();
        if length <= 0.0 || self.stacked(b, c) {
            return Clarity::Unclear;
        }
        let at = middle(a) - from;
        let (along, off) = (at.dot(way) / (length * length), at.perp_dot(way).abs() / length);
        let wide = 0.5 * self.shapes[b].length.max(self.shapes[c].length);
        let beside = off >= (3.0 * wide).max(0.5 * length);
        let yes = (0.15..=0.85).contains(&along) && off <= 0.5 * wide && !self.stacked(a, b) && !self.stacked(a, c);
        Clarity::of(yes, !(-0.05..=1.05).contains(&along) || beside)
    }

    pub(super) fn larger(&self, a: usize, b: usize) -> Clarity {
        let [a, b] = [a, b].map(|i| &self.shapes[i]);
        let (volume, diagonal) = (a.volume() / b.volume(), a.diagonal() / b.diagonal());
        Clarity::of(volume >= LONGER.powi(3) && diagonal >= 1.05, volume <= 0.9 && diagonal <= 0.97)
    }

    pub(super) fn taller(&self, a: usize, b: usize) -> Clarity {
        self.taller_than(a, self.shapes[b].height)
    }

    pub(super) fn longer(&self, a: usize, b: usize) -> Clarity {
        let [a, b] = [a, b].map(|i| &self.shapes[i]);
        exceeds(a.longest(), b.longest()).agree(exceeds(a.length, b.length))
    }

    pub(super) fn taller_than(&self, a: usize, length: f64) -> Clarity {
        exceeds(self.shapes[a].height, length)
    }

    pub(super) fn longer_than(&self, a: usize, length: f64) -> Clarity {
        exceeds(self.shapes[a].longest(), length).agree(exceeds(self.shapes[a].length, length))
    }

    /// Answers whether `a` is at most `distance` away from `b`, by the gap and by the middles.
    pub(super) fn within(&self, a: usize, b: usize, distance: f64) -> Clarity {
        let gap = self.gap(a, b).unwrap_or(f64::NAN);
        Clarity::of(LONGER * self.between_middles(a, b) <= distance, gap >= LONGER * distance)
    }

    /// Returns whether one of two objects may stand on the other.
    fn stacked(&self, a: usize, b: usize) -> bool {
        let on = |a, b| self.stands(a, b) != Clarity::No || self.rests(a, b);
        on(a, b) || on(b, a)
    }

    fn smaller(&self, a: usize, b: usize) -> f64 {
        self.shapes[a].longest().min(self.shapes[b].longest())
    }

    fn near(&self, a: usize, b: usize, [near, far]: [f64; 2], size: f64) -> Clarity {
        match self.gap(a, b) {
            Some(gap) if !self.stacked(a, b) => Clarity::of(gap <= near * size, gap >= far * size),
            _ => Clarity::Unclear,
        }
    }

    /// Answers whether `a` comes before `b` (after it, if `reversed`) in both readings.
    fn both(&self, a: usize, b: usize, readings: [ViewReading; 2], reversed: bool) -> Clarity {
        let [first, second] = readings.map(|reading| {
            let [a, b] = [a, b].map(|i| self.span(i, reading));
            if reversed { before(a.reversed(), b.reversed()) } else { before(a, b) }
        });
        first.agree(second)
    }
}

fn before(a: MeshSpan, b: MeshSpan) -> Clarity {
    let yes = a.high <= b.low + OVERLAP * a.width().min(b.width());
    Clarity::of(yes, !yes && a.middle() >= b.low + PASSED * b.width())
}

fn exceeds(length: f64, limit: f64) -> Clarity {
    Clarity::of(length >= LONGER * limit, LONGER * length <= limit)
}
