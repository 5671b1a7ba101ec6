//! How close a picture is to a photo.

use crate::math::Real;
use crate::render::Frame;
use crate::render::cpu::ssim::ssim;
use crate::scene::PhotoPixels;

/// The colour planes of a photo, 0 to 1.
pub fn planes<R: Real>(photo: &PhotoPixels) -> [Vec<R>; 3] {
    std::array::from_fn(|c| photo.rgb.iter().map(|p| R::of(f64::from(p[c]) / 255.0)).collect())
}

/// PSNR in dB (peak 1) of a mean squared error; infinite for 0.
pub fn psnr_of(mse: f64) -> f64 {
    -10.0 * mse.log10()
}

/// PSNR and SSIM of a rendered frame, clamped to 0..1, against a photo of the same size. Pixels
/// that the photo does not cover count as equal in SSIM and do not count in PSNR. Computed in f64.
pub fn score(frame: &Frame<f32>, photo: &PhotoPixels) -> (f64, f64) {
    let target = planes::<f64>(photo);
    let mut rendered: [Vec<f64>; 3] =
        std::array::from_fn(|c| frame.color[c].iter().map(|v| f64::from(v.clamp(0.0, 1.0))).collect());
    let mut covered = target[0].len();
    if let Some(coverage) = &photo.coverage {
        covered = coverage.iter().filter(|&&c| c > 0).count();
        for (plane, want) in rendered.iter_mut().zip(&target) {
            for ((r, t), c) in plane.iter_mut().zip(want).zip(coverage) {
                if *c == 0 {
                    *r = *t;
                }
            }
        }
    }
    let squared: f64 = rendered.iter().flatten().zip(target.iter().flatten()).map(|(a, b)| (a - b) * (a - b)).sum();
    let mse = squared / (3 * covered.max(1)) as f64;
    (psnr_of(mse), ssim(&rendered, &target, frame.width_px))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn photo(level: u8, coverage: Option<Vec<u8>>) -> PhotoPixels {
        PhotoPixels { width_px: 4, height_px: 4, rgb: vec![[level; 3]; 16], coverage }
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
