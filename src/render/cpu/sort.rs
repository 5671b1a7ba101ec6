//! Front-to-back order of the splats.

use rayon::prelude::*;

use super::project::Splat;
use crate::math::Real;

/// Indices of `splats` by ascending depth; equal depths keep their order. Depths are positive, so
/// their bit patterns order like the numbers; the index in the low half makes keys unique, which
/// makes an unstable sort deterministic.
pub fn sort<R: Real>(splats: &[Splat<R>], keys: &mut Vec<u64>) {
    keys.clear();
    keys.par_extend(splats.par_iter().enumerate().map(|(i, s)| (u64::from(s.depth.f32().to_bits()) << 32) | i as u64));
    keys.par_sort_unstable();
}

/// The splat that a sorted key stands for.
#[inline(always)]
pub fn splat_of(key: u64) -> u32 {
    key as u32
}
