//! Regions of one picture.

use std::ops::Range;

use rayon::prelude::*;

use crate::math::resize::nearest;

/// Words that one thread fills at least: less is not worth handing over.
const WORDS_PER_TASK: usize = 1024;

/// A set of pixels of a picture, one bit each, row-major.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Mask {
    width_px: usize,
    height_px: usize,
    words: Vec<u64>,
}

/// Columns and rows that a region spans, ends exclusive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PixelBox {
    pub(crate) x: Range<usize>,
    pub(crate) y: Range<usize>,
}

impl PixelBox {
    pub(crate) fn contains(&self, x: usize, y: usize) -> bool {
        self.x.contains(&x) && self.y.contains(&y)
    }
}

impl Mask {
    /// No pixel of a picture of this size.
    pub fn empty(width_px: usize, height_px: usize) -> Self {
        Self { width_px, height_px, words: vec![0; (width_px * height_px).div_ceil(64)] }
    }

    /// The pixels for which `inside(index)` holds.
    pub fn from_fn(width_px: usize, height_px: usize, inside: impl Fn(usize) -> bool + Sync) -> Self {
        let n = width_px * height_px;
        let word = |k: usize| (k * 64..n.min(k * 64 + 64)).fold(0, |word, i| word | u64::from(inside(i)) << (i % 64));
        let words = (0..n.div_ceil(64)).into_par_iter().with_min_len(WORDS_PER_TASK).map(word).collect();
        Self { width_px, height_px, words }
    }

    /// Adds the pixels whose centers are inside a polygon (even-odd rule), vertices in px. With vertices
    /// on whole numbers, as in label files, a pixel center is at its whole coordinates.
    pub(crate) fn add_polygon(&mut self, vertices: &[[f64; 2]]) {
        let rows = |end: fn(f64, f64) -> f64, none: f64| vertices.iter().map(|v| v[1]).fold(none, end);
        let (top, bottom) = (rows(f64::min, f64::INFINITY), rows(f64::max, f64::NEG_INFINITY));
        let (width_px, height_px) = (self.width_px, self.height_px);
        let mut crossings = Vec::new();
        // The crossings of a row at a vertex count downwards only, so none lie on the last.
        let end = bottom.ceil().clamp(0.0, height_px as f64) as usize;
        for y in top.ceil().clamp(0.0, height_px as f64) as usize..end {
            let row = y as f64;
            crossings.clear();
            for (i, a) in vertices.iter().enumerate() {
                let b = vertices[(i + 1) % vertices.len()];
                if (a[1] <= row) != (b[1] <= row) {
                    crossings.push(a[0] + (row - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
                }
            }
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                let from = pair[0].ceil().max(0.0) as usize;
                let to = (pair[1].floor() + 1.0).clamp(0.0, width_px as f64) as usize;
                (from..to).for_each(|x| self.insert(y * width_px + x));
            }
        }
    }

    /// Width of the picture, px.
    pub fn width_px(&self) -> usize {
        self.width_px
    }

    /// Height of the picture, px.
    pub fn height_px(&self) -> usize {
        self.height_px
    }

    /// Adds the pixel with this index.
    pub fn insert(&mut self, index: usize) {
        self.words[index / 64] |= 1 << (index % 64);
    }

    pub(crate) fn contains(&self, index: usize) -> bool {
        self.words[index / 64] >> (index % 64) & 1 == 1
    }

    /// Number of pixels.
    pub fn area(&self) -> usize {
        self.words.iter().map(|w| w.count_ones() as usize).sum()
    }

    /// Returns whether it has no pixels.
    pub fn is_empty(&self) -> bool {
        self.words.iter().all(|w| *w == 0)
    }

    /// Indices of its pixels, ascending.
    pub(crate) fn pixels(&self) -> impl Iterator<Item = usize> + '_ {
        self.words.iter().enumerate().flat_map(|(k, &word)| {
            std::iter::successors((word != 0).then_some(word), |w| Some(w & (w - 1)).filter(|w| *w != 0))
                .map(move |w| k * 64 + w.trailing_zeros() as usize)
        })
    }

    /// Adds the pixels of another mask of the same size.
    pub(crate) fn add(&mut self, other: &Self) {
        self.words.iter_mut().zip(&other.words).for_each(|(a, b)| *a |= b);
    }

    /// Takes the pixels of another mask of the same size away.
    pub(crate) fn subtract(&mut self, other: &Self) {
        self.words.iter_mut().zip(&other.words).for_each(|(a, b)| *a &= !b);
    }

    /// Keeps the pixels that are in another mask of the same size too.
    pub(crate) fn intersect(&mut self, other: &Self) {
        self.words.iter_mut().zip(&other.words).for_each(|(a, b)| *a &= b);
    }

    /// Pixels in both masks.
    pub(crate) fn overlap(&self, other: &Self) -> usize {
        self.words.iter().zip(&other.words).map(|(a, b)| (a & b).count_ones() as usize).sum()
    }

    /// Intersection over union; 1 for two empty masks.
    pub fn iou(&self, other: &Self) -> f64 {
        let both = self.overlap(other);
        let either = self.area() + other.area() - both;
        if either == 0 { 1.0 } else { both as f64 / either as f64 }
    }

