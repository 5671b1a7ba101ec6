//! Features of a picture: corners at several sizes, each with a histogram of the slopes around it relative to their
//! main direction (Lowe 2004), compared by the square root of its shares (Arandjelović and Zisserman 2012). They survive
//! exposure, turns in the picture plane and moderate changes of viewpoint.

use std::f32::consts::TAU;

use glam::DVec2;
use rayon::prelude::*;

use super::corners::corners;
use super::gray::GrayPlane;

/// Length of a descriptor: 4 x 4 places of 8 directions.
pub(super) const LENGTH: usize = PLACES * PLACES * DIRECTIONS;
const PLACES: usize = 4;
const DIRECTIONS: usize = 8;
/// Samples along a side of the described square.
const SAMPLES: usize = 16;
/// Distance of samples, px of the level.
const STEP_PX: f32 = 1.25;
/// Blur of a level before its slopes are taken, px.
const BLUR_PX: f32 = 1.2;
/// Bins of the histogram that gives the main direction.
const TURN_BINS: usize = 36;
/// A second direction is described, too, if it has this share of the first one's weight.
const SECOND: f32 = 0.8;
/// Ratio of sizes from level to level.
const LEVEL_RATIO: f64 = 1.4;
/// Smallest longer side of a level, px.
const SMALLEST_PX: f64 = 80.0;
/// Largest share of one entry, against single strong edges.
const LARGEST: f32 = 0.2;

/// A corner and its surroundings.
#[derive(Clone, Debug)]
pub(super) struct PictureFeature {
    /// Place in the picture, px.
    pub(super) at: DVec2,
    pub(super) descriptor: [f32; LENGTH],
}

/// At most about `most` features of the finest level, and fewer of coarser ones in proportion to their side.
pub(super) fn features(gray: &GrayPlane, most: usize) -> Vec<PictureFeature> {
    let mut found = Vec::new();
    let longer = gray.width.max(gray.height) as f64;
    let mut ratio = 1.0;
    while ratio == 1.0 || longer / ratio >= SMALLEST_PX {
        let side = |s: usize| ((s as f64 / ratio).round() as usize).max(1);
        let level = if ratio == 1.0 { gray.clone() } else { gray.resized(side(gray.width), side(gray.height)) };
        let slopes = level.blurred(BLUR_PX).slopes();
        let scale = DVec2::new(gray.width as f64 / level.width as f64, gray.height as f64 / level.height as f64);
        let describe = |at: [f32; 2]| {
            let turns = main_turns(&slopes, at);
            let slopes = &slopes;
            turns.into_iter().map(move |turn| PictureFeature {
                at: DVec2::new(f64::from(at[0]), f64::from(at[1])) * scale,
                descriptor: descriptor(slopes, at, turn),
            })
        };
        let places = corners(&slopes, (most as f64 / ratio) as usize);
        found.extend(places.into_par_iter().flat_map_iter(describe).collect::<Vec<_>>());
        ratio *= LEVEL_RATIO;
    }
    found
}

/// Main directions of the slopes around a place, radians.
fn main_turns([dx, dy]: &[GrayPlane; 2], at: [f32; 2]) -> Vec<f32> {
    let mut bins = [0.0_f32; TURN_BINS];
    let reach = SAMPLES as f32 * STEP_PX * 0.5;
    for j in 0..SAMPLES {
        for i in 0..SAMPLES {
            let [x, y] = [i, j].map(|k| (k as f32 + 0.5) * STEP_PX - reach);
            let near = (-(x * x + y * y) / (2.0 * (0.5 * reach).powi(2))).exp();
            let (gx, gy) = (dx.sample(at[0] + x, at[1] + y), dy.sample(at[0] + x, at[1] + y));
            let bin = (gy.atan2(gx) / TAU).rem_euclid(1.0) * TURN_BINS as f32;
            bins[bin as usize % TURN_BINS] += near * gx.hypot(gy);
        }
    }
    for _ in 0..2 {
        let old = bins;
        for (k, bin) in bins.iter_mut().enumerate() {
            let around = old[(k + TURN_BINS - 1) % TURN_BINS] + old[(k + 1) % TURN_BINS];
            *bin = 0.5 * old[k] + 0.25 * around;
        }
    }
    let sides = |k: usize| [bins[(k + TURN_BINS - 1) % TURN_BINS], bins[(k + 1) % TURN_BINS]];
    let most = bins.iter().copied().fold(0.0, f32::max);
    let is_peak = |&k: &usize| sides(k).iter().all(|s| bins[k] > *s) && bins[k] >= SECOND * most && most > 0.0;
    let mut peaks: Vec<usize> = (0..TURN_BINS).filter(is_peak).collect();
    peaks.sort_by(|a, b| bins[*b].total_cmp(&bins[*a]));
    let turn = |k: usize| {
        let [low, high] = sides(k);
        let top = 0.5 * (low - high) / (low - 2.0 * bins[k] + high);
        (k as f32 + 0.5 + top) / TURN_BINS as f32 * TAU
    };
    peaks.into_iter().take(2).map(turn).collect()
}

