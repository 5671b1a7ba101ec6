//! Initial points for scenes without sparse points, by a plane sweep.
//!
//! Many depths are tried along the ray of a pixel. A depth is rejected if photos show background there, because they
//! are transparent or have the background's color: the rest lies in the visual hull. Of the remaining depths, the one
//! is taken at which neighboring photos have the same colors. Points at random depths would become fog before a light
//! background, which looks right in the few photos that see through it, and stays.

use glam::{DVec2, DVec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use super::TrainView;
use super::sweep_view::{Shows, SmallView, ViewPair, neighbors};
use crate::math::stats::quantile;
use crate::scene::SparsePoint;

/// Depths tried along a ray, from the distance of the focus divided by `REACH` to that times `REACH`, by equal factors.
const DEPTHS: usize = 96;
const REACH: f64 = 4.0;
/// Most views in the test for empty space.
const ASKED: usize = 40;
/// Share of the views of a point that may show background there: silhouettes are not exact.
const MAY_MISS: f64 = 0.06;
/// Share of the tested views that must show a point of a cut-out object; at least two views.
const SEEN: f64 = 0.25;
/// Offsets that are compared around a pixel, px.
const AROUND: [[f64; 2]; 5] = [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
/// Largest mean color difference (0 to 1) at which photos agree.
const AGREES: f32 = 0.06;
/// Margin of the mean difference within which depths are as good as the best.
const AS_GOOD: f32 = 0.012;
/// Rays that are tried for each requested point.
const TRIES: usize = 4;
/// Points that one task makes.
const BLOCK: usize = 250;

/// Returns at most `n` points in the colors of the photos. `background` is the background color, if known.
pub(super) fn points(
    focus: DVec3,
    views: &[&TrainView],
    background: Option<[f32; 3]>,
    n: usize,
    rng: &mut Pcg64Mcg,
) -> Vec<SparsePoint> {
    let backdrop = background.map(|b| b.map(|c| (c * 255.0).round() as u8));
    let small: Vec<SmallView> = views.par_iter().map(|v| SmallView::new(v, backdrop)).collect();
    let sweep = Sweep::new(&small, focus);
    if sweep.pixels.is_empty() {
        return Vec::new();
    }
    let seeds: Vec<u64> = (0..n.div_ceil(BLOCK)).map(|_| rng.random()).collect();
    let blocks: Vec<Vec<SparsePoint>> = seeds
        .into_par_iter()
        .enumerate()
        .map(|(block, seed)| sweep.some(BLOCK.min(n - block * BLOCK), &mut Pcg64Mcg::seed_from_u64(seed)))
        .collect();
    blocks.concat()
}

struct Sweep<'a> {
    views: &'a [SmallView],
    neighbors: Vec<Vec<ViewPair>>,
    focus: DVec3,
    /// View and index of every pixel that is not background.
    pixels: Vec<(u32, u32)>,
    /// True if some photo shows background.
    carves: bool,
}

impl<'a> Sweep<'a> {
    fn new(views: &'a [SmallView], focus: DVec3) -> Self {
        let shown = |(v, view): (usize, &SmallView)| -> Vec<(u32, u32)> {
            let shows = view.shows.iter().enumerate().filter(|(_, s)| **s == Shows::Something);
            shows.map(|(i, _)| (v as u32, i as u32)).collect()
        };
        Self {
            pixels: views.iter().enumerate().flat_map(shown).collect(),
            neighbors: neighbors(views, focus),
            carves: views.iter().any(|v| v.shows.contains(&Shows::Nothing)),
            views,
            focus,
        }
    }

    /// Returns `n` points, or fewer if most rays have none.
    fn some(&self, n: usize, rng: &mut Pcg64Mcg) -> Vec<SparsePoint> {
        let tries = (0..n * TRIES).filter_map(|_| {
            let (view, pixel) = self.pixels[rng.random_range(0..self.pixels.len())];
            self.point(view as usize, pixel as usize, rng)
        });
        tries.take(n).collect()
    }

    /// Finds a point along the ray of a pixel.
    fn point(&self, v: usize, pixel: usize, rng: &mut Pcg64Mcg) -> Option<SparsePoint> {
        let view = &self.views[v];
        let place = view.place(pixel);
        let ray = view.camera.ray(place);
        let distance = view.camera.center.distance(self.focus).max(f64::MIN_POSITIVE);
        let start: f64 = rng.random();
        let depth = |k: usize| distance * REACH.powf(2.0 * (k as f64 + start) / DEPTHS as f64 - 1.0);
        let at = |k: usize| view.camera.center + ray * depth(k);
        let open: Vec<usize> = (0..DEPTHS).filter(|&k| !self.carves || self.may_be(at(k))).collect();
        let rays = AROUND.map(|d| self.camera_ray(v, place + DVec2::from(d)));
        let colors = AROUND.map(|d| view.pixel(place + DVec2::from(d)).map(|i| view.rgb[i]));
        let scores: Vec<(f32, usize)> =
            open.iter().filter_map(|&k| Some((self.disagreement(v, &rays, &colors, depth(k))?, k))).collect();
        let best = scores.iter().map(|s| s.0).fold(f32::INFINITY, f32::min);
        let good: Vec<usize> = match best <= AGREES {
            true => scores.iter().filter(|s| s.0 <= best + AS_GOOD).map(|s| s.1).collect(),
            false => open,
        };
        let k = *good.get(rng.random_range(0..good.len().max(1)))?;
        let rgb = view.rgb[pixel].map(|c| (c * 255.0).round() as u8);
        Some(SparsePoint { position: at(k), rgb })
    }

    /// Ray of an image position, in camera axes with depth 1.
    fn camera_ray(&self, v: usize, place: DVec2) -> DVec3 {
        let camera = &self.views[v].camera;
        ((place - camera.principal_px) / camera.focal_px).extend(1.0)
    }

    /// Returns whether a point may be occupied: nearly all photos that see it show foreground there.
    fn may_be(&self, point: DVec3) -> bool {
        let step = self.views.len().div_ceil(ASKED).max(1);
        let asked = self.views.len().div_ceil(step);
        let (mut seen, mut nothing) = (0_usize, 0_usize);
        for shows in self.views.iter().step_by(step).filter_map(|v| v.at(point)) {
            seen += usize::from(shows != Shows::Unknown);
            nothing += usize::from(shows == Shows::Nothing);
        }
        let enough = (SEEN * asked as f64).max(2.0).min(asked as f64);
        seen as f64 >= enough && nothing as f64 <= MAY_MISS * seen as f64
    }

    /// Mean color difference in the better half of the neighboring photos; `None` if too few see the point.
    fn disagreement(&self, v: usize, rays: &[DVec3; 5], colors: &[Option<[f32; 3]>; 5], depth: f64) -> Option<f32> {
        let pairs = &self.neighbors[v];
        let mut of_views: Vec<f64> = Vec::with_capacity(pairs.len());
        for pair in pairs {
            let other = &self.views[pair.other];
            let (mut sum, mut count) = (0.0_f32, 0);
            for (ray, color) in rays.iter().zip(colors) {
                let found = pair.place(*ray, depth).and_then(|p| other.pixel(p));
                let (Some(i), Some(color)) = (found.filter(|&i| other.shows[i] != Shows::Unknown), color) else {
                    continue;
                };
                sum += (0..3).map(|c| (other.rgb[i][c] - color[c]).abs()).sum::<f32>() / 3.0;
                count += 1;
            }
            if count > AROUND.len() / 2 {
                of_views.push(f64::from(sum / count as f32));
            }
        }
        let enough = of_views.len() >= pairs.len().clamp(1, 2);
        enough.then(|| quantile(&of_views, 0.4) as f32)
    }
}
