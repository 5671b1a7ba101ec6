//! Half-size photos for the first steps: coarse structure is trained at a quarter of the cost.

use super::{TrainConfig, TrainView};
use crate::io::photo;

/// Least side of a half-size photo, px.
const LEAST_PX: u32 = 16;

/// Number of steps with half-size photos.
pub(super) fn steps(config: &TrainConfig) -> u64 {
    (config.coarse_share * config.steps as f64).round() as u64
}

pub(crate) fn halved(views: &[TrainView]) -> Vec<TrainView> {
    views.iter().map(half).collect()
}

fn half(view: &TrainView) -> TrainView {
    if view.camera.width_px.min(view.camera.height_px) / 2 < LEAST_PX {
        return view.clone();
    }
    let (pixels, camera) = photo::half(&view.pixels, &view.camera);
    TrainView { name: view.name.clone(), camera, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, PhotoPixels};
    use glam::{DVec2, DVec3};

    fn view(w: u32, h: u32, coverage: Option<Vec<u8>>) -> TrainView {
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, w, h).expect("valid");
        let rgb = (0..w * h).map(|i| [(i % w) as u8, (i / w) as u8, 100]).collect();
        TrainView {
            name: "a".into(),
            camera,
            pixels: PhotoPixels { width_px: w, height_px: h, rgb, coverage, alpha: None },
        }
    }

    #[test]
    fn a_half_shows_the_same_with_half_the_pixels() {
        let full = view(80, 65, None);
        let half = &halved(std::slice::from_ref(&full))[0];
        assert_eq!((half.pixels.width_px, half.pixels.height_px, half.pixels.rgb.len()), (40, 32, 40 * 32));
        assert_eq!(half.pixels.rgb[41], [3, 3, 100], "means of 2 and 3, rounded up");
        let point = DVec3::new(0.1, -0.1, 0.2);
        let (a, b) = (full.camera.project(point).expect("seen"), half.camera.project(point).expect("seen"));
        assert!((a * DVec2::new(0.5, 32.0 / 65.0) - b).length() < 1e-9);
    }

    #[test]
    fn uncovered_pixels_do_not_count_and_small_photos_stay() {
        let mut coverage = vec![255; 64 * 64];
        (coverage[1], coverage[64], coverage[65]) = (0, 0, 0);
        let half = &halved(&[view(64, 64, Some(coverage))])[0];
        assert_eq!(half.pixels.rgb[0], [0, 0, 100], "only the covered one");
        assert_eq!(half.pixels.coverage.as_ref().expect("kept")[0], 64);
        let small = view(30, 30, None);
        assert_eq!(halved(std::slice::from_ref(&small))[0].camera, small.camera);
    }
}
