//! The grid of points that a network is asked at. Every second one along both sides is asked first; one that lies
//! between those is left out where all of them lie, with it, in one mask that is the smallest of one of them: there
//! is nothing finer in it, unless it is smaller than two steps of the grid.

/// Steps between the points that are asked first.
const STRIDE: usize = 2;
/// Points along a side under which all are asked.
const FEW: usize = 8;

/// A square grid over the unit square, and which mask is the smallest that a point was answered with.
pub(super) struct GridPoints {
    per_side: usize,
    /// By point: an index in what was found.
    smallest: Vec<Option<usize>>,
}

impl GridPoints {
    pub(super) fn new(per_side: usize) -> Self {
        Self { per_side, smallest: vec![None; per_side * per_side] }
    }

    pub(super) fn len(&self) -> usize {
        self.smallest.len()
    }

    /// Where a point lies in the unit square.
    pub(super) fn at(&self, k: usize) -> [f64; 2] {
        [k % self.per_side, k / self.per_side].map(|i| (i as f64 + 0.5) / self.per_side as f64)
    }

    /// Points in the order in which they are asked: all at once, or those that are asked first, and the others.
    pub(super) fn stages(&self, sparing: bool) -> Vec<Vec<usize>> {
        let all: Vec<usize> = (0..self.len()).collect();
        if !sparing || self.per_side < FEW {
            return vec![all];
        }
        let (first, rest) = all.into_iter().partition(|k| self.is_first(*k));
        vec![first, rest]
    }

    fn is_first(&self, k: usize) -> bool {
        (k % self.per_side).is_multiple_of(STRIDE) && (k / self.per_side).is_multiple_of(STRIDE)
    }

    /// Remembers that a point was answered with masks of these `areas`, of which the first has index `first` in what
    /// was found.
    pub(super) fn answer(&mut self, k: usize, first: usize, areas: impl Iterator<Item = usize>) {
        self.smallest[k] = areas.zip(first..).min().map(|(_, i)| i);
    }

    /// Whether a point would be answered with what was found around it. `holds` says whether the mask of an index in
    /// that holds a place in the unit square.
    pub(super) fn is_known(&self, k: usize, holds: &dyn Fn(usize, [f64; 2]) -> bool) -> bool {
        let Some(around) = (!self.is_first(k)).then(|| self.around(k)).flatten() else { return false };
        let together = |i: &usize| around.iter().chain([&k]).all(|k| holds(*i, self.at(*k)));
        around.iter().filter_map(|k| self.smallest[*k].as_ref()).any(together)
    }

    /// The points asked first between which a point lies; `None` at an edge of the grid, where some are missing.
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
