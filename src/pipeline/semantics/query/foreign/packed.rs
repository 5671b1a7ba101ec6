//! Blended weights of a codebook's entries (LangSplatV2), packed for phrases.
//!
//! A phrase reads all weights of a view, so their bytes are its time. Weights are whole numbers of 16 bits, in units of
//! their pixel's largest, and entries without weight in a block of pixels are left out. Directions do not depend on the
//! unit; lengths of embeddings, which no phrase changes, are divided by beforehand.

use rayon::prelude::*;

use super::blend::BlendedCodes;
use super::cosines::{BLOCK, CosineHead, Directions, NO_LENGTH};
use super::pieces::{PIECE, PieceCosines, part};

/// Pixels whose weights lie side by side.
const SIDE: usize = 16;
/// Phrases that are compared at a time: as many sums as the registers hold.
const GROUP: usize = 6;
/// The largest weight of a pixel.
const MOST: f32 = u16::MAX as f32;

/// Weights of all pixels of a view.
#[derive(Clone, Debug)]
pub(crate) struct PackedWeights {
    pixels: usize,
    entries: usize,
    pieces: Vec<PackedPiece>,
}

/// Weights of the pixels of a piece, block by block.
#[derive(Clone, Debug, Default)]
struct PackedPiece {
    /// Number of weights up to the end of each block.
    ends: Vec<u32>,
    /// Entries that have weight in a block.
    entries: Vec<u16>,
    /// Their weights.
    weights: Vec<[u16; SIDE]>,
    /// One over the length of each pixel's embedding; 0 for those without direction.
    factors: Vec<[f32; SIDE]>,
}

impl PackedWeights {
    /// Packs blended weights, which are not negative, of at most 65,536 entries.
    pub(crate) fn new(head: &CosineHead, blended: &BlendedCodes) -> Self {
        let (pixels, entries) = (blended.alpha.len(), blended.planes.len());
        let one = |piece| PackedPiece::new(head, blended, piece);
        Self { pixels, entries, pieces: (0..pixels.div_ceil(PIECE)).into_par_iter().map(one).collect() }
    }

    /// Prepares a comparison with phrases.
    pub(crate) fn compared(&self, directions: &Directions) -> PackedCosines<'_> {
        let group = |from: usize| -> Vec<[f32; GROUP]> {
            let entry = |k: usize| std::array::from_fn(|p| directions.weight(from + p, k));
            (0..self.entries).map(entry).collect()
        };
        let groups = (0..directions.len()).step_by(GROUP).map(group).collect();
        PackedCosines { packed: self, phrases: directions.len(), groups }
    }

    /// Pixels that have weights.
    pub(crate) fn reached(&self) -> usize {
        self.pieces.iter().flat_map(|piece| piece.factors.as_flattened()).filter(|factor| **factor > 0.0).count()
    }

    /// Memory of the weights.
    pub(crate) fn bytes(&self) -> usize {
        let of = |p: &PackedPiece| {
            size_of_val(&p.ends[..])
                + size_of_val(&p.entries[..])
                + size_of_val(&p.weights[..])
                + size_of_val(&p.factors[..])
        };
        self.pieces.iter().map(of).sum()
    }
}

impl PackedPiece {
    fn new(head: &CosineHead, blended: &BlendedCodes, piece: usize) -> Self {
        let mut packed = Self::default();
        let count = part(&blended.alpha, piece).len();
        let mut codes = vec![0.0_f32; blended.planes.len() * BLOCK];
        for from in (0..count).step_by(BLOCK) {
            let pixels = from..count.min(from + BLOCK);
            codes.fill(0.0);
            for (codes, plane) in codes.chunks_exact_mut(BLOCK).zip(&blended.planes) {
                codes[..pixels.len()].copy_from_slice(&part(plane, piece)[pixels.clone()]);
            }
            packed.add(head, &mut codes);
        }
        packed.weights.shrink_to_fit();
        packed.entries.shrink_to_fit();
        packed
    }

    /// Adds the codes of a block, which become whole numbers.
    fn add(&mut self, head: &CosineHead, codes: &mut [f32]) {
        let mut most = [0.0_f32; BLOCK];
        for codes in codes.as_chunks::<BLOCK>().0 {
            most.iter_mut().zip(codes).for_each(|(most, v)| *most = most.max(*v));
        }
        let scales = most.map(|most| if most > 0.0 { MOST / most } else { 0.0 });
        for codes in codes.as_chunks_mut::<BLOCK>().0 {
            codes.iter_mut().zip(&scales).for_each(|(v, scale)| *v = (*v * scale).round().clamp(0.0, MOST));
        }
        let squares = head.squares(codes);
        let factor = |k: usize| {
            let is_long = scales[k] > 0.0 && squares[k] / (scales[k] * scales[k]) > NO_LENGTH;
            if is_long { 1.0 / squares[k].sqrt() } else { 0.0 }
        };
        for from in (0..BLOCK).step_by(SIDE) {
            for (entry, codes) in (0..).zip(codes.as_chunks::<BLOCK>().0) {
                let weights: [u16; SIDE] = std::array::from_fn(|k| codes[from + k] as u16);
                if weights != [0; SIDE] {
                    self.entries.push(entry);
                    self.weights.push(weights);
                }
            }
            self.ends.push(self.entries.len() as u32);
            self.factors.push(std::array::from_fn(|k| factor(from + k)));
        }
    }
}

