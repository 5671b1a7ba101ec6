//! Tile binning: the list of splats that reach each tile, in depth order.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use rayon::prelude::*;

use super::chunk::Chunk;
use super::project::Splat;
use super::sort::{self, KeptOrder};
use crate::math::Real;
use crate::render::TILE_PX;

/// Tile lists and, for the backward pass, the way back from a splat to its entries.
#[derive(Debug, Default)]
pub(crate) struct Tiles {
    /// Tiles per row and per column.
    pub(crate) grid: [usize; 2],
    /// Tile `t` owns `entries[first[t]..first[t + 1]]`.
    pub(crate) first: Vec<u32>,
    /// Splats of all tiles, tile after tile, each tile's front to back: keys of [`sort::key`]. Written once from
    /// several threads to disjoint places, hence atomics (relaxed ones cost nothing).
    pub(crate) entries: Vec<AtomicU64>,
    /// The splat at place `p` has its entries in `ways_back[span[p]..span[p + 1]]`.
    pub(crate) span: Vec<u32>,
    /// Places in `entries`, splat after splat.
    pub(crate) ways_back: Vec<u32>,
}

/// Inclusive tile rectangle `[x0, y0, x1, y1]` of the tiles with a pixel center inside the splat's
/// bounding box; `None` if there is none.
#[inline(always)]
fn rectangle<R: Real>(s: &Splat<R>, size: [usize; 2]) -> Option<[usize; 4]> {
    let mut r = [0; 4];
    for axis in 0..2 {
        let lo = (s.mean[axis] - s.half[axis]).f64() - 0.5;
        let hi = (s.mean[axis] + s.half[axis]).f64() - 0.5;
        let lo = lo.ceil().max(0.0);
        let hi = hi.floor().min(size[axis] as f64 - 1.0);
        if !(lo <= hi) {
            return None;
        }
        r[axis] = lo as usize / TILE_PX;
        r[axis + 2] = hi as usize / TILE_PX;
    }
    Some(r)
}

/// Squared Mahalanobis distances from a splat, with the terms that all tiles share.
struct Distances<R> {
    conic: [R; 3],
    /// Slopes to the nearest point of an edge: for edges along y, y over x; for those along x, x over y.
    slopes: [R; 2],
}

impl<R: Real> Distances<R> {
    #[inline(always)]
    fn new(s: &Splat<R>) -> Self {
        let [a, b, c] = s.conic;
        Self { conic: s.conic, slopes: [-b / c, -b / a] }
    }

    /// The smallest over a rectangle of pixel centers, given by its edges' offsets from the splat's center.
    #[inline(always)]
    fn nearest(&self, [x0, x1]: [R; 2], [y0, y1]: [R; 2]) -> R {
        // The minimum lies on the edges that face the center.
        let facing = |from: R, to: R| if from > R::ZERO { from } else { to };
        let between = |v: R, from: R, to: R| {
            let v = if v > from { v } else { from };
            if v < to { v } else { to }
        };
        let [a, b, c] = self.conic;
        let q = |x: R, y: R| a * x * x + R::of(2.0) * b * x * y + c * y * y;
        let inside = |from: R, to: R| from <= R::ZERO && to >= R::ZERO;
        let along_y = |x: R| q(x, between(self.slopes[0] * x, y0, y1));
        let along_x = |y: R| q(between(self.slopes[1] * y, x0, x1), y);
        match (inside(x0, x1), inside(y0, y1)) {
            (true, true) => R::ZERO,
            (false, true) => along_y(facing(x0, x1)),
            (true, false) => along_x(facing(y0, y1)),
            (false, false) => {
                let (p, q) = (along_y(facing(x0, x1)), along_x(facing(y0, y1)));
                if p < q { p } else { q }
            }
        }
    }
}

/// Calls `found` for every tile that the splat reaches.
#[inline(always)]
fn each_tile<R: Real>(s: &Splat<R>, size: [usize; 2], columns: usize, mut found: impl FnMut(u32)) {
    let Some([x0, y0, x1, y1]) = rectangle(s, size) else { return };
    if x0 == x1 && y0 == y1 {
        return found((y0 * columns + x0) as u32);
    }
    let distances = Distances::new(s);
    // Offsets of a tile's first and last pixel centers.
    let ends = |axis: usize, tile: usize| {
        let center = |p: usize| R::of(p.min(size[axis] - 1) as f64 + 0.5) - s.mean[axis];
        [center(tile * TILE_PX), center(tile * TILE_PX + TILE_PX - 1)]
    };
    for ty in y0..=y1 {
        let rows = ends(1, ty);
        for tx in x0..=x1 {
            if distances.nearest(ends(0, tx), rows) <= s.reach {
                found((ty * columns + tx) as u32);
            }
        }
    }
}

