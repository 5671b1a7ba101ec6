//! Rows of numbers: one vector for each Gaussian, cluster or entry of a codebook.

use std::path::Path;

use half::f16;
use rayon::prelude::*;

use crate::io::{IoError, memory};
use crate::scene::{ExtraProperty, GaussianCloud};

/// Vectors of one length, row after row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FeatureRows {
    dim: usize,
    numbers: RowNumbers,
}

/// Numbers as they are kept: those of wide rows take half the memory.
#[derive(Clone, Debug, PartialEq)]
enum RowNumbers {
    Single(Vec<f32>),
    Half(Vec<f16>),
}

impl Default for RowNumbers {
    fn default() -> Self {
        Self::Single(Vec::new())
    }
}

impl FeatureRows {
    /// Creates rows of `dim` numbers; `None` if the numbers do not fill whole rows.
    pub fn new(dim: usize, values: Vec<f32>) -> Option<Self> {
        let whole = dim > 0 && values.len().is_multiple_of(dim);
        whole.then_some(Self { dim, numbers: RowNumbers::Single(values) })
    }

    /// As [`Self::new`], of half the precision.
    pub fn halves(dim: usize, values: Vec<f16>) -> Option<Self> {
        let whole = dim > 0 && values.len().is_multiple_of(dim);
        whole.then_some(Self { dim, numbers: RowNumbers::Half(values) })
    }

    /// Numbers of a row.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        let numbers = match &self.numbers {
            RowNumbers::Single(v) => v.len(),
            RowNumbers::Half(v) => v.len(),
        };
        numbers / self.dim.max(1)
    }

    /// Returns whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Copies the numbers of row `i` from column `from` on into `out`.
    pub fn copy(&self, i: usize, from: usize, out: &mut [f32]) {
        let at = i * self.dim + from;
        match &self.numbers {
            RowNumbers::Single(v) => out.copy_from_slice(&v[at..at + out.len()]),
            RowNumbers::Half(v) => out.iter_mut().zip(&v[at..]).for_each(|(out, v)| *out = v.to_f32()),
        }
    }

    /// Row `i`.
    pub fn row(&self, i: usize) -> Vec<f32> {
        let mut out = vec![0.0; self.dim];
        self.copy(i, 0, &mut out);
        out
    }

    /// Places the rows where `has` is true, in order, and zeros elsewhere; `None` if it is true another number of times.
    pub(crate) fn spread(&self, has: &[bool]) -> Option<Self> {
        let fits = has.iter().filter(|has| **has).count() == self.len();
        let numbers = || match &self.numbers {
            RowNumbers::Single(v) => RowNumbers::Single(spread(v, self.dim, has)),
            RowNumbers::Half(v) => RowNumbers::Half(spread(v, self.dim, has)),
        };
        fits.then(|| Self { dim: self.dim, numbers: numbers() })
    }

    /// All numbers, row after row.
    pub fn to_vec(&self) -> Vec<f32> {
        match &self.numbers {
            RowNumbers::Single(v) => v.clone(),
            RowNumbers::Half(v) => v.iter().map(|v| v.to_f32()).collect(),
        }
    }

    /// Checks that all numbers are finite; the error names the first row that has another.
    pub(crate) fn finite(self, path: &Path, what: &str) -> Result<Self, IoError> {
        let at = match &self.numbers {
            RowNumbers::Single(v) => v.par_iter().position_first(|v| !v.is_finite()),
            RowNumbers::Half(v) => v.par_iter().position_first(|v| !v.is_finite()),
        };
        match at {
            None => Ok(self),
            Some(at) => Err(IoError::NotFinite {
                path: path.into(),
                element: "row",
                index: at / self.dim.max(1),
                property: format!("number {} of {what}", at % self.dim.max(1)),
            }),
        }
    }
}

/// Places rows where `has` is true, and zeros elsewhere.
fn spread<T: Copy + Default>(values: &[T], dim: usize, has: &[bool]) -> Vec<T> {
    let mut all = vec![T::default(); has.len() * dim];
    let places = all.chunks_exact_mut(dim).zip(has).filter(|(_, has)| **has);
    places.zip(values.chunks_exact(dim)).for_each(|((place, _), row)| place.copy_from_slice(row));
    all
}

/// Number of the properties `<prefix>0`, `<prefix>1`, ... of a cloud.
pub(crate) fn count(cloud: &GaussianCloud, prefix: &str) -> usize {
    let numbered = |k: usize| cloud.extras.iter().any(|e| e.name.strip_prefix(prefix) == Some(&*k.to_string()));
    (0..).take_while(|k| numbered(*k)).count()
}

