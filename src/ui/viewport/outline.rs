//! Outlines of masks: a line inside the mask's border with a dark halo around it, so that it stands out on any
//! color, and a light fill that leaves the colors below readable.

use egui::{Color32, ColorImage};
use rayon::prelude::*;

use crate::math::grid::neighbors;
use crate::scene::{Mask, PixelBox};

/// Opacity of a mask's fill.
const FILL: f32 = 0.16;
/// Around outlines: whatever color is beside them, they stand out.
const HALO: Color32 = Color32::from_black_alpha(170);

/// What a pixel is of an outlined mask.
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
    /// What pixel `i` is. The border of the picture is none of the mask.
    pub(super) fn at(mask: &Mask, i: usize) -> Self {
        let (w, n) = (mask.width_px(), mask.width_px() * mask.height_px());
        let near = |i: usize| neighbors(i, w, n);
        if !mask.contains(i) {
            return if near(i).any(|j| mask.contains(j)) { Self::Halo } else { Self::Outside };
        }
        let line = near(i).any(|j| !mask.contains(j) || near(j).any(|k| !mask.contains(k)));
        if line { Self::Line } else { Self::Fill }
    }

    /// Its color in an outline of this one; `None` outside.
    pub(super) fn color(self, [r, g, b]: [u8; 3]) -> Option<Color32> {
        match self {
            Self::Halo => Some(HALO),
            Self::Line => Some(Color32::from_rgb(r, g, b)),
            Self::Fill => Some(with_alpha([r, g, b], FILL)),
            Self::Outside => None,
        }
    }
}

/// The outline of a mask in a picture that is no larger than it needs to be, and where in the mask's own that is;
/// `None` if the mask is empty.
pub(super) fn image(mask: &Mask, color: [u8; 3]) -> Option<(ColorImage, PixelBox)> {
    let inner = mask.bounds()?;
    let (w, h) = (mask.width_px(), mask.height_px());
    let around = |from: usize, to: usize, most: usize| from.saturating_sub(1)..(to + 1).min(most);
    let (x, y) = (around(inner.x.start, inner.x.end, w), around(inner.y.start, inner.y.end, h));
    let width = x.len();
    let pixel = |k: usize| Outline::at(mask, (y.start + k / width) * w + x.start + k % width).color(color);
    let pixels = (0..width * y.len()).into_par_iter().map(|k| pixel(k).unwrap_or(Color32::TRANSPARENT)).collect();
    Some((ColorImage::new([width, y.len()], pixels), PixelBox { x, y }))
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
        // Columns 3 to 8 of a picture of 12 x 7, rows 0 to 6: cut by the picture above and below.
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
    fn the_image_is_cut_to_the_mask_and_its_halo() {
        assert!(image(&Mask::empty(5, 5), [9; 3]).is_none());
        let mask = Mask::from_fn(20, 10, |i| i == 4 * 20 + 19);
        let (image, at) = image(&mask, [200, 100, 50]).expect("a pixel");
        assert_eq!((at.x.clone(), at.y.clone(), image.size), (18..20, 3..6, [2, 3]));
        assert_eq!(image.pixels[3], Color32::from_rgb(200, 100, 50));
        assert_eq!((image.pixels[2], image.pixels[0]), (HALO, Color32::TRANSPARENT));
    }
}
