//! Colors for the hidden part of a surface, from its visible part.
//!
//! Brightness and texture are painted separately. The smooth part fills the hole like a soap film, as a wall in
//! slanting light needs. The rest, the texture, is composed of patches seen elsewhere (PatchMatch: Barnes et al.
//! 2009; voting over scales: Wexler et al. 2007). Where the surface has lines, these go on ([`lines`]).

mod lines;
mod telea;

pub(super) use lines::continue_lines;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use serde::{Deserialize, Serialize};

use crate::math::grid::{neighbors, spread};

/// Methods of painting a hidden surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Paint {
    /// The brightness of its rim, with texture from around it, and lines that go on.
    #[default]
    Patches,
    /// The brightness of its rim alone.
    Smooth,
    /// Every texel like the nearest visible one.
    Nearest,
    /// Fast marching, as in image editors.
    Telea,
    /// The network LaMa ('fmlgs models fetch lama').
    Lama,
}

/// Half of a patch's side, texels.
const HALF: usize = 3;
/// Radius over which brightness is smooth, texels.
const SMOOTH: usize = 6;
/// Rounds of search and vote at each size, and passes of a search.
const ROUNDS: usize = 4;
const PASSES: usize = 3;
/// Largest side of the sheets at which painting begins.
const SMALLEST: usize = 24;
/// Over-relaxation of the film.
const RELAX: f32 = 1.9;

/// Paints the texels of `hole`, of a sheet of this size, from the `known` ones, by any method but a network.
pub(super) fn fill(color: &mut [[f32; 3]], size: [usize; 2], known: &[bool], hole: &[bool], how: Paint, seed: u64) {
    let n = color.len();
    let holes: Vec<usize> = (0..n).filter(|i| hole[*i]).collect();
    if how == Paint::Telea {
        return telea::fill(color, size, known, hole);
    }
    if how == Paint::Nearest {
        let nearest = nearest(color, size, known);
        return holes.into_iter().for_each(|i| color[i] = nearest[i]);
    }
    let smooth = smooth(color, size, known, hole);
    if how == Paint::Smooth {
        return holes.into_iter().for_each(|i| color[i] = smooth[i]);
    }
    let texture: Vec<[f32; 3]> = (0..n).map(|i| std::array::from_fn(|c| color[i][c] - smooth[i][c])).collect();
    let picture = Picture { size, color: texture, known: known.to_vec(), hole: hole.to_vec() };
    let texture = picture.painted(&mut Pcg32::seed_from_u64(seed));
    holes.into_iter().for_each(|i| color[i] = std::array::from_fn(|c| smooth[i][c] + texture[i][c]));
}

/// Returns the color of the nearest known texel for each.
fn nearest(color: &[[f32; 3]], size: [usize; 2], known: &[bool]) -> Vec<[f32; 3]> {
    let n = color.len();
    let found = spread(size[0], n, (0..n).filter(|i| known[*i]).map(|i| (i, color[i])), |_| true);
    found.into_iter().map(|c| c.unwrap_or([0.5; 3])).collect()
}

/// Returns the smooth part of a surface: means of the known texels around each one, and a film between them in the
/// hole.
pub(super) fn smooth(color: &[[f32; 3]], size: [usize; 2], known: &[bool], hole: &[bool]) -> Vec<[f32; 3]> {
    let (mut smooth, nearest) = (blurred(color, size, known), nearest(color, size, known));
    let holes: Vec<usize> = (0..color.len()).filter(|i| hole[*i]).collect();
    holes.iter().for_each(|&i| smooth[i] = nearest[i]);
    film(&mut smooth, size, known, &holes);
    smooth
}

/// Means over the known texels around each.
fn blurred(color: &[[f32; 3]], size: [usize; 2], known: &[bool]) -> Vec<[f32; 3]> {
    let mut sums: Vec<[f32; 4]> =
        color.iter().zip(known).map(|(c, k)| if *k { [c[0], c[1], c[2], 1.0] } else { [0.0; 4] }).collect();
    // Two boxes one after the other along each axis are a tent.
    for along in [0, 1, 0, 1] {
        let [stride, length] = if along == 0 { [1, size[0]] } else { [size[0], size[1]] };
        let before = sums.clone();
        for (i, sum) in sums.iter_mut().enumerate() {
            let at = if along == 0 { i % size[0] } else { i / size[0] };
            let (from, to) = (at.saturating_sub(SMOOTH / 2), (at + SMOOTH / 2).min(length - 1));
            *sum = [0.0; 4];
            for t in from..=to {
                let other = before[i + t * stride - at * stride];
                (0..4).for_each(|c| sum[c] += other[c]);
            }
        }
    }
    sums.iter().map(|s| if s[3] > 0.0 { [s[0] / s[3], s[1] / s[3], s[2] / s[3]] } else { [0.0; 3] }).collect()
}

