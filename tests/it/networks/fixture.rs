//! Reads the fixtures.

use std::path::PathBuf;

use fmlgs::math::stats;
use fmlgs::models::tensor::Tensor;
use fmlgs::scene::PhotoPixels;
use safetensors::{Dtype, SafeTensors};
use serde_json::Value;

/// A file of the fixtures.
pub fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/networks").join(name)
}

/// A JSON file.
pub fn json(name: &str) -> Value {
    serde_json::from_slice(&std::fs::read(path(name)).expect("fixture")).expect("JSON")
}

/// A file of tensors.
pub struct Tensors(Vec<u8>);

impl Tensors {
    pub fn open(name: &str) -> Self {
        Self(std::fs::read(path(name)).expect("fixture"))
    }

    fn raw(&self, name: &str) -> (Vec<usize>, Dtype, Vec<u8>) {
        let file = SafeTensors::deserialize(&self.0).expect("safetensors");
        let view = file.tensor(name).unwrap_or_else(|_| panic!("no tensor '{name}'"));
        (view.shape().to_vec(), view.dtype(), view.data().to_vec())
    }

    pub fn names(&self) -> Vec<String> {
        let file = SafeTensors::deserialize(&self.0).expect("safetensors");
        file.names().into_iter().map(str::to_owned).collect()
    }

    /// Floating-point numbers.
    pub fn floats(&self, name: &str) -> Tensor {
        let (shape, dtype, data) = self.raw(name);
        assert_eq!(dtype, Dtype::F32, "{name}");
        Tensor::new(&shape, data.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
    }

    /// Whole numbers of 64 bits.
    pub fn ints(&self, name: &str) -> Tensor<i64> {
        let (shape, dtype, data) = self.raw(name);
        assert_eq!(dtype, Dtype::I64, "{name}");
        let values = data.chunks_exact(8).map(|b| i64::from_le_bytes(b.try_into().expect("eight"))).collect();
        Tensor::new(&shape, values)
    }

    /// Bytes.
    pub fn bytes(&self, name: &str) -> (Vec<usize>, Vec<u8>) {
        let (shape, dtype, data) = self.raw(name);
        assert!(matches!(dtype, Dtype::U8 | Dtype::I8), "{name}");
        (shape, data)
    }

    /// Numbers of 16 or 32 bits, little-endian, unsigned.
    pub fn unsigned(&self, name: &str) -> Vec<usize> {
        let (_, dtype, data) = self.raw(name);
        let size = if dtype == Dtype::U16 { 2 } else { 4 };
        let number = |b: &[u8]| b.iter().rev().fold(0_usize, |n, b| n << 8 | usize::from(*b));
        data.chunks_exact(size).map(number).collect()
    }

    /// A picture `[H, W, 3]`, or the `k`-th of `[n, H, W, 3]`.
    pub fn picture(&self, name: &str, k: usize) -> PhotoPixels {
        let (shape, data) = self.bytes(name);
        let [h, w] = [shape[shape.len() - 3], shape[shape.len() - 2]];
        let rgb = data[k * h * w * 3..(k + 1) * h * w * 3].chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        PhotoPixels { width_px: w as u32, height_px: h as u32, rgb, coverage: None, alpha: None }
    }
}

/// The largest difference, relative to the largest expected magnitude.
pub fn error(got: &[f32], expected: &[f32]) -> f64 {
    assert_eq!(got.len(), expected.len(), "another number of values");
    let largest = stats::worst(expected.iter().map(|v| v.abs()));
    assert!(largest > 0.0, "nothing to compare with");
    stats::worst_difference(got, expected) / largest
}

/// Bound on [`error`].
pub const TOLERANCE: f64 = 1e-3;

/// Asserts that `got` agrees and that `wrong`, the output of a faulty program, does not.
pub fn agrees(what: &str, got: &[f32], wrong: &[f32], expected: &[f32]) {
    let (right, control) = (error(got, expected), error(wrong, expected));
    println!("{what}: relative error {right:.1e}, negative control {control:.1e}");
    assert!(right < TOLERANCE, "{what}: {right:e}");
    assert!(control > 10.0 * TOLERANCE, "{what}: the negative control passes ({control:e})");
}

#[test]
fn what_is_no_number_agrees_with_nothing() {
    let expected = [1.0, -2.0];
    assert!(error(&[1.0, -2.001], &expected) < TOLERANCE);
    assert!(error(&[f32::NAN, -2.0], &expected).is_nan() && error(&[1.0, f32::NAN], &expected).is_nan());
    assert!(error(&[1.0, f32::NEG_INFINITY], &expected).is_infinite());
}
