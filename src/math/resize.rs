//! Changing the size of images: one separable filter over any kind of pixel.
//!
//! Columns are resized first, then rows, as Pillow and PyTorch do it; a pass that changes nothing is left out.
//!
//! Images are resized here only.

use rayon::prelude::*;

/// Resampling filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// Exact mean of the area that a resized pixel covers.
    Area,
    /// Between the two nearest pixel centers, also where the image shrinks (PyTorch without antialiasing).
    Linear,
    /// Linear where the image grows, a triangle as wide as it shrinks (Pillow's bilinear).
    Bilinear,
    /// The cubic with a = -1/2, as wide as the image shrinks (Pillow's bicubic).
    Bicubic,
}

impl Filter {
    /// By the name in a model's metadata.
    pub(crate) fn named(name: &str) -> Option<Self> {
        match name {
            "bilinear" => Some(Self::Bilinear),
            "bicubic" => Some(Self::Bicubic),
            _ => None,
        }
    }
}

/// Pixel of an image.
pub trait Pixel: Copy + Send + Sync {
    /// A share of a pixel.
    type Weight: Copy + Send + Sync;
    /// A share of at most 1.
    fn weight(share: f64) -> Self::Weight;
    /// The weighted sum.
    fn mix(parts: impl Iterator<Item = (Self, Self::Weight)>) -> Self;
}

impl Pixel for f64 {
    type Weight = f64;
    fn weight(share: f64) -> f64 {
        share
    }
    fn mix(parts: impl Iterator<Item = (f64, f64)>) -> f64 {
        parts.map(|(value, weight)| value * weight).sum()
    }
}

impl Pixel for f32 {
    type Weight = f32;
    fn weight(share: f64) -> f32 {
        share as f32
    }
    fn mix(parts: impl Iterator<Item = (f32, f32)>) -> f32 {
        parts.map(|(value, weight)| value * weight).sum()
    }
}

impl<const N: usize> Pixel for [f32; N] {
    type Weight = f32;
    fn weight(share: f64) -> f32 {
        share as f32
    }
    fn mix(parts: impl Iterator<Item = (Self, f32)>) -> Self {
        let mut sums = [0.0; N];
        parts.for_each(|(pixel, weight)| sums.iter_mut().zip(pixel).for_each(|(sum, v)| *sum += v * weight));
        sums
    }
}

/// Bits after the point of a weight of bytes.
const PRECISION_BITS: u32 = 22;

/// Fixed-point weights and rounding after each pass: bit by bit Pillow's 8-bit resampling.
impl Pixel for [u8; 3] {
    type Weight = i64;
    fn weight(share: f64) -> i64 {
        (share * f64::from(1_u32 << PRECISION_BITS)).round() as i64
    }
    fn mix(parts: impl Iterator<Item = (Self, i64)>) -> Self {
        let mut sums = [1_i64 << (PRECISION_BITS - 1); 3];
        parts.for_each(|(pixel, weight)| sums.iter_mut().zip(pixel).for_each(|(sum, v)| *sum += weight * i64::from(v)));
        sums.map(|sum| (sum >> PRECISION_BITS).clamp(0, 255) as u8)
    }
}

/// The pixels of a line, from `first` on, that one pixel of the resized line is made of.
#[derive(Clone, Debug)]
pub(crate) struct Tap<P: Pixel> {
    first: usize,
    weights: Vec<P::Weight>,
}

impl<P: Pixel> Tap<P> {
    fn new(first: usize, shares: impl Iterator<Item = f64>) -> Self {
        Self { first, weights: shares.map(P::weight).collect() }
    }

    pub(crate) fn mix(&self, pixel: impl Fn(usize) -> P) -> P {
        P::mix(self.weights.iter().enumerate().map(|(k, weight)| (pixel(self.first + k), *weight)))
    }
}

/// The taps of a line of `to` pixels in one of `from`, which is not empty.
pub(crate) fn taps<P: Pixel>(from: usize, to: usize, filter: Filter) -> Vec<Tap<P>> {
    let (reach, weight): (f64, fn(f64) -> f64) = match filter {
        Filter::Area => return (0..to).map(|i| area(from, to, i)).collect(),
        Filter::Linear => {
            let tap = |i| {
                let (low, high, share) = between(i, from, to);
                let shares = [1.0 - share, share].map(f64::from);
                Tap::new(low, shares.into_iter().take(high - low + 1))
            };
            return (0..to).map(tap).collect();
        }
        Filter::Bilinear => (1.0, |x| (1.0 - x.abs()).max(0.0)),
        Filter::Bicubic => (2.0, cubic),
    };
    let scale = from as f64 / to as f64;
    let stretch = scale.max(1.0);
    let support = reach * stretch;
    let tap = |i: usize| {
        let center = (i as f64 + 0.5) * scale;
        let first = (center - support + 0.5).max(0.0) as usize;
        let end = ((center + support + 0.5) as usize).min(from);
        let weights: Vec<f64> = (first..end).map(|j| weight((j as f64 - center + 0.5) / stretch)).collect();
        let sum: f64 = weights.iter().sum();
        Tap::new(first, weights.iter().map(|w| w / sum))
    };
    (0..to).map(tap).collect()
}

