//! Shadows of Gaussians on a surface along each direction of the light.

use glam::DVec3;
use rayon::prelude::*;

use super::plane::Plane;
use super::sheet::SurfaceTexture;

/// Directions over the hemisphere above the surface.
const DIRECTIONS: usize = 64;
/// Least cosine to the normal: shadows of grazing light are long and faint.
pub(super) const LEAST_COSINE: f64 = 0.2;

/// Opaque Gaussian over the surface.
pub(super) struct Occluder {
    pub(super) at: DVec3,
    pub(super) radius: f64,
    /// True if it belongs to the thing.
    pub(super) is_thing: bool,
}

/// Bits of the occluders.
pub(super) const OTHERS: u8 = 1;
pub(super) const THING: u8 = 2;

/// Occluders of the light from one direction, for each texel.
pub(super) struct Shadow {
    pub(super) toward: DVec3,
    pub(super) bits: Vec<u8>,
}

impl Shadow {
    /// Projects the occluders along each direction onto the surface.
    pub(super) fn all(
        plane: &Plane,
        sheet: &SurfaceTexture<'_>,
        directions: &[DVec3],
        occluders: &[Occluder],
    ) -> Vec<Self> {
        let one = |d: &DVec3| Self { toward: *d, bits: blocked(plane, sheet, *d, occluders) };
        directions.par_iter().map(one).collect()
    }
}

/// Returns the shares of the light of an even sky that others and the thing alone block at each texel.
pub(super) fn blocked_sky(plane: &Plane, shadows: &[Shadow], texels: usize) -> Vec<[f32; 2]> {
    let total: f64 = shadows.iter().map(|s| s.toward.dot(plane.normal)).sum();
    let mut sky = vec![[0.0; 2]; texels];
    for shadow in shadows {
        let share = (shadow.toward.dot(plane.normal) / total) as f32;
        for (sky, bits) in sky.iter_mut().zip(&shadow.bits).filter(|(_, bits)| **bits != 0) {
            sky[usize::from(bits & OTHERS == 0)] += share;
        }
    }
    sky
}

fn blocked(plane: &Plane, sheet: &SurfaceTexture<'_>, toward: DVec3, occluders: &[Occluder]) -> Vec<u8> {
    let mut bits = vec![0; sheet.state.len()];
    let [width, height] = sheet.size.map(|s| s as f64);
    for o in occluders {
        let foot = o.at - toward * (plane.height(o.at) / toward.dot(plane.normal));
        let [x, y] = sheet.place(foot);
        let reach = o.radius / sheet.step;
        if !(x > -reach && y > -reach && x < width + reach && y < height + reach) {
            continue;
        }
        let bit = if o.is_thing { THING } else { OTHERS };
        let ends = |at: f64, most: f64| {
            let first = (at - reach - 0.5).ceil().clamp(0.0, most) as usize;
            (first, (at + reach - 0.5).floor().clamp(-1.0, most - 1.0) as i64)
        };
        let ((x0, x1), (y0, y1)) = (ends(x, width), ends(y, height));
        for ty in y0 as i64..=y1 {
            for tx in x0 as i64..=x1 {
                let (dx, dy) = (tx as f64 + 0.5 - x, ty as f64 + 0.5 - y);
                if dx * dx + dy * dy <= reach * reach {
                    bits[ty as usize * sheet.size[0] + tx as usize] |= bit;
                }
            }
        }
        // An occluder smaller than a texel still lies in one.
        if (0.0..width).contains(&x) && (0.0..height).contains(&y) {
            bits[y as usize * sheet.size[0] + x as usize] |= bit;
        }
    }
    bits
}

/// Returns directions spread evenly over the hemisphere above the surface.
pub(super) fn hemisphere(plane: &Plane) -> Vec<DVec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let one = |k: usize| {
        let z = 1.0 - (1.0 - LEAST_COSINE) * (k as f64 + 0.5) / DIRECTIONS as f64;
        let (sin, cos) = (golden * k as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        plane.u * (r * cos) + plane.v * (r * sin) + plane.normal * z
    };
    (0..DIRECTIONS).map(one).collect()
}

/// Returns six directions at an angle about one.
pub(super) fn around(toward: DVec3, angle: f64) -> impl Iterator<Item = DVec3> {
    let (a, b) = toward.any_orthonormal_pair();
    (0..6).map(move |k| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 6.0).sin_cos();
        (toward + (a * cos + b * sin) * angle.tan()).normalize_or(toward)
    })
}
