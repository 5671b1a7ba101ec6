//! Photos: their paths and cameras, and their pixels once loaded.

use std::borrow::Cow;
use std::path::PathBuf;

use super::{Camera, Distortion, text};

/// A posed photo of a dataset. Its pixels are loaded by `io`, undistorted.
#[derive(Clone, Debug, PartialEq)]
pub struct Photo {
    /// File name as the dataset writes it, for example `images/0001.jpg`.
    pub name: String,
    /// Path of the file; empty if only the camera is known.
    pub path: PathBuf,
    /// The pinhole camera of the undistorted photo at full resolution.
    pub camera: Camera,
    /// Distortion of the file on disk relative to that pinhole; `None` for none.
    pub distortion: Option<Distortion>,
    /// True if the dataset marks the photo as test (Blender's `test` split).
    pub test_split: bool,
    /// Color that the file's transparent pixels are composited over; `None` = they count for
    /// nothing (coverage 0).
    pub background: Option<[f32; 3]>,
    /// True if training keeps the scene empty where the file is transparent; see [`AlphaUse`].
    ///
    /// [`AlphaUse`]: super::AlphaUse
    pub(crate) cut_out: bool,
    /// Picture of the pixels that count: those that are not black.
    pub(crate) mask: Option<PathBuf>,
}

impl Photo {
    /// A photo without a lens of its own.
    pub fn new(name: impl Into<String>, path: impl Into<PathBuf>, camera: Camera) -> Self {
        let (name, path) = (name.into(), path.into());
        Self { name, path, camera, distortion: None, test_split: false, background: None, cut_out: false, mask: None }
    }

    /// Returns whether it has a file: of some photos on other computers only the cameras are known.
    pub(crate) fn has_pixels(&self) -> bool {
        !self.path.as_os_str().is_empty()
    }

    /// Its name as it may be shown.
    pub(crate) fn title(&self) -> Cow<'_, str> {
        text::line(&self.name)
    }
}

/// A loaded, undistorted photo.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotoPixels {
    /// Width in px.
    pub width_px: u32,
    /// Height in px.
    pub height_px: u32,
    /// Row-major sRGB, as displayed; black where `coverage` is 0.
    pub rgb: Vec<[u8; 3]>,
    /// Row-major weight of each pixel, 0 where the photo shows nothing (outside the lens after
    /// undistortion, transparent, black in its mask); `None` means all of it counts.
    pub coverage: Option<Vec<u8>>,
    /// Row-major share of each pixel that is not transparent, 0 to 255, of photos of things that were cut out: `rgb` is
    /// then over [`Photo::background`]. `None` where the photo does not say.
    pub alpha: Option<Vec<u8>>,
}

impl PhotoPixels {
    pub(crate) fn len(&self) -> usize {
        self.rgb.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.rgb.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_counted() {
        let photo = |n: usize| PhotoPixels {
            width_px: n as u32,
            height_px: 1,
            rgb: vec![[0; 3]; n],
            coverage: None,
            alpha: None,
        };
        assert_eq!((photo(3).len(), photo(3).is_empty(), photo(0).is_empty()), (3, false, true));
    }
}
