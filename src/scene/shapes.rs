//! Shape of each identity as far as questions need it: some points of its surface, without strays.
//!
//! All else (spans, distances, upright boxes) is computed from these points, for whatever axes a question needs.

use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::support::{Standing, Support};
use super::upright_box::{UprightBox, upright_axes};
use super::{Bounds, GaussianCloud, Identities, IdentityId, SemanticMap};

/// Number of points spread evenly over an identity's Gaussians.
const SPREAD: usize = 32;

/// Points of one identity, parts included.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SampledShape {
    /// Points spread over the surface, then the outermost ones of many directions.
    points: Vec<DVec3>,
    spread: usize,
    /// Interval along each of the [`DIRECTIONS`].
    spans: [(f64, f64); DIRECTIONS],
    pub(crate) bounds: Bounds,
}

/// Number of directions in which a shape is measured.
const DIRECTIONS: usize = 13;

impl SampledShape {
    /// Samples finite points; `None` without any. Strays are left out.
    pub(crate) fn new(points: &[DVec3]) -> Option<Self> {
        let bounds = Bounds::robust(points.iter().copied())?;
        let slack = 1e-6 * (1.0 + bounds.radius());
        let inside = |p: &&DVec3| p.cmpge(bounds.min - slack).all() && p.cmple(bounds.max + slack).all();
        let inside: Vec<DVec3> = points.iter().filter(inside).copied().collect();
        let kept = if inside.is_empty() { vec![bounds.center()] } else { inside };
        let every = kept.len().div_ceil(SPREAD).max(1);
        let mut points: Vec<DVec3> = kept.iter().step_by(every).copied().collect();
        let spread = points.len();
        for axis in directions() {
            let along = |a: &&DVec3, b: &&DVec3| a.dot(axis).total_cmp(&b.dot(axis));
            points.extend(kept.iter().min_by(along).into_iter().chain(kept.iter().max_by(along)).copied());
        }
        Some(Self::measured(points, spread, bounds))
    }

    fn measured(points: Vec<DVec3>, spread: usize, bounds: Bounds) -> Self {
        let mut shape = Self { points, spread, spans: [(0.0, 0.0); DIRECTIONS], bounds };
        shape.spans = directions().map(|axis| shape.span(axis));
        shape
    }

    /// Takes over the points of a piece that are farther out.
    fn add(&mut self, piece: &Self) {
        for (k, axis) in directions().into_iter().enumerate() {
            for (at, sign) in [(2 * k, -1.0), (2 * k + 1, 1.0)] {
                let (own, other) = (self.points.get(self.spread + at), piece.points.get(piece.spread + at));
                if let (Some(own), Some(other)) = (own, other)
                    && sign * other.dot(axis) > sign * own.dot(axis)
                {
                    self.points[self.spread + at] = *other;
                }
            }
        }
        let (a, b) = (&mut self.bounds, &piece.bounds);
        (a.min, a.max) = (a.min.min(b.min), a.max.max(b.max));
        self.spans = directions().map(|axis| self.span(axis));
    }

    /// Samples a box.
    fn of_box(bounds: Bounds) -> Self {
        let steps = |i: usize| DVec3::new((i % 4) as f64, (i / 4 % 4) as f64, (i / 16) as f64) / 3.0;
        let mut points: Vec<DVec3> = (0..64).map(|i| bounds.min + bounds.size() * steps(i)).collect();
        let spread = points.len();
        points.extend([bounds.min, bounds.max]);
        Self::measured(points, spread, bounds)
    }

    /// Points spread over the surface.
    pub(crate) fn spread(&self) -> &[DVec3] {
        &self.points[..self.spread]
    }

    /// All points, the outermost ones included.
    pub(crate) fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// Interval along a unit axis.
    pub(crate) fn span(&self, axis: DVec3) -> (f64, f64) {
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        self.points.iter().map(|p| p.dot(axis)).fold(ends, |(low, high), x| (low.min(x), high.max(x)))
    }

    /// Middle of the points.
    pub(crate) fn center(&self) -> DVec3 {
        self.bounds.center()
    }

    /// Lower bound of the distance to another shape: the widest gap along any of many directions. 0 if they touch.
    pub(crate) fn gap(&self, other: &Self) -> f64 {
        let boxes = (self.bounds.min - other.bounds.max).max(other.bounds.min - self.bounds.max);
        let along = self.spans.iter().zip(&other.spans).map(|(a, b)| (a.0 - b.1).max(b.0 - a.1));
        let apart = along.fold(f64::NEG_INFINITY, f64::max);
        apart.max(boxes.max(DVec3::ZERO).length()).max(0.0)
    }
}

