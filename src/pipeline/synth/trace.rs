//! Ray casting against the triangles, with a bounding volume hierarchy.

use std::time::Duration;

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::ray::{Ray, RayHit};
use obvhs::rt_triangle::RtTriangle;

use super::surface::{Surface, Triangle};

/// Margin of triangles and boxes beyond their edges, in the frame's units: more than the rounding errors of a ray
/// across the scene, far less than a pixel.
const REACH: f32 = 1e-6;
/// Largest margin as a fraction of a triangle's least height, which limits it for slivers.
const MAX_SHARE: f32 = 0.02;

#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceHit {
    /// Distance, in lengths of the ray's direction.
    pub(crate) t: f32,
    /// Index of the triangle.
    pub(crate) triangle: usize,
    /// Weights of the triangle's corners, which sum to one.
    pub(crate) weights: Vec3,
}

/// Hierarchy over a surface: binary, because the compressed wide one loses rays that are nearly parallel to an axis
/// (its box test subtracts large products).
pub(crate) struct Tracer {
    bvh: Bvh2,
    /// Triangles in the order of the hierarchy's leaves, each with [`REACH`] as a fraction of its least height.
    triangles: Vec<(RtTriangle, f32)>,
    /// Index of each in the surface.
    original: Vec<u32>,
}

impl Tracer {
    pub(crate) fn new(surface: &Surface) -> Self {
        Self::of(surface, |_| true)
    }

    /// Builds the hierarchy over the triangles for which `is_there` holds.
    pub(crate) fn of(surface: &Surface, is_there: impl Fn(&Triangle) -> bool) -> Self {
        let there: Vec<u32> =
            (0..surface.triangles.len()).filter(|&i| is_there(&surface.triangles[i])).map(|i| i as u32).collect();
        let boxes: Vec<Aabb> = there
            .iter()
            .map(|&i| surface.corners(&surface.triangles[i as usize]))
            .map(|[a, b, c]| Aabb { min: a.min(b).min(c) - REACH, max: a.max(b).max(c) + REACH })
            .collect();
        let bvh = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        let original: Vec<u32> = bvh.primitive_indices.iter().map(|&i| there[i as usize]).collect();
        let triangle = |&i: &u32| {
            let [a, b, c] = surface.corners(&surface.triangles[i as usize]);
            let triangle = RtTriangle::new(a, b, c);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            // Twice the area over the longest side is the least height.
            (triangle, (REACH * longest / triangle.ng.length()).min(MAX_SHARE))
        };
        let triangles = original.iter().map(triangle).collect();
        Self { bvh, triangles, original }
    }

    /// Finds the nearest surface from `origin` along `direction`, from `t_min` on.
    pub(crate) fn nearest(&self, origin: Vec3A, direction: Vec3A, t_min: f32) -> Option<SurfaceHit> {
        let ray = Ray::new(origin, direction, t_min, f32::INFINITY);
        let mut hit = RayHit::none();
        if !self.bvh.ray_traverse(ray, &mut hit, |ray, i| distance(&self.triangles[i], ray)) {
            return None;
        }
        let i = hit.primitive_id as usize;
        let w = self.triangles[i].0.compute_barycentric(&ray);
        let weights = Vec3::new(1.0 - w.x - w.y, w.x, w.y);
        Some(SurfaceHit { t: hit.t, triangle: self.original[i] as usize, weights })
    }

    /// Returns whether the segment from `origin` to `origin + direction` is free of surfaces, ignoring hits for which
    /// `passes` holds.
    pub(crate) fn free(&self, origin: Vec3A, direction: Vec3A, passes: impl Fn(usize, Vec3) -> bool) -> bool {
        let ray = Ray::new(origin, direction, 0.0, 1.0);
        self.bvh.ray_traverse_miss(ray, |ray, i| {
            let triangle = &self.triangles[i];
            let t = distance(triangle, ray);
            if t.is_finite() {
                let w = triangle.0.compute_barycentric(ray);
                if passes(self.original[i] as usize, Vec3::new(1.0 - w.x - w.y, w.x, w.y)) {
                    return f32::INFINITY;
                }
            }
            t
        })
    }
}

/// Distance at which a ray hits a triangle, infinity for a miss (Möller and Trumbore). Edges belong to both triangles
/// that share them, so that no ray passes between two.
fn distance((triangle, share): &(RtTriangle, f32), ray: &Ray) -> f32 {
    let c = triangle.v0 - ray.origin;
    let r = ray.direction.cross(c);
    let inverse = 1.0 / triangle.ng.dot(ray.direction);
    let (u, v) = (r.dot(triangle.e2) * inverse, r.dot(triangle.e1) * inverse);
    let t = triangle.ng.dot(c) * inverse;
    // NaN and infinity, from a ray within the triangle's plane, fail these.
    let inside = u >= -share && v >= -share && u + v <= 1.0 + share;
    if inside && t >= ray.tmin && t <= ray.tmax { t } else { f32::INFINITY }
}
