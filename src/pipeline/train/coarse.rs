//! Photos at half their size, for the first steps: what is large is found at a quarter of the cost.

use super::TrainView;
use crate::scene::PhotoPixels;

/// Sides below this are not halved.
const LEAST_PX: u32 = 32;

/// The views at half their size, each 2 x 2 pixels as their mean; pixels that a photo does not cover do
/// not count.
pub fn halved(views: &[TrainView]) -> Vec<TrainView> {
    views.iter().map(half).collect()
}

fn half(view: &TrainView) -> TrainView {
    let p = &view.pixels;
    let (w, h) = (p.width_px / 2, p.height_px / 2);
    if w.min(h) < LEAST_PX {
        return view.clone();
    }
    let mut rgb = Vec::with_capacity((w * h) as usize);
    let mut coverage = Vec::with_capacity((w * h) as usize);
    for i in 0..w * h {
        let corner = (i / w * 2 * p.width_px + i % w * 2) as usize;
        let four = [corner, corner + 1, corner + p.width_px as usize, corner + p.width_px as usize + 1];
        let weight = |k: usize| p.coverage.as_ref().map_or(255, |c| u32::from(c[k]));
        let sum: u32 = four.iter().map(|&k| weight(k)).sum();
        let mean = |c: usize| {
            let of: u32 = four.iter().map(|&k| weight(k) * u32::from(p.rgb[k][c])).sum();
            ((of + sum / 2) / sum.max(1)) as u8
        };
        rgb.push(std::array::from_fn(mean));
        coverage.push(((sum + 2) / 4) as u8);
    }
    let coverage = p.coverage.is_some().then_some(coverage);
    let pixels = PhotoPixels { width_px: w, height_px: h, rgb, coverage };
    TrainView { name: view.name.clone(), camera: view.camera.reduced(2), pixels }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;
    use glam::DVec3;

    fn view(w: u32, h: u32, coverage: Option<Vec<u8>>) -> TrainView {
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, w, h).expect("valid");
        let rgb = (0..w * h).map(|i| [(i % w) as u8, (i / w) as u8, 100]).collect();
        TrainView { name: "a".into(), camera, pixels: PhotoPixels { width_px: w, height_px: h, rgb, coverage } }
    }

    #[test]
    fn a_half_shows_the_same_with_half_the_pixels() {
        let full = view(80, 65, None);
        let half = &halved(std::slice::from_ref(&full))[0];
        assert_eq!((half.pixels.width_px, half.pixels.height_px, half.pixels.rgb.len()), (40, 32, 40 * 32));
        assert_eq!(half.pixels.rgb[41], [3, 3, 100], "means of 2 and 3, rounded up");
        let point = DVec3::new(0.1, -0.1, 0.2);
        let (a, b) = (full.camera.project(point).expect("seen"), half.camera.project(point).expect("seen"));
        assert!((a * 0.5 - b).length() < 1e-9);
    }

    #[test]
    fn uncovered_pixels_do_not_count_and_small_photos_stay() {
        let mut coverage = vec![255; 64 * 64];
        (coverage[1], coverage[64], coverage[65]) = (0, 0, 0);
        let half = &halved(&[view(64, 64, Some(coverage))])[0];
        assert_eq!(half.pixels.rgb[0], [0, 0, 100], "only the covered one");
        assert_eq!(half.pixels.coverage.as_ref().expect("kept")[0], 64);
        let small = view(40, 40, None);
        assert_eq!(halved(std::slice::from_ref(&small))[0].camera, small.camera);
    }
}
