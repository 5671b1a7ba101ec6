//! Grid of point prompts. Every second point along both sides is prompted first. A point between those is skipped if
//! it lies with all of them in one mask that is the smallest mask of one of them: that mask contains nothing finer,
//! unless it is smaller than two steps of the grid.

/// Steps between the points that are prompted first.
const STRIDE: usize = 2;
/// Number of points along a side below which none is skipped.
const FEW: usize = 8;

/// Square grid over the unit square, with the smallest mask of each prompted point.
pub(super) struct GridPoints {
    per_side: usize,
    /// By point: index of a found mask.
    smallest: Vec<Option<usize>>,
}

impl GridPoints {
    pub(super) fn new(per_side: usize) -> Self {
        Self { per_side, smallest: vec![None; per_side * per_side] }
    }

    pub(super) fn len(&self) -> usize {
        self.smallest.len()
    }

    /// Position of a point in the unit square.
    pub(super) fn at(&self, k: usize) -> [f64; 2] {
        [k % self.per_side, k / self.per_side].map(|i| (i as f64 + 0.5) / self.per_side as f64)
    }

    /// Points by stage: all at once, or those that are prompted first, then the others.
    pub(super) fn stages(&self, adaptive: bool) -> Vec<Vec<usize>> {
        let all: Vec<usize> = (0..self.len()).collect();
        if !adaptive || self.per_side < FEW {
            return vec![all];
        }
        let (first, rest) = all.into_iter().partition(|k| self.is_first(*k));
        vec![first, rest]
    }

    fn is_first(&self, k: usize) -> bool {
        (k % self.per_side).is_multiple_of(STRIDE) && (k / self.per_side).is_multiple_of(STRIDE)
    }

    /// Records the masks of a point by their `areas`; the first of them has index `first` among the found masks.
    pub(super) fn answer(&mut self, k: usize, first: usize, areas: impl Iterator<Item = usize>) {
        self.smallest[k] = areas.zip(first..).min().map(|(_, i)| i);
    }

    /// Returns whether a point needs no prompt, because the masks around it cover it. `holds` says whether the found
    /// mask of an index contains a position in the unit square.
    pub(super) fn is_known(&self, k: usize, holds: &dyn Fn(usize, [f64; 2]) -> bool) -> bool {
        let Some(around) = (!self.is_first(k)).then(|| self.around(k)).flatten() else { return false };
        let together = |i: &usize| around.iter().chain([&k]).all(|k| holds(*i, self.at(*k)));
        around.iter().filter_map(|k| self.smallest[*k].as_ref()).any(together)
    }

    /// Neighbors of a point among those prompted first; `None` at an edge of the grid, where some are missing.
    fn around(&self, k: usize) -> Option<Vec<usize>> {
        let along = |i: usize| -> Option<Vec<usize>> {
            let below = i - i % STRIDE;
            let ends = if i == below { vec![below] } else { vec![below, below + STRIDE] };
            ends.iter().all(|i| *i < self.per_side).then_some(ends)
        };
        let (columns, rows) = (along(k % self.per_side)?, along(k / self.per_side)?);
        Some(rows.iter().flat_map(|y| columns.iter().map(move |x| y * self.per_side + x)).collect())
    }
}

#[cfg(test)]
mod tests;
