//! Shadow of a thing on a flat surface, and the brightness of the surface without it.
//!
//! A matt surface of one color shows its light minus the occluded light. The occlusion along a direction is known,
//! because it is made of Gaussians. An even sky and lights along single directions are fitted to the brightness of the
//! surface ([`light`]), first from everywhere, then ever finer about the strongest directions. Everything around the
//! thing stands in the same light, so grain and stains, which look like some of the shadows, do not look like all of
//! them; a light whose shadows could be grain does not count. The strength of the thing's own shadow is fitted beside
//! it ([`LitChannel`]): light that it reflects makes it weaker.

use glam::{DMat2, DVec2, DVec3};

use super::light;
use super::occlusion::{LEAST_COSINE, OTHERS, Occluder, Shadow, THING, around, blocked_sky, hemisphere};
use super::plane::Plane;
use super::sheet::{SurfaceTexture, Texel};
use crate::math::srgb;
use crate::math::stats::quantile;

/// Rounds in which directions with much light are divided, and the share of the light that is much.
const FINER_ROUNDS: usize = 3;
const MUCH: f64 = 0.06;
/// Least number of texels of the surface.
const LEAST_TEXELS: usize = 200;
/// Most texels that the light is fitted to.
const MOST_TEXELS: usize = 12_000;
/// Least share of light that the thing blocks from a texel in its shadow.
const SHADED: f64 = 0.03;
/// Least difference that a shadow makes, root mean square, as a share of the brightness.
const LEAST_SHADE: f64 = 0.02;
/// Least number of texels in it, without outliers.
const LEAST_INSIDE: f64 = 40.0;
/// Largest share of the squared differences that credible shadows leave unexplained: in the thing's shadow, beyond the
/// usual ones beside it; or of all things, everywhere.
const EXPLAINED: (f64, f64) = (0.7, 0.85);
/// Least share of light that is left in a shadow.
const LEAST_LIGHT: f64 = 0.05;
/// Expected deviation of a shadow's strength from 1, and neighboring texels that differ together, as grain does.
const DEVIATION: f64 = 0.3;
const TOGETHER: f64 = 20.0;
/// Deviations of a sum of such texels by which the shadows of a light must differ from grain.
const SURE: f64 = 2.0;
/// Strengths of a shadow from single lights and from the sky. A bright thing may reflect more light than it blocks.
const STRENGTHS: [(f64, f64); 2] = [(0.0, 2.0), (-0.5, 2.0)];
/// Rounds of fitting the brightness of the surface and the strengths in turn.
const STRENGTH_ROUNDS: usize = 4;
/// Gains of a surface, least visible difference of a gain from 1, and least texels of a shadow.
const GAINS: (f32, f32) = (0.7, 6.0);
const LEAST_GAIN: f32 = 0.03;
const LEAST_SHADED: usize = 12;
/// Brightest light of a surface: this quantile of its values as a share of the fitted ones, at most the second
/// number.
const BRIGHTEST: (f64, f64) = (0.95, 2.0);
/// Linear light that counts as black.
const DARK: f32 = 1e-4;

/// Gain of each texel of a sheet without the thing, in linear light.
pub(super) struct Brightening<'a> {
    sheet: &'a SurfaceTexture<'a>,
    gain: Vec<[f32; 3]>,
    /// Brightest linear light of the surface without the shadow: brighter texels are something else.
    bound: Vec<[f32; 3]>,
}

