//! Networks that other methods store to turn short codes into embeddings: linear layers with simple steps between, and
//! numbers that skip some of them.

use std::path::Path;

use crate::io::IoError;
use crate::math::vector::{dot, unit};

/// Most numbers of a layer's input or output.
const MOST_NUMBERS: usize = 1 << 14;

/// A step of a [`Decoder`].
#[derive(Clone, Debug, PartialEq)]
pub enum DecoderStep {
    /// `weight x + bias`.
    Linear(LinearLayer),
    /// The larger of each number and zero.
    Relu,
    /// Division by the length.
    Unit,
    /// Shares that sum to one.
    Softmax,
    /// Remembers the numbers for the next [`Self::AddKept`].
    Keep,
    /// Adds the numbers that were remembered last.
    AddKept,
}

/// A linear layer.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearLayer {
    inputs: usize,
    outputs: usize,
    /// `[outputs, inputs]`, row after row.
    weight: Vec<f32>,
    bias: Vec<f32>,
}

impl LinearLayer {
    /// Creates a layer of a weight `[outputs, inputs]` and a bias `[outputs]`, which may be missing.
    pub(crate) fn new(
        [outputs, inputs]: [usize; 2],
        weight: Vec<f32>,
        bias: Option<Vec<f32>>,
        path: &Path,
    ) -> Result<Self, IoError> {
        let bias = bias.unwrap_or_else(|| vec![0.0; outputs]);
        let fits = |n: usize| (1..=MOST_NUMBERS).contains(&n);
        if !fits(inputs) || !fits(outputs) || weight.len() != inputs * outputs || bias.len() != outputs {
            let (weights, biases) = (weight.len(), bias.len());
            let reason =
                format!("a layer from {inputs} to {outputs} numbers has {weights} weights and {biases} biases");
            return Err(IoError::syntax(path, "decoder", reason));
        }
        Ok(Self { inputs, outputs, weight, bias })
    }

    /// Creates the layer that blends the rows of a codebook `[inputs, outputs]`.
    pub(crate) fn of_codebook([entries, dim]: [usize; 2], book: &[f32], path: &Path) -> Result<Self, IoError> {
        let whole = entries.checked_mul(dim) == Some(book.len());
        let turned =
            if whole { (0..dim).flat_map(|d| (0..entries).map(move |k| book[k * dim + d])).collect() } else { vec![] };
        Self::new([dim, entries], turned, None, path)
    }

    /// Numbers that it takes.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Numbers that it makes.
    pub fn outputs(&self) -> usize {
        self.outputs
    }

    /// Weights of output `k`.
    pub fn weights(&self, k: usize) -> &[f32] {
        &self.weight[k * self.inputs..(k + 1) * self.inputs]
    }

    /// Numbers that are added to the outputs.
    pub fn bias(&self) -> &[f32] {
        &self.bias
    }

    fn apply(&self, values: &[f32]) -> Vec<f32> {
        (0..self.outputs).map(|k| dot(self.weights(k), values) + self.bias[k]).collect()
    }
}

impl DecoderStep {
    /// Applies the step; `kept` has the numbers that were remembered last.
    fn apply(&self, values: &[f32], kept: &mut Vec<f32>) -> Vec<f32> {
        match self {
            Self::Linear(layer) => layer.apply(values),
            Self::Relu => values.iter().map(|v| v.max(0.0)).collect(),
            Self::Unit => unit(values).unwrap_or_else(|| values.to_vec()),
            Self::Softmax => {
                let most = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                let shares: Vec<f32> = values.iter().map(|v| (v - most).exp()).collect();
                let sum: f32 = shares.iter().sum();
                shares.into_iter().map(|v| v / sum).collect()
            }
            Self::Keep => {
                *kept = values.to_vec();
                values.to_vec()
            }
            Self::AddKept => values.iter().zip(&*kept).map(|(v, kept)| v + kept).collect(),
        }
    }
}

/// Steps from a code to an embedding, none if codes are embeddings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decoder {
    inputs: usize,
    outputs: usize,
    steps: Vec<DecoderStep>,
}

impl Decoder {
    /// Creates a decoder of codes of `inputs` numbers whose layers fit one another.
    pub(crate) fn new(inputs: usize, steps: Vec<DecoderStep>, path: &Path) -> Result<Self, IoError> {
        let (mut outputs, mut kept) = (inputs, 0);
        for (k, step) in steps.iter().enumerate() {
            let takes = match step {
                DecoderStep::Linear(layer) => layer.inputs,
                DecoderStep::AddKept => kept,
                DecoderStep::Relu | DecoderStep::Unit | DecoderStep::Softmax | DecoderStep::Keep => outputs,
            };
            if takes != outputs {
                let reason = format!("step {k} takes {takes} numbers, but gets {outputs}");
                return Err(IoError::syntax(path, "decoder", reason));
            }
            match step {
                DecoderStep::Linear(layer) => outputs = layer.outputs,
                DecoderStep::Keep => kept = outputs,
                _ => {}
            }
        }
        Ok(Self { inputs, outputs, steps })
    }

