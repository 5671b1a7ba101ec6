//! Gradients of one row of tiles: back-to-front walk over what [`super::blend`] composited.
//!
//! Per tile entry the pass leaves the sums over the tile's pixels of `dL/dpower` (power = -q/2)
//! times `1, dx, dy, dx², dx dy, dy²`, then `dL/dvalue` per channel. Everything about the splat's
//! shape follows from those six moments.

use std::sync::atomic::Ordering::Relaxed;

use super::bin::Tiles;
use super::lanes::{GROUPS, LANES, Lane, SLOTS, Walk, alphas, row_terms};
use super::project::Splat;
use crate::math::Real;
use crate::render::{ALPHA_MAX, TILE_PX};

/// Moments in front of the channels in a tile entry's record.
pub const MOMENTS: usize = 6;

/// What the backward pass reads of one row of tiles, `width * rows` values each.
pub struct RowIn<'a, R> {
    /// `dL/dplane` for each channel; missing or empty = zero.
    pub planes: Vec<&'a [R]>,
    /// `dL/dtransmittance`: background times colour gradient, minus the gradient of alpha.
    pub transmittance_gradient: &'a [R],
    /// Transmittance left by the forward pass.
    pub transmittance: &'a [R],
    /// As the forward pass left it.
    pub last: &'a [u32],
}

/// Fills `records` (`MOMENTS + C` values per entry of the tile row, in the order of the lists).
#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
pub fn blend_row_backward<R: Real, const C: usize>(
    splats: &[Splat<R>],
    values: &[R],
    tiles: &Tiles,
    size: [usize; 2],
    ty: usize,
    input: &RowIn<'_, R>,
    records: &mut [R],
) {
    let (values, _) = values.as_chunks::<C>();
    let base = tiles.first[ty * tiles.grid[0]] as usize;
    for tx in 0..tiles.grid[0] {
        let t = ty * tiles.grid[0] + tx;
        let (first, end) = (tiles.first[t] as usize, tiles.first[t + 1] as usize);
        let stride = MOMENTS + C;
        let own = &mut records[(first - base) * stride..(end - base) * stride];
        tile_backward::<R, C>(splats, values, tiles, size, [tx, ty], input, own);
    }
}

#[inline(always)]
fn tile_backward<R: Real, const C: usize>(
    splats: &[Splat<R>],
    values: &[[R; C]],
    tiles: &Tiles,
    size: [usize; 2],
    tile: [usize; 2],
    input: &RowIn<'_, R>,
    records: &mut [R],
) {
    let corner = [tile[0] * TILE_PX, tile[1] * TILE_PX];
    let height = TILE_PX.min(size[1] - corner[1]);
    let width = TILE_PX.min(size[0] - corner[0]);
    let index = tile[1] * tiles.grid[0] + tile[0];
    let first = tiles.first[index] as usize;

    let mut gradient = [[[R::ZERO; LANES]; SLOTS]; C];
    let mut left = [[R::ONE; LANES]; SLOTS];
    // Light that arrives from behind the current splat, times its gradient.
    let mut behind = [[R::ZERO; LANES]; SLOTS];
    let mut last = [[0_u32; LANES]; SLOTS];
    let mut furthest = [0_u32; SLOTS];
    for row in 0..height {
        for g in 0..width.div_ceil(LANES) {
            let slot = row * GROUPS + g;
            let lanes = LANES.min(width - g * LANES);
            let at = row * size[0] + corner[0] + g * LANES;
            for (c, plane) in input.planes.iter().enumerate().filter(|(_, p)| !p.is_empty()) {
                gradient[c][slot][..lanes].copy_from_slice(&plane[at..at + lanes]);
            }
            left[slot][..lanes].copy_from_slice(&input.transmittance[at..at + lanes]);
            last[slot][..lanes].copy_from_slice(&input.last[at..at + lanes]);
            for l in 0..lanes {
                behind[slot][l] = left[slot][l] * input.transmittance_gradient[at + l];
            }
            furthest[slot] = last[slot].iter().fold(0, |m, &v| m.max(v));
        }
    }
    let deepest = furthest.iter().fold(0, |m, &v| m.max(v)) as usize;

    let stride = MOMENTS + C;
    records[deepest * stride..].fill(R::ZERO);
    for k in (0..deepest).rev() {
        let id = tiles.entries[first + k].load(Relaxed) as usize;
        let s = splats[id];
        let value = &values[id];
        let walk = Walk::new(&s, corner, height);
        let mut moments = [[R::ZERO; LANES]; MOMENTS];
        let mut value_sums = [[R::ZERO; LANES]; C];
        for row in walk.rows.clone() {
            let dy = walk.dy(row);
            let terms = row_terms(&s, dy);
            for g in walk.groups(dy) {
                let slot = row * GROUPS + g;
                if (k as u32) >= furthest[slot] {
                    continue;
                }
                let dx = &walk.dx[g];
                let mut alpha = alphas(&s, dx, terms);
                for l in 0..LANES {
                    alpha[l] = if (k as u32) < last[slot][l] { alpha[l] } else { R::ZERO };
                }
                let mut along = [R::ZERO; LANES];
                for c in 0..C {
                    for l in 0..LANES {
                        along[l] += gradient[c][slot][l] * value[c];
                    }
                }
                let (weight, power) = unwind(&alpha, &along, &mut left[slot], &mut behind[slot]);
                for c in 0..C {
                    for l in 0..LANES {
                        value_sums[c][l] += weight[l] * gradient[c][slot][l];
                    }
                }
                for l in 0..LANES {
                    let px = power[l] * dx[l];
                    let py = power[l] * dy;
                    moments[0][l] += power[l];
                    moments[1][l] += px;
                    moments[2][l] += py;
                    moments[3][l] += px * dx[l];
                    moments[4][l] += px * dy;
                    moments[5][l] += py * dy;
                }
            }
        }
        let record = &mut records[k * stride..(k + 1) * stride];
        for (r, lanes) in record.iter_mut().zip(moments.iter().chain(&value_sums)) {
            *r = sum(lanes);
        }
    }
}

/// Takes one splat off each pixel: restores the transmittance in front of it and returns its
/// weight and `dL/dpower`. `along` is the gradient of the picture along the splat's value.
#[inline(always)]
fn unwind<R: Real>(alpha: &Lane<R>, along: &Lane<R>, left: &mut Lane<R>, behind: &mut Lane<R>) -> (Lane<R>, Lane<R>) {
    let mut weight = [R::ZERO; LANES];
    let mut power = [R::ZERO; LANES];
    for l in 0..LANES {
        let inverse = R::ONE / (R::ONE - alpha[l]);
        let before = left[l] * inverse;
        weight[l] = alpha[l] * before;
        let d_alpha = before * along[l] - behind[l] * inverse;
        // A capped alpha does not depend on the splat's opacity or shape.
        power[l] = if alpha[l] < R::of(ALPHA_MAX) { alpha[l] * d_alpha } else { R::ZERO };
        behind[l] += weight[l] * along[l];
        left[l] = before;
    }
    (weight, power)
}

/// Sum over lanes in a fixed order.
#[inline(always)]
fn sum<R: Real>(v: &Lane<R>) -> R {
    ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]))
}
