//! A few weights for each Gaussian among the entries of a codebook.

/// Weights of entries, the same number for each row.
#[derive(Clone, Debug, PartialEq)]
pub struct SparseRows {
    dim: usize,
    kept: usize,
    /// Entry and weight, [`Self::kept`] for each row.
    entries: Vec<(u16, f32)>,
}

/// Number that LangSplatV2 adds to the sum of the kept weights before they are divided by it.
const TINY: f32 = 1e-10;

impl SparseRows {
    /// Keeps the `most` largest shares of each row of logits: a softmax over the row, of which the largest are divided by
    /// their sum. Of equal shares, the first is kept.
    pub(crate) fn largest_shares(dim: usize, logits: &[f32], most: usize) -> Option<Self> {
        let kept = most.min(dim);
        if dim == 0 || dim > usize::from(u16::MAX) || kept == 0 || !logits.len().is_multiple_of(dim) {
            return None;
        }
        let mut entries = Vec::with_capacity(logits.len() / dim * kept);
        let mut order: Vec<u16> = Vec::with_capacity(dim);
        for row in logits.chunks_exact(dim) {
            let highest = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            let share = |k: u16| (row[usize::from(k)] - highest).exp();
            let sum: f32 = (0..dim as u16).map(share).sum();
            order.clear();
            order.extend(0..dim as u16);
            order.sort_by(|a, b| row[usize::from(*b)].total_cmp(&row[usize::from(*a)]));
            let kept = &order[..kept];
            let among: f32 = kept.iter().map(|k| share(*k) / sum).sum::<f32>() + TINY;
            entries.extend(kept.iter().map(|k| (*k, share(*k) / sum / among)));
        }
        Some(Self { dim, kept, entries })
    }

    /// Numbers of a row.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Weights that are kept of each row.
    pub fn kept(&self) -> usize {
        self.kept
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.entries.len() / self.kept
    }

    /// Returns whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Entries and weights of row `i`.
    pub fn row(&self, i: usize) -> &[(u16, f32)] {
        &self.entries[i * self.kept..(i + 1) * self.kept]
    }

    /// Copies numbers of row `i` from column `from` on into `out`.
    pub fn copy(&self, i: usize, from: usize, out: &mut [f32]) {
        out.fill(0.0);
        for (k, weight) in self.row(i) {
            if let Some(out) = usize::from(*k).checked_sub(from).and_then(|k| out.get_mut(k)) {
                *out = *weight;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_shares_are_kept_and_sum_to_one() {
        let logits = [0.0, 2.0, 1.0, -1.0, 5.0, 5.0, 5.0, 5.0];
        let rows = SparseRows::largest_shares(4, &logits, 2).expect("rows");
        let mut row = [0.0; 4];
        rows.copy(0, 0, &mut row);
        let e = 1.0_f32.exp();
        assert!((row[1] - e / (1.0 + e)).abs() < 1e-6 && (row[2] - 1.0 / (1.0 + e)).abs() < 1e-6, "{row:?}");
        assert_eq!((row[0], row[3], rows.len(), rows.kept()), (0.0, 0.0, 2, 2));
        rows.copy(1, 0, &mut row);
        assert_eq!((row[0] > 0.49, row[1] > 0.49, row[2], row[3]), (true, true, 0.0, 0.0));
        let mut part = [7.0; 2];
        rows.copy(0, 2, &mut part);
        assert!(part[0] > 0.2 && part[1] == 0.0, "{part:?}");
        assert_eq!(SparseRows::largest_shares(3, &logits, 2), None, "no whole rows");
    }
}