    /// The decoder of codes that are embeddings.
    pub fn none(dim: usize) -> Self {
        Self { inputs: dim, outputs: dim, steps: Vec::new() }
    }

    /// Numbers of a code.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Numbers of an embedding.
    pub fn outputs(&self) -> usize {
        self.outputs
    }

    /// Embedding of a code, of unit length; zeros if it has no direction.
    pub fn embedding(&self, code: &[f32]) -> Vec<f32> {
        let mut kept = Vec::new();
        let whole = self.steps.iter().fold(code.to_vec(), |values, step| step.apply(&values, &mut kept));
        unit(&whole).unwrap_or_else(|| vec![0.0; self.outputs])
    }

    /// Steps before the last linear layer, and that layer, if it is the last step.
    pub fn split(&self) -> (&[DecoderStep], Option<&LinearLayer>) {
        match self.steps.split_last() {
            Some((DecoderStep::Linear(last), before)) => (before, Some(last)),
            _ => (&self.steps, None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_fit_one_another_or_are_refused() {
        let path = Path::new("x.pth");
        let layer =
            |shape: [usize; 2]| LinearLayer::new(shape, vec![1.0; shape[0] * shape[1]], None, path).expect("fits");
        let two = |a, b| vec![DecoderStep::Linear(layer(a)), DecoderStep::Relu, DecoderStep::Linear(layer(b))];
        let decoder = Decoder::new(3, two([4, 3], [5, 4]), path).expect("fits");
        assert_eq!((decoder.inputs(), decoder.outputs(), decoder.split().0.len()), (3, 5, 2));
        assert!(Decoder::new(3, two([4, 3], [4, 5]), path).is_err(), "turned");
        assert!(Decoder::new(4, two([4, 3], [5, 4]), path).is_err());
        // Numbers that skip a layer.
        let over = |last: [usize; 2]| {
            let kept = [DecoderStep::Keep, DecoderStep::Linear(layer(last)), DecoderStep::AddKept];
            Decoder::new(3, [vec![DecoderStep::Linear(layer([4, 3]))], kept.to_vec()].concat(), path)
        };
        assert!(over([4, 4]).is_ok_and(|d| d.outputs() == 4 && d.split().1.is_none()));
        assert!(over([5, 4]).expect_err("another number").to_string().contains("step 3 takes 4"));
        assert!(Decoder::new(3, vec![DecoderStep::AddKept], path).is_err(), "nothing was kept");
        for (shape, weights, biases) in [([2, 3], 5, 2), ([2, 3], 6, 3), ([0, 3], 0, 0), ([1 << 40, 3], 6, 2)] {
            assert!(LinearLayer::new(shape, vec![0.0; weights], Some(vec![0.0; biases]), path).is_err(), "{shape:?}");
        }
        let book = LinearLayer::of_codebook([2, 3], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], path).expect("fits");
        assert_eq!((book.inputs(), book.weights(0), book.weights(2)), (2, &[1.0, 4.0][..], &[3.0, 6.0][..]));
        assert!(LinearLayer::of_codebook([usize::MAX, 3], &[1.0], path).is_err());
    }

    #[test]
    fn every_step_is_applied_in_its_order() {
        let path = Path::new("x.pth");
        let layer = LinearLayer::new([2, 2], vec![1.0, 0.0, 0.0, -1.0], Some(vec![0.0, 1.0]), path).expect("fits");
        let made = |steps: Vec<DecoderStep>| Decoder::new(2, steps, path).expect("fits").embedding(&[3.0, 4.0]);
        let near = |found: Vec<f32>, wanted: [f32; 2]| found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(near(made(vec![]), [0.6, 0.8]));
        // (3, -3), then (3, 0).
        assert!(near(made(vec![DecoderStep::Linear(layer.clone()), DecoderStep::Relu]), [1.0, 0.0]));
        // (3, 4), then (3, -3): the control, another order.
        let half = 0.5_f32.sqrt();
        assert!(near(made(vec![DecoderStep::Relu, DecoderStep::Linear(layer.clone())]), [half, -half]));
        // (0.6, 0.8), then (0.6, 0.2).
        let length = 0.4_f32.sqrt();
        assert!(near(made(vec![DecoderStep::Unit, DecoderStep::Linear(layer)]), [0.6 / length, 0.2 / length]));
        // Shares 1 to e.
        let (one, e) = (1.0, 1.0_f32.exp());
        let length = (one + e * e).sqrt();
        assert!(near(made(vec![DecoderStep::Softmax]), [one / length, e / length]));
        assert_eq!(Decoder::none(2).embedding(&[0.0, 0.0]), [0.0, 0.0], "no direction");
    }
}
