//! Outlines of masks: a line inside the mask's border with a dark halo around it, visible on any color, and a light
//! fill that keeps the colors below readable.

use egui::{Color32, ColorImage};
use rayon::prelude::*;

use crate::math::grid::{neighbors, regions};
use crate::scene::{Mask, PixelBox};

/// Opacity of a mask's fill.
const FILL: f32 = 0.16;
/// Halo of outlines, for contrast to any color.
const HALO: Color32 = Color32::from_black_alpha(170);

/// Opacity of a contour.
const CONTOUR: f32 = 0.75;
/// Pieces smaller than the largest by this factor are specks.
const SPECK: usize = 50;

/// Class of a pixel in the outline of a mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outline {
    /// Beside the mask.
    Halo,
    /// At its border, two pixels wide.
    Line,
    Fill,
    Outside,
}

impl Outline {
    /// Class of pixel `i`. The image's border is no border of the mask.
    pub(super) fn at(mask: &Mask, i: usize) -> Self {
        let (w, n) = (mask.width_px(), mask.width_px() * mask.height_px());
        let near = |i: usize| neighbors(i, w, n);
        if !mask.contains(i) {
            return if near(i).any(|j| mask.contains(j)) { Self::Halo } else { Self::Outside };
        }
        let line = near(i).any(|j| !mask.contains(j) || near(j).any(|k| !mask.contains(k)));
        if line { Self::Line } else { Self::Fill }
    }

    /// Color in an outline of the given color; `None` outside.
    pub(super) fn color(self, [r, g, b]: [u8; 3]) -> Option<Color32> {
        match self {
            Self::Halo => Some(HALO),
            Self::Line => Some(Color32::from_rgb(r, g, b)),
            Self::Fill => Some(with_alpha([r, g, b], FILL)),
            Self::Outside => None,
        }
    }
}

/// The outline of a mask, cropped to it, and its place in the mask's image; `None` if the mask is empty.
pub(super) fn image(mask: &Mask, color: [u8; 3]) -> Option<(ColorImage, PixelBox)> {
    let (mask, at) = cut(mask)?;
    let pixel = |i: usize| Outline::at(&mask, i).color(color).unwrap_or_default();
    Some((picture(&mask, pixel), at))
}

/// The outline without fill, one pixel wide, around the larger pieces of the mask only and not around occluders.
pub(super) fn contour(mask: &Mask, color: [u8; 3]) -> Option<(ColorImage, PixelBox)> {
    let (mask, at) = cut(mask)?;
    let mask = tidied(&mask);
    let (w, n) = (mask.width_px(), mask.width_px() * mask.height_px());
    let differs = |i: usize| neighbors(i, w, n).any(|j| mask.contains(j) != mask.contains(i));
    let pixel = |i: usize| match (differs(i), mask.contains(i)) {
        (false, _) => Color32::TRANSPARENT,
        (true, true) => with_alpha(color, CONTOUR),
        (true, false) => HALO.gamma_multiply(CONTOUR),
    };
    Some((picture(&mask, pixel), at))
}

fn picture(mask: &Mask, pixel: impl Fn(usize) -> Color32 + Sync + Send) -> ColorImage {
    let size = [mask.width_px(), mask.height_px()];
    ColorImage::new(size, (0..size[0] * size[1]).into_par_iter().map(pixel).collect())
}

/// The mask cropped to its pixels with a margin of one pixel, and the place of the crop.
fn cut(mask: &Mask) -> Option<(Mask, PixelBox)> {
    let inner = mask.bounds()?;
    let (w, h) = (mask.width_px(), mask.height_px());
    let around = |from: usize, to: usize, most: usize| from.saturating_sub(1)..(to + 1).min(most);
    let (x, y) = (around(inner.x.start, inner.x.end, w), around(inner.y.start, inner.y.end, h));
    let width = x.len();
    let inside = |k: usize| mask.contains((y.start + k / width) * w + x.start + k % width);
    Some((Mask::from_fn(width, y.len(), inside), PixelBox { x, y }))
}

