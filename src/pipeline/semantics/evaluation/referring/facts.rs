//! Measures of a scene's objects and parts: sizes, places as a viewer sees them, colors, contact.

use glam::DVec3;
use rayon::prelude::*;

use super::clarity::Clarity;
use super::color::TERMS;
use super::contact::{gap, stands};
use super::mesh::MeshSolid;
use super::shape::MeshShape;
use crate::math::stats::quantile;
use crate::pipeline::synth::{SynthError, TrueIdentity};
use crate::scene::Level;

/// Share of a surface's points that count as strays at either end.
const STRAYS: f64 = 0.02;

/// Viewer with upright axes: y is up.
pub(super) struct TrueView {
    eye: DVec3,
    right: DVec3,
    ahead: DVec3,
}

impl TrueView {
    /// Makes the view from `eye` along `forward`; `None` if that is vertical or not finite.
    pub(super) fn new(eye: [f64; 3], forward: [f64; 3]) -> Option<Self> {
        let (eye, forward) = (DVec3::from_array(eye), DVec3::from_array(forward).try_normalize()?);
        let level = DVec3::new(forward.x, 0.0, forward.z);
        let ahead = level.try_normalize().filter(|_| level.length() > 1e-3 && eye.is_finite())?;
        Some(Self { eye, right: ahead.cross(DVec3::Y), ahead })
    }

    fn readings(&self, p: DVec3) -> [f64; 5] {
        let d = p - self.eye;
        let (right, ahead) = (d.dot(self.right), d.dot(self.ahead));
        [right, right.atan2(ahead), ahead, right.hypot(ahead), p.y]
    }
}

/// Coordinates of a point for the viewer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ViewReading {
    /// Along the horizontal axis of the picture.
    Right,
    /// Angle from the line of sight.
    Angle,
    /// Along the horizontal line of sight.
    Ahead,
    /// Horizontal distance from the viewer.
    Distance,
    /// Height in the world.
    Up,
}

/// Reach of a thing along an axis, without strays.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshSpan {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl MeshSpan {
    pub(super) fn middle(&self) -> f64 {
        0.5 * (self.low + self.high)
    }

    pub(super) fn width(&self) -> f64 {
        self.high - self.low
    }

    /// Span along the opposite axis.
    pub(super) fn reversed(&self) -> Self {
        Self { low: -self.high, high: -self.low }
    }
}

/// All measures; things are numbered from 0 in the order of their identities, objects first.
pub(super) struct MeshFacts {
    /// Number of objects; the parts follow.
    pub(super) objects: usize,
    /// Object of each part.
    pub(super) wholes: Vec<Option<usize>>,
    pub(super) shapes: Vec<MeshShape>,
    pub(super) solids: Vec<MeshSolid>,
    view: TrueView,
    spans: Vec<[MeshSpan; 5]>,
    /// Shares of the surface that surely and perhaps have each color.
    shares: Vec<Vec<[f64; 2]>>,
    /// Distances and support among objects, row by row.
    gaps: Vec<f64>,
    stands: Vec<Clarity>,
    /// True where an object carries another, directly or through others.
    rests: Vec<bool>,
}

impl MeshFacts {
    pub(super) fn of(list: &[TrueIdentity], solids: Vec<MeshSolid>, view: TrueView) -> Result<Self, SynthError> {
        let objects = list.iter().filter(|i| i.level == Level::Object).count();
        let wholes = list.iter().map(|i| i.parent.map(|p| usize::from(p) - 1)).collect();
        let shapes: Option<Vec<MeshShape>> = solids.iter().map(|s| MeshShape::of(&s.corners)).collect();
        let shapes = shapes.ok_or(SynthError::Empty)?;
        let spans = solids.par_iter().map(|s| spans(&s.points, &view)).collect();
        let shares = solids.par_iter().map(|s| TERMS.iter().map(|t| t.shares(&s.colors)).collect()).collect();
        let pairs = 0..objects * objects;
        let apart = |k: usize| {
            let (a, b) = (k / objects, k % objects);
            if a >= b { 0.0 } else { gap(&solids[a], &solids[b], shapes[a].longest().min(shapes[b].longest())) }
        };
        let half: Vec<f64> = pairs.clone().into_par_iter().map(apart).collect();
        let gaps = pairs.clone().map(|k| half[k].max(half[k % objects * objects + k / objects])).collect();
        let on = |k: usize| {
            let (a, b) = (k / objects, k % objects);
            if a == b { Clarity::No } else { stands(&solids[a], &shapes[a], &solids[b]) }
        };
        let stands: Vec<Clarity> = pairs.into_par_iter().map(on).collect();
        let mut rests: Vec<bool> = stands.iter().map(|s| *s == Clarity::Yes).collect();
        for via in 0..objects {
            for a in 0..objects {
                for b in 0..objects {
                    rests[a * objects + b] |= rests[a * objects + via] && rests[via * objects + b];
                }
            }
        }
        Ok(Self { objects, wholes, shapes, solids, view, spans, shares, gaps, stands, rests })
    }

    /// Reach of a thing along an axis of the view.
    pub(super) fn span(&self, thing: usize, reading: ViewReading) -> MeshSpan {
        self.spans[thing][reading as usize]
    }

    /// Shares of a surface that surely and perhaps have a color, by its index.
    pub(super) fn share(&self, thing: usize, term: usize) -> [f64; 2] {
        self.shares[thing][term]
    }

    /// Smallest distance between the surfaces of two objects; `None` for parts.
    pub(super) fn gap(&self, a: usize, b: usize) -> Option<f64> {
        self.pair(a, b).map(|k| self.gaps[k])
    }

    /// Answers whether an object stands directly on another.
    pub(super) fn stands(&self, a: usize, b: usize) -> Clarity {
        self.pair(a, b).map_or(Clarity::Unclear, |k| self.stands[k])
    }

    /// Returns whether an object rests on another, directly or through others.
    pub(super) fn rests(&self, a: usize, b: usize) -> bool {
        self.pair(a, b).is_some_and(|k| self.rests[k])
    }

    /// Objects that carry at least half of the others, directly or not: tables, floors.
    pub(super) fn carriers(&self) -> Vec<bool> {
        let carried = |b: usize| (0..self.objects).filter(|&a| a != b && self.rests(a, b)).count();
        let carries = |b: usize| b < self.objects && carried(b) > 0 && 2 * carried(b) >= self.objects - 1;
        (0..self.shapes.len()).map(carries).collect()
    }

    /// Distance of a thing's middle from the viewer.
    pub(super) fn distance_to_eye(&self, thing: usize) -> f64 {
        self.shapes[thing].bounds.center().distance(self.view.eye)
    }

    /// Distance between the middles of two things.
    pub(super) fn between_middles(&self, a: usize, b: usize) -> f64 {
        self.shapes[a].bounds.center().distance(self.shapes[b].bounds.center())
    }

    fn pair(&self, a: usize, b: usize) -> Option<usize> {
        (a < self.objects && b < self.objects).then(|| a * self.objects + b)
    }
}

fn spans(points: &[DVec3], view: &TrueView) -> [MeshSpan; 5] {
    let all: Vec<[f64; 5]> = points.iter().map(|p| view.readings(*p)).collect();
    [0, 1, 2, 3, 4].map(|axis| {
        let values: Vec<f64> = all.iter().map(|r| r[axis]).collect();
        MeshSpan { low: quantile(&values, STRAYS), high: quantile(&values, 1.0 - STRAYS) }
    })
}
