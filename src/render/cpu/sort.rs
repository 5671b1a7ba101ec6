//! Front-to-back order of the splats.

use rayon::prelude::*;

use super::project::{CHUNK, Chunk, Splat};
use crate::math::Real;

/// The splats of one frame, front to back.
#[derive(Debug, Default)]
pub(crate) struct Ordered<R> {
    /// By ascending depth; equal depths in the cloud's order.
    pub(crate) splats: Vec<Splat<R>>,
    /// Their values, as in [`Chunk::values`].
    pub(crate) values: Vec<R>,
    keys: Vec<u64>,
}

/// Brings the splats of all parts into order. Everything after this reads them nearly from front
/// to back, instead of jumping through the cloud. With `keep`, the order is that of the frame before;
/// splats that were not in it come last.
pub(crate) fn sort<R: Real>(out: &mut Ordered<R>, parts: &[Chunk<R>], channels: usize, keep: bool) {
    if keep {
        keep_order(out, parts);
    } else {
        by_depth(out, parts);
    }
    gather(out, parts, channels);
}

/// Place of a splat among the parts: the low half of its key.
fn place(part: usize, i: usize) -> u64 {
    (part * CHUNK + i) as u64
}

fn by_depth<R: Real>(out: &mut Ordered<R>, parts: &[Chunk<R>]) {
    // Depths are positive, so their bit patterns order like the numbers. The low half of a key is
    // the splat's part and its place in there, which makes keys unique and an unstable sort
    // deterministic.
    out.keys.clear();
    out.keys.par_extend(parts.par_iter().enumerate().flat_map_iter(|(p, part)| {
        let key = move |(i, s): (usize, &Splat<R>)| (u64::from(s.depth.f32().to_bits()) << 32) | place(p, i);
        part.splats.iter().enumerate().map(key)
    }));
    out.keys.par_sort_unstable();
}

fn keep_order<R: Real>(out: &mut Ordered<R>, parts: &[Chunk<R>]) {
    const GONE: u32 = u32::MAX;
    let largest = parts.iter().flat_map(|p| &p.splats).chain(&out.splats).map(|s| s.gaussian as usize + 1).max();
    let mut now = vec![GONE; largest.unwrap_or(0)];
    for (p, part) in parts.iter().enumerate() {
        for (i, s) in part.splats.iter().enumerate() {
            now[s.gaussian as usize] = place(p, i) as u32;
        }
    }
    out.keys.clear();
    for s in &out.splats {
        let at = std::mem::replace(&mut now[s.gaussian as usize], GONE);
        out.keys.extend((at != GONE).then_some(u64::from(at)));
    }
    out.keys.extend(now.iter().filter(|at| **at != GONE).map(|at| u64::from(*at)));
}

/// Copies the splats in the order of the keys.
fn gather<R: Real>(out: &mut Ordered<R>, parts: &[Chunk<R>], channels: usize) {
    let n = out.keys.len();
    out.splats.resize(n, Splat::default());
    out.values.resize(n * channels, R::ZERO);
    let blocks = out.splats.par_chunks_mut(CHUNK).zip(out.values.par_chunks_mut(CHUNK * channels));
    blocks.zip(out.keys.par_chunks(CHUNK)).for_each(|((splats, values), keys)| {
        for ((splat, value), &key) in splats.iter_mut().zip(values.chunks_exact_mut(channels)).zip(keys) {
            let (part, i) = (&parts[key as u32 as usize / CHUNK], key as u32 as usize % CHUNK);
            *splat = part.splats[i];
            value.copy_from_slice(&part.values[i * channels..(i + 1) * channels]);
        }
    });
}
