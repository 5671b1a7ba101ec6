//! Small pictures of a comparison: colors of a view, and relevancy with the outline of a mask.

use crate::math::colormap::Colormap;
use crate::math::resize::{Filter, resize};
use crate::scene::Mask;

/// Longer side of a small picture, px.
const SIDE_PX: usize = 320;
/// Colors of outlines: a mask's, its outside, and the label's.
const INSIDE: [u8; 3] = [255; 3];
const OUTSIDE: [u8; 3] = [0; 3];
const LABEL: [u8; 3] = [60, 230, 90];

/// Size of the small picture of a view.
pub(super) fn tile_size((w, h): (usize, usize)) -> (usize, usize) {
    let longer = w.max(h).max(1);
    let side = |s: usize| ((s * SIDE_PX + longer / 2) / longer).max(1);
    (side(w), side(h))
}

/// Relevancy and mask of a cell in the size of its small picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CellTile {
    size: (usize, usize),
    values: Vec<f32>,
    mask: Mask,
}

impl CellTile {
    pub(super) fn new(values: &[f32], mask: &Mask) -> Self {
        let from = (mask.width_px(), mask.height_px());
        let size = tile_size(from);
        Self { size, values: resize(values, from, size, Filter::Area), mask: mask.resized(size.0, size.1) }
    }

    /// Least and largest value; what nothing shows, 0, does not count.
    pub(super) fn range(&self) -> Option<[f32; 2]> {
        let shown = || self.values.iter().copied().filter(|v| *v > 0.0);
        shown().next()?;
        Some([shown().fold(f32::INFINITY, f32::min), shown().fold(0.0, f32::max)])
    }

    /// Colors, with a range from the first color to the last.
    pub(super) fn colors(&self, [least, most]: [f32; 2]) -> TilePicture {
        let scaled = |v: &f32| (v - least) / (most - least).max(1e-6);
        let rgb = self.values.iter().map(|v| Colormap::Turbo.color(scaled(v))).collect();
        let mut picture = TilePicture { size: self.size, rgb };
        picture.outline(&self.mask, INSIDE, Some(OUTSIDE));
        picture
    }
}

/// A small picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TilePicture {
    pub(super) size: (usize, usize),
    pub(super) rgb: Vec<[u8; 3]>,
}

impl TilePicture {
    /// The view's colors, made small.
    pub(super) fn of_view(rgb: &[[u8; 3]], from: (usize, usize)) -> Self {
        let size = tile_size(from);
        let channel =
            |c: usize| resize(&rgb.iter().map(|p| f32::from(p[c])).collect::<Vec<_>>(), from, size, Filter::Area);
        let [r, g, b] = [0, 1, 2].map(channel);
        let pixel = |i: usize| [r[i], g[i], b[i]].map(|v| (v + 0.5) as u8);
        Self { size, rgb: (0..size.0 * size.1).map(pixel).collect() }
    }

    /// Outlines a label.
    pub(super) fn label(&mut self, mask: &Mask) {
        self.outline(&mask.resized(self.size.0, self.size.1), LABEL, Some(OUTSIDE));
    }

    /// Colors the outermost pixels of a mask, and those around it.
    fn outline(&mut self, mask: &Mask, inside: [u8; 3], outside: Option<[u8; 3]>) {
        let (w, h) = self.size;
        let near = |i: usize| {
            let (x, y) = (i % w, i / w);
            let beside = [(x > 0).then(|| i - 1), (x + 1 < w).then(|| i + 1)];
            let above = [(y > 0).then(|| i - w), (y + 1 < h).then(|| i + w)];
            beside.into_iter().chain(above).flatten().any(|k| mask.contains(k) != mask.contains(i))
        };
        for i in (0..w * h).filter(|i| near(*i)) {
            match outside {
                _ if mask.contains(i) => self.rgb[i] = inside,
                Some(color) => self.rgb[i] = color,
                None => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_pictures_keep_shape_range_and_outline() {
        assert_eq!((tile_size((640, 480)), tile_size((24, 18))), ((320, 240), (320, 240)));
        let (w, h) = (16, 8);
        let values: Vec<f32> = (0..w * h).map(|i| if i % w < 8 { 0.0 } else { 0.5 + 0.01 * (i / w) as f32 }).collect();
        let mask = Mask::from_fn(w, h, |i| i % w >= 8);
        let tile = CellTile::new(&values, &mask);
        let [least, most] = tile.range().expect("shown");
        assert!((least - 0.5).abs() < 0.02 && (most - 0.57).abs() < 0.02, "{least} {most}");
        let picture = tile.colors([0.0, 1.0]);
        let at = |x: usize| picture.rgb[80 * 320 + x];
        assert_eq!((at(160), at(159)), (INSIDE, OUTSIDE));
        assert_eq!(at(20), Colormap::Turbo.color(0.0));
        assert_ne!(at(300), at(20));
        assert_eq!(CellTile::new(&vec![0.0; w * h], &Mask::empty(w, h)).range(), None);
        let mut colors = TilePicture::of_view(&vec![[10, 20, 30]; w * h], (w, h));
        assert!(colors.rgb.iter().all(|p| *p == [10, 20, 30]));
        colors.label(&mask);
        assert!(colors.rgb.contains(&LABEL));
    }
}
