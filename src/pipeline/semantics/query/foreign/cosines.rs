//! Cosines between the embeddings of codes and those of phrases, without an embedding ever being written down.
//!
//! The last layer of a decoder is linear, `f = W h + b`. So `f.q = h.(W^T q) + b.q`, and `|f|^2` is a quadratic form of
//! `h` with the matrix `W^T W`. For a codebook of 64 entries these are 64 products a phrase instead of 512.

use crate::io::results::{Decoder, DecoderStep, LinearLayer};
use crate::math::vector::dot;

/// Codes that are decoded together, side by side.
pub(crate) const BLOCK: usize = 32;
/// Squared length under which an embedding has no direction.
pub(crate) const NO_LENGTH: f32 = 1e-20;

/// Parts of a decoder that do not depend on phrases.
#[derive(Clone, Debug)]
pub(crate) struct CosineHead {
    inputs: usize,
    outputs: usize,
    before: Vec<DecoderStep>,
    last: Option<LastLayer>,
}

/// The last layer, with its products with itself.
#[derive(Clone, Debug)]
struct LastLayer {
    layer: LinearLayer,
    /// Lower triangle of `W^T W`, row after row, twice off the diagonal.
    products: Vec<f32>,
    /// `2 W^T b`.
    with_bias: Vec<f32>,
    /// `b.b`.
    of_bias: f32,
}

/// Phrases as seen by the last hidden numbers: `[hidden]` and an offset for each.
#[derive(Clone, Debug)]
pub(crate) struct Directions(Vec<(Vec<f32>, f32)>);

impl Directions {
    /// Number of phrases.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// Weight of a hidden number; 0 for a phrase that there is not.
    pub(crate) fn weight(&self, phrase: usize, hidden: usize) -> f32 {
        self.0.get(phrase).map_or(0.0, |(weights, _)| weights[hidden])
    }
}

impl CosineHead {
    pub(crate) fn new(decoder: &Decoder) -> Self {
        let (before, last) = decoder.split();
        let last = last.map(|layer| LastLayer::new(layer.clone()));
        Self { inputs: decoder.inputs(), outputs: decoder.outputs(), before: before.to_vec(), last }
    }

    /// Numbers of an embedding.
    pub(crate) fn outputs(&self) -> usize {
        self.outputs
    }

    /// Returns whether codes are the embeddings themselves.
    pub(crate) fn is_plain(&self) -> bool {
        self.before.is_empty() && self.last.is_none()
    }

    /// Returns whether codes are weights of a codebook's entries: embeddings of any positive multiple have one direction.
    pub(crate) fn is_codebook(&self) -> bool {
        self.before.is_empty() && self.last.as_ref().is_some_and(|last| last.of_bias == 0.0)
    }

    /// Prepares embeddings of phrases, of unit length.
    pub(crate) fn directions(&self, phrases: &[&[f32]]) -> Directions {
        let one = |q: &&[f32]| match &self.last {
            None => (q.to_vec(), 0.0),
            Some(last) => {
                let mut seen = vec![0.0_f64; last.layer.inputs()];
                for (k, q) in q.iter().enumerate() {
                    let weights = last.layer.weights(k);
                    seen.iter_mut().zip(weights).for_each(|(sum, w)| *sum += f64::from(*w) * f64::from(*q));
                }
                (seen.into_iter().map(|v| v as f32).collect(), dot(last.layer.bias(), q))
            }
        };
        Directions(phrases.iter().map(one).collect())
    }

    /// Cosines of a block of codes with all phrases: `out[phrase * BLOCK + k]` for code `k` of `codes[number * BLOCK +
    /// k]`. Codes whose embedding has no length are alike to nothing.
    pub(crate) fn cosines(&self, codes: &[f32], directions: &Directions, out: &mut [f32]) {
        debug_assert_eq!((codes.len(), out.len()), (self.inputs * BLOCK, directions.len() * BLOCK));
        let (mut hidden, mut kept) = (codes.to_vec(), Vec::new());
        for step in &self.before {
            match step {
                DecoderStep::Linear(layer) => hidden = linear(layer, &hidden),
                DecoderStep::Relu => hidden.iter_mut().for_each(|v| *v = v.max(0.0)),
                DecoderStep::Unit => unit(&mut hidden),
                DecoderStep::Softmax => softmax(&mut hidden),
                DecoderStep::Keep => kept.clone_from(&hidden),
                DecoderStep::AddKept => hidden.iter_mut().zip(&kept).for_each(|(v, kept)| *v += kept),
            }
        }
        let squares = self.squares(&hidden);
        for (out, (direction, offset)) in out.chunks_exact_mut(BLOCK).zip(&directions.0) {
            project(&hidden, direction, *offset, out);
            for (v, square) in out.iter_mut().zip(&squares) {
                *v = if *square > NO_LENGTH { *v / square.sqrt() } else { 0.0 };
            }
        }
    }

