//! Changed copies of photos, as other cameras and other days would have taken them.

use glam::DVec2;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::math::resize::{Filter, resize};
use crate::math::srgb::brighter;
use crate::scene::{Camera, PhotoPixels};

/// Factor of 1.5 stops.
const STOPS: f32 = 2.828_427;
/// Gains of light under a warmer lamp.
const WARM: [f32; 3] = [1.3, 1.0, 0.65];
/// Side of the blur's window, in longer sides of the photo: 4 px of 640.
const BLUR: f64 = 1.0 / 160.0;
/// Share of the photo behind something foreign.
const COVERED: f64 = 0.2;
/// Size of what is foreign's spots, in longer sides of the photo.
const SPOT: f64 = 1.0 / 40.0;
/// Share of the photo's sides that a crop leaves: the focal length is 1.4 times as long.
const CROP: f64 = 0.7;

/// A change of a photo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PhotoChange {
    Brighter,
    Darker,
    Warmer,
    Blurred,
    Covered,
    Cropped,
}

impl PhotoChange {
    pub(super) const ALL: [Self; 6] =
        [Self::Brighter, Self::Darker, Self::Warmer, Self::Blurred, Self::Covered, Self::Cropped];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Brighter => "1.5 stops brighter",
            Self::Darker => "1.5 stops darker",
            Self::Warmer => "warmer light",
            Self::Blurred => "blurred",
            Self::Covered => "20 % hidden",
            Self::Cropped => "zoomed 1.4 times",
        }
    }

    /// Returns whether it hides the focal length.
    pub(super) fn hides_focal(self) -> bool {
        self == Self::Cropped
    }

    /// The changed photo, and its camera. `seed` chooses what is foreign and where.
    pub(super) fn of(self, photo: &PhotoPixels, camera: &Camera, seed: u64) -> (PhotoPixels, Camera) {
        let recolored = |gain: [f32; 3]| {
            let one =
                |rgb: &[u8; 3]| brighter(rgb.map(|v| f32::from(v) / 255.0), gain).map(|v| (255.0 * v + 0.5) as u8);
            PhotoPixels { rgb: photo.rgb.iter().map(one).collect(), ..photo.clone() }
        };
        let changed = match self {
            Self::Brighter => recolored([STOPS; 3]),
            Self::Darker => recolored([1.0 / STOPS; 3]),
            Self::Warmer => recolored(WARM),
            Self::Blurred => blurred(photo),
            Self::Covered => covered(photo, seed),
            Self::Cropped => return cropped(photo, camera),
        };
        (changed, camera.clone())
    }
}

fn size_of(photo: &PhotoPixels) -> (usize, usize) {
    (photo.width_px as usize, photo.height_px as usize)
}

fn share_of(share: f64, length: usize) -> usize {
    ((share * length as f64).round() as usize).clamp(1, length)
}

fn blurred(photo: &PhotoPixels) -> PhotoPixels {
    let size = size_of(photo);
    let window = share_of(BLUR, size.0.max(size.1));
    let small = (size.0.div_ceil(window), size.1.div_ceil(window));
    let rgb = resize(&resize(&photo.rgb, size, small, Filter::Area), small, size, Filter::Bicubic);
    PhotoPixels { rgb, ..photo.clone() }
}

/// The photo with colored spots over a share of it.
fn covered(photo: &PhotoPixels, seed: u64) -> PhotoPixels {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let (width, height) = size_of(photo);
    let [w, h] = [width, height].map(|side| share_of(COVERED.sqrt(), side));
    let (left, top) = (rng.random_range(0..=width - w), rng.random_range(0..=height - h));
    let spots = noise((w, h), share_of(SPOT, width.max(height)), &mut rng);
    let mut rgb = photo.rgb.clone();
    for (row, spots) in spots.chunks_exact(w).enumerate() {
        let first = (top + row) * width + left;
        rgb[first..first + w].copy_from_slice(spots);
    }
    PhotoPixels { rgb, ..photo.clone() }
}