impl<'a> Brightening<'a> {
    /// Finds the shadow; `None` if there is none. `same` = texels of one material; `near` = those beside the thing.
    pub(super) fn find(
        plane: &Plane,
        sheet: &'a SurfaceTexture<'a>,
        same: impl Fn(usize) -> bool,
        near: impl Fn(usize) -> bool,
        occluders: &[Occluder],
    ) -> Option<Self> {
        let all: Vec<usize> = (0..sheet.state.len()).filter(|&i| sheet.state[i] == Texel::Seen && same(i)).collect();
        let beside: Vec<usize> = all.iter().copied().filter(|i| near(*i)).collect();
        if beside.len() < LEAST_TEXELS || !occluders.iter().any(|o| o.is_thing) {
            return None;
        }
        let part = MOST_TEXELS as f64 / all.len() as f64;
        let rows = all.into_iter().filter(|i| scattered(*i) < part).collect();
        let everywhere = Shadow::all(plane, sheet, &hemisphere(plane), occluders);
        let sky = blocked_sky(plane, &everywhere, sheet.state.len());
        let lit = LitSurface { plane, sheet, occluders, rows, sky };
        let channels = [0, 1, 2].map(|c| sheet.linear(&lit.rows, c));
        let values: Vec<f32> = (0..lit.rows.len()).map(|k| channels.iter().map(|c| c[k]).sum::<f32>() / 3.0).collect();
        let (about, counts) = lit.directions(everywhere, &values);
        let columns = lit.columns(&about, THING | OTHERS);
        let mean = light::solve(&columns, &values, &counts, 0.0);
        if !lit.is_explained(&about, &values, (&columns, &mean), &counts) {
            return None;
        }
        let found = [0, 1, 2].map(|c| {
            let blocked = lit.blocked(&about, &light::solve(&columns, &channels[c], &counts, 0.0));
            LitChannel { sheet, rows: &beside, values: sheet.linear(&beside, c), blocked }.without_thing()
        });
        let gain = |i: usize| [0, 1, 2].map(|c| found[c].0[i]);
        let is_visible = |i: usize| near(i) && gain(i).iter().any(|g| (g - 1.0).abs() >= LEAST_GAIN);
        let gain: Vec<[f32; 3]> =
            (0..sheet.state.len()).map(|i| if is_visible(i) { gain(i) } else { [1.0; 3] }).collect();
        let bound = (0..sheet.state.len()).map(|i| [0, 1, 2].map(|c| found[c].1[i])).collect();
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
    /// Shares of the sky that others and the thing alone block at each texel.
    sky: Vec<[f32; 2]>,
}

impl LitSurface<'_> {
    /// Returns the directions of single lights, searched from these on, and the weight of each row.
    fn directions(&self, mut about: Vec<Shadow>, values: &[f32]) -> (Vec<Shadow>, Vec<f64>) {
        let mut spacing = (std::f64::consts::TAU * (1.0 - LEAST_COSINE) / about.len() as f64).sqrt();
        let mut counts = Vec::new();
        for round in 0..=FINER_ROUNDS {
            let grain = SURE * TOGETHER.sqrt();
            let (weights, rows) = light::fit(&self.columns(&about, THING | OTHERS), values, grain);
            counts = rows;
            let weights = &weights[light::SKY + 1..];
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
                about.extend(Shadow::all(self.plane, self.sheet, &finer, self.occluders));
            }
        }
        (about, counts)
    }

    /// Returns the columns that compose the brightness of the rows, with the occluders `which`.
    fn columns(&self, shadows: &[Shadow], which: u8) -> Vec<Vec<f32>> {
        let rows = &self.rows;
        let base = (0..light::FREE).map(|k| rows.iter().map(|&i| base(self.sheet, i)[k] as f32).collect());
        let shade = |s: &Shadow| rows.iter().map(|&i| if s.bits[i] & which == 0 { 0.0 } else { -1.0 }).collect();
        let of = |[others, thing]: [f32; 2]| if which & THING == 0 { others } else { others + thing };
        let sky = rows.iter().map(|&i| -of(self.sky[i])).collect();
        base.chain(std::iter::once(sky)).chain(shadows.iter().map(shade)).collect()
    }

    /// Returns whether the thing's shadow explains the darker texels in it, or all shadows those of the surface.
    fn is_explained(
        &self,
        about: &[Shadow],
        values: &[f32],
        (all, weights): (&[Vec<f32>], &[f64]),
        counts: &[f64],
    ) -> bool {
        let inside: Vec<bool> = self
            .rows
            .iter()
            .map(|&i| {
                let shade = |s: (&Shadow, &f64)| if s.0.bits[i] == THING { *s.1 } else { 0.0 };
                let sky = f64::from(self.sky[i][1]) * weights[light::SKY];
                let dark = sky + about.iter().zip(&weights[light::SKY + 1..]).map(shade).sum::<f64>();
                dark > SHADED * unshaded(self.sheet, i, weights).abs()
            })
            .collect();
        // Sums the weighted squares of the rows inside the shadow, or outside of it, and their weights.
        let squares = |off: &[f64], is: bool| -> (f64, f64) {
            let of = (0..off.len()).filter(|k| inside[*k] == is);
            of.fold((0.0, 0.0), |(sum, n), k| (sum + counts[k] * off[k] * off[k], n + counts[k]))
        };
        let with = light::residuals(all, values, weights);
        // Grain exists in the shadow and beside it.
        let (beside, of) = squares(&with, false);
        let left = |off: &[f64]| -> f64 {
            let (sum, n) = squares(off, true);
            (sum - n * beside / of.max(1.0)).max(0.0)
        };
        let others = self.columns(about, OTHERS);
        let bare = light::residuals(&others, values, &light::solve(&others, values, counts, 0.0));
        let better = squares(&bare, true).0 - squares(&with, true).0;
        let least = squares(&vec![LEAST_SHADE * self.level(weights); values.len()], true);
        if least.1 < LEAST_INSIDE || better < least.0 {
            return false;
        }
        let sum = |off: &[f64]| -> f64 { off.iter().zip(counts).map(|(off, n)| n * off * off).sum() };
        let even = &all[..light::FREE];
        let without = sum(&light::residuals(even, values, &light::solve(even, values, counts, 0.0)));
        left(&with) < EXPLAINED.0 * left(&bare) || sum(&with) < EXPLAINED.1 * without
    }

    /// Returns the mean brightness without shadows.
    fn level(&self, weights: &[f64]) -> f64 {
        let sum: f64 = self.rows.iter().map(|&i| unshaded(self.sheet, i, weights)).sum();
        (sum / self.rows.len() as f64).max(f64::from(DARK))
    }

    /// Returns the shares of light that are blocked at each texel: by others; by the thing alone, from single lights
    /// and from the sky.
    fn blocked(&self, about: &[Shadow], weights: &[f64]) -> Vec<[f64; 3]> {
        let level = self.level(weights);
        let share = |weight: f64| (weight / level) as f32;
        let of_sky = |[others, thing]: &[f32; 2]| [*others, 0.0, *thing].map(|s| s * share(weights[light::SKY]));
        let mut blocked: Vec<[f32; 3]> = self.sky.iter().map(of_sky).collect();
        for (shadow, weight) in about.iter().zip(&weights[light::SKY + 1..]) {
            for (blocked, bits) in blocked.iter_mut().zip(&shadow.bits).filter(|(_, bits)| **bits != 0) {
                blocked[usize::from(bits & OTHERS == 0)] += share(*weight);
            }
        }
        blocked.into_iter().map(|of| of.map(f64::from)).collect()
    }
}

