//! Pixels of a view piece by piece: the cosines of a piece with all phrases stay in the cache until they are relevancy.

use rayon::prelude::*;

use crate::pipeline::semantics::relevancy::quick_score;

/// Pixels of a piece.
pub(crate) const PIECE: usize = 1 << 12;
/// Pixels that are scored side by side.
const WIDE: usize = 16;

/// Cosines of the pixels of a view with phrases.
pub(crate) trait PieceCosines: Sync {
    fn pixels(&self) -> usize;

    fn phrases(&self) -> usize;

    /// Accumulated opacity of the pixels, if what no Gaussian reaches has cosines other than 0.
    fn alpha(&self) -> Option<&[f32]>;

    /// Writes the cosines of a piece: of its pixel `k` with phrase `p` to `out[p * PIECE + k]`.
    fn of_piece(&self, piece: usize, out: &mut [f32]);
}

/// Cosines that are there already, a plane for each phrase.
pub(crate) struct KnownCosines(pub(crate) Vec<Vec<f32>>);

impl PieceCosines for KnownCosines {
    fn pixels(&self) -> usize {
        self.0.first().map_or(0, Vec::len)
    }

    fn phrases(&self) -> usize {
        self.0.len()
    }

    fn alpha(&self) -> Option<&[f32]> {
        None
    }

    fn of_piece(&self, piece: usize, out: &mut [f32]) {
        for (out, plane) in out.chunks_exact_mut(PIECE).zip(&self.0) {
            out.iter_mut().zip(part(plane, piece)).for_each(|(out, v)| *out = *v);
        }
    }
}

/// Values of the pixels of a piece.
pub(crate) fn part<T>(values: &[T], piece: usize) -> &[T] {
    &values[piece * PIECE..values.len().min((piece + 1) * PIECE)]
}

/// Cosines as planes, one for each phrase.
pub(crate) fn planes(source: &dyn PieceCosines) -> Vec<Vec<f32>> {
    let of = |piece: usize| {
        let mut out = vec![0.0; source.phrases() * PIECE];
        source.of_piece(piece, &mut out);
        out
    };
    let found: Vec<Vec<f32>> = (0..source.pixels().div_ceil(PIECE)).into_par_iter().map(of).collect();
    let plane = |p: usize| {
        let mut plane: Vec<f32> = found.iter().flat_map(|out| &out[p * PIECE..(p + 1) * PIECE]).copied().collect();
        plane.truncate(source.pixels());
        plane
    };
    (0..source.phrases()).map(plane).collect()
}

/// Relevancy of the first phrase, row-major, more than 0 and at most 1; the other phrases are the canonical ones. It is 0
/// where nothing is, and for what has no direction, and so cosines of 0 with all phrases.
pub(crate) fn relevancy(source: &dyn PieceCosines, temperature: f32) -> Vec<f32> {
    let mut found = vec![0.0; source.pixels()];
    let buffer = || vec![0.0; source.phrases() * PIECE];
    found.par_chunks_mut(PIECE).enumerate().for_each_init(buffer, |cosines, (piece, found)| {
        source.of_piece(piece, cosines);
        score_piece(cosines, temperature, found);
        if let Some(alpha) = source.alpha() {
            found.iter_mut().zip(part(alpha, piece)).filter(|(_, a)| **a == 0.0).for_each(|(r, _)| *r = 0.0);
        }
    });
    found
}

/// Turns cosines into relevancy.
#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
fn score_piece(cosines: &[f32], temperature: f32, found: &mut [f32]) {
    let Some((query, canonical)) = cosines.split_at_checked(PIECE) else { return };
    let query = query.as_chunks::<WIDE>().0;
    for (b, found) in found.chunks_mut(WIDE).enumerate() {
        let query = &query[b];
        let mut nearest = [if canonical.is_empty() { 0.0 } else { f32::NEG_INFINITY }; WIDE];
        let mut sizes: [f32; WIDE] = std::array::from_fn(|k| query[k].abs());
        for plane in canonical.chunks_exact(PIECE) {
            let other = &plane.as_chunks::<WIDE>().0[b];
            for k in 0..WIDE {
                nearest[k] = if other[k] > nearest[k] { other[k] } else { nearest[k] };
                sizes[k] += other[k].abs();
            }
        }
        let mut scores = [0.0; WIDE];
        for k in 0..WIDE {
            let relevancy = quick_score(query[k] - nearest[k], temperature);
            scores[k] = if sizes[k] == 0.0 { 0.0 } else { relevancy };
        }
        found.copy_from_slice(&scores[..found.len()]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::semantics::relevancy::{nearest, score};

    /// Cosines of two pieces and a bit with three phrases; every tenth pixel has none.
    fn cosines() -> KnownCosines {
        let one = |p: usize, i: usize| if i % 10 == 0 { 0.0 } else { ((i * 31 + p * 17) % 97) as f32 / 97.0 - 0.5 };
        KnownCosines((0..3).map(|p| (0..2 * PIECE + 21).map(|i| one(p, i)).collect()).collect())
    }

    #[test]
    fn pieces_are_scored_like_single_pixels() {
        let source = cosines();
        assert_eq!(planes(&source), source.0);
        for phrases in [1, 3] {
            let source = KnownCosines(source.0[..phrases].to_vec());
            let found = relevancy(&source, 10.0);
            let apart = |temperature: f32| {
                let one = |i: usize| {
                    let [query, canonical @ ..] = &source.0[..] else { return 1.0 };
                    let plain = score(query[i] - nearest(canonical.iter().map(|c| c[i])), temperature);
                    (found[i] - if i % 10 == 0 { 0.0 } else { plain }).abs()
                };
                (0..source.pixels()).map(one).fold(0.0, f32::max)
            };
            assert!(apart(10.0) < 1e-6, "{phrases}: {}", apart(10.0));
            assert!(apart(10.5) > 1e-3, "the control: another temperature");
        }
        assert!(relevancy(&KnownCosines(vec![Vec::new()]), 10.0).is_empty());
        // What is there is never 0, however little relevant.
        let far = KnownCosines(vec![vec![-1.0; 20], vec![1.0; 20]]);
        assert!(relevancy(&far, 1e6).iter().all(|r| *r > 0.0 && *r < 1e-30));
    }
}
