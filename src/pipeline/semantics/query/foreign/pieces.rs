//! Pixels of a view piece by piece: the cosines of a piece with all phrases stay in the cache until they are relevancy.

use rayon::prelude::*;

use crate::pipeline::semantics::relevancy::quick_score;

/// Pixels of a piece.
pub(crate) const PIECE: usize = 1 << 12;
/// Relevancy of what is alike to nothing, as the methods compute it.
const UNDECIDED: f32 = 0.5;
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

/// Relevancy of the pixels of a level, row-major, 0 to 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PixelRelevancy {
    /// 0 where nothing is.
    pub shown: Vec<f32>,
    /// With the relevancy that the methods compute where nothing is.
    pub of_method: Vec<f32>,
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

/// Relevancy of the first phrase; the others are the canonical ones.
pub(crate) fn relevancy(source: &dyn PieceCosines, temperature: f32) -> PixelRelevancy {
    let mut found = PixelRelevancy { shown: vec![0.0; source.pixels()], of_method: vec![0.0; source.pixels()] };
    let PixelRelevancy { shown, of_method } = &mut found;
    let pieces = shown.par_chunks_mut(PIECE).zip(of_method.par_chunks_mut(PIECE)).enumerate();
    let buffer = || vec![0.0; source.phrases() * PIECE];
    pieces.for_each_init(buffer, |cosines, (piece, (shown, of_method))| {
        source.of_piece(piece, cosines);
        score_piece(cosines, temperature, shown, of_method);
        if let Some(alpha) = source.alpha() {
            shown.iter_mut().zip(part(alpha, piece)).filter(|(_, a)| **a == 0.0).for_each(|(r, _)| *r = 0.0);
        }
    });
    found
}

/// Turns cosines into relevancy. What has no direction, and so cosines of 0 with all phrases, is undecided.
#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
fn score_piece(cosines: &[f32], temperature: f32, shown: &mut [f32], of_method: &mut [f32]) {
    let Some((query, canonical)) = cosines.split_at_checked(PIECE) else { return };
    let query = query.as_chunks::<WIDE>().0;
    for (b, (shown, of_method)) in shown.chunks_mut(WIDE).zip(of_method.chunks_mut(WIDE)).enumerate() {
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
        let mut pair = [[0.0; WIDE]; 2];
        for k in 0..WIDE {
            let relevancy = quick_score(query[k] - nearest[k], temperature);
            pair[0][k] = if sizes[k] == 0.0 { 0.0 } else { relevancy };
            pair[1][k] = if sizes[k] == 0.0 { UNDECIDED } else { relevancy };
        }
        shown.copy_from_slice(&pair[0][..shown.len()]);
        of_method.copy_from_slice(&pair[1][..of_method.len()]);
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
                    let wanted = if i % 10 == 0 { [0.0, 0.5] } else { [plain; 2] };
                    (found.shown[i] - wanted[0]).abs().max((found.of_method[i] - wanted[1]).abs())
                };
                (0..source.pixels()).map(one).fold(0.0, f32::max)
            };
            assert!(apart(10.0) < 1e-6, "{phrases}: {}", apart(10.0));
            assert!(apart(10.5) > 1e-3, "the control: another temperature");
        }
        assert_eq!(relevancy(&KnownCosines(vec![Vec::new()]), 10.0), PixelRelevancy::default());
    }
}