/// The mask without specks and holes.
fn tidied(mask: &Mask) -> Mask {
    let (w, h) = (mask.width_px(), mask.height_px());
    let (pieces, sizes) = regions(w, w * h, |i| mask.contains(i));
    let largest = sizes.iter().copied().max().unwrap_or(0);
    let (gaps, areas) = regions(w, w * h, |i| !mask.contains(i));
    let mut is_hole = vec![true; areas.len()];
    let border = (0..w).flat_map(|x| [x, (h - 1) * w + x]).chain((0..h).flat_map(|y| [y * w, y * w + w - 1]));
    border.filter(|i| !mask.contains(*i)).for_each(|i| is_hole[gaps[i] as usize - 1] = false);
    Mask::from_fn(w, h, |i| match mask.contains(i) {
        true => sizes[pieces[i] as usize - 1] * SPECK >= largest,
        false => is_hole[gaps[i] as usize - 1],
    })
}

/// A color of this opacity.
pub(super) fn with_alpha([r, g, b]: [u8; 3], alpha: f32) -> Color32 {
    Color32::from_rgba_unmultiplied(r, g, b, (alpha * 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_lies_inside_the_border_and_a_halo_around_it() {
        // Columns 3 to 8 of an image of 12 x 7, rows 0 to 6: cut by the image above and below.
        let mask = Mask::from_fn(12, 7, |i| (3..9).contains(&(i % 12)));
        let row: Vec<Outline> = (0..12).map(|x| Outline::at(&mask, 3 * 12 + x)).collect();
        use Outline::{Fill, Halo, Line, Outside};
        assert_eq!(
            row,
            [Outside, Outside, Halo, Line, Line, Fill, Fill, Line, Line, Halo, Outside, Outside],
            "two pixels of line"
        );
        assert_eq!(Outline::at(&mask, 5), Fill, "the picture's border is no border of the mask");
    }

    #[test]
    fn a_contour_leaves_out_specks_and_holes() {
        // A square of 20 x 20 with a hole in it, and a speck beside it.
        let is_square = |x: usize, y: usize| (5..25).contains(&x) && (5..25).contains(&y);
        let is_hole = |x: usize, y: usize| (10..13).contains(&x) && (10..13).contains(&y);
        let square = Mask::from_fn(40, 30, |i| is_square(i % 40, i / 40));
        let rough = Mask::from_fn(40, 30, |i| {
            let (x, y) = (i % 40, i / 40);
            is_square(x, y) && !is_hole(x, y) || (x, y) == (35, 15)
        });
        assert_eq!(tidied(&rough), square);
        let (image, at) = contour(&rough, [255; 3]).expect("a contour");
        let lines = image.pixels.iter().filter(|p| **p == with_alpha([255; 3], CONTOUR)).count();
        assert_eq!((at.x, lines), (4..37, 76), "one pixel wide");
        let halves = Mask::from_fn(40, 30, |i| is_square(i % 40, i / 40) && i % 40 != 15);
        assert_eq!(tidied(&halves), halves, "the control: two pieces of a size, and a gap that is no hole");
    }

    #[test]
    fn the_image_is_cut_to_the_mask_and_its_halo() {
        assert!(image(&Mask::empty(5, 5), [9; 3]).is_none());
        let mask = Mask::from_fn(20, 10, |i| i == 4 * 20 + 19);
        let (image, at) = image(&mask, [200, 100, 50]).expect("a pixel");
        assert_eq!((at.x.clone(), at.y.clone(), image.size), (18..20, 3..6, [2, 3]));
        assert_eq!(image.pixels[3], Color32::from_rgb(200, 100, 50));
        assert_eq!((image.pixels[2], image.pixels[0]), (HALO, Color32::TRANSPARENT));
    }
}