    /// Squared lengths of the embeddings of a block of last hidden numbers.
    pub(crate) fn squares(&self, hidden: &[f32]) -> [f32; BLOCK] {
        match &self.last {
            None => plain_squares(hidden),
            Some(last) => squares(last, hidden),
        }
    }
}

impl LastLayer {
    fn new(layer: LinearLayer) -> Self {
        let (n, rows) = (layer.inputs(), layer.outputs());
        let mut products = vec![0.0_f64; n * (n + 1) / 2];
        let mut with_bias = vec![0.0_f64; n];
        for k in 0..rows {
            let (w, b) = (layer.weights(k), f64::from(layer.bias()[k]));
            let mut at = 0;
            for i in 0..n {
                let wide = f64::from(w[i]);
                with_bias[i] += 2.0 * wide * b;
                products[at..=at + i].iter_mut().zip(w).for_each(|(sum, v)| *sum += wide * f64::from(*v));
                at += i + 1;
            }
        }
        let mut at = 0;
        for i in 0..n {
            products[at..at + i].iter_mut().for_each(|v| *v *= 2.0);
            at += i + 1;
        }
        let single = |v: Vec<f64>| v.into_iter().map(|v| v as f32).collect();
        let of_bias = dot(layer.bias(), layer.bias());
        Self { layer, products: single(products), with_bias: single(with_bias), of_bias }
    }
}

#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
fn linear(layer: &LinearLayer, input: &[f32]) -> Vec<f32> {
    let mut out = vec![0.0; layer.outputs() * BLOCK];
    for (k, out) in out.as_chunks_mut::<BLOCK>().0.iter_mut().enumerate() {
        let mut sums = [layer.bias()[k]; BLOCK];
        for (w, input) in layer.weights(k).iter().zip(input.as_chunks::<BLOCK>().0) {
            sums.iter_mut().zip(input).for_each(|(sum, v)| *sum += w * v);
        }
        *out = sums;
    }
    out
}

/// Squared lengths of the embeddings.
#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
fn squares(last: &LastLayer, hidden: &[f32]) -> [f32; BLOCK] {
    let mut all = [last.of_bias; BLOCK];
    let hidden = hidden.as_chunks::<BLOCK>().0;
    let mut at = 0;
    for (i, own) in hidden.iter().enumerate() {
        let mut sums = [last.with_bias[i]; BLOCK];
        for (w, other) in last.products[at..=at + i].iter().zip(hidden) {
            sums.iter_mut().zip(other).for_each(|(sum, v)| *sum += w * v);
        }
        at += i + 1;
        for k in 0..BLOCK {
            all[k] += own[k] * sums[k];
        }
    }
    all
}

#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
fn plain_squares(hidden: &[f32]) -> [f32; BLOCK] {
    let mut all = [0.0; BLOCK];
    for part in hidden.as_chunks::<BLOCK>().0 {
        all.iter_mut().zip(part).for_each(|(sum, v)| *sum += v * v);
    }
    all
}

#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
fn project(hidden: &[f32], direction: &[f32], offset: f32, out: &mut [f32]) {
    let mut sums = [offset; BLOCK];
    for (w, part) in direction.iter().zip(hidden.as_chunks::<BLOCK>().0) {
        sums.iter_mut().zip(part).for_each(|(sum, v)| *sum += w * v);
    }
    out.copy_from_slice(&sums);
}

fn unit(hidden: &mut [f32]) {
    let lengths = plain_squares(hidden).map(|s| s.sqrt().max(1e-12));
    for part in hidden.as_chunks_mut::<BLOCK>().0 {
        part.iter_mut().zip(&lengths).for_each(|(v, length)| *v /= length);
    }
}

fn softmax(hidden: &mut [f32]) {
    let parts = hidden.as_chunks_mut::<BLOCK>().0;
    let mut most = [f32::NEG_INFINITY; BLOCK];
    parts.iter().for_each(|part| most.iter_mut().zip(part).for_each(|(m, v)| *m = m.max(*v)));
    let mut sums = [0.0; BLOCK];
    for part in parts.iter_mut() {
        for k in 0..BLOCK {
            part[k] = (part[k] - most[k]).exp();
            sums[k] += part[k];
        }
    }
    parts.iter_mut().for_each(|part| part.iter_mut().zip(&sums).for_each(|(v, sum)| *v /= sum));
}
