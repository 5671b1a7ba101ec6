//! Tensors of PyTorch files as the readers of results need them.

use std::path::Path;

use super::decoder::LinearLayer;
use super::rows::FeatureRows;
use crate::io::torch::WeightFile;
use crate::io::{IoError, trainings};
use crate::scene::GaussianCloud;

/// Rows that are read at once.
const BLOCK_ROWS: usize = 1 << 14;

/// A PyTorch file with its path.
pub(super) struct Tensors<'a> {
    file: WeightFile,
    path: &'a Path,
}

impl<'a> Tensors<'a> {
    pub(super) fn open(path: &'a Path) -> Result<Self, IoError> {
        Ok(Self { file: WeightFile::open(path).map_err(|e| e.of(path))?, path })
    }

    /// Shape of a tensor.
    pub(super) fn shape(&self, name: &str) -> Option<&[usize]> {
        self.file.tensors.get(name).map(|t| t.shape.as_slice())
    }

    /// Returns whether a tensor holds fractions.
    pub(super) fn is_float(&self, name: &str) -> bool {
        self.file.tensors.get(name).is_some_and(|t| t.dtype.is_float())
    }

    /// Names of all tensors, sorted.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.file.tensors.keys().map(String::as_str)
    }

    /// Number of values in a tuple or list.
    pub(super) fn length(&self, name: &str) -> Option<usize> {
        self.file.tree.length(name)
    }

    /// Numbers of a tensor, row after row.
    pub(super) fn floats(&mut self, name: &str) -> Result<Vec<f32>, IoError> {
        self.file.floats(name).map_err(|e| e.of(self.path))
    }

    /// Whole numbers of a tensor.
    pub(super) fn integers(&mut self, name: &str) -> Result<Vec<i64>, IoError> {
        self.file.integers(name).map_err(|e| e.of(self.path))
    }

    /// A tensor as rows: its first axis, and all others together.
    pub(super) fn rows(&mut self, name: &str) -> Result<FeatureRows, IoError> {
        let dim = self.dim(name)?;
        let rows = FeatureRows::new(dim, self.floats(name)?);
        rows.ok_or_else(|| self.error(name, "has no numbers".into()))
    }

    /// As [`Self::rows`], of half the precision, and never as a whole in full.
    pub(super) fn half_rows(&mut self, name: &str) -> Result<FeatureRows, IoError> {
        let dim = self.dim(name)?;
        let mut values = Vec::new();
        let mut each = |_: usize, block: &[f32]| values.extend(block.iter().map(|v| half::f16::from_f32(*v)));
        self.file.blocks(name, BLOCK_ROWS, &mut each).map_err(|e| e.of(self.path))?;
        let rows = FeatureRows::halves(dim, values).ok_or_else(|| self.error(name, "has no numbers".into()))?;
        rows.finite(self.path, name)
    }

    /// The column with the largest number of each row, the first of equal ones, and the number of columns.
    pub(super) fn largest_columns(&mut self, name: &str) -> Result<(Vec<i64>, usize), IoError> {
        let dim = self.dim(name)?;
        let (mut all, mut bad) = (Vec::new(), None);
        let mut each = |first: usize, block: &[f32]| {
            for (k, row) in block.chunks_exact(dim).enumerate() {
                if row.iter().any(|v| !v.is_finite()) {
                    bad.get_or_insert(first + k);
                }
                let best = (0..dim).reduce(|a, b| if row[b] > row[a] { b } else { a });
                all.push(best.map_or(-1, |best| best as i64));
            }
        };
        self.file.blocks(name, BLOCK_ROWS, &mut each).map_err(|e| e.of(self.path))?;
        match bad {
            None => Ok((all, dim)),
            Some(row) => Err(self.error(name, format!("has a number in row {row} that is not finite"))),
        }
    }

    fn dim(&self, name: &str) -> Result<usize, IoError> {
        let shape = self.shape(name).ok_or_else(|| self.error(name, "is not there".into()))?;
        let dim = shape.iter().skip(1).product();
        if shape.len() < 2 || dim == 0 {
            return Err(self.error(name, format!("has the shape {shape:?}, expected rows")));
        }
        Ok(dim)
    }

    /// A linear layer, or a convolution of one pixel: `<name>.weight` and `<name>.bias`.
    pub(super) fn layer(&mut self, name: &str) -> Result<LinearLayer, IoError> {
        let (weight, bias) = (format!("{name}.weight"), format!("{name}.bias"));
        let shape = self.shape(&weight).unwrap_or_default().to_vec();
        let [outputs, inputs, rest @ ..] = shape.as_slice() else {
            return Err(self.error(&weight, format!("has the shape {shape:?}, expected [outputs, inputs]")));
        };
        if rest.iter().any(|n| *n != 1) {
            return Err(
                self.error(&weight, format!("has the shape {shape:?}; only convolutions of one pixel are read"))
            );
        }
        let (values, bias) = (self.floats(&weight)?, self.floats(&bias)?);
        LinearLayer::new([*outputs, *inputs], values, Some(bias), self.path)
    }

    pub(super) fn error(&self, name: &str, problem: String) -> IoError {
        IoError::syntax(self.path, format!("tensor '{name}'"), problem)
    }

    /// Gaussians of the tuple that 3D Gaussian Splatting's `capture()` makes.
    pub(super) fn cloud(&mut self) -> Result<GaussianCloud, IoError> {
        trainings::gaussians(self.path, &mut self.file)
    }
}
