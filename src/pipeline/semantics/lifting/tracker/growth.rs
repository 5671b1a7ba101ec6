//! Growth of known labels over a photo.
//!
//! Growing is a race of all identities over the pixels. Changes of the photo or the depth cost a pixel time. So does a
//! color that is not known of the identity, compared with those of all others and of unseen things. The first identity
//! to arrive keeps the pixel; a pixel that none reaches in time stays unknown.

use super::super::regions::edges::{ImagePlanes, strength};
use super::super::regions::lab::{lab, planes};
use super::super::votes::UNKNOWN;
use crate::math::grid::neighbors;
use crate::scene::IdentityId;

/// Lab is divided into cells of this size: lightness, and both color axes.
const CELL: [f32; 3] = [8.0, 7.0, 7.0];
/// Cells along each axis.
const CELLS: [usize; 3] = [13, 36, 36];

/// Colors and edges of a photo, in px of the view.
pub(super) struct GrowthGrid {
    width: usize,
    /// Cell of each pixel's color.
    cell: Vec<u32>,
    /// Time that a pixel takes for its edges.
    edge_cost: Vec<f32>,
}

/// Limits and costs of growing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GrowOptions {
    /// Time limit of growing.
    time_limit: f32,
    /// Time of a pixel without edges in a color of this identity alone.
    step: f32,
    /// Time per Lab step of an edge, and for the end of a surface.
    edge: f32,
    end: f32,
    /// Time per nat of evidence of the color against the identity.
    color: f32,
    /// Nats from which a color is excluded for the identity.
    most: f32,
    /// Least share of a pixel's weight for its identity to be known.
    pub(super) share: f32,
    /// Share of colors of unseen things.
    pub(super) unseen: f32,
}

impl Default for GrowOptions {
    fn default() -> Self {
        Self { time_limit: 10.0, step: 0.04, edge: 0.12, end: 12.0, color: 0.25, most: 2.5, share: 0.7, unseen: 0.1 }
    }
}

impl GrowthGrid {
    /// Creates the terrain of sRGB pixels with surface ends, 0 to 1 each.
    pub(super) fn new(width: usize, rgb: &[[u8; 3]], ends: Option<&[f32]>, options: &GrowOptions) -> Self {
        let colors = lab(rgb);
        let strength = strength(&ImagePlanes { width, channels: &planes(&colors) });
        let end = |i: usize| ends.map_or(0.0, |e| e[i]);
        let edge_cost = (0..rgb.len()).map(|i| options.edge * strength[i] + options.end * end(i)).collect();
        Self { width, cell: colors.iter().map(|c| cell(*c)).collect(), edge_cost }
    }
}

fn cell(lab: [f32; 3]) -> u32 {
    let at = |c: usize, low: f32| (((lab[c] - low) / CELL[c]).max(0.0) as usize).min(CELLS[c] - 1);
    ((at(0, 0.0) * CELLS[1] + at(1, -126.0)) * CELLS[2] + at(2, -126.0)) as u32
}

/// Number of pixels of each color cell, by identity, 0 = nobody.
pub(super) struct ColorCounts(Vec<Vec<f32>>);

/// Evidence of each color cell against each identity, compared with all others and with unseen things, in nats.
pub(super) struct ColorModels(Vec<Vec<f32>>);

impl ColorCounts {
    pub(super) fn new(identities: usize) -> Self {
        Self(vec![vec![0.0; CELLS.iter().product()]; identities + 1])
    }

    /// Counts the colors of a view by its known labels.
    pub(super) fn add(&mut self, grid: &GrowthGrid, known: &[IdentityId]) {
        for (cell, id) in grid.cell.iter().zip(known) {
            if let Some(counts) = self.0.get_mut(*id as usize) {
                counts[*cell as usize] += 1.0;
            }
        }
    }

    /// Compares the counted colors; `unseen` is the share of colors of unseen things.
    pub(super) fn compare(self, unseen: f32) -> ColorModels {
        let shares: Vec<Vec<f32>> = self.0.iter().map(|c| smooth_shares(c)).collect();
        let cells: usize = CELLS.iter().product();
        // Unseen things may have any color that things have: about one in thirty cells.
        let anything = unseen * 30.0 / cells as f32;
        let all: Vec<f32> = (0..cells).map(|k| anything + shares.iter().map(|s| s[k]).sum::<f32>()).collect();
        let nats = |s: &f32, all: &f32| -(s / all).max(1e-3).ln();
        ColorModels(shares.iter().map(|s| s.iter().zip(&all).map(|(s, all)| nats(s, all)).collect()).collect())
    }
}

impl ColorModels {
    fn against(&self, id: IdentityId, cell: u32) -> f32 {
        self.0.get(id as usize).map_or(0.0, |a| a[cell as usize])
    }
}