/// The middle of a photo.
fn cropped(photo: &PhotoPixels, camera: &Camera) -> (PhotoPixels, Camera) {
    let (width, height) = size_of(photo);
    let [w, h] = [width, height].map(|side| share_of(CROP, side));
    let (left, top) = ((width - w) / 2, (height - h) / 2);
    let pixels = |i: usize| (top + i / w) * width + left + i % w;
    let plane = |of: &Option<Vec<u8>>| of.as_ref().map(|all| (0..w * h).map(|i| all[pixels(i)]).collect());
    let changed = PhotoPixels {
        width_px: w as u32,
        height_px: h as u32,
        rgb: (0..w * h).map(|i| photo.rgb[pixels(i)]).collect(),
        coverage: plane(&photo.coverage),
        alpha: plane(&photo.alpha),
    };
    let principal_px = camera.principal_px - DVec2::new(left as f64, top as f64);
    (changed, Camera { width_px: w as u32, height_px: h as u32, principal_px, ..camera.clone() })
}

/// Random colors in spots of about this size.
pub(super) fn noise(size: (usize, usize), spot_px: usize, rng: &mut Pcg64Mcg) -> Vec<[u8; 3]> {
    let small = (size.0.div_ceil(spot_px).max(2), size.1.div_ceil(spot_px).max(2));
    let spots: Vec<[u8; 3]> = (0..small.0 * small.1).map(|_| rng.random()).collect();
    resize(&spots, small, size, Filter::Bicubic)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn photo() -> (PhotoPixels, Camera) {
        let camera = Camera::look_at(DVec3::new(0.0, -4.0, 1.0), DVec3::ZERO, DVec3::Z, 0.8, 160, 120).expect("valid");
        let rgb = (0..160 * 120).map(|i| [(i % 160) as u8, (i / 160) as u8, 90]).collect();
        (PhotoPixels { width_px: 160, height_px: 120, rgb, coverage: None, alpha: None }, camera)
    }

    fn differing(a: &PhotoPixels, b: &PhotoPixels) -> f64 {
        a.rgb.iter().zip(&b.rgb).filter(|(a, b)| a != b).count() as f64 / a.len() as f64
    }

    #[test]
    fn each_change_is_what_its_name_says() {
        let (photo, camera) = photo();
        for change in PhotoChange::ALL {
            let (changed, of) = change.of(&photo, &camera, 3);
            assert_eq!(changed.rgb.len(), (of.width_px * of.height_px) as usize, "{}", change.name());
            assert_eq!(changed, change.of(&photo, &camera, 3).0, "{}", change.name());
            let mean = |p: &PhotoPixels, c: usize| p.rgb.iter().map(|v| f64::from(v[c])).sum::<f64>() / p.len() as f64;
            let [red, blue] = [0, 2].map(|c| mean(&changed, c) / mean(&photo, c));
            match change {
                PhotoChange::Brighter => assert!(red > 1.4 && blue > 1.4, "{red} {blue}"),
                PhotoChange::Darker => assert!(red < 0.7 && blue < 0.7, "{red} {blue}"),
                PhotoChange::Warmer => assert!(red > 1.05 && blue < 0.9, "{red} {blue}"),
                PhotoChange::Blurred => assert!((red - 1.0).abs() < 0.02 && (blue - 1.0).abs() < 0.02),
                PhotoChange::Covered => {
                    let share = differing(&photo, &changed);
                    assert!((share - 0.2).abs() < 0.03, "{share}");
                    assert_ne!(changed, change.of(&photo, &camera, 4).0);
                }
                PhotoChange::Cropped => {
                    let point = DVec3::new(0.1, 0.2, -0.1);
                    let [before, after] = [&camera, &of].map(|c| c.project(point).expect("in front"));
                    let color = |p: &PhotoPixels, at: DVec2| p.rgb[at.y as usize * p.width_px as usize + at.x as usize];
                    assert_eq!(color(&photo, before), color(&changed, after));
                    assert_eq!(of.width_px, 112);
                }
            }
        }
    }
}
