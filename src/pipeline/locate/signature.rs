//! Signatures of small pictures: directions of edges by cell. They survive exposure and white balance, and tolerate
//! shifts by some px, so that the nearest of some hundred views is found.

use super::gray::GrayPlane;

/// Side of a cell, px.
pub(super) const CELL_PX: usize = 8;
/// Directions of edges, over half a turn.
const BINS: usize = 8;
/// Largest shift that is tried, cells.
const FARTHEST: isize = 3;
/// Smallest share of the photo's cells that a shift must leave over the other picture.
const LEAST_OVERLAP: f32 = 0.5;

/// Directions of edges in the cells of a small picture.
#[derive(Clone, Debug)]
pub(super) struct ViewSignature {
    columns: usize,
    rows: usize,
    cells: Vec<[f32; BINS]>,
}

/// The best place of a photo's signature on that of a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placed {
    /// Cosine of the cells on each other, less for parts that hang over.
    pub(super) likeness: f32,
    /// Place of the photo's middle from the view's middle, px.
    pub(super) shift_px: [f64; 2],
}

impl ViewSignature {
    pub(super) fn of(gray: &GrayPlane) -> Self {
        let (columns, rows) = (gray.width / CELL_PX, gray.height / CELL_PX);
        let [dx, dy] = gray.blurred(1.0).slopes();
        let mut cells = vec![[0.0; BINS]; columns * rows];
        for y in 0..rows * CELL_PX {
            for x in 0..columns * CELL_PX {
                let at = y * gray.width + x;
                let (gx, gy) = (dx.values[at], dy.values[at]);
                let bin = (gy.atan2(gx) / std::f32::consts::PI).rem_euclid(1.0) * BINS as f32;
                let (low, share) = (bin as usize % BINS, bin.fract());
                let strength = gx.hypot(gy);
                let cell = &mut cells[y / CELL_PX * columns + x / CELL_PX];
                cell[low] += strength * (1.0 - share);
                cell[(low + 1) % BINS] += strength * share;
            }
        }
        let length = |cell: &[f32; BINS]| cell.iter().map(|v| v * v).sum::<f32>().sqrt();
        let mean = cells.iter().map(length).sum::<f32>() / cells.len().max(1) as f32;
        // Cells of little contrast count little, whatever the exposure is.
        for cell in &mut cells {
            let by = (length(cell) + 0.5 * mean).max(f32::MIN_POSITIVE);
            cell.iter_mut().for_each(|v| *v /= by);
        }
        Self { columns, rows, cells }
    }

    /// The best place of this photo on a view.
    pub(super) fn placed_on(&self, view: &Self) -> Placed {
        let base = [view.columns as isize - self.columns as isize, view.rows as isize - self.rows as isize];
        let mut best = Placed { likeness: 0.0, shift_px: [0.0; 2] };
        for sy in -FARTHEST..=FARTHEST {
            for sx in -FARTHEST..=FARTHEST {
                let offset = [base[0].div_euclid(2) + sx, base[1].div_euclid(2) + sy];
                let Some(likeness) = self.likeness(view, offset).filter(|l| *l > best.likeness) else { continue };
                let shift = |axis: usize| (offset[axis] as f64 - base[axis] as f64 / 2.0) * CELL_PX as f64;
                best = Placed { likeness, shift_px: [shift(0), shift(1)] };
            }
        }
        best
    }

    /// Likeness with this signature's first cell at cell `offset` of the view.
    fn likeness(&self, view: &Self, offset: [isize; 2]) -> Option<f32> {
        let (mut product, mut own, mut others, mut count) = (0.0, 0.0, 0.0, 0_usize);
        for y in 0..self.rows {
            let there = y as isize + offset[1];
            if !(0..view.rows as isize).contains(&there) {
                continue;
            }
            for x in 0..self.columns {
                let at = x as isize + offset[0];
                if !(0..view.columns as isize).contains(&at) {
                    continue;
                }
                let a = &self.cells[y * self.columns + x];
                let b = &view.cells[there as usize * view.columns + at as usize];
                for (a, b) in a.iter().zip(b) {
                    product += a * b;
                    own += a * a;
                    others += b * b;
                }
                count += 1;
            }
        }
        let overlap = count as f32 / (self.cells.len().max(1)) as f32;
        let norm = (own * others).sqrt();
        // A photo that is larger than the view hangs over everywhere.
        let most = (view.cells.len() as f32 / self.cells.len().max(1) as f32).min(1.0);
        (norm > 0.0 && overlap >= LEAST_OVERLAP * most).then(|| product / norm * (overlap / most).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of made-up waves, cut out at an offset.
    fn waves(width: usize, height: usize, offset: [f32; 2], seed: f32) -> GrayPlane {
        let at = |i: usize| {
            let (x, y) = ((i % width) as f32 + offset[0], (i / width) as f32 + offset[1]);
            let wave = |k: f32| (x * 0.11 * (k + seed).sin() + y * 0.13 * (k * 1.7 + seed).cos() + k).sin();
            0.5 + 0.1 * (1..6).map(|k| wave(k as f32 * 1.3)).sum::<f32>()
        };
        GrayPlane { width, height, values: (0..width * height).map(at).collect() }
    }

    #[test]
    fn a_shifted_and_brighter_picture_is_placed_and_another_is_less_alike() {
        let view = ViewSignature::of(&waves(96, 72, [0.0, 0.0], 0.0));
        let mut photo = waves(96, 72, [16.0, -8.0], 0.0);
        photo.values.iter_mut().for_each(|v| *v = 1.6 * *v + 0.1);
        let placed = ViewSignature::of(&photo).placed_on(&view);
        assert_eq!(placed.shift_px, [16.0, -8.0]);
        let other = ViewSignature::of(&waves(96, 72, [0.0, 0.0], 2.0)).placed_on(&view);
        assert!(placed.likeness > other.likeness + 0.1, "{placed:?} {other:?}");
    }

    #[test]
    fn nothing_is_like_a_flat_picture() {
        let flat = ViewSignature::of(&GrayPlane { width: 96, height: 72, values: vec![0.5; 96 * 72] });
        assert_eq!(flat.placed_on(&flat).likeness, 0.0);
        let tiny = ViewSignature::of(&GrayPlane { width: 1, height: 1, values: vec![0.5] });
        assert_eq!(tiny.placed_on(&flat).likeness, 0.0);
    }
}