/// One channel of a surface in known light.
struct LitChannel<'a> {
    sheet: &'a SurfaceTexture<'a>,
    /// Texels beside the thing, and their linear light.
    rows: &'a [usize],
    values: Vec<f32>,
    /// Blocked shares of the light at each texel by [`LitSurface::blocked`].
    blocked: Vec<[f64; 3]>,
}

impl LitChannel<'_> {
    /// Returns the gain of each texel without the thing, and its brightest light then.
    fn without_thing(&self) -> (Vec<f32>, Vec<f32>) {
        let mut strength = [1.0; 2];
        let (mut level, mut counts, mut usual) = (Vec::new(), vec![1.0; self.rows.len()], 0.0);
        for _ in 0..STRENGTH_ROUNDS {
            let column = |k: usize| {
                self.rows.iter().map(|&i| (base(self.sheet, i)[k] * self.left(i, strength)) as f32).collect()
            };
            let columns: Vec<Vec<f32>> = (0..light::FREE).map(column).collect();
            let weights = light::solve(&columns, &self.values, &counts, 0.0);
            let unshaded = |i| unshaded(self.sheet, i, &weights).max(f64::from(DARK));
            level = (0..self.blocked.len()).map(unshaded).collect();
            strength = self.strength(&level, &counts, usual);
            let off = |(&i, v): (&usize, &f32)| f64::from(*v) - level[i] * self.left(i, strength);
            (counts, usual) =
                light::row_weights(&self.rows.iter().zip(&self.values).map(off).collect::<Vec<_>>(), &self.values);
        }
        let gain = |i: usize| (self.left(i, [0.0; 2]) / self.left(i, strength)) as f32;
        let gain: Vec<f32> = (0..level.len()).map(|i| gain(i).clamp(GAINS.0, GAINS.1)).collect();
        let without: Vec<f64> = (0..level.len()).map(|i| level[i] * self.left(i, [0.0; 2])).collect();
        let of_fit = |(&i, v): (&usize, &f32)| f64::from(*v * gain[i]) / without[i];
        let of_fit: Vec<f64> = self.rows.iter().zip(&self.values).map(of_fit).collect();
        let brightest = quantile(&of_fit, BRIGHTEST.0).clamp(1.0, BRIGHTEST.1);
        (blurred(gain, self.sheet.size), without.iter().map(|v| (v * brightest) as f32).collect())
    }

    /// Returns the share of light at a texel if the thing's shadow is this strong.
    fn left(&self, i: usize, strength: [f64; 2]) -> f64 {
        let [others, lights, sky] = self.blocked[i];
        (1.0 - others - strength[0] * lights - strength[1] * sky).max(LEAST_LIGHT)
    }

    /// Fits the strengths to the rows, whose deviations are `usual`; the fewer rows tell of them, the nearer to 1.
    fn strength(&self, level: &[f64], counts: &[f64], usual: f64) -> [f64; 2] {
        let prior = TOGETHER * (usual / DEVIATION).powi(2).max(1e-9);
        let (mut gram, mut right) = (DMat2::from_diagonal(DVec2::splat(prior)), DVec2::splat(prior));
        for ((&i, value), count) in self.rows.iter().zip(&self.values).zip(counts) {
            let shade = DVec2::new(self.blocked[i][1], self.blocked[i][2]) * level[i];
            let darker = level[i] * self.left(i, [0.0; 2]) - f64::from(*value);
            right += shade * (count * darker);
            gram += DMat2::from_cols(shade * shade.x, shade * shade.y) * *count;
        }
        let found = (gram.inverse() * right).to_array();
        std::array::from_fn(|k| found[k].clamp(STRENGTHS[k].0, STRENGTHS[k].1))
    }
}

/// Terms of the brightness of an evenly lit surface: a constant, and changes along the surface up to squares.
fn base(sheet: &SurfaceTexture<'_>, i: usize) -> [f64; light::FREE] {
    let part = |at: usize, length: usize| at as f64 / length.max(1) as f64 - 0.5;
    let (x, y) = (part(i % sheet.size[0], sheet.size[0]), part(i / sheet.size[0], sheet.size[1]));
    [1.0, x, y, x * x, x * y, y * y]
}

/// Brightness of a texel without shadows, by the leading weights.
fn unshaded(sheet: &SurfaceTexture<'_>, i: usize, weights: &[f64]) -> f64 {
    base(sheet, i).iter().zip(weights).map(|(b, w)| b * w).sum()
}

/// Returns a number from 0 to 1 for a texel, without a pattern.
fn scattered(i: usize) -> f64 {
    f64::from((i as u32).wrapping_mul(2_654_435_761)) / f64::from(u32::MAX)
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
