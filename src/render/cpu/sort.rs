//! Front-to-back order of the splats: within each tile, which is all that compositing asks for. Splats stay where the
//! projection left them, so those of a tile lie as near one another as their Gaussians do in the cloud.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use rayon::prelude::*;

use super::chunk::{CHUNK, Chunk};
use super::project::Splat;
use crate::math::Real;

/// The order of splats that were not in the frame before.
const LAST: u32 = u32::MAX;

/// Place of a splat among the parts, as one number.
pub(crate) fn place(part: usize, i: usize) -> u32 {
    (part * CHUNK + i) as u32
}

/// The part of a place and the number in there.
#[inline(always)]
pub(crate) fn part_of(place: u32) -> (usize, usize) {
    (place as usize / CHUNK, place as usize % CHUNK)
}

/// Sort key of an entry: order first, equal ones as in the cloud. Unique, so that an unstable sort is deterministic.
#[inline(always)]
pub(crate) fn key(order: u32, place: u32) -> u64 {
    u64::from(order) << 32 | u64::from(place)
}

/// Depths are positive, so their bit patterns order like the numbers.
#[inline(always)]
pub(crate) fn by_depth<R: Real>(splat: &Splat<R>) -> u32 {
    splat.depth.f32().to_bits()
}

/// An order of Gaussians that is kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct KeptOrder(Vec<u32>);

impl KeptOrder {
    /// Order of the last frame's splats, which may itself have been kept.
    pub(crate) fn of<R: Real>(parts: &[Chunk<R>], before: Option<&Self>) -> Self {
        let splats = || parts.iter().flat_map(|p| &p.splats);
        let most = splats().map(|s| s.gaussian as usize + 1).max().unwrap_or(0);
        let mut now = vec![LAST; most];
        for s in splats() {
            now[s.gaussian as usize] = before.map_or_else(|| by_depth(s), |kept| kept.order(s));
        }
        Self(now)
    }

    /// Splats that are new come last.
    pub(crate) fn order<R>(&self, splat: &Splat<R>) -> u32 {
        self.0.get(splat.gaussian as usize).copied().unwrap_or(LAST)
    }
}

/// Brings each tile's entries, which end where those of the next begin, into order.
pub(crate) fn sort(entries: &mut [AtomicU64], first: &[u32]) {
    let mut rest = entries;
    let mut lists = Vec::with_capacity(first.len());
    for ends in first.windows(2) {
        let (own, others) = rest.split_at_mut((ends[1] - ends[0]) as usize);
        lists.push(own);
        rest = others;
    }
    lists.into_par_iter().for_each(|list| list.sort_unstable_by_key(|entry| entry.load(Relaxed)));
}