/// Returns shares that add up to 1, spread to neighboring cells.
fn smooth_shares(counts: &[f32]) -> Vec<f32> {
    let strides = [CELLS[1] * CELLS[2], CELLS[2], 1];
    let mut out = counts.to_vec();
    for (axis, stride) in strides.into_iter().enumerate() {
        let from = out.clone();
        for (k, v) in out.iter_mut().enumerate() {
            let at = k / stride % CELLS[axis];
            let side = |ok: bool, j: usize| if ok { from[j] } else { 0.0 };
            *v = 0.5 * from[k]
                + 0.25 * side(at > 0, k.wrapping_sub(stride))
                + 0.25 * side(at + 1 < CELLS[axis], (k + stride).min(from.len() - 1));
        }
    }
    let sum: f32 = out.iter().sum();
    out.iter_mut().for_each(|v| *v /= sum.max(1.0));
    out
}

/// Grows the `known` labels (`UNKNOWN` elsewhere); returns the label of every pixel.
pub(super) fn grow(
    grid: &GrowthGrid,
    known: &[IdentityId],
    colors: &ColorModels,
    options: &GrowOptions,
) -> Vec<IdentityId> {
    let n = known.len();
    let mut label = vec![UNKNOWN; n];
    let mut time = vec![f32::INFINITY; n];
    // A step takes two spans at least, so that nothing new comes into the span in turn: sorted once, it is in order.
    let span = |time: f32| (time / (0.5 * options.step)) as usize;
    let mut open: Vec<Vec<u64>> = vec![Vec::new(); span(options.time_limit) + 1];
    // By time, then by pixel. Non-negative floats order like their bits.
    let key = |time: f32, i: usize| u64::from(time.to_bits()) << 32 | i as u64;
    for i in (0..n).filter(|&i| known[i] != UNKNOWN) {
        (label[i], time[i]) = (known[i], 0.0);
        if neighbors(i, grid.width, n).any(|j| known[j] == UNKNOWN) {
            open[0].push(key(0.0, i));
        }
    }
    for turn in 0..open.len() {
        let mut arrived = std::mem::take(&mut open[turn]);
        arrived.sort_unstable();
        for key_of in arrived {
            let (i, now) = (key_of as u32 as usize, f32::from_bits((key_of >> 32) as u32));
            // Another one was faster.
            if now > time[i] {
                continue;
            }
            let id = label[i];
            for j in neighbors(i, grid.width, n).filter(|&j| known[j] == UNKNOWN) {
                let against = colors.against(id, grid.cell[j]);
                let then = now + options.step + grid.edge_cost[j] + options.color * against;
                if against <= options.most && then < time[j] && then <= options.time_limit {
                    (time[j], label[j]) = (then, id);
                    open[span(then)].push(key(then, j));
                }
            }
        }
    }
    label
}

#[cfg(test)]
mod tests {
    use std::cmp::Reverse;
    use std::collections::BinaryHeap;

    use super::*;
    use crate::scene::NO_IDENTITY;

    const W: usize = 40;
    const RED: [u8; 3] = [200, 40, 40];
    const BLUE: [u8; 3] = [40, 60, 200];
    const GREEN: [u8; 3] = [40, 190, 60];

    /// Grows the known labels in a picture of columns.
    fn grown(
        color: impl Fn(usize) -> [u8; 3],
        known: impl Fn(usize) -> IdentityId,
        end: Option<usize>,
    ) -> Vec<IdentityId> {
        let options = GrowOptions::default();
        let rgb: Vec<[u8; 3]> = (0..W * 10).map(|i| color(i % W)).collect();
        let known: Vec<IdentityId> = (0..W * 10).map(|i| known(i % W)).collect();
        let ends: Option<Vec<f32>> = end.map(|x| (0..W * 10).map(|i| f32::from(u8::from(i % W == x))).collect());
        let grid = GrowthGrid::new(W, &rgb, ends.as_deref(), &options);
        let mut counts = ColorCounts::new(2);
        counts.add(&grid, &known);
        let colors = counts.compare(options.unseen);
        grow(&grid, &known, &colors, &options)[5 * W..6 * W].to_vec()
    }

    #[test]
    fn what_is_known_grows_to_where_the_color_changes() {
        let color = |x: usize| if x < 20 { RED } else { BLUE };
        let known = |x: usize| {
            if x < 4 {
                1
            } else if x >= 36 {
                NO_IDENTITY
            } else {
                UNKNOWN
            }
        };
        let row = grown(color, known, None);
        // The border stays open: it belongs to both sides a little.
        assert!(row[..16].iter().all(|id| *id == 1), "{row:?}");
        assert!(row[24..].iter().all(|id| *id == NO_IDENTITY), "{row:?}");
        assert!(row[16..20].iter().all(|id| *id != NO_IDENTITY) && row[20..24].iter().all(|id| *id != 1), "{row:?}");
    }

