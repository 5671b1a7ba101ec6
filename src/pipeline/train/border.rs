//! Black borders of photos that another program has undistorted.
//!
//! No scene can explain a border, because it moves with the camera. Left in, training builds dark floaters in front of
//! every camera, and the border limits every score.

use std::collections::{BTreeMap, VecDeque};

use rayon::prelude::*;

use crate::io::{IoError, photo};
use crate::math::grid::neighbors;
use crate::math::stats::median;
use crate::scene::{Camera, Dataset, Photo, PhotoPixels};

/// Most photos of a camera that are searched; a border is the same in all.
const SAMPLE: usize = 24;

/// Fewest photos that distinguish a border from a dark wall.
const MIN_PHOTOS: usize = 8;
/// Brightest value of a border pixel in any photo, as a share of the pictures' usual brightest.
/// Below one half, because resampling blends the border's last row with the picture.
const DARK: f64 = 0.55;
/// Pixels beyond the dark ones that resampling has darkened, px.
const BLEND_PX: usize = 2;
/// Share of the pixels next to a border that must be bright in some photo.
const SHARP: f64 = 0.95;
/// Largest share of the picture that a border may take.
const MAX_SHARE: f64 = 0.4;

/// Borders of a dataset's photos at one size, by camera.
pub(crate) struct Borders {
    max_side_px: u32,
    by_camera: BTreeMap<[u64; 6], Vec<bool>>,
}

impl Borders {
    /// Finds borders in a sample of the photos with these indices (the training photos), scaled to `max_side_px`.
    pub(crate) fn of(dataset: &Dataset, photos: &[usize], max_side_px: u32) -> Result<Self, IoError> {
        let mut cameras: BTreeMap<[u64; 6], Vec<&Photo>> = BTreeMap::new();
        for photo in photos.iter().map(|&i| &dataset.photos[i]).filter(|p| may_have_border(p)) {
            cameras.entry(intrinsics(&photo.camera)).or_default().push(photo);
        }
        let mut by_camera = BTreeMap::new();
        for (camera, photos) in cameras.into_iter().filter(|(_, photos)| photos.len() >= MIN_PHOTOS) {
            let step = photos.len().div_ceil(SAMPLE);
            let sample: Result<Vec<Option<PhotoPixels>>, IoError> =
                photos.par_iter().step_by(step).map(|p| unless_blank(photo::load(p, max_side_px))).collect();
            let sample: Vec<PhotoPixels> = sample?.into_iter().flatten().collect();
            if let Some(border) = find(&sample.iter().collect::<Vec<_>>()) {
                by_camera.insert(camera, border);
            }
        }
        Ok(Self { max_side_px, by_camera })
    }

    /// Loads the photo's pixels, without the border of its camera.
    pub(crate) fn load(&self, photo: &Photo) -> Result<PhotoPixels, IoError> {
        let mut pixels = photo::load(photo, self.max_side_px)?;
        if let Some(border) = self.by_camera.get(&intrinsics(&photo.camera)).filter(|_| may_have_border(photo)) {
            leave_out(border, &mut pixels);
        }
        Ok(pixels)
    }

    /// Largest share of a picture that a border takes; 0 without any.
    pub(crate) fn share(&self) -> f64 {
        let share = |b: &Vec<bool>| b.iter().filter(|b| **b).count() as f64 / b.len().max(1) as f64;
        self.by_camera.values().map(share).fold(0.0, f64::max)
    }
}

/// Turns the error of a blank photo into `None`.
pub(super) fn unless_blank<T>(loaded: Result<T, IoError>) -> Result<Option<T>, IoError> {
    match loaded {
        Err(IoError::NothingShown { .. }) => Ok(None),
        loaded => loaded.map(Some),
    }
}

/// Returns whether a photo may have a border: not if it is undistorted here, or has a background of its own.
fn may_have_border(photo: &Photo) -> bool {
    photo.distortion.is_none() && photo.background.is_none()
}

/// Key of the camera intrinsics.
fn intrinsics(camera: &Camera) -> [u64; 6] {
    let (focal, principal) = (camera.focal_px, camera.principal_px);
    let size = [u64::from(camera.width_px), u64::from(camera.height_px)];
    [size[0], size[1], focal.x.to_bits(), focal.y.to_bits(), principal.x.to_bits(), principal.y.to_bits()]
}

