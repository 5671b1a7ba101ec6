//! Shadow of a thing on a flat surface, and the brightness of the surface without it.
//!
//! A matt surface of one color shows its light minus the occluded light. The occlusion along a direction is known,
//! because it is made of Gaussians. The light along each direction is fitted to the brightness of the surrounding
//! surface ([`light`]), first from everywhere, then ever finer about the strongest directions. So the shadow of the
//! thing is distinguished from those of others, and from stains. Differences that its shadow cannot explain stay.

use glam::DVec3;
use rayon::prelude::*;

use super::light;
use super::plane::Plane;
use super::sheet::{SurfaceTexture, Texel};
use crate::math::srgb;
use crate::math::stats::quantile;

/// Directions of the first round, over the hemisphere above the surface.
const DIRECTIONS: usize = 64;
/// Least cosine to the normal: shadows of grazing light are long and faint.
const LEAST_COSINE: f64 = 0.2;
/// Rounds in which directions with much light are divided, and the share of the light that is much.
const FINER_ROUNDS: usize = 3;
const MUCH: f64 = 0.06;
/// Least number of texels of the surface.
const LEAST_TEXELS: usize = 200;
/// Least share of light that the thing blocks from a texel in its shadow.
const SHADED: f64 = 0.03;
/// Largest share of the squared differences in the shadow, beyond the usual ones beside it, that a credible shadow
/// leaves unexplained.
const EXPLAINED: f64 = 0.7;
/// Largest gain of a surface, least visible gain, and least texels of a shadow.
const MOST: f32 = 6.0;
const LEAST_GAIN: f32 = 1.03;
const LEAST_SHADED: usize = 12;
/// Brightest light of a surface: this quantile of its values as a share of the fitted ones, at most the second
/// number.
const BRIGHTEST: (f64, f64) = (0.95, 2.0);
/// Linear light that counts as black.
const DARK: f32 = 1e-4;

/// Opaque Gaussian over the surface.
pub(super) struct Occluder {
    pub(super) at: DVec3,
    pub(super) radius: f64,
    /// True if it belongs to the thing.
    pub(super) is_thing: bool,
}

/// Bits of the occluders.
const OTHERS: u8 = 1;
const THING: u8 = 2;

/// Gain of each texel of a sheet without the thing, in linear light.
pub(super) struct Brightening<'a> {
    sheet: &'a SurfaceTexture<'a>,
    gain: Vec<[f32; 3]>,
    /// Brightest linear light of the surface without the shadow: brighter texels are something else.
    bound: Vec<[f32; 3]>,
}

impl<'a> Brightening<'a> {
    /// Finds the shadow; `None` if there is none. `same` = texels of one material.
    pub(super) fn find(
        plane: &Plane,
        sheet: &'a SurfaceTexture<'a>,
        same: impl Fn(usize) -> bool,
        occluders: &[Occluder],
    ) -> Option<Self> {
        let rows: Vec<usize> = (0..sheet.state.len()).filter(|&i| sheet.state[i] == Texel::Seen && same(i)).collect();
        if rows.len() < LEAST_TEXELS || !occluders.iter().any(|o| o.is_thing) {
            return None;
        }
        let channel =
            |c: usize| -> Vec<f32> { rows.iter().map(|&i| srgb::linear(sheet.color[i][c].max(0.0))).collect() };
        let channels = [0, 1, 2].map(channel);
        let values: Vec<f32> = (0..rows.len()).map(|k| channels.iter().map(|c| c[k]).sum::<f32>() / 3.0).collect();
        let lit = LitSurface { plane, sheet, occluders, rows };
        let (about, counts) = lit.directions(&values);
        if !lit.is_explained(&about, &values, &counts) {
            return None;
        }
        let all = lit.columns(&about, THING | OTHERS);
        let found: [(Vec<f32>, Vec<f32>); 3] = channels.map(|values| {
            let weights = light::solve(&all, &values, &counts);
            let floor = 0.05 * weights[0].max(1e-6);
            let [with, without] =
                [THING | OTHERS, OTHERS].map(|which| lit.brightness(&about, &weights, which)).map(|all| {
                    let above = |v: f64| v.max(floor);
                    all.into_iter().map(above).collect::<Vec<f64>>()
                });
            let of_fit: Vec<f64> = lit.rows.iter().zip(&values).map(|(i, v)| f64::from(*v) / with[*i]).collect();
            let brightest = quantile(&of_fit, BRIGHTEST.0).clamp(1.0, BRIGHTEST.1);
            let gain = with.iter().zip(&without).map(|(w, o)| ((o / w) as f32).clamp(1.0, MOST)).collect();
            (blurred(gain, sheet.size), without.iter().map(|o| (o * brightest) as f32).collect())
        });
        let n = sheet.state.len();
        let gain = |i: usize| Some([0, 1, 2].map(|c| found[c].0[i])).filter(|g| g.iter().any(|g| *g >= LEAST_GAIN));
        let gain: Vec<[f32; 3]> = (0..n).map(|i| gain(i).unwrap_or([1.0; 3])).collect();
        let bound = (0..n).map(|i| [0, 1, 2].map(|c| found[c].1[i])).collect();
        // Fewer texels are noise.
        (gain.iter().filter(|g| **g != [1.0; 3]).count() >= LEAST_SHADED).then_some(Self { sheet, gain, bound })
    }

