//! The located photo that the camera flies to, and how it is shown there.

use std::path::PathBuf;

/// A photo to look through once the camera is where it was taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PhotoArrival {
    /// Number of the scene.
    pub(crate) scene: u64,
    /// File of the photo.
    pub(crate) photo: PathBuf,
    /// True to show the difference; else the photo is compared by the slider.
    pub(crate) differs: bool,
}