/// Finds the border pixels (row-major) of equally large photos of one camera: dark in every photo, connected to the
/// picture's edge, and ending sharply. `None` if there is no border.
fn find(photos: &[&PhotoPixels]) -> Option<Vec<bool>> {
    let first = photos.first().filter(|_| photos.len() >= MIN_PHOTOS)?;
    let (width, height) = (first.width_px as usize, first.height_px as usize);
    let mut brightest = vec![0_u8; width * height];
    for photo in photos {
        for (b, rgb) in brightest.iter_mut().zip(&photo.rgb) {
            *b = rgb.iter().fold(*b, |m, &v| m.max(v));
        }
    }
    let usual = median(&brightest.iter().map(|&b| f64::from(b)).collect::<Vec<_>>());
    let dark = connected_to_edge(width, height, |i| f64::from(brightest[i]) < DARK * usual);
    let any_black = dark.iter().zip(&brightest).any(|(d, b)| *d && *b <= 2);
    let border = grown(&dark, width, BLEND_PX);
    let rim = grown(&border, width, 1);
    let count = |of: &[bool]| of.iter().filter(|b| **b).count();
    let next: Vec<usize> = (0..width * height).filter(|&i| rim[i] && !border[i]).collect();
    let bright = next.iter().filter(|&&i| f64::from(brightest[i]) > DARK * usual).count();
    let sharp = bright as f64 >= SHARP * next.len() as f64;
    let small = count(&border) as f64 <= MAX_SHARE * border.len() as f64;
    (any_black && sharp && small).then_some(border)
}

fn leave_out(border: &[bool], photo: &mut PhotoPixels) {
    let n = photo.len();
    let coverage = photo.coverage.get_or_insert_with(|| vec![u8::MAX; n]);
    for ((c, rgb), _) in coverage.iter_mut().zip(&mut photo.rgb).zip(border).filter(|(_, b)| **b) {
        (*c, *rgb) = (0, [0; 3]);
    }
}

/// Marks the pixels with `is` that are connected to the picture's edge through such pixels.
fn connected_to_edge(width: usize, height: usize, is: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut reached = vec![false; width * height];
    let edge = |i: usize| i % width == 0 || i % width == width - 1 || i < width || i >= width * (height - 1);
    let mut queue: VecDeque<usize> = (0..width * height).filter(|&i| edge(i) && is(i)).collect();
    queue.iter().for_each(|&i| reached[i] = true);
    while let Some(i) = queue.pop_front() {
        for j in neighbors(i, width, width * height) {
            if !reached[j] && is(j) {
                reached[j] = true;
                queue.push_back(j);
            }
        }
    }
    reached
}

/// Dilates a set of pixels by `by` px, along rows, columns and diagonals.
fn grown(set: &[bool], width: usize, by: usize) -> Vec<bool> {
    let height = set.len() / width.max(1);
    let along = |set: &[bool], x_by: usize, y_by: usize| -> Vec<bool> {
        (0..set.len())
            .map(|i| {
                let (x, y) = (i % width, i / width);
                (y.saturating_sub(y_by)..(y + y_by + 1).min(height))
                    .any(|v| (x.saturating_sub(x_by)..(x + x_by + 1).min(width)).any(|u| set[v * width + u]))
            })
            .collect()
    };
    along(&along(set, by, 0), 0, by)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Photos of a bright, varying scene with `frame` black pixels around it.
    fn photos(n: usize, frame: u32) -> Vec<PhotoPixels> {
        let (w, h) = (60, 40);
        let inside = |x: u32, y: u32| x >= frame && y >= frame && x < w - frame && y < h - frame;
        (0..n as u32)
            .map(|k| {
                let level = |x, y| if inside(x, y) { (90 + (x * 7 + y * 13 + k * 37) % 160) as u8 } else { 0 };
                let rgb = (0..h).flat_map(|y| (0..w).map(move |x| [level(x, y); 3])).collect();
                PhotoPixels { width_px: w, height_px: h, rgb, coverage: None, alpha: None }
            })
            .collect()
    }

    #[test]
    fn a_black_frame_is_left_out_of_every_photo() {
        let mut photos = photos(10, 2);
        let border = find(&photos.iter().collect::<Vec<_>>()).expect("a border");
        // Two black rows and two that resampling may have darkened.
        assert_eq!(border.iter().filter(|b| **b).count(), 60 * 40 - 52 * 32);
        leave_out(&border, &mut photos[0]);
        let coverage = photos[0].coverage.as_ref().expect("partial");
        assert_eq!((coverage[0], coverage[20 * 60 + 30]), (0, 255));
    }

    #[test]
    fn without_a_frame_or_enough_photos_nothing_is_left_out() {
        let full = photos(10, 0);
        assert_eq!(find(&full.iter().collect::<Vec<_>>()), None);
        let few = photos(MIN_PHOTOS - 1, 2);
        assert_eq!(find(&few.iter().collect::<Vec<_>>()), None);
        assert_eq!(find(&[]), None);
    }

    #[test]
    fn a_dark_background_without_a_sharp_end_is_kept() {
        // A bright disk on black fading out over many pixels.
        let fade = |x: u32, y: u32| {
            let d = f64::from(x.abs_diff(20)).hypot(f64::from(y.abs_diff(15)));
            (255.0 * (1.0 - d / 16.0)).max(0.0) as u8
        };
        let rgb = (0..30).flat_map(|y| (0..40).map(move |x| [fade(x, y); 3])).collect();
        let photo = PhotoPixels { width_px: 40, height_px: 30, rgb, coverage: None, alpha: None };
        assert_eq!(find(&[&photo; 10]), None);
    }
}