struct Share {
    tiles: Vec<u32>,
    lengths: Vec<u32>,
    counts: Vec<u32>,
}

/// Finds the tiles of the splats of these parts.
#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
fn share_of<R: Real>(parts: &[Chunk<R>], size: [usize; 2], grid: [usize; 2]) -> Share {
    let splats: usize = parts.iter().map(|p| p.splats.len()).sum();
    let mut s = Share {
        tiles: Vec::with_capacity(splats * 2),
        lengths: Vec::with_capacity(splats),
        counts: vec![0; grid[0] * grid[1]],
    };
    for splat in parts.iter().flat_map(|p| &p.splats) {
        let before = s.tiles.len();
        let (list, counts) = (&mut s.tiles, &mut s.counts);
        each_tile(splat, size, grid[0], |t| {
            list.push(t);
            counts[t as usize] += 1;
        });
        s.lengths.push((s.tiles.len() - before) as u32);
    }
    s
}

/// Builds the lists of all splats, in the cloud's order, with keys to sort by: depths, or the order that is `kept`.
pub(crate) fn bin<R: Real>(out: &mut Tiles, parts: &[Chunk<R>], kept: Option<&KeptOrder>, size: [usize; 2]) {
    let grid = [size[0].div_ceil(TILE_PX), size[1].div_ceil(TILE_PX)];
    let tiles = grid[0] * grid[1];
    // A fixed number of shares: the lists do not depend on the number of threads anyway, but the
    // counters of a share cost `tiles` words each.
    let share = parts.len().div_ceil(2 * rayon::current_num_threads()).max(1);
    let mut shares: Vec<Share> = parts.par_chunks(share).map(|parts| share_of(parts, size, grid)).collect();

    // Counts become first places: tile-major, and within a tile share after share.
    out.grid = grid;
    out.first.clear();
    out.first.reserve(tiles + 1);
    let mut at = 0;
    for t in 0..tiles {
        out.first.push(at);
        for s in &mut shares {
            at += std::mem::replace(&mut s.counts[t], at);
        }
    }
    out.first.push(at);

    out.entries.resize_with(at as usize, AtomicU64::default);
    let entries = &out.entries;
    shares.par_iter_mut().zip(parts.par_chunks(share)).enumerate().for_each(|(k, (s, parts))| {
        let (mut tiles, mut lengths) = (s.tiles.iter(), s.lengths.iter());
        for (p, part) in parts.iter().enumerate() {
            for (i, (splat, &length)) in part.splats.iter().zip(&mut lengths).enumerate() {
                let order = kept.map_or_else(|| sort::by_depth(splat), |kept| kept.order(splat));
                let key = sort::key(order, sort::place(k * share + p, i));
                for &tile in tiles.by_ref().take(length as usize) {
                    let next = &mut s.counts[tile as usize];
                    entries[*next as usize].store(key, Relaxed);
                    *next += 1;
                }
            }
        }
    });
}

impl Tiles {
    /// The place of the splat of entry `k`.
    #[inline(always)]
    pub(crate) fn splat(&self, k: usize) -> u32 {
        self.entries[k].load(Relaxed) as u32
    }

    /// Finds the entries of each splat; the splats' places are under `places`.
    pub(crate) fn find_ways_back(&mut self, places: usize) {
        self.span.clear();
        self.span.resize(places + 2, 0);
        for k in 0..self.entries.len() {
            let place = self.splat(k) as usize;
            self.span[place + 2] += 1;
        }
        (1..places + 2).for_each(|p| self.span[p] += self.span[p - 1]);
        self.ways_back.resize(self.entries.len(), 0);
        for k in 0..self.entries.len() {
            // Becomes the end of this splat's span, once all are there.
            let next = &mut self.span[self.entries[k].load(Relaxed) as u32 as usize + 1];
            self.ways_back[*next as usize] = k as u32;
            *next += 1;
        }
    }

    /// Entries of the splat at `place`, tile after tile.
    #[inline(always)]
    pub(crate) fn ways_back(&self, place: u32) -> &[u32] {
        &self.ways_back[self.span[place as usize] as usize..self.span[place as usize + 1] as usize]
    }
}