    /// The smallest box around it; `None` if it is empty.
    pub(crate) fn bounds(&self) -> Option<PixelBox> {
        let mut found: Option<PixelBox> = None;
        for i in self.pixels() {
            let (x, y) = (i % self.width_px, i / self.width_px);
            let b = found.get_or_insert(PixelBox { x: x..x + 1, y: y..y + 1 });
            b.x = b.x.start.min(x)..b.x.end.max(x + 1);
            b.y = b.y.start..b.y.end.max(y + 1);
        }
        found
    }

    /// The same region in a picture of another size: each pixel takes the value at its center.
    pub(crate) fn resized(&self, width_px: usize, height_px: usize) -> Self {
        if (width_px, height_px) == (self.width_px, self.height_px) {
            return self.clone();
        }
        let mut resized = Self::empty(width_px, height_px);
        let columns: Vec<usize> = (0..width_px).map(|x| nearest(x, self.width_px, width_px)).collect();
        for y in 0..height_px {
            let first = nearest(y, self.height_px, height_px) * self.width_px;
            // Most masks are small, and most rows empty.
            let words = first / 64..(first + self.width_px).div_ceil(64);
            if self.words[words].iter().any(|word| *word != 0) {
                let inside = columns.iter().enumerate().filter(|(_, column)| self.contains(first + *column));
                inside.for_each(|(x, _)| resized.insert(y * width_px + x));
            }
        }
        resized
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_do_what_sets_do() {
        let a = Mask::from_fn(13, 7, |i| i % 3 == 0);
        let b = Mask::from_fn(13, 7, |i| i % 2 == 0);
        assert_eq!(a.pixels().collect::<Vec<_>>(), (0..91).filter(|i| i % 3 == 0).collect::<Vec<_>>());
        assert_eq!((a.area(), a.overlap(&b)), (31, 16));
        let union = 31 + 46 - 16;
        assert!((a.iou(&b) - 16.0 / union as f64).abs() < 1e-12);
        let mut c = a.clone();
        c.add(&b);
        assert_eq!(c.area(), union as usize);
        c.subtract(&b);
        assert_eq!(c.area(), 31 - 16);
        let empty = Mask::empty(13, 7);
        assert!(empty.is_empty() && empty.bounds().is_none() && empty.pixels().next().is_none());
        assert_eq!((empty.iou(&empty), empty.iou(&a)), (1.0, 0.0));
    }

    #[test]
    fn polygons_cover_their_inside() {
        let of = |vertices: &[[f64; 2]]| {
            let mut mask = Mask::empty(10, 8);
            mask.add_polygon(vertices);
            mask
        };
        let square = [[2.0, 1.0], [6.0, 1.0], [6.0, 4.0], [2.0, 4.0]];
        let mask = of(&square);
        assert_eq!(mask.bounds(), Some(PixelBox { x: 2..7, y: 1..4 }));
        assert_eq!(mask.area(), 15);
        // A hole by the even-odd rule, and vertices outside the picture.
        let bow = [[-5.0, -5.0], [50.0, -5.0], [50.0, 50.0], [-5.0, 50.0]];
        assert_eq!(of(&bow).area(), 80);
        assert!(of(&[]).is_empty());
        assert!(of(&[[3.0, 3.0]]).is_empty());
    }

    #[test]
    fn resizing_keeps_the_region() {
        let mask = Mask::from_fn(40, 20, |i| i % 40 >= 20);
        let small = mask.resized(10, 5);
        assert_eq!(small, Mask::from_fn(10, 5, |i| i % 10 >= 5));
        assert_eq!(small.resized(40, 20), mask);
    }

    #[test]
    fn boxes_polygons_and_sizes_of_odd_numbers() {
        // 70 x 3: rows begin within words.
        let mask = Mask::from_fn(70, 3, |i| i == 69 || i == 71 || i == 3 * 70 - 1);
        assert_eq!(mask.pixels().collect::<Vec<_>>(), [69, 71, 209]);
        assert_eq!(mask.bounds(), Some(PixelBox { x: 1..70, y: 0..3 }));
        assert_eq!((mask.width_px(), mask.height_px(), mask.area()), (70, 3, 3));
        assert!(PixelBox { x: 1..3, y: 4..5 }.contains(2, 4) && !PixelBox { x: 1..3, y: 4..5 }.contains(3, 4));
        // A triangle, by hand: rows 0 to 4, from column 0 to the row's number.
        let mut triangle = Mask::empty(9, 9);
        triangle.add_polygon(&[[0.0, 0.0], [4.0, 4.0], [0.0, 4.0]]);
        let rows = |m: &Mask| (0..9).map(|y| (0..9).filter(|x| m.contains(y * 9 + x)).count()).collect::<Vec<_>>();
        assert!(
            rows(&triangle)[..4].iter().zip([1, 2, 3, 4]).all(|(a, b)| a.abs_diff(b) <= 1),
            "{:?}",
            rows(&triangle)
        );
        assert_eq!(rows(&triangle)[5..], [0; 4]);
        // 3 pixels of 2: the centers are at 1/3, 1 and 5/3, that is pixels 0, 1 and 1.
        let two = Mask::from_fn(2, 2, |i| i == 0);
        assert_eq!(two.resized(3, 3), Mask::from_fn(3, 3, |i| i == 0));
        assert_eq!(two.resized(4, 2), Mask::from_fn(4, 2, |i| i < 2));
        assert_eq!(Mask::from_fn(5, 1, |i| i == 2).resized(1, 1).area(), 1);
    }
}