    #[test]
    fn a_color_that_nothing_has_stays_unknown() {
        let color = |x: usize| {
            if x < 12 {
                RED
            } else if x < 28 {
                GREEN
            } else {
                BLUE
            }
        };
        let known = |x: usize| {
            if x < 4 {
                1
            } else if x >= 36 {
                2
            } else {
                UNKNOWN
            }
        };
        let row = grown(color, known, None);
        assert!(row[14..26].iter().all(|id| *id == UNKNOWN), "{row:?}");
        assert!(row[..8].iter().all(|id| *id == 1) && row[32..].iter().all(|id| *id == 2), "{row:?}");
    }

    #[test]
    fn the_end_of_a_surface_stops_it_whatever_the_color() {
        let known = |x: usize| if x < 4 { 1 } else { UNKNOWN };
        assert_eq!(grown(|_| RED, known, None), [1; W], "the control: nothing ends");
        let row = grown(|_| RED, known, Some(25));
        assert!(row[..25].iter().all(|id| *id == 1) && row[26..].iter().all(|id| *id == UNKNOWN), "{row:?}");
    }

    #[test]
    fn nothing_known_grows_nothing_and_what_is_known_stays() {
        assert_eq!(grown(|_| RED, |_| UNKNOWN, None), [UNKNOWN; W]);
        let known = |x: usize| if x % 2 == 0 { 1 } else { 2 };
        let row = grown(|_| BLUE, known, None);
        assert!((0..W).all(|x| row[x] == known(x)));
    }

    /// The same with one heap of all open pixels.
    fn grown_by_heap(
        grid: &GrowthGrid,
        known: &[IdentityId],
        colors: &ColorModels,
        options: &GrowOptions,
    ) -> Vec<IdentityId> {
        let n = known.len();
        let mut label = vec![UNKNOWN; n];
        let mut time = vec![f32::INFINITY; n];
        // Non-negative floats order like their bits.
        let mut open: BinaryHeap<Reverse<(u32, u32, IdentityId)>> = BinaryHeap::new();
        for i in (0..n).filter(|&i| known[i] != UNKNOWN) {
            (label[i], time[i]) = (known[i], 0.0);
            if neighbors(i, grid.width, n).any(|j| known[j] == UNKNOWN) {
                open.push(Reverse((0, i as u32, known[i])));
            }
        }
        while let Some(Reverse((bits, i, id))) = open.pop() {
            let (i, now) = (i as usize, f32::from_bits(bits));
            if now > time[i] || label[i] != id {
                continue;
            }
            for j in neighbors(i, grid.width, n).filter(|&j| known[j] == UNKNOWN) {
                let against = colors.against(id, grid.cell[j]);
                let then = now + options.step + grid.edge_cost[j] + options.color * against;
                if against <= options.most && then < time[j] && then <= options.time_limit {
                    (time[j], label[j]) = (then, id);
                    open.push(Reverse((then.to_bits(), j as u32, id)));
                }
            }
        }
        label
    }

    #[test]
    fn spans_of_time_give_the_labels_that_a_heap_gives() {
        let mut random = 3_u32;
        let mut next = |n: u32| {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 16) % n
        };
        let options = GrowOptions::default();
        for flat in [false, true] {
            // Patches of few colors, some of them noisy: many pixels are reached at the same time.
            let patches: Vec<[u8; 3]> = (0..6).map(|_| [RED, BLUE, GREEN][next(3) as usize]).collect();
            let at = |i: usize| patches[i / W / 20 * 2 + i % W / 20];
            let mut noisy = |i: usize| at(i).map(|c| c.saturating_add(if flat { 0 } else { next(6) as u8 }));
            let rgb: Vec<[u8; 3]> = (0..W * 60).map(&mut noisy).collect();
            let ends: Vec<f32> = (0..W * 60).map(|i| if i % 11 == 3 { 0.02 * next(20) as f32 } else { 0.0 }).collect();
            let known: Vec<IdentityId> = (0..W * 60).map(|_| if next(40) == 0 { next(3) } else { UNKNOWN }).collect();
            let grid = GrowthGrid::new(W, &rgb, Some(&ends), &options);
            let mut counts = ColorCounts::new(2);
            counts.add(&grid, &known);
            let colors = counts.compare(options.unseen);
            let labels = grow(&grid, &known, &colors, &options);
            assert_eq!(labels, grown_by_heap(&grid, &known, &colors, &options), "flat: {flat}");
            let count = |id: IdentityId| labels.iter().filter(|l| **l == id).count();
            assert!([0, 1, 2].iter().all(|id| count(*id) > 100) && count(UNKNOWN) > 0, "{flat}");
            // The control: half the time reaches less.
            let soon = GrowOptions { time_limit: 0.5 * options.time_limit, ..options };
            assert_ne!(grow(&grid, &known, &colors, &soon), labels);
        }
    }
}
