//! Image metrics of renders against photos.
//!
//! PSNR is measured here only.

use crate::math::Real;
use crate::math::resize::nearest;
use crate::math::stats::psnr_of;
use crate::render::{Frame, ssim};
use crate::scene::PhotoPixels;

/// Color planes of a photo, 0 to 1.
pub(crate) fn planes<R: Real>(photo: &PhotoPixels) -> [Vec<R>; 3] {
    std::array::from_fn(|c| photo.rgb.iter().map(|p| R::of(f64::from(p[c]) / 255.0)).collect())
}

/// Color planes of a photo. A photo with alpha is put in front of its stored background color plus `shift`.
pub(crate) fn planes_before<R: Real>(photo: &PhotoPixels, shift: [f32; 3]) -> [Vec<R>; 3] {
    let mut planes = planes::<R>(photo);
    if let Some(alpha) = photo.alpha.as_ref().filter(|_| shift != [0.0; 3]) {
        for (plane, by) in planes.iter_mut().zip(shift) {
            for (value, a) in plane.iter_mut().zip(alpha) {
                *value += R::of(f64::from(by) * (1.0 - f64::from(*a) / 255.0));
            }
        }
    }
    planes
}

/// PSNR in dB of a picture of (width, height) px, clamped to 0..1, against a photo; infinite for an exact match.
/// Pixels that the photo does not cover do not count. For a photo of another size, the nearest pixels are compared.
pub(crate) fn psnr<R: Real>(color: &[Vec<R>; 3], (width, height): (usize, usize), photo: &PhotoPixels) -> f64 {
    let (w, h) = (photo.width_px as usize, photo.height_px as usize);
    let (mut squared, mut covered) = (0.0, 0_usize);
    for y in 0..height {
        let row = nearest(y, h, height) * w;
        for x in 0..width {
            let at = row + nearest(x, w, width);
            if photo.coverage.as_ref().is_some_and(|c| c[at] == 0) {
                continue;
            }
            covered += 1;
            let off = |c: usize| color[c][y * width + x].f64().clamp(0.0, 1.0) - f64::from(photo.rgb[at][c]) / 255.0;
            squared += (0..3).map(|c| off(c) * off(c)).sum::<f64>();
        }
    }
    psnr_of(squared / (3 * covered.max(1)) as f64)
}

/// PSNR and SSIM of a rendered frame, clamped to 0..1, against a photo of the same size. Pixels that the photo does
/// not cover count as equal in SSIM and do not count in PSNR. Computed in f64.
pub(crate) fn score(frame: &Frame<f32>, photo: &PhotoPixels) -> (f64, f64) {
    let target = planes::<f64>(photo);
    let mut rendered: [Vec<f64>; 3] =
        std::array::from_fn(|c| frame.color[c].iter().map(|v| f64::from(v.clamp(0.0, 1.0))).collect());
    if let Some(coverage) = &photo.coverage {
        for (plane, want) in rendered.iter_mut().zip(&target) {
            for ((r, t), c) in plane.iter_mut().zip(want).zip(coverage) {
                if *c == 0 {
                    *r = *t;
                }
            }
        }
    }
    let size = (frame.width_px, frame.height_px);
    (psnr(&frame.color, size, photo), ssim(&rendered, &target, frame.width_px))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn photo(level: u8, coverage: Option<Vec<u8>>) -> PhotoPixels {
        PhotoPixels { width_px: 4, height_px: 4, rgb: vec![[level; 3]; 16], coverage, alpha: None }
    }

    fn frame(level: f32) -> Frame<f32> {
        Frame { width_px: 4, height_px: 4, color: std::array::from_fn(|_| vec![level; 16]), ..Frame::default() }
    }

    #[test]
    fn a_tenth_off_everywhere_is_twenty_decibels() {
        let (db, _) = score(&frame(0.1), &photo(0, None));
        assert!((db - 20.0).abs() < 1e-6);
        let (db, similarity) = score(&frame(0.0), &photo(0, None));
        assert!(db.is_infinite() && (similarity - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_photo_of_another_size_is_looked_at_where_the_pixels_centers_lie() {
        let mut big = PhotoPixels { width_px: 8, height_px: 8, rgb: vec![[255; 3]; 64], coverage: None, alpha: None };
        (0..16).for_each(|i| big.rgb[(2 * (i / 4) + 1) * 8 + 2 * (i % 4) + 1] = [0; 3]);
        assert!((psnr(&frame(0.1).color, (4, 4), &big) - 20.0).abs() < 1e-6);
        assert!(psnr(&frame(0.1).color, (4, 4), &photo(255, None)) < 1.0);
    }

    #[test]
    fn uncovered_pixels_do_not_count() {
        let mut p = photo(0, Some([vec![255; 8], vec![0; 8]].concat()));
        let (db, _) = score(&frame(0.1), &p);
        assert!((db - 20.0).abs() < 1e-6);
        p.rgb[15] = [200; 3];
        assert_eq!(score(&frame(0.1), &p).0, db);
        p.rgb[0] = [200; 3];
        assert!(score(&frame(0.1), &p).0 < db);
    }
}
