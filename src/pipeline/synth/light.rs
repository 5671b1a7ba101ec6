//! Light on the surface: a sky, a soft key light with shadows, and one bounce of light off surfaces that hide the sky.
//!
//! All but the highlights is view-independent, so it is computed once per vertex and face, when a photo first shows
//! it, and interpolated. Directions are the same for all vertices, so there is no noise between them.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{Vec3A, Vec4};

use super::material::Materials;
use super::surface::{Surface, Triangle, Vertex, blend};
use super::trace::Tracer;

/// Number of directions from which light is gathered, over the whole sphere: fewer for many vertices.
const SKY_DIRECTIONS: std::ops::RangeInclusive<usize> = 40..=96;
/// Total rays toward the sky, as far as the least number of directions allows.
const SKY_RAYS: usize = 10_000_000;
/// Points on the key light.
const KEY_POINTS: usize = 9;
/// Direction to the middle of the key light (y is up).
const KEY: Vec3A = Vec3A::new(-0.48, 0.79, 0.38);
/// Tangent of the key light's angular radius.
const KEY_SPREAD: f32 = 0.09;
/// Irradiance from the key light, over pi.
const KEY_COLOR: Vec3A = Vec3A::new(0.60, 0.56, 0.49);
/// Brightness of the sky straight up, at the horizon, and of the unseen ground.
const SKY: [Vec3A; 3] = [Vec3A::new(0.56, 0.60, 0.66), Vec3A::new(0.44, 0.45, 0.46), Vec3A::new(0.20, 0.18, 0.165)];
/// Light from a white surface that hides the sky.
const BOUNCE: f32 = 0.42;
/// Distance of ray starts above the surface, in the frame's units.
const LIFT: f32 = 2e-4;

#[derive(Clone, Copy, Debug, Default)]
struct Face {
    /// Irradiance over pi: the radiance of a white surface.
    diffuse: Vec3A,
    /// Visible fraction of the key light, 0 to 1.
    key: f32,
}

impl Face {
    /// First word of a face that is not computed yet: no color is this NaN.
    const UNKNOWN: u32 = u32::MAX;
}

/// Light on the vertices, computed on demand.
pub(crate) struct Light {
    /// Mean color of each triangle.
    albedo: Vec<Vec3A>,
    sky: Vec<Vec3A>,
    key: Vec<Vec3A>,
    /// Bits of each face: color and visibility of the key light. Computed on demand; two threads that do so at once
    /// store the same bits.
    faces: Vec<[[AtomicU32; 4]; 2]>,
}

impl Light {
    pub(crate) fn new(surface: &Surface, materials: &Materials) -> Self {
        let directions = SKY_RAYS / surface.vertices.len().max(1);
        let directions = directions.clamp(*SKY_DIRECTIONS.start(), *SKY_DIRECTIONS.end());
        let unknown = || [0; 4].map(|_: u32| AtomicU32::new(Face::UNKNOWN));
        Self {
            albedo: surface.triangles.iter().map(|t| mean_albedo(surface, materials, t)).collect(),
            sky: fibonacci_sphere(directions),
            key: key_directions(),
            faces: surface.vertices.iter().map(|_| [unknown(), unknown()]).collect(),
        }
    }

    /// Radiance of a white diffuse surface, and visible fraction of the key light, at a point of a triangle on its
    /// outer (`front`) or inner face.
    pub(crate) fn at(&self, scene: Lit<'_>, triangle: &Triangle, weights: glam::Vec3, front: bool) -> (Vec3A, f32) {
        let face = triangle.vertices.map(|v| self.face(scene, v as usize, front));
        (blend(face.map(|f| f.diffuse), weights), blend(face.map(|f| f.key), weights))
    }

    fn face(&self, scene: Lit<'_>, vertex: usize, front: bool) -> Face {
        let [x, y, z, key] = &self.faces[vertex][usize::from(!front)];
        let first = x.load(Ordering::Acquire);
        if first != Face::UNKNOWN {
            let rest = [y, z, key].map(|w| f32::from_bits(w.load(Ordering::Relaxed)));
            return Face { diffuse: Vec3A::new(f32::from_bits(first), rest[0], rest[1]), key: rest[2] };
        }
        let face = self.gather(scene, &scene.surface.vertices[vertex], front);
        // The first word is stored last: a thread that reads it also sees the others.
        y.store(face.diffuse.y.to_bits(), Ordering::Relaxed);
        z.store(face.diffuse.z.to_bits(), Ordering::Relaxed);
        key.store(face.key.to_bits(), Ordering::Relaxed);
        x.store(face.diffuse.x.to_bits(), Ordering::Release);
        face
    }

