//! Sizes of masks: drawn on a photo as stored or on a copy of it, and resampled to the photo as loaded.

use std::collections::BTreeMap;
use std::path::Path;

use crate::io::resample::centers;
use crate::io::{IoError, files, memory, photo, photo_list};
use crate::scene::{Camera, Mask, Photo};

/// Largest ratio of a mask's sides to the photo's.
const MOST_LARGER: f64 = 8.0;

/// Most masks of one photo: object detection compares every pair.
const MOST_MASKS: usize = 4096;
/// Most memory for the masks of one photo, bytes: a thousand of eight million pixels.
const MOST_BYTES: u64 = 1 << 30;

/// Photo that masks are drawn on, as stored or as a larger or smaller copy.
#[derive(Clone, Copy)]
pub(crate) struct Sheet<'a>(&'a Photo);

impl<'a> Sheet<'a> {
    pub(crate) fn new(photo: &'a Photo) -> Self {
        Self(photo)
    }

    /// Width and height of the photo, px.
    pub(super) fn size_px(self) -> [u32; 2] {
        [self.0.camera.width_px, self.0.camera.height_px]
    }

    /// Checks that `masks` masks of `size_px` (width, height), from `path`, have the photo's shape and fit into memory.
    /// To be called before they are made.
    pub(crate) fn check(self, path: &Path, size_px: (u32, u32), masks: usize) -> Result<(), IoError> {
        let (w, h) = size_px;
        if w == 0 || h == 0 || w > Camera::MAX_SIDE_PX || h > Camera::MAX_SIDE_PX {
            return Err(IoError::EmptyPicture { path: path.into(), width_px: w, height_px: h });
        }
        let expected = (self.0.camera.width_px, self.0.camera.height_px);
        let larger = f64::from(w.max(h)) / f64::from(expected.0.max(expected.1));
        if !photo_list::is_scaled(expected, size_px) || larger > MOST_LARGER {
            return Err(IoError::PhotoSize { path: path.into(), found: size_px, expected });
        }
        if masks > MOST_MASKS {
            let reason = format!("{masks} regions of one photo; at most {MOST_MASKS} are taken");
            return Err(IoError::Syntax { path: path.into(), place: "masks".into(), reason });
        }
        let pixels = (u64::from(w) * u64::from(h)).max(u64::from(expected.0) * u64::from(expected.1));
        let (bytes, limit) = (pixels.div_ceil(8).saturating_mul(masks as u64), memory::budget().min(MOST_BYTES));
        if bytes > limit {
            let remedy = "label fewer regions, or smaller photos";
            return Err(IoError::OverBudget { path: path.into(), what: "its masks", bytes, limit, remedy });
        }
        Ok(())
    }
}

/// Resampling of masks on a photo as stored, or on scaled copies, to the photo as loaded: each pixel takes the value at
/// its center.
pub(super) struct AsLoaded<'a> {
    photo: &'a Photo,
    size: [usize; 2],
    /// Pixel of a distorted copy at each center, by the copy's size.
    centers: BTreeMap<[usize; 2], Vec<Option<usize>>>,
}

impl<'a> AsLoaded<'a> {
    pub(super) fn new(photo: &'a Photo, max_side_px: u32) -> Self {
        let camera = photo.camera.limited_to(max_side_px);
        Self { photo, size: [camera.width_px as usize, camera.height_px as usize], centers: BTreeMap::new() }
    }

    pub(super) fn mask(&mut self, mask: &Mask) -> Mask {
        let [width, height] = self.size;
        let Some(distortion) = self.photo.distortion.as_ref().filter(|_| !mask.is_empty()) else {
            return mask.resized(width, height);
        };
        let drawn = [mask.width_px(), mask.height_px()];
        let camera = || self.photo.camera.resized(drawn[0] as u32, drawn[1] as u32);
        let centers = self.centers.entry(drawn).or_insert_with(|| centers(&camera(), distortion, self.size));
        Mask::from_fn(width, height, |i| centers[i].is_some_and(|at| mask.contains(at)))
    }

    /// Width and height of the photo as loaded, px.
    pub(super) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Resamples a number for each pixel of a copy of this width and height; `outside` where the lens shows nothing.
    pub(super) fn numbers(&self, numbers: &[u16], drawn: [usize; 2], outside: u16) -> Vec<u16> {
        let [width, height] = self.size;
        if let Some(distortion) = &self.photo.distortion {
            let camera = self.photo.camera.resized(drawn[0] as u32, drawn[1] as u32);
            let number = |at: Option<usize>| at.map_or(outside, |at| numbers[at]);
            return centers(&camera, distortion, self.size).into_iter().map(number).collect();
        }
        let nearest = |i: usize, axis: usize| (2 * i + 1) * drawn[axis] / (2 * self.size[axis]);
        let row = |y: usize| (0..width).map(move |x| nearest(y, 1) * drawn[0] + nearest(x, 0));
        (0..height).flat_map(row).map(|at| numbers[at]).collect()
    }
}

/// Adds the pixels with centers in a polygon, where (0, 0) is the corner of the first pixel.
pub(super) fn draw(mask: &mut Mask, points: impl Iterator<Item = [f64; 2]>) {
    mask.add_polygon(&points.map(|p| p.map(|v| v - 0.5)).collect::<Vec<_>>());
}

/// Reads a picture file's id per pixel: 8- or 16-bit gray, of the photo's shape; `masks` masks are made of it.
pub(super) fn read_ids(path: &Path, sheet: Sheet<'_>, masks: usize) -> Result<(usize, usize, Vec<u16>), IoError> {
    sheet.check(path, photo::size(path)?, masks)?;
    let bytes = files::read(path, files::MAX_PICTURE_BYTES)?;
    let ids = photo::decode_gray16(&bytes, path)?;
    Ok((ids.width() as usize, ids.height() as usize, ids.into_raw()))
}