/// Cosines of packed weights with phrases.
pub(crate) struct PackedCosines<'a> {
    packed: &'a PackedWeights,
    phrases: usize,
    /// For each group of phrases, their products with each entry.
    groups: Vec<Vec<[f32; GROUP]>>,
}

impl PieceCosines for PackedCosines<'_> {
    fn pixels(&self) -> usize {
        self.packed.pixels
    }

    fn phrases(&self) -> usize {
        self.phrases
    }

    fn alpha(&self) -> Option<&[f32]> {
        None
    }

    fn of_piece(&self, piece: usize, out: &mut [f32]) {
        for (products, out) in self.groups.iter().zip(out.chunks_mut(GROUP * PIECE)) {
            compare(&self.packed.pieces[piece], products, out);
        }
    }
}

/// Writes the cosines of a piece with the phrases of a group.
#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
fn compare(piece: &PackedPiece, products: &[[f32; GROUP]], out: &mut [f32]) {
    let mut from = 0;
    for (b, (end, factors)) in piece.ends.iter().zip(&piece.factors).enumerate() {
        let (entries, weights) = (&piece.entries[from..*end as usize], &piece.weights[from..*end as usize]);
        from = *end as usize;
        let mut sums = [[0.0_f32; SIDE]; GROUP];
        for (entry, weights) in entries.iter().zip(weights) {
            let weights: [f32; SIDE] = std::array::from_fn(|k| f32::from(weights[k]));
            let products = &products[usize::from(*entry)];
            for p in 0..GROUP {
                for k in 0..SIDE {
                    sums[p][k] += products[p] * weights[k];
                }
            }
        }
        for (plane, sums) in out.chunks_exact_mut(PIECE).zip(&sums) {
            let cosines = &mut plane.as_chunks_mut::<SIDE>().0[b];
            for k in 0..SIDE {
                cosines[k] = sums[k] * factors[k];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::io::results::{Decoder, DecoderStep, LinearLayer};
    use crate::math::vector::unit;
    use crate::pipeline::semantics::query::foreign::blend::BlendedCosines;
    use crate::pipeline::semantics::query::foreign::pieces::{planes, relevancy};

    const DIM: usize = 24;

    /// A codebook, the weights of two pieces and a bit (nothing in every 13th pixel, and hardly anything in every 11th),
    /// and phrases.
    fn example(entries: usize, phrases: usize) -> (CosineHead, BlendedCodes, Vec<Vec<f32>>) {
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        let mut vector = |n: usize| -> Vec<f32> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
        let path = Path::new("x");
        let book = LinearLayer::of_codebook([entries, DIM], &vector(entries * DIM), path).expect("fits");
        let decoder = Decoder::new(entries, vec![DecoderStep::Linear(book)], path).expect("fits");
        let phrases = (0..phrases).map(|_| unit(&vector(DIM)).expect("a direction")).collect();
        let count = 2 * PIECE + 21;
        let alpha: Vec<f32> = (0..count)
            .map(|i| {
                if i % 13 == 0 || i / 100 == 3 {
                    0.0
                } else if i % 11 == 0 {
                    0.004
                } else {
                    0.9
                }
            })
            .collect();
        let plane = |k: usize| -> Vec<f32> {
            // A few entries in each stretch of pixels.
            let is_there = |i: usize| (i / 50 + k) % 3 == 0;
            vector(count)
                .iter()
                .zip(&alpha)
                .enumerate()
                .map(|(i, (v, a))| f32::from(u8::from(is_there(i))) * v.abs() * a)
                .collect()
        };
        let planes = (0..entries).map(plane).collect();
        (CosineHead::new(&decoder), BlendedCodes { width_px: count, height_px: 1, alpha, planes }, phrases)
    }

    fn most(a: &[f32], b: &[f32]) -> f32 {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn packed_weights_answer_like_blended_ones() {
        for (entries, phrases) in [(64, 5), (9, 1), (70, 14)] {
            let (head, blended, phrases) = example(entries, phrases);
            let phrases: Vec<&[f32]> = phrases.iter().map(Vec::as_slice).collect();
            let directions = head.directions(&phrases);
            let plain = BlendedCosines::new(&head, &blended, directions.clone());
            let packed = PackedWeights::new(&head, &blended);
            let quick = packed.compared(&directions);
            let cosines = planes(&quick);
            assert_eq!(cosines.len(), phrases.len());
            for (quick, plain) in cosines.iter().zip(planes(&plain)) {
                assert!(most(quick, &plain) < 4e-5, "{entries}: {}", most(quick, &plain));
            }
            let (found, wanted) = (relevancy(&quick, 10.0), relevancy(&plain, 10.0));
            assert!(most(&found, &wanted) < 1e-4, "{entries}: {}", most(&found, &wanted));
            let reached = blended.alpha.iter().filter(|a| **a > 0.0).count();
            assert_eq!(packed.reached(), reached);
            // A third of the entries is there, and takes half the memory: a byte for each instead of four.
            assert!(packed.bytes() < (entries + 5) * blended.alpha.len(), "{}", packed.bytes());
            let mut other = blended.clone();
            other.planes.swap(0, 1);
            let other = PackedWeights::new(&head, &other);
            let exchanged = relevancy(&other.compared(&directions), 10.0);
            assert!(most(&exchanged, &wanted) > 0.01, "the control: two entries exchanged");
        }
    }
}