    fn gather(&self, scene: Lit<'_>, vertex: &Vertex, front: bool) -> Face {
        let Lit { surface, tracer, materials } = scene;
        let normal = if front { vertex.normal } else { -vertex.normal };
        let origin = vertex.position + normal * LIFT;
        let passes = |t: usize, w| materials.passes(surface, &surface.triangles[t], w);
        let mut face = Face::default();
        for &d in &self.sky {
            let cos = normal.dot(d);
            if cos <= 0.0 {
                continue;
            }
            let radiance = match tracer.nearest(origin, d, 0.0) {
                Some(hit) if !passes(hit.triangle, hit.weights) => self.albedo[hit.triangle] * BOUNCE,
                _ => sky_radiance(d),
            };
            face.diffuse += radiance * (cos * 4.0 / self.sky.len() as f32);
        }
        for &d in &self.key {
            let cos = normal.dot(d);
            // Four radii reach out of the scene from anywhere in it.
            if cos > 0.0 && tracer.free(origin, d * 4.0, passes) {
                face.diffuse += KEY_COLOR * (cos / KEY_POINTS as f32);
                face.key += 1.0 / KEY_POINTS as f32;
            }
        }
        face
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Lit<'a> {
    pub(crate) surface: &'a Surface,
    pub(crate) tracer: &'a Tracer,
    pub(crate) materials: &'a Materials,
}

/// Highlight of the key light: normal, direction toward the eye, roughness, reflectance at normal
/// incidence. Normalized Blinn-Phong.
pub(crate) fn highlight(normal: Vec3A, to_eye: Vec3A, roughness: f32, reflectance: Vec3A) -> Vec3A {
    let toward = KEY.normalize_or_zero();
    let half = (toward + to_eye).normalize_or_zero();
    let (n_h, n_l) = (normal.dot(half).max(0.0), normal.dot(toward).max(0.0));
    let alpha = roughness.clamp(0.25, 1.0).powi(2);
    let exponent = 2.0 / (alpha * alpha) - 2.0;
    KEY_COLOR * reflectance * (n_l * (exponent + 2.0) / 8.0 * n_h.powf(exponent))
}

fn sky_radiance(d: Vec3A) -> Vec3A {
    let [up, horizon, down] = SKY;
    if d.y >= 0.0 { horizon.lerp(up, d.y) } else { horizon.lerp(down, (-4.0 * d.y).min(1.0)) }
}

fn mean_albedo(surface: &Surface, materials: &Materials, t: &Triangle) -> Vec3A {
    let tint: Vec4 = surface.vertices[t.vertices[0] as usize].color;
    Vec3A::from_vec4(materials.mean(t.material as usize) * tint).clamp(Vec3A::ZERO, Vec3A::ONE)
}

/// Directions spread evenly over the sphere.
pub(crate) fn fibonacci_sphere(n: usize) -> Vec<Vec3A> {
    let golden = std::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    (0..n)
        .map(|i| {
            let y = 1.0 - (2.0 * i as f32 + 1.0) / n as f32;
            let r = (1.0 - y * y).max(0.0).sqrt();
            let a = golden * i as f32;
            Vec3A::new(r * a.cos(), y, r * a.sin())
        })
        .collect()
}

/// Unit directions toward points on the key light's disc.
fn key_directions() -> Vec<Vec3A> {
    let axis = KEY.normalize_or_zero();
    let side = axis.any_orthonormal_vector();
    let other = axis.cross(side);
    let golden = std::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    (0..KEY_POINTS)
        .map(|i| {
            let r = ((i as f32 + 0.5) / KEY_POINTS as f32).sqrt() * KEY_SPREAD;
            let a = golden * i as f32;
            (axis + side * (r * a.cos()) + other * (r * a.sin())).normalize_or_zero()
        })
        .collect()
}
