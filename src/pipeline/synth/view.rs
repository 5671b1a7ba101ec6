//! Rendering of one photo: colors, depth and ids.

use glam::{DVec2, Vec3A};
use rayon::prelude::*;

use super::levels::NodeIds;
use super::light::{Light, Lit, highlight};
use super::material::Materials;
use super::options::SynthOptions;
use super::surface::Surface;
use super::trace::{SurfaceHit, Tracer};
use crate::math::srgb;
use crate::scene::Camera;

/// Most surfaces along one sample ray.
const MAX_LAYERS: usize = 16;
/// Transmittance below which a sample ray stops.
const MIN_TRANSMITTANCE: f32 = 1.0 / 512.0;
/// Largest difference of a pixel's samples, in linear light, that needs no further samples.
const MAX_DIFFERENCE: f32 = 0.02;

/// A rendered photo; all lists are row-major.
pub(crate) struct SynthView {
    /// sRGB.
    pub(crate) rgb: Vec<[u8; 3]>,
    /// Depth along the camera's axis at the pixel's center, scene units; 0 = none.
    pub(crate) depth: Vec<f32>,
    /// Object at the pixel's center; 0 = none.
    pub(crate) object: Vec<u16>,
    /// Part at the pixel's center; 0 = none.
    pub(crate) part: Vec<u16>,
}

/// Scene that is ready for rendering.
pub struct SynthScene {
    pub(crate) surface: Surface,
    pub(crate) tracer: Tracer,
    /// Visible surfaces, if fewer than those that cast shadows.
    pub(crate) seen: Option<Tracer>,
    pub(crate) materials: Materials,
    pub(crate) light: Light,
}

impl SynthScene {
    /// Renders the scene from `camera`; `view` is the photo's number and seeds its random numbers.
    pub(crate) fn render(&self, camera: &Camera, view: usize, options: &SynthOptions) -> SynthView {
        let (w, h) = (camera.width_px as usize, camera.height_px as usize);
        let rows: Vec<Vec<Pixel>> =
            (0..h).into_par_iter().map(|y| (0..w).map(|x| self.pixel(camera, x, y, view, options)).collect()).collect();
        let pixels = || rows.iter().flatten();
        SynthView {
            rgb: pixels().map(|p| p.rgb).collect(),
            depth: pixels().map(|p| p.depth).collect(),
            object: pixels().map(|p| p.object).collect(),
            part: pixels().map(|p| p.part).collect(),
        }
    }

    /// Removes an object or part. With `keep_shadows` it still shades the rest, as in a scene from which it was removed
    /// after it was photographed.
    pub(crate) fn take_away(&mut self, id: u16, keep_shadows: bool) {
        let rest = Tracer::of(&self.surface, |t| t.ids.object != id && t.ids.part != id);
        if keep_shadows {
            self.seen = Some(rest);
        } else {
            self.tracer = rest;
        }
    }