/// Thirteen directions: axes, diagonals of faces and of the cube.
fn directions() -> [DVec3; DIRECTIONS] {
    const ALL: [[i8; 3]; DIRECTIONS] = [
        [1, 0, 0],
        [0, 1, 0],
        [0, 0, 1],
        [1, 1, 0],
        [1, -1, 0],
        [1, 0, 1],
        [1, 0, -1],
        [0, 1, 1],
        [0, 1, -1],
        [1, 1, 1],
        [1, 1, -1],
        [1, -1, 1],
        [-1, 1, 1],
    ];
    ALL.map(|d| DVec3::from(d.map(f64::from)).normalize_or_zero())
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
    /// Fits the upright box with the smallest footprint. It depends on the points and the up direction alone, never
    /// on a view.
    pub(crate) fn new(points: &[DVec3], up: DVec3) -> Option<Self> {
        let [length, width, height] = UprightBox::fit(points, up)?.size();
        Some(Self { length, width, height })
    }

    /// Product of the edges; of a flat thing, nearly its area.
    pub(crate) fn volume(&self) -> f64 {
        let least = 1e-3 * self.length.max(self.height).max(1e-9);
        [self.length, self.width, self.height].map(|edge| edge.max(least)).iter().product()
    }
}

/// Shape relative to an origin, as a page carries it: Gaussians have 32-bit positions, so nothing is lost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct NearShape {
    points: Vec<Vec3>,
    spread: usize,
    /// Lowest and highest corner.
    bounds: [Vec3; 2],
}

impl From<NearShape> for SampledShape {
    /// The origin is that of the world.
    fn from(near: NearShape) -> Self {
        let points: Vec<DVec3> = near.points.iter().map(|p| p.as_dvec3()).collect();
        let [min, max] = near.bounds.map(|v| v.as_dvec3());
        let spread = near.spread.min(points.len());
        Self::measured(points, spread, Bounds { min, max })
    }
}

/// Shapes of all identities, by number; empty until computed.
#[derive(Clone, Debug, Default)]
pub(crate) struct SeenShapes {
    all: Arc<[Option<SampledShape>]>,
    /// Upright boxes for the up direction that was asked for first.
    extents: Arc<OnceLock<(DVec3, Vec<Option<Extent>>)>>,
    /// Supports for the up direction that was asked for first.
    support: Arc<OnceLock<(DVec3, Arc<Support>)>>,
}

impl PartialEq for SeenShapes {
    /// Always equal: shapes follow from the Gaussians.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl FromIterator<Option<SampledShape>> for SeenShapes {
    /// By number from 0.
    fn from_iter<T: IntoIterator<Item = Option<SampledShape>>>(shapes: T) -> Self {
        Self { all: shapes.into_iter().collect(), ..Self::default() }
    }
}

impl SeenShapes {
    /// Shapes of the identities of a cloud.
    pub(crate) fn of(cloud: &GaussianCloud, map: &SemanticMap) -> Self {
        let mut places: Vec<Vec<DVec3>> = vec![Vec::new(); map.identities.len() + 1];
        for (i, &id) in map.identity_of.iter().enumerate().take(cloud.len()) {
            let at = cloud.world_position(i);
            if at.is_finite() {
                map.identities.ancestors(id).for_each(|id| places[id as usize].push(at));
            }
        }
        let mut all: Vec<_> = places.par_iter().map(|points| SampledShape::new(points)).collect();
        // The thin legs of a table are no strays. Wholes have smaller numbers than their pieces.
        for id in (1..all.len()).rev() {
            let whole = map.identities.get(id as IdentityId).map_or(0, |i| i.parent) as usize;
            if let Some(piece) = all[id].clone().filter(|_| (1..id).contains(&whole))
                && let Some(Some(whole)) = all.get_mut(whole)
            {
                whole.add(&piece);
            }
        }
        all.into_iter().collect()
    }

    /// Shapes of boxes, by number from 0.
    pub(crate) fn of_boxes(boxes: &[Option<Bounds>]) -> Self {
        boxes.iter().map(|b| b.map(SampledShape::of_box)).collect()
    }