/// Histogram of the slopes around a place, relative to a direction.
fn descriptor([dx, dy]: &[GrayPlane; 2], at: [f32; 2], turn: f32) -> [f32; LENGTH] {
    let (sin, cos) = turn.sin_cos();
    let half = SAMPLES as f32 * 0.5;
    let mut out = [0.0_f32; LENGTH];
    for j in 0..SAMPLES {
        for i in 0..SAMPLES {
            let [u, v] = [i, j].map(|k| k as f32 + 0.5 - half);
            let (x, y) = (at[0] + STEP_PX * (cos * u - sin * v), at[1] + STEP_PX * (sin * u + cos * v));
            let (gx, gy) = (dx.sample(x, y), dy.sample(x, y));
            let near = (-(u * u + v * v) / (2.0 * half * half)).exp();
            let strength = near * gx.hypot(gy);
            let direction = ((gy.atan2(gx) - turn) / TAU).rem_euclid(1.0) * DIRECTIONS as f32;
            // Each sample counts in the two nearest bins along each of the three axes.
            let place = |k: f32| (k + half) / SAMPLES as f32 * PLACES as f32 - 0.5;
            let (px, py) = (place(u), place(v));
            for (row, wy) in nearest_two(py) {
                for (column, wx) in nearest_two(px) {
                    let inside = |k: isize| (0..PLACES as isize).contains(&k);
                    if !inside(row) || !inside(column) {
                        continue;
                    }
                    let first = (row as usize * PLACES + column as usize) * DIRECTIONS;
                    for (bin, wd) in nearest_two(direction) {
                        out[first + bin.rem_euclid(DIRECTIONS as isize) as usize] += strength * wx * wy * wd;
                    }
                }
            }
        }
    }
    let length = out.iter().map(|v| v * v).sum::<f32>().sqrt().max(f32::MIN_POSITIVE);
    out.iter_mut().for_each(|v| *v = (*v / length).min(LARGEST));
    let sum = out.iter().sum::<f32>().max(f32::MIN_POSITIVE);
    out.map(|v| (v / sum).sqrt())
}

/// The two integers around a number, each with its weight.
fn nearest_two(x: f32) -> [(isize, f32); 2] {
    let low = x.floor();
    [(low as isize, 1.0 - (x - low)), (low as isize + 1, x - low)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vector::dot;

    /// Blobs at made-up places, turned about the middle.
    fn blobs(turn: f32, gain: f32) -> GrayPlane {
        let (sin, cos) = turn.sin_cos();
        let at = |i: usize| {
            let (x, y) = ((i % 120) as f32 - 59.5, (i / 120) as f32 - 59.5);
            let (x, y) = (cos * x + sin * y, -sin * x + cos * y);
            let blob = |k: usize| {
                let k = k as f32;
                let (cx, cy) = (45.0 * (k * 2.4).sin() * (k * 0.37).cos(), 45.0 * (k * 1.7).cos());
                (0.3 + 0.2 * (k * 5.1).sin())
                    * (-((x - cx).powi(2) + (y - cy).powi(2)) / (18.0 + 10.0 * (k * 3.3).sin())).exp()
            };
            gain * (0..30).map(blob).sum::<f32>()
        };
        GrayPlane { width: 120, height: 120, values: (0..120 * 120).map(at).collect() }
    }

    #[test]
    fn features_are_recognized_in_a_turned_and_darker_picture() {
        let turn = 0.6_f32;
        let (a, b) = (features(&blobs(0.0, 1.0), 100), features(&blobs(turn, 0.5), 100));
        assert!(a.len() > 20 && b.len() > 20, "{} {}", a.len(), b.len());
        let (sin, cos) = f64::from(turn).sin_cos();
        let right = a.iter().filter(|f| {
            let near = |g: &&PictureFeature| dot(&f.descriptor, &g.descriptor);
            let best = b.iter().max_by(|x, y| near(x).total_cmp(&near(y))).expect("some");
            let p = f.at - 60.0;
            let there = DVec2::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y) + 60.0;
            best.at.distance(there) < 4.0
        });
        let right = right.count();
        assert!(2 * right > a.len(), "{right} of {}", a.len());
    }

    #[test]
    fn descriptors_have_unit_length() {
        for f in features(&blobs(0.0, 1.0), 50) {
            assert!((dot(&f.descriptor, &f.descriptor) - 1.0).abs() < 1e-4);
        }
    }
}