/// Fills the hole with a film: every texel is the mean of its neighbors.
fn film(color: &mut [[f32; 3]], size: [usize; 2], known: &[bool], holes: &[usize]) {
    let mut inside = vec![false; color.len()];
    holes.iter().for_each(|i| inside[*i] = true);
    let rounds = 4 * (holes.len() as f64).sqrt() as usize + 20;
    for _ in 0..rounds {
        for &i in holes {
            let (mut sum, mut count) = ([0.0; 3], 0.0);
            for j in neighbors(i, size[0], color.len()).filter(|j| inside[*j] || known[*j]) {
                (0..3).for_each(|c| sum[c] += color[j][c]);
                count += 1.0;
            }
            if count > 0.0 {
                (0..3).for_each(|c| color[i][c] += RELAX * (sum[c] / count - color[i][c]));
            }
        }
    }
}

/// A picture with a hole.
struct Picture {
    size: [usize; 2],
    color: Vec<[f32; 3]>,
    known: Vec<bool>,
    hole: Vec<bool>,
}

impl Picture {
    /// Returns the colors with the hole painted; zeros in it if no area is large enough to paint from.
    fn painted(mut self, rng: &mut Pcg32) -> Vec<[f32; 3]> {
        (0..self.color.len()).filter(|i| self.hole[*i]).for_each(|i| self.color[i] = [0.0; 3]);
        if self.size.iter().min().is_some_and(|s| *s > SMALLEST)
            && let half = self.halved()
            && !half.sources().is_empty()
        {
            let (width, small) = (half.size[0], half.painted(rng));
            for i in (0..self.color.len()).filter(|i| self.hole[*i]) {
                self.color[i] = small[i / self.size[0] / 2 * width + i % self.size[0] / 2];
            }
        }
        let sources = self.sources();
        if !sources.is_empty() {
            self.vote_and_search(&sources, rng);
        }
        self.color
    }