    /// Gain of this color at a point of the surface; 1 beyond the sheet.
    pub(super) fn at(&self, point: DVec3, rgb: [f32; 3]) -> [f32; 3] {
        let sample = |of: &[[f32; 3]]| self.sheet.sample(point, |i| of[i]);
        let (Some(gain), Some(bound)) = (sample(&self.gain), sample(&self.bound)) else { return [1.0; 3] };
        let most = |c: usize| (bound[c] / srgb::linear(rgb[c].max(0.0)).max(DARK)).max(1.0);
        [0, 1, 2].map(|c| gain[c].min(most(c)))
    }
}

/// A surface of one material, and the occluders of its light.
struct LitSurface<'a> {
    plane: &'a Plane,
    sheet: &'a SurfaceTexture<'a>,
    occluders: &'a [Occluder],
    /// Texels that the light is fitted to.
    rows: Vec<usize>,
}

impl LitSurface<'_> {
    /// Returns the directions of the light, and the weight of each row.
    fn directions(&self, values: &[f32]) -> (Vec<Shadow>, Vec<f64>) {
        let mut about = self.shadows(&hemisphere(self.plane));
        let mut spacing = (std::f64::consts::TAU * (1.0 - LEAST_COSINE) / DIRECTIONS as f64).sqrt();
        let mut counts = Vec::new();
        for round in 0..=FINER_ROUNDS {
            let (weights, rows) = light::fit(&self.columns(&about, THING | OTHERS), values);
            counts = rows;
            let weights = &weights[light::FREE..];
            let total: f64 = weights.iter().sum();
            let mut kept: Vec<(Shadow, f64)> =
                about.into_iter().zip(weights.iter().copied()).filter(|(_, w)| *w > 1e-3 * total).collect();
            kept.sort_by(|a, b| b.1.total_cmp(&a.1));
            let much = kept.iter().filter(|(_, w)| *w > MUCH * total).map(|(s, _)| s.toward);
            spacing *= 0.5;
            let finer: Vec<DVec3> =
                much.flat_map(|d| around(d, spacing)).filter(|d| d.dot(self.plane.normal) >= LEAST_COSINE).collect();
            about = kept.into_iter().map(|k| k.0).collect();
            if round < FINER_ROUNDS {
                about.extend(self.shadows(&finer));
            }
        }
        (about, counts)
    }

    fn shadows(&self, directions: &[DVec3]) -> Vec<Shadow> {
        let one = |d: &DVec3| Shadow { toward: *d, bits: blocked(self.plane, self.sheet, *d, self.occluders) };
        directions.par_iter().map(one).collect()
    }

    /// Returns the columns that compose the brightness of the rows, with the occluders `which`.
    fn columns(&self, shadows: &[Shadow], which: u8) -> Vec<Vec<f32>> {
        let rows = &self.rows;
        let base = (0..light::FREE).map(|k| rows.iter().map(|&i| base(self.sheet, i)[k] as f32).collect());
        let shade = |s: &Shadow| rows.iter().map(|&i| if s.bits[i] & which == 0 { 0.0 } else { -1.0 }).collect();
        base.chain(shadows.iter().map(shade)).collect()
    }

    /// Returns the brightness of each texel, with the occluders `which`.
    fn brightness(&self, about: &[Shadow], weights: &[f64], which: u8) -> Vec<f64> {
        let at = |i: usize| {
            let base: f64 = base(self.sheet, i).iter().zip(weights).map(|(b, w)| b * w).sum();
            let less = |(s, w): (&Shadow, &f64)| if s.bits[i] & which == 0 { 0.0 } else { *w };
            base - about.iter().zip(&weights[light::FREE..]).map(less).sum::<f64>()
        };
        (0..self.sheet.state.len()).map(at).collect()
    }

    /// Returns whether the thing's shadow explains the darker texels in it.
    fn is_explained(&self, about: &[Shadow], values: &[f32], counts: &[f64]) -> bool {
        let [all, others] = [THING | OTHERS, OTHERS].map(|which| self.columns(about, which));
        let weights = light::solve(&all, values, counts);
        let [with, without] = [THING | OTHERS, OTHERS].map(|which| self.brightness(about, &weights, which));
        let in_shadow = |k: &usize| {
            let i = self.rows[*k];
            without[i] - with[i] > SHADED * without[i].abs()
        };
        let inside: Vec<bool> = (0..self.rows.len()).map(|k| in_shadow(&k)).collect();
        // Sums the weighted squares of the rows inside the shadow, or outside of it, and their weights.
        let squares = |off: &[f64], is: bool| -> (f64, f64) {
            let of = (0..off.len()).filter(|k| inside[*k] == is);
            of.fold((0.0, 0.0), |(sum, n), k| (sum + counts[k] * off[k] * off[k], n + counts[k]))
        };
        let with = light::residuals(&all, values, &weights);
        // Grain exists in the shadow and beside it.
        let (beside, of) = squares(&with, false);
        let left = |off: &[f64]| -> f64 {
            let (sum, n) = squares(off, true);
            (sum - n * beside / of.max(1.0)).max(0.0)
        };
        let full = left(&with);
        let bare = left(&light::residuals(&others, values, &light::solve(&others, values, counts)));
        bare > 0.0 && full < EXPLAINED * bare
    }
}

