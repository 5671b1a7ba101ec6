//! Front-to-back compositing of one row of tiles.

use std::sync::atomic::Ordering::Relaxed;

use super::bin::Tiles;
use super::lanes::{GROUPS, LANES, Lane, SLOTS, Walk, alphas, row_terms};
use super::project::Splat;
use crate::math::Real;
use crate::render::{TILE_PX, TRANSMITTANCE_MIN};

/// Splats between two looks at which pixels are still open.
const CLOSED_CHECK: usize = 16;

/// The rows of the output planes that one row of tiles writes, `width * rows` values each.
pub struct RowOut<'a, R> {
    /// Composited values, without background; as many planes as are wanted, at most `C`.
    pub planes: Vec<&'a mut [R]>,
    /// Transmittance left.
    pub transmittance: &'a mut [R],
    /// One past the position in the tile's list of the last splat that contributed; 0 = none.
    pub last: &'a mut [u32],
    /// Median depth; empty = not wanted.
    pub median: &'a mut [R],
}

/// Blends the tiles of row `ty`. Returns the number of splat-pixel products evaluated.
#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
pub fn blend_row<R: Real, const C: usize>(
    splats: &[Splat<R>],
    values: &[R],
    tiles: &Tiles,
    size: [usize; 2],
    ty: usize,
    out: &mut RowOut<'_, R>,
) -> u64 {
    let (values, _) = values.as_chunks::<C>();
    let mut products = 0;
    for tx in 0..tiles.grid[0] {
        products += if out.median.is_empty() {
            blend_tile::<R, C, false>(splats, values, tiles, size, [tx, ty], out)
        } else {
            blend_tile::<R, C, true>(splats, values, tiles, size, [tx, ty], out)
        };
    }
    products
}

#[inline(always)]
fn blend_tile<R: Real, const C: usize, const MEDIAN: bool>(
    splats: &[Splat<R>],
    values: &[[R; C]],
    tiles: &Tiles,
    size: [usize; 2],
    tile: [usize; 2],
    out: &mut RowOut<'_, R>,
) -> u64 {
    let corner = [tile[0] * TILE_PX, tile[1] * TILE_PX];
    let height = TILE_PX.min(size[1] - corner[1]);
    let width = TILE_PX.min(size[0] - corner[0]);
    let index = tile[1] * tiles.grid[0] + tile[0];
    let (first, end) = (tiles.first[index] as usize, tiles.first[index + 1] as usize);

    let mut sums = [[[R::ZERO; LANES]; SLOTS]; C];
    let mut left = [[R::ONE; LANES]; SLOTS];
    let mut open = [[R::ONE; LANES]; SLOTS];
    let mut last = [[0_u32; LANES]; SLOTS];
    let mut median = [[R::ZERO; LANES]; SLOTS];
    let mut closed = [false; SLOTS];
    let mut groups_done = 0_u64;

    for (k, entry) in tiles.entries[first..end].iter().enumerate() {
        let id = entry.load(Relaxed) as usize;
        let s = splats[id];
        let value = &values[id];
        let walk = Walk::new(&s, corner, height);
        for row in walk.rows.clone() {
            let dy = walk.dy(row);
            let terms = row_terms(&s, dy);
            for g in walk.groups(dy) {
                let slot = row * GROUPS + g;
                if closed[slot] {
                    continue;
                }
                groups_done += 1;
                let alpha = alphas(&s, &walk.dx[g], terms);
                let weight = attenuate(&alpha, &mut left[slot], &mut open[slot], |l, before, after| {
                    if MEDIAN && before > R::HALF && after <= R::HALF {
                        median[slot][l] = s.depth;
                    }
                });
                for l in 0..LANES {
                    last[slot][l] = if weight[l] > R::ZERO { k as u32 + 1 } else { last[slot][l] };
                }
                for c in 0..C {
                    for l in 0..LANES {
                        sums[c][slot][l] += weight[l] * value[c];
                    }
                }
            }
        }
        if k % CLOSED_CHECK == CLOSED_CHECK - 1 {
            let mut all = true;
            for slot in 0..height * GROUPS {
                closed[slot] = open[slot].iter().fold(R::ZERO, |m, &o| m + o) == R::ZERO;
                all &= closed[slot];
            }
            if all {
                break;
            }
        }
    }

    for row in 0..height {
        for g in 0..width.div_ceil(LANES) {
            let slot = row * GROUPS + g;
            let lanes = LANES.min(width - g * LANES);
            let at = row * size[0] + corner[0] + g * LANES;
            for (c, plane) in out.planes.iter_mut().enumerate() {
                plane[at..at + lanes].copy_from_slice(&sums[c][slot][..lanes]);
            }
            out.transmittance[at..at + lanes].copy_from_slice(&left[slot][..lanes]);
            out.last[at..at + lanes].copy_from_slice(&last[slot][..lanes]);
            if MEDIAN {
                out.median[at..at + lanes].copy_from_slice(&median[slot][..lanes]);
            }
        }
    }
    groups_done * LANES as u64
}

/// Lets a splat of the given alphas take its share of each open pixel's light. Returns the weights
/// `alpha * transmittance`; `seen` is told the transmittance before and after.
#[inline(always)]
fn attenuate<R: Real>(
    alpha: &Lane<R>,
    left: &mut Lane<R>,
    open: &mut Lane<R>,
    mut seen: impl FnMut(usize, R, R),
) -> Lane<R> {
    let mut weight = [R::ZERO; LANES];
    for l in 0..LANES {
        let before = left[l];
        let after = before * (R::ONE - alpha[l]);
        let still = if after >= R::of(TRANSMITTANCE_MIN) { open[l] } else { R::ZERO };
        open[l] = still;
        weight[l] = if still > R::ZERO { alpha[l] * before } else { R::ZERO };
        left[l] = if still > R::ZERO { after } else { before };
        seen(l, before, left[l]);
    }
    weight
}