    /// The same at half the size.
    fn halved(&self) -> Self {
        let size = self.size.map(|s| s.div_ceil(2));
        let four = |i: usize| {
            let (x, y) = (2 * (i % size[0]), 2 * (i / size[0]));
            let inside = move |(x, y): &(usize, usize)| *x < self.size[0] && *y < self.size[1];
            [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)]
                .into_iter()
                .filter(inside)
                .map(|(x, y)| y * self.size[0] + x)
        };
        let n = size[0] * size[1];
        let mean = |i: usize| {
            let all: Vec<usize> = four(i).filter(|j| self.known[*j]).collect();
            let part = 1.0 / all.len().max(1) as f32;
            std::array::from_fn(|c| all.iter().map(|j| self.color[*j][c]).sum::<f32>() * part)
        };
        Self {
            size,
            color: (0..n).map(mean).collect(),
            known: (0..n).map(|i| four(i).all(|j| self.known[j])).collect(),
            hole: (0..n).map(|i| four(i).any(|j| self.hole[j])).collect(),
        }
    }

    /// Returns the centers of fully known patches.
    fn sources(&self) -> Vec<usize> {
        let whole = |i: &usize| self.patch(*i).is_some_and(|mut patch| patch.all(|j| self.known[j]));
        (0..self.color.len()).filter(whole).collect()
    }

    /// Returns the texels of the patch around a texel, row by row; `None` if it reaches beyond the picture.
    fn patch(&self, i: usize) -> Option<impl Iterator<Item = usize> + '_> {
        let (x, y) = (i % self.size[0], i / self.size[0]);
        let inside = |at: usize, end: usize| at >= HALF && at + HALF < end;
        (inside(x, self.size[0]) && inside(y, self.size[1]))
            .then(|| (y - HALF..=y + HALF).flat_map(move |y| (x - HALF..=x + HALF).map(move |x| y * self.size[0] + x)))
    }

    /// Mean squared difference of two patches, over known or painted texels; given up above `limit`.
    fn distance(&self, target: usize, source: usize, limit: f32) -> f32 {
        let (Some(a), Some(b)) = (self.patch(target), self.patch(source)) else { return f32::INFINITY };
        let (mut sum, mut count) = (0.0, 0.0);
        let all = ((2 * HALF + 1) * (2 * HALF + 1)) as f32;
        for (i, j) in a.zip(b) {
            if self.known[i] || self.hole[i] {
                let difference: [f32; 3] = std::array::from_fn(|c| self.color[i][c] - self.color[j][c]);
                sum += difference.iter().map(|d| d * d).sum::<f32>();
                count += 1.0;
            }
            if sum > limit * all {
                return f32::INFINITY;
            }
        }
        if count > 0.0 { sum / count } else { f32::INFINITY }
    }

    fn vote_and_search(&mut self, sources: &[usize], rng: &mut Pcg32) {
        let n = self.color.len();
        let mut is_source = vec![false; n];
        sources.iter().for_each(|i| is_source[*i] = true);
        // Patches that reach into the hole.
        let reaches = |i: &usize| self.patch(*i).is_some_and(|mut patch| patch.any(|j| self.hole[j]));
        let targets: Vec<usize> = (0..n).filter(reaches).collect();
        let mut from: Vec<usize> = targets.iter().map(|_| sources[rng.random_range(0..sources.len())]).collect();
        let mut slot = vec![usize::MAX; n];
        targets.iter().enumerate().for_each(|(k, i)| slot[*i] = k);
        for _ in 0..ROUNDS {
            let mut best: Vec<f32> =
                targets.iter().zip(&from).map(|(t, s)| self.distance(*t, *s, f32::INFINITY)).collect();
            for pass in 0..PASSES {
                self.search(&targets, &slot, &is_source, &mut from, &mut best, pass % 2 == 1, rng);
            }
            self.vote(&targets, &from, &best);
        }
    }

    /// One pass over all targets: the match of the neighbor, shifted, and random places ever nearer.
    #[expect(clippy::too_many_arguments, reason = "the state of one search")]
    fn search(
        &self,
        targets: &[usize],
        slot: &[usize],
        is_source: &[bool],
        from: &mut [usize],
        best: &mut [f32],
        backward: bool,
        rng: &mut Pcg32,
    ) {
        let width = self.size[0] as i64;
        for k in 0..targets.len() {
            let k = if backward { targets.len() - 1 - k } else { k };
            let i = targets[k];
            let attempt = |source: i64, from: &mut [usize], best: &mut [f32]| {
                let Ok(source) = usize::try_from(source) else { return };
                if is_source.get(source) == Some(&true) && source != from[k] {
                    let distance = self.distance(i, source, best[k]);
                    if distance < best[k] {
                        (from[k], best[k]) = (source, distance);
                    }
                }
            };
            for step in [1, width] {
                // A pass spreads good matches along its direction, from the neighbor that it has just updated.
                let step = if backward { -step } else { step };
                let beside = (i as i64 - step) as usize;
                if let Some(&other) = slot.get(beside).filter(|s| **s != usize::MAX) {
                    attempt(from[other] as i64 + step, from, best);
                }
            }
            let mut reach = self.size[0].max(self.size[1]) as i64;
            while reach >= 1 {
                let (x, y) = (from[k] as i64 % width, from[k] as i64 / width);
                let (dx, dy) = (rng.random_range(-reach..=reach), rng.random_range(-reach..=reach));
                if (0..width).contains(&(x + dx)) {
                    attempt((y + dy) * width + x + dx, from, best);
                }
                reach /= 2;
            }
        }
    }

    /// Sets every texel of the hole to the weighted mean of the patches over it, in which better matches count more.
    fn vote(&mut self, targets: &[usize], from: &[usize], best: &[f32]) {
        let mut sorted: Vec<f32> = best.iter().copied().filter(|d| d.is_finite()).collect();
        sorted.sort_by(f32::total_cmp);
        let usual = sorted.get(sorted.len() * 3 / 4).copied().unwrap_or(0.0).max(1e-8);
        let mut sums = vec![[0.0_f32; 4]; self.color.len()];
        for ((&target, &source), &distance) in targets.iter().zip(from).zip(best) {
            let weight = (-distance / (2.0 * usual)).exp();
            let (Some(to), Some(of)) = (self.patch(target), self.patch(source)) else { continue };
            for (i, j) in to.zip(of).filter(|(i, _)| self.hole[*i]) {
                (0..3).for_each(|c| sums[i][c] += weight * self.color[j][c]);
                sums[i][3] += weight;
            }
        }
        for (i, sum) in sums.iter().enumerate().filter(|(_, s)| s[3] > 0.0) {
            self.color[i] = [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [80, 64];

    /// Returns the mean error in the hole of a sheet of these colors, painted in a hole of 16 x 16 texels.
    fn error(color: impl Fn(usize, usize) -> [f32; 3], how: Paint) -> f32 {
        let truth: Vec<[f32; 3]> = (0..SIZE[0] * SIZE[1]).map(|i| color(i % SIZE[0], i / SIZE[0])).collect();
        let hole: Vec<bool> =
            (0..truth.len()).map(|i| (32..48).contains(&(i % SIZE[0])) && (24..40).contains(&(i / SIZE[0]))).collect();
        let known: Vec<bool> = hole.iter().map(|h| !h).collect();
        let mut painted: Vec<[f32; 3]> = truth.iter().zip(&hole).map(|(c, h)| if *h { [9.0; 3] } else { *c }).collect();
        fill(&mut painted, SIZE, &known, &hole, how, 1);
        let inside = || (0..truth.len()).filter(|i| hole[*i]);
        assert!((0..truth.len()).all(|i| hole[i] || painted[i] == truth[i]), "what is known is touched");
        inside().map(|i| (painted[i][0] - truth[i][0]).abs()).sum::<f32>() / inside().count() as f32
    }

    #[test]
    fn a_slope_of_light_goes_on_through_the_hole() {
        let slope = |x: usize, y: usize| [0.2 + 0.006 * x as f32 + 0.002 * y as f32; 3];
        assert!(error(slope, Paint::Smooth) < 0.01, "{}", error(slope, Paint::Smooth));
        assert!(error(slope, Paint::Patches) < 0.012, "{}", error(slope, Paint::Patches));
        assert!(error(slope, Paint::Telea) < 0.02, "{}", error(slope, Paint::Telea));
        assert!(error(slope, Paint::Nearest) > 2.0 * error(slope, Paint::Smooth), "{}", error(slope, Paint::Nearest));
    }

    #[test]
    fn texture_goes_on_where_a_film_would_blur_it() {
        // Tiles of 8 texels on a slope.
        let tiles = |x: usize, y: usize| {
            let dark = if (x / 4 + y / 4) % 2 == 0 { 0.3 } else { 0.0 };
            [0.2 + dark + 0.003 * x as f32; 3]
        };
        let (patches, smooth) = (error(tiles, Paint::Patches), error(tiles, Paint::Smooth));
        assert!(patches < 0.05 && smooth > 0.1, "{patches} {smooth}");
        assert!(error(tiles, Paint::Telea) > 2.0 * patches, "{}", error(tiles, Paint::Telea));
    }

    /// Grain along a slanted line, without a period.
    fn grain(x: usize, y: usize) -> [f32; 3] {
        let across = y as f32 - 0.3 * x as f32 + 100.0;
        let bright = |k: f32| (k.mul_add(12.9898, 4.1).sin() * 43_758.547).fract().abs();
        let (row, part) = ((across / 3.0).floor(), (across / 3.0).fract());
        [0.4 + 0.2 * (bright(row) * (1.0 - part) + bright(row + 1.0) * part); 3]
    }

    #[test]
    fn lines_go_on_through_the_hole_and_not_into_what_stands_beside_it() {
        let n = SIZE[0] * SIZE[1];
        let truth: Vec<[f32; 3]> = (0..n).map(|i| grain(i % SIZE[0], i / SIZE[0])).collect();
        let within =
            |i: usize, x: std::ops::Range<usize>| x.contains(&(i % SIZE[0])) && (24..40).contains(&(i / SIZE[0]));
        let hole: Vec<bool> = (0..n).map(|i| within(i, 32..48)).collect();
        let known: Vec<bool> = hole.iter().map(|h| !h).collect();
        let error = |color: &[[f32; 3]]| {
            let inside = || (0..n).filter(|i| hole[*i]);
            inside().map(|i| (color[i][0] - truth[i][0]).abs()).sum::<f32>() / inside().count() as f32
        };
        let run = |black: std::ops::Range<usize>| {
            let mut color = truth.clone();
            (0..n).filter(|i| within(*i, black.clone())).for_each(|i| color[i] = [0.0; 3]);
            fill(&mut color, SIZE, &known, &hole, Paint::Smooth, 1);
            let smooth = error(&color);
            continue_lines(&mut color, SIZE, &known, &hole, &vec![false; n]);
            (smooth, error(&color))
        };
        let (smooth, lines) = run(0..0);
        assert!(lines < 0.3 * smooth, "{lines} {smooth}");
        let (smooth, lines) = run(48..56);
        assert!(lines < smooth, "{lines} {smooth}");
    }

    #[test]
    fn nothing_known_and_everything_known_are_no_trouble() {
        let mut color = vec![[0.3; 3]; 9];
        fill(&mut color, [3, 3], &[false; 9], &[true; 9], Paint::Patches, 0);
        fill(&mut color, [3, 3], &[false; 9], &[true; 9], Paint::Telea, 0);
        assert!(color.iter().flatten().all(|c| c.is_finite()));
        let before = color.clone();
        fill(&mut color, [3, 3], &[true; 9], &[false; 9], Paint::Patches, 0);
        assert_eq!(color, before);
        fill(&mut [], [0, 0], &[], &[], Paint::Patches, 0);
    }
}