/// The cells out of `from` that cell `i` out of `to` overlaps when both span the same length.
fn area<P: Pixel>(from: usize, to: usize, i: usize) -> Tap<P> {
    // In units of 1 / (from * to) of the span, all bounds are integers.
    let (start, end) = (i * from, (i + 1) * from);
    let overlap = |j: usize| end.min((j + 1) * to) - start.max(j * to);
    Tap::new(start / to, (start / to..end.div_ceil(to)).map(|j| overlap(j) as f64 / from as f64))
}

/// The two pixels of a line of `from` around the center of pixel `i` of the resized line, and the share of the
/// second. Beyond the outermost centers they are the same.
pub(crate) fn between(i: usize, from: usize, to: usize) -> (usize, usize, f32) {
    // In f32, as PyTorch has it: in f64 a mask's border differs by a pixel now and then.
    let scale = (from as f64 / to as f64) as f32;
    let at = ((i as f32 + 0.5) * scale - 0.5).max(0.0);
    let low = (at as usize).min(from - 1);
    match low + 1 < from {
        true => (low, low + 1, at - low as f32),
        false => (low, low, 0.0),
    }
}

/// The cubic filter with a = -1/2.
fn cubic(x: f64) -> f64 {
    const A: f64 = -0.5;
    let x = x.abs();
    if x < 1.0 {
        ((A + 2.0) * x - (A + 3.0)) * x * x + 1.0
    } else if x < 2.0 {
        (((x - 5.0) * x + 8.0) * x - 4.0) * A
    } else {
        0.0
    }
}

/// Resizes an image of `from` = (width, height) px, row by row, to `to`; empty if either has no pixels or the length of
/// the image does not match `from`.
pub fn resize<P: Pixel>(image: &[P], from: (usize, usize), to: (usize, usize), filter: Filter) -> Vec<P> {
    if from.0 * from.1 == 0 || to.0 * to.1 == 0 || image.len() != from.0 * from.1 {
        return Vec::new();
    }
    let wide = (from.0 != to.0).then(|| {
        let columns = taps(from.0, to.0, filter);
        let line = |row: &[P]| columns.iter().map(|tap| tap.mix(|i| row[i])).collect::<Vec<_>>();
        image.par_chunks_exact(from.0).with_min_len(16).flat_map_iter(line).collect::<Vec<P>>()
    });
    let wide = wide.as_deref().unwrap_or(image);
    if from.1 == to.1 {
        return wide.to_vec();
    }
    let rows = taps(from.1, to.1, filter);
    let line = |tap: &Tap<P>| (0..to.0).map(|x| tap.mix(|i| wide[i * to.0 + x])).collect::<Vec<_>>();
    rows.par_iter().with_min_len(16).flat_map_iter(line).collect()
}

/// The pixel of a line of `from` whose square holds the center of pixel `i` of the line at size `to`.
pub(crate) fn nearest(i: usize, from: usize, to: usize) -> usize {
    ((2 * i + 1) * from / (2 * to)).min(from.saturating_sub(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_keep_their_value_and_middles_are_mixed() {
        for filter in [Filter::Linear, Filter::Bilinear] {
            let out = resize(&[0.0_f32, 4.0], (2, 1), (4, 1), filter);
            assert_eq!(out, [0.0, 1.0, 3.0, 4.0]);
            assert_eq!(resize(&out, (4, 1), (4, 1), filter), out);
            assert_eq!(resize(&[7.0], (1, 1), (3, 2), filter), [7.0; 6]);
        }
    }

    #[test]
    fn shrinking_takes_means_or_looks_between_two_pixels() {
        let image: Vec<f32> = (0..64).map(|i| if i % 8 < 4 { 1.0 } else { 0.0 }).collect();
        let out = resize(&image, (8, 8), (2, 2), Filter::Bilinear);
        assert!(out[0] > 0.8 && out[1] < 0.2 && (out[0] + out[1] - 1.0).abs() < 1e-6, "{out:?}");
        assert_eq!(resize(&image, (8, 8), (2, 2), Filter::Area), [1.0, 0.0, 1.0, 0.0]);
        let spike = [0.0_f32, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(resize(&spike, (8, 1), (2, 1), Filter::Area), [2.25, 0.0]);
        assert_eq!(resize(&spike, (8, 1), (2, 1), Filter::Linear), [0.0, 0.0], "1.5 and 5.5 are beside it");
        // Three into two: weights 2/3 and 1/3.
        let thirds = resize(&[30.0, 90.0, 150.0], (3, 1), (2, 1), Filter::Area);
        assert!((thirds[0] - 50.0_f64).abs() + (thirds[1] - 130.0).abs() < 1e-12);
    }

    #[test]
    fn a_ramp_stays_a_ramp_between_its_ends() {
        let ramp: Vec<f64> = (0..16).map(|x| f64::from(x) + 0.5).collect();
        for filter in [Filter::Linear, Filter::Bilinear, Filter::Bicubic] {
            let large = resize(&ramp, (16, 1), (64, 1), filter);
            assert!((8..56).all(|x| (large[x] - (x as f64 + 0.5) / 4.0).abs() < 1e-12), "{filter:?}");
        }
    }

    #[test]
    fn nothing_gives_nothing() {
        assert!(resize(&[0.0_f32; 3], (2, 2), (4, 4), Filter::Area).is_empty());
        assert!(resize(&[0.0_f32; 4], (2, 2), (0, 4), Filter::Bicubic).is_empty());
        assert!(resize::<[u8; 3]>(&[], (0, 3), (1, 1), Filter::Linear).is_empty());
        assert_eq!([0, 1, 2].map(|i| nearest(i, 2, 3)), [0, 1, 1]);
    }
}