/// Takes these properties out of a cloud, as rows.
pub(crate) fn take(cloud: &mut GaussianCloud, names: &[String], path: &Path) -> Result<FeatureRows, IoError> {
    let mut columns: Vec<Vec<f32>> = Vec::with_capacity(names.len());
    for name in names {
        let at = cloud.extras.iter().position(|e| e.name == *name);
        let at = at.ok_or_else(|| IoError::syntax(path, "element 'vertex'", format!("no property '{name}'")))?;
        columns.push(cloud.extras.swap_remove(at).values);
    }
    gathered(columns, cloud.len(), path, names.first().map_or("", |n| n.as_str()))
}

/// Removes properties that other programs left and that mean nothing here.
pub(crate) fn drop_extras(cloud: &mut GaussianCloud, unwanted: impl Fn(&ExtraProperty) -> bool) {
    cloud.extras.retain(|e| !unwanted(e));
}

/// Turns columns of `rows` numbers each into rows.
fn gathered(columns: Vec<Vec<f32>>, rows: usize, path: &Path, what: &str) -> Result<FeatureRows, IoError> {
    let dim = columns.len().max(1);
    let bytes = (rows * dim * size_of::<f32>()) as u64;
    let limit = memory::budget();
    if bytes > limit {
        let remedy = "free some memory";
        return Err(IoError::OverBudget {
            path: path.into(),
            what: "turning its columns into rows",
            bytes,
            limit,
            remedy,
        });
    }
    let mut values = vec![0.0; rows * dim];
    for (c, column) in columns.into_iter().enumerate() {
        values.par_chunks_exact_mut(dim).zip(&column).for_each(|(row, v)| row[c] = *v);
    }
    let rows = FeatureRows::new(dim, values);
    let rows = rows.ok_or_else(|| IoError::syntax(path, "element 'vertex'", format!("no columns like '{what}'")))?;
    rows.finite(path, what)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_become_rows_and_those_that_are_missing_are_named() {
        let mut cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 2], 0.0, 0.0);
        let extra = |name: &str, values: [f32; 2]| ExtraProperty { name: name.into(), values: values.to_vec() };
        cloud.extras = vec![extra("f_1", [3.0, 4.0]), extra("f_0", [1.0, 2.0]), extra("kept", [9.0; 2])];
        assert_eq!((count(&cloud, "f_"), count(&cloud, "g_")), (2, 0));
        let path = Path::new("x.ply");
        let names = ["f_0", "f_1"].map(str::to_owned);
        let rows = take(&mut cloud.clone(), &names, path).expect("two columns");
        assert_eq!((rows.dim(), rows.len(), rows.row(0), rows.row(1)), (2, 2, vec![1.0, 3.0], vec![2.0, 4.0]));
        let turned = take(&mut cloud.clone(), &["f_1", "f_0"].map(str::to_owned), path).expect("two columns");
        assert_ne!(rows, turned, "the control");
        let e = take(&mut cloud.clone(), &["f_2".to_owned()], path).expect_err("missing").to_string();
        assert!(e.contains("f_2"), "{e}");
        cloud.extras[0].values[1] = f32::NAN;
        let e = take(&mut cloud, &names, path).expect_err("no number").to_string();
        assert!(e.contains("number 1") && e.contains("row 1"), "{e}");
        assert_eq!(cloud.extras.len(), 1);
    }

    #[test]
    fn halves_take_half_the_memory_and_read_alike() {
        let single = FeatureRows::new(3, vec![0.5, -1.0, 2.0, 0.25, 0.0, 8.0]).expect("whole rows");
        let half = single.to_vec().into_iter().map(f16::from_f32).collect();
        let half = FeatureRows::halves(3, half).expect("whole rows");
        assert_eq!((half.row(1), half.len()), (single.row(1), 2));
        let mut part = [0.0; 2];
        half.copy(1, 1, &mut part);
        assert_eq!(part, [0.0, 8.0]);
        assert_eq!((FeatureRows::new(4, vec![0.0; 6]), FeatureRows::new(0, vec![])), (None, None));
        for rows in [&single, &half] {
            let spread = rows.spread(&[false, true, false, true]).expect("two rows");
            assert_eq!((spread.len(), spread.row(1), spread.row(3)), (4, rows.row(0), rows.row(1)));
            assert_eq!((spread.row(0), spread.row(2)), (vec![0.0; 3], vec![0.0; 3]));
            assert_eq!(rows.spread(&[true]), None);
        }
    }
}