    /// Shapes relative to an origin, by number from 0.
    pub(crate) fn near(&self, origin: DVec3) -> Vec<Option<NearShape>> {
        let near = |p: DVec3| (p - origin).as_vec3();
        let shape = |s: &SampledShape| NearShape {
            points: s.points.iter().map(|p| near(*p)).collect(),
            spread: s.spread,
            bounds: [near(s.bounds.min), near(s.bounds.max)],
        };
        self.all.iter().map(|s| s.as_ref().map(shape)).collect()
    }

    /// Returns whether shapes were computed.
    pub(crate) fn are_known(&self) -> bool {
        !self.all.is_empty()
    }

    /// Shape of an identity, if it has Gaussians.
    pub(crate) fn get(&self, id: IdentityId) -> Option<&SampledShape> {
        self.all.get(id as usize)?.as_ref()
    }

    /// Upright box of an identity.
    pub(crate) fn extent(&self, id: IdentityId, up: DVec3) -> Option<Extent> {
        let fit = |shape: &Option<SampledShape>| Extent::new(shape.as_ref()?.points(), up);
        let (known_up, known) = self.extents.get_or_init(|| (up, self.all.par_iter().map(fit).collect()));
        if *known_up == up { *known.get(id as usize)? } else { fit(self.all.get(id as usize)?) }
    }

    /// Finds what carries what, for identities with these shapes.
    pub(crate) fn support(&self, identities: &Identities, up: DVec3) -> Arc<Support> {
        let find = || {
            let axes = upright_axes(up).unwrap_or([DVec3::X, DVec3::Y, DVec3::Z]);
            let place = |s: &SampledShape| Standing::of(s.spread(), axes.map(|axis| s.span(axis)), &axes);
            let standing: Vec<Option<Standing>> = self.all.iter().map(|s| s.as_ref().map(place)).collect();
            Arc::new(Support::of(&standing, identities))
        };
        let (known_up, known) = self.support.get_or_init(|| (up, find()));
        if *known_up == up { Arc::clone(known) } else { find() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(size: DVec3) -> Vec<DVec3> {
        let steps = (0..21).flat_map(|x| (0..11).flat_map(move |y| (0..6).map(move |z| (x, y, z))));
        steps.map(|(x, y, z)| DVec3::new(f64::from(x) / 20.0, f64::from(y) / 10.0, f64::from(z) / 5.0) * size).collect()
    }

    #[test]
    fn a_things_size_is_its_own_however_it_is_turned() {
        let points = grid(DVec3::new(2.0, 1.0, 0.5));
        for degrees in [0.0_f64, 9.0, 33.0, 81.0, 120.0] {
            let turn = glam::DQuat::from_axis_angle(DVec3::Z, degrees.to_radians());
            let turned: Vec<DVec3> = points.iter().map(|p| turn * *p + DVec3::splat(3.0)).collect();
            let shape = SampledShape::new(&turned).expect("a shape");
            let extent = Extent::new(shape.points(), DVec3::Z).expect("an extent");
            let edges = [extent.length, extent.width, extent.height];
            assert!(edges.iter().zip([2.0, 1.0, 0.5]).all(|(a, b)| (a - b).abs() < 0.25), "{degrees}: {edges:?}");
            // Control: a box along the world axes is larger.
            let larger = Bounds::of(turned).expect("a box").size();
            assert!(degrees % 90.0 < 5.0 || larger.x * larger.y > 1.2 * extent.length * extent.width, "{degrees}");
        }
        assert!(Extent::new(&[], DVec3::Z).is_none() && SampledShape::new(&[DVec3::NAN]).is_none());
    }

    #[test]
    fn gaps_are_seen_across_corners_and_strays_do_not_count() {
        let mut points = grid(DVec3::ONE);
        points.push(DVec3::splat(1e6));
        let cube = SampledShape::new(&points).expect("a shape");
        let moved = |by: DVec3| SampledShape::new(&grid(DVec3::ONE).iter().map(|p| *p + by).collect::<Vec<_>>());
        let gap = |by: DVec3| cube.gap(&moved(by).expect("a shape"));
        assert!((gap(DVec3::X * 3.0) - 2.0).abs() < 0.1, "{}", gap(DVec3::X * 3.0));
        assert!(gap(DVec3::X * 0.5) == 0.0 && gap(DVec3::new(2.0, 2.0, 0.0)) > 1.3);
        assert!(cube.bounds.max.x < 1.1 && cube.spread().len() <= SPREAD);
        let of_box = SampledShape::of_box(Bounds { min: DVec3::ZERO, max: DVec3::new(1.0, 2.0, 3.0) });
        assert_eq!((of_box.span(DVec3::Z), of_box.center().y), ((0.0, 3.0), 1.0));
    }
}