/// Terms of the brightness of an evenly lit surface: a constant, and changes along the surface up to squares.
fn base(sheet: &SurfaceTexture<'_>, i: usize) -> [f64; light::FREE] {
    let part = |at: usize, length: usize| at as f64 / length.max(1) as f64 - 0.5;
    let (x, y) = (part(i % sheet.size[0], sheet.size[0]), part(i / sheet.size[0], sheet.size[1]));
    [1.0, x, y, x * x, x * y, y * y]
}

/// Occluders of the light from one direction, for each texel.
struct Shadow {
    toward: DVec3,
    bits: Vec<u8>,
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
fn hemisphere(plane: &Plane) -> Vec<DVec3> {
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
fn around(toward: DVec3, angle: f64) -> impl Iterator<Item = DVec3> {
    let (a, b) = toward.any_orthonormal_pair();
    (0..6).map(move |k| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 6.0).sin_cos();
        (toward + (a * cos + b * sin) * angle.tan()).normalize_or(toward)
    })
}

/// Averages with the neighbors along both axes: shadows have soft edges.
fn blurred(values: Vec<f32>, size: [usize; 2]) -> Vec<f32> {
    let [width, height] = size;
    let pass = |values: &[f32], stride: usize, length: usize, at: fn(usize, usize) -> usize| -> Vec<f32> {
        let one = |i: usize| {
            let at = at(i, width);
            let (a, b) = (if at > 0 { i - stride } else { i }, if at + 1 < length { i + stride } else { i });
            0.25 * values[a] + 0.5 * values[i] + 0.25 * values[b]
        };
        (0..values.len()).map(one).collect()
    };
    let along = pass(&values, 1, width, |i, w| i % w);
    pass(&along, width, height, |i, w| i / w)
}
