//! Crops of identities: the same arithmetic as `tools/encoder/tiles.py`, held equal by a test.

use crate::math::resize::{Filter, resize};
use crate::scene::Mask;

/// Picture of one identity: its mask on black, padded to a square, side x side, sRGB 0..1, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentityCrop {
    /// Side in px.
    pub side_px: usize,
    /// Colors.
    pub rgb: Vec<[f32; 3]>,
}

impl IdentityCrop {
    /// Cuts the masked region of a picture on black: its bounding box, padded to a square, resized. `None` for an empty
    /// mask, and for a picture that does not have the mask's size.
    pub(crate) fn cut(rgb: &[[f32; 3]], mask: &Mask, side_px: usize) -> Option<Self> {
        let bounds = mask.bounds()?;
        let width_px = mask.width_px();
        if rgb.len() != width_px * mask.height_px() || side_px == 0 {
            return None;
        }
        let (w, h) = (bounds.x.len(), bounds.y.len());
        let square = w.max(h);
        let (left, top) = ((square - w) / 2, (square - h) / 2);
        let mut padded = vec![[0.0_f32; 3]; square * square];
        for y in 0..h {
            let from = (bounds.y.start + y) * width_px + bounds.x.start;
            let to = (top + y) * square + left;
            (0..w).filter(|x| mask.contains(from + x)).for_each(|x| padded[to + x] = rgb[from + x]);
        }
        Some(Self { side_px, rgb: resize(&padded, (square, square), (side_px, side_px), Filter::Bilinear) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_masked_box_is_centered_on_black() {
        let rgb: Vec<[f32; 3]> = (0..200).map(|i| [i as f32 / 200.0, 0.5, 1.0]).collect();
        let inside = |i: usize| (3..11).contains(&(i % 20)) && (2..6).contains(&(i / 20)) && i != 2 * 20 + 3;
        let tile = IdentityCrop::cut(&rgb, &Mask::from_fn(20, 10, inside), 8).expect("not empty");
        // 8 x 4 px from row 2 on, centered in 8 x 8: row 2 again.
        for i in 0..64_usize {
            let (x, y) = (i % 8, i / 8);
            let seen = (2..6).contains(&y) && (x, y) != (0, 2);
            let expected = if seen { rgb[y * 20 + 3 + x] } else { [0.0; 3] };
            assert_eq!(tile.rgb[i], expected, "{x}, {y}");
        }
    }

    #[test]
    fn flat_color_keeps_its_value_at_any_size() {
        let rgb = vec![[0.25, 0.5, 0.75]; 37 * 37];
        for side_px in [1, 5, 37, 64] {
            let tile = IdentityCrop::cut(&rgb, &Mask::from_fn(37, 37, |_| true), side_px).expect("not empty");
            assert_eq!(tile.rgb.len(), side_px * side_px);
            let off = |p: &[f32; 3]| (p[0] - 0.25).abs().max((p[2] - 0.75).abs());
            assert!(tile.rgb.iter().all(|p| off(p) < 1e-6), "{side_px}");
        }
    }

    #[test]
    fn nothing_gives_nothing() {
        assert_eq!(IdentityCrop::cut(&[[0.0; 3]; 12], &Mask::empty(4, 3), 8), None);
        assert_eq!(IdentityCrop::cut(&[[0.0; 3]; 11], &Mask::from_fn(4, 3, |_| true), 8), None);
        assert_eq!(IdentityCrop::cut(&[[0.0; 3]; 12], &Mask::from_fn(4, 3, |_| true), 0), None);
        let one = IdentityCrop::cut(&[[0.5; 3]; 12], &Mask::from_fn(4, 3, |i| i == 11), 4).expect("one pixel");
        assert!(one.rgb.iter().all(|p| *p == [0.5; 3]));
    }
}
