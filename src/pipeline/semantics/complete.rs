//! Photos as evidence: what is known of a view, drawn into its photo, grows over what is unknown until the photo or the
//! shape of the scene says that something ends there.
//!
//! Growing is a race of all identities over the pixels: a pixel takes time where the photo or the depth changes, and
//! where its color is not one that the identity is known to have, compared with all others and with something never
//! seen. Whoever comes first keeps a pixel; where nobody comes in time it stays unknown.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::regions::edges::{ImagePlanes, strength};
use super::regions::lab::lab;
use super::votes::UNKNOWN;
use crate::math::grid::neighbors;
use crate::scene::IdentityId;

/// Lab is divided into cells of this size: lightness, and both color axes.
const CELL: [f32; 3] = [8.0, 7.0, 7.0];
/// Cells along each axis.
const CELLS: [usize; 3] = [13, 36, 36];
/// Weight of lightness in edges: shadows change it within a thing.
const LIGHTNESS: f32 = 0.7;

/// What a photo shows, in px of the view.
pub(crate) struct Terrain {
    pub(crate) width: usize,
    /// Cell of each pixel's color.
    cell: Vec<u32>,
    /// Time that a pixel takes for its edges.
    wall: Vec<f32>,
}

/// How patient and how strict growing is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GrowOptions {
    /// Time after which nobody comes any more.
    pub(crate) patience: f32,
    /// Time of a pixel without edges in a color that only this identity has.
    pub(crate) step: f32,
    /// Time per Lab step of an edge, and for the end of a surface.
    pub(crate) edge: f32,
    pub(crate) end: f32,
    /// Time per nat that the color speaks against the identity.
    pub(crate) color: f32,
    /// Least share of a pixel's weight for its identity to be known.
    pub(crate) share: f32,
    /// Share of colors that are of things never seen.
    pub(crate) unseen: f32,
}

impl Default for GrowOptions {
    fn default() -> Self {
        let env = |name: &str, v: f32| std::env::var(name).ok().and_then(|s| s.parse().ok()).unwrap_or(v);
        Self {
            patience: env("G_PAT", 10.0),
            step: env("G_STEP", 0.04),
            edge: env("G_EDGE", 0.12),
            end: env("G_END", 12.0),
            color: env("G_COLOR", 0.25),
            share: env("G_SHARE", 0.7),
            unseen: env("G_UNSEEN", 0.1),
        }
    }
}

impl Terrain {
    /// Of sRGB pixels, and of how clearly surfaces end at them, 0 to 1.
    pub(crate) fn new(width: usize, rgb: &[[u8; 3]], ends: Option<&[f32]>, options: &GrowOptions) -> Self {
        let colors = lab(rgb);
        let weights = [LIGHTNESS, 1.0, 1.0];
        let channels = [0, 1, 2].map(|c| colors.iter().map(|p| weights[c] * p[c]).collect::<Vec<f32>>());
        let strength = strength(&ImagePlanes { width, channels: &channels });
        let end = |i: usize| ends.map_or(0.0, |e| e[i]);
        let wall = (0..rgb.len()).map(|i| options.edge * strength[i] + options.end * end(i)).collect();
        Self { width, cell: colors.iter().map(|c| cell(*c)).collect(), wall }
    }
}

fn cell(lab: [f32; 3]) -> u32 {
    let at = |c: usize, low: f32| (((lab[c] - low) / CELL[c]).max(0.0) as usize).min(CELLS[c] - 1);
    ((at(0, 0.0) * CELLS[1] + at(1, -126.0)) * CELLS[2] + at(2, -126.0)) as u32
}

/// The colors that identities are known to have.
#[derive(Clone, Debug, Default)]
pub(crate) struct ColorModels {
    /// By identity, 0 = nobody: how often each cell was seen.
    counts: Vec<Vec<f32>>,
    /// The same, smoothed and as shares: what a color says for an identity, in nats against it.
    against: Vec<Vec<f32>>,
}

impl ColorModels {
    pub(crate) fn new(identities: usize) -> Self {
        Self { counts: vec![vec![0.0; CELLS.iter().product()]; identities + 1], against: Vec::new() }
    }

    /// Takes in what is known of a view.
    pub(crate) fn add(&mut self, terrain: &Terrain, known: &[IdentityId]) {
        for (cell, id) in terrain.cell.iter().zip(known) {
            if let Some(counts) = self.counts.get_mut(*id as usize) {
                counts[*cell as usize] += 1.0;
            }
        }
    }

    /// Compares what was taken in; `unseen` is the share of colors that are of none.
    pub(crate) fn compare(&mut self, unseen: f32) {
        let shares: Vec<Vec<f32>> = self.counts.iter().map(|c| smooth_shares(c)).collect();
        let cells: usize = CELLS.iter().product();
        // What nobody has seen may have any color of those that things have: about one in thirty cells.
        let anything = unseen * 30.0 / cells as f32;
        let all: Vec<f32> = (0..cells).map(|k| anything + shares.iter().map(|s| s[k]).sum::<f32>()).collect();
        let nats = |s: &f32, all: &f32| -(s / all).max(1e-3).ln();
        self.against = shares.iter().map(|s| s.iter().zip(&all).map(|(s, all)| nats(s, all)).collect()).collect();
    }

    fn against(&self, id: IdentityId, cell: u32) -> f32 {
        self.against.get(id as usize).map_or(0.0, |a| a[cell as usize])
    }
}

/// Shares that add up to 1, spread to neighboring cells.
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

/// Grows what is `known` (`UNKNOWN` where nothing is): label of every pixel, and the time at which it came, 0 where it
/// was known.
pub(crate) fn grow(
    terrain: &Terrain,
    known: &[IdentityId],
    colors: &ColorModels,
    options: &GrowOptions,
) -> (Vec<IdentityId>, Vec<f32>) {
    let n = known.len();
    let mut label = vec![UNKNOWN; n];
    let mut time = vec![f32::INFINITY; n];
    // Non-negative floats order like their bits.
    let mut open: BinaryHeap<Reverse<(u32, u32, IdentityId)>> = BinaryHeap::new();
    for i in (0..n).filter(|&i| known[i] != UNKNOWN) {
        (label[i], time[i]) = (known[i], 0.0);
        if neighbors(i, terrain.width, n).any(|j| known[j] == UNKNOWN) {
            open.push(Reverse((0, i as u32, known[i])));
        }
    }
    while let Some(Reverse((bits, i, id))) = open.pop() {
        let (i, now) = (i as usize, f32::from_bits(bits));
        if now > time[i] || label[i] != id {
            continue;
        }
        for j in neighbors(i, terrain.width, n).filter(|&j| known[j] == UNKNOWN) {
            let then = now + options.step + terrain.wall[j] + options.color * colors.against(id, terrain.cell[j]);
            if then < time[j] && then <= options.patience {
                (time[j], label[j]) = (then, id);
                open.push(Reverse((then.to_bits(), j as u32, id)));
            }
        }
    }
    (label, time)
}
