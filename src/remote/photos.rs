//! Photos for clients: by number, never by name or path, and no larger than displayed.

use std::io::Cursor;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ColorType, ImageEncoder, ImageFormat, ImageReader, Limits};

use crate::io::trained::SceneInfo;
use crate::io::{self, Opened, photo};
use crate::scene::{Dataset, Photo, PhotoPixels};

/// Longest side of a photo that is sent, in px.
const MOST_PX: u64 = 4096;

/// Photos of a scene, in the order of its cameras; `None` for a missing one.
#[derive(Debug, Default)]
pub(super) struct ServedPhotos {
    photos: Vec<Option<Photo>>,
    /// Lock held while a photo is loaded: clients take turns.
    turn: Mutex<()>,
}

impl ServedPhotos {
    /// Returns the photos of a dataset with the same cameras as the scene.
    pub(super) fn of(dataset: &Dataset) -> Self {
        Self { photos: dataset.photos.iter().cloned().map(Some).collect(), turn: Mutex::default() }
    }

    /// Returns the photos of a trained scene that still exist in its data set.
    pub(super) fn of_scene(info: &SceneInfo, dataset: Option<&Path>) -> Self {
        let Some(Ok(Opened::Dataset(dataset))) = dataset.map(io::open) else { return Self::default() };
        let of = |name: &str| dataset.photos.iter().find(|photo| photo.name == name).cloned();
        Self { photos: info.cameras.iter().map(|camera| of(&camera.name)).collect(), turn: Mutex::default() }
    }

    /// Returns whether there are no photos.
    pub(super) fn is_empty(&self) -> bool {
        self.photos.iter().all(Option::is_none)
    }

    /// Encodes a photo as a `.png` with a longest side of at most `side_px`; `None` if it is missing or unreadable.
    pub(super) fn png(&self, index: u64, side_px: u64) -> Option<Vec<u8>> {
        let one = self.photos.get(usize::try_from(index).ok()?)?.as_ref()?;
        let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
        let pixels = photo::load(one, u32::try_from(side_px.clamp(16, MOST_PX)).ok()?).ok()?;
        let size = (pixels.width_px, pixels.height_px);
        let mut out = Vec::new();
        let png = PngEncoder::new_with_quality(&mut out, CompressionType::Fast, FilterType::Adaptive);
        let written = match &pixels.coverage {
            None => png.write_image(pixels.rgb.as_flattened(), size.0, size.1, ColorType::Rgb8.into()),
            Some(coverage) => {
                let covered = |([r, g, b], c): (&[u8; 3], &u8)| [*r, *g, *b, *c];
                let all: Vec<[u8; 4]> = pixels.rgb.iter().zip(coverage).map(covered).collect();
                png.write_image(all.as_flattened(), size.0, size.1, ColorType::Rgba8.into())
            }
        };
        written.ok().map(|()| out)
    }
}

/// Decodes a photo.
///
/// # Errors
/// If the bytes are not a valid `.png`, or the photo is larger than the server sends.
pub(super) fn read(png: &[u8]) -> Result<PhotoPixels, image::ImageError> {
    let mut reader = ImageReader::with_format(Cursor::new(png), ImageFormat::Png);
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(MOST_PX as u32), Some(MOST_PX as u32));
    reader.limits(limits);
    let picture = reader.decode()?;
    let (width_px, height_px) = (picture.width(), picture.height());
    let coverage = picture.color().has_alpha().then(|| picture.to_rgba8().pixels().map(|p| p.0[3]).collect());
    let rgb = picture.to_rgb8().pixels().map(|p| p.0).collect();
    Ok(PhotoPixels { width_px, height_px, rgb, coverage, alpha: None })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;
    use glam::DVec3;

    #[test]
    fn photos_arrive_as_they_are_loaded() {
        let folder = tempfile::tempdir().expect("folder");
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid");
        let photo = |name: &str, alpha: u8| {
            let path = folder.path().join(name);
            let at = |x: u32, y: u32| image::Rgba([x as u8, (5 * y) as u8, 7, if x < 32 { 255 } else { alpha }]);
            image::RgbaImage::from_fn(64, 48, at).save(&path).expect("save");
            Photo::new(name, path, camera.clone())
        };
        let all = vec![photo("a.png", 255), photo("b.png", 0), Photo::new("c.png", "gone.png", camera.clone())];
        let served = ServedPhotos::of(&Dataset { photos: all.clone(), ..Dataset::default() });
        for (index, side) in [(0, 64), (0, 32), (1, 48)] {
            let sent = read(&served.png(index, side).expect("a photo")).expect("a picture");
            let other = photo::load(&all[1 - index as usize], side as u32).expect("loaded");
            assert_eq!(sent, photo::load(&all[index as usize], side as u32).expect("loaded"));
            assert!(sent != other, "another photo is another");
        }
        assert!(served.png(2, 64).is_none() && served.png(3, 64).is_none() && served.png(u64::MAX, 0).is_none());
        assert!(read(b"nothing").is_err());
    }
}