    /// Scene data for the light.
    pub(crate) fn lit(&self) -> Lit<'_> {
        Lit { surface: &self.surface, tracer: &self.tracer, materials: &self.materials }
    }

    /// Renders a pixel: ids and depth at its center; color as the mean of `samples` x `samples` stratified samples, or
    /// of five if those are alike.
    fn pixel(&self, camera: &Camera, x: usize, y: usize, view: usize, options: &SynthOptions) -> Pixel {
        let origin = self.surface.local(camera.center);
        let (px, py) = (x as f64, y as f64);
        let along = |dx: f64, dy: f64| camera.ray(DVec2::new(px + dx, py + dy)).as_vec3a();
        let n = options.samples;
        // Tangent of the angle between two samples.
        let step = 1.0 / (camera.focal_px.y as f32 * n as f32);
        let background = Vec3A::from_array(options.background.map(|c| srgb::linear(f32::from(c) / 255.0)));
        let look = |dx: f64, dy: f64| self.sample(origin, along(dx, dy), step, background, options.specular);
        let stratum = |i: u32| {
            let [jx, jy] = jitter(options.seed, view, y * camera.width_px as usize + x, i);
            look((f64::from(i % n) + jx) / f64::from(n), (f64::from(i / n) + jy) / f64::from(n))
        };
        let center = look(0.5, 0.5);
        let mean = if n <= 2 {
            (0..n * n).map(|i| stratum(i).color).sum::<Vec3A>() / (n * n) as f32
        } else {
            let corners = [0, n - 1, n * (n - 1), n * n - 1];
            let first = corners.map(stratum);
            let sum: Vec3A = first.iter().map(|s| s.color).sum();
            if first.iter().all(|s| s.is_like(&center)) {
                (sum + center.color) / 5.0
            } else {
                let others = (0..n * n).filter(|i| !corners.contains(i));
                (sum + others.map(|i| stratum(i).color).sum::<Vec3A>()) / (n * n) as f32
            }
        };
        let rgb = [srgb::byte(mean.x), srgb::byte(mean.y), srgb::byte(mean.z)];
        Pixel { rgb, depth: center.depth, object: center.ids.object, part: center.ids.part }
    }

    /// Traces a ray of unit depth: linear light through transparent surfaces, up to the first opaque one.
    fn sample(&self, origin: Vec3A, direction: Vec3A, step: f32, background: Vec3A, specular: f32) -> Sample {
        let (mut out, mut left, mut t_min) = (Sample::default(), 1.0_f32, 0.0_f32);
        for _ in 0..MAX_LAYERS {
            let tracer = self.seen.as_ref().unwrap_or(&self.tracer);
            let Some(hit) = tracer.nearest(origin, direction, t_min) else { break };
            let (color, alpha) = self.shade(&hit, direction, step, specular);
            out.color += color * (alpha * left);
            left *= 1.0 - alpha;
            if alpha >= 0.5 && out.depth == 0.0 {
                let triangle = &self.surface.triangles[hit.triangle];
                // The direction has unit depth, so its multiple is the depth.
                out.depth = (f64::from(hit.t) * self.surface.unit) as f32;
                (out.ids, out.material) = (triangle.ids, triangle.material);
            }
            if left < MIN_TRANSMITTANCE {
                left = 0.0;
                break;
            }
            t_min = behind(hit.t);
        }
        out.color = (out.color + background * left).clamp(Vec3A::ZERO, Vec3A::ONE);
        out
    }

    /// Color and coverage of a point.
    fn shade(&self, hit: &SurfaceHit, direction: Vec3A, step: f32, specular: f32) -> (Vec3A, f32) {
        let triangle = &self.surface.triangles[hit.triangle];
        let material = self.materials.get(triangle.material);
        let look = self.materials.look(&self.surface, triangle, hit.weights, hit.t * step);
        if material.unlit || look.alpha <= 0.0 {
            return (look.albedo, look.alpha);
        }
        let corners = triangle.vertices.map(|v| &self.surface.vertices[v as usize]);
        let [a, b, c] = corners.map(|v| v.position);
        let smooth = super::surface::blend(corners.map(|v| v.normal), hit.weights).normalize_or_zero();
        let flat = (b - a).cross(c - a);
        // The triangle decides which face is visible, not its interpolated normal, which may already point away at an
        // outline.
        let outward = if flat.dot(smooth) < 0.0 { -flat } else { flat };
        let front = outward.dot(direction) <= 0.0;
        let (diffuse, key) = self.light.at(self.lit(), triangle, hit.weights, front);
        let mut color = look.albedo * diffuse + look.emission;
        if specular > 0.0 && key > 0.0 {
            let normal = if front { smooth } else { -smooth };
            let reflectance = Vec3A::splat(0.04).lerp(look.albedo, material.metallic.clamp(0.0, 1.0));
            let to_eye = -direction.normalize_or_zero();
            color += highlight(normal, to_eye, material.roughness, reflectance) * (key * specular);
        }
        (color, look.alpha)
    }
}

#[derive(Clone, Copy, Default)]
struct Sample {
    /// Linear, 0 to 1.
    color: Vec3A,
    /// Scene units, 0 = none.
    depth: f32,
    ids: NodeIds,
    material: u32,
}

impl Sample {
    /// Returns whether two samples of a pixel lie on the same smooth piece of surface.
    fn is_like(&self, other: &Self) -> bool {
        let same = self.ids == other.ids && self.material == other.material;
        let differs = (self.color - other.color).abs().max_element() > MAX_DIFFERENCE;
        same && !differs && (self.depth - other.depth).abs() <= 0.02 * self.depth
    }
}

#[derive(Clone, Copy, Default)]
struct Pixel {
    rgb: [u8; 3],
    depth: f32,
    object: u16,
    part: u16,
}

/// Start of a ray that continues behind a surface at `t`.
fn behind(t: f32) -> f32 {
    t * (1.0 + 4.0 * f32::EPSILON) + 1e-6
}

/// Two numbers in 0..1 for one sample of one pixel of one view.
fn jitter(seed: u64, view: usize, pixel: usize, sample: u32) -> [f64; 2] {
    let mut h = mix(seed ^ mix(view as u64 ^ mix((pixel as u64) << 8 | u64::from(sample))));
    let first = h >> 11;
    h = mix(h);
    [first, h >> 11].map(|v| v as f64 / (1_u64 << 53) as f64)
}

/// SplitMix64's finalizer: every bit of the input reaches every bit of the output.
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
