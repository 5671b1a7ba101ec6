//! The camera path as it is stored, to know what was changed since.

use std::path::PathBuf;

use crate::scene::CameraPath;

/// Stored camera path of the open scene.
#[derive(Default)]
pub(super) struct StoredPath {
    /// Number and folder of its scene.
    pub(super) of: (u64, PathBuf),
    /// The path, if it has keys.
    pub(super) stored: Option<CameraPath>,
    /// True if it was stored in another folder, before the scene got this one.
    pub(super) is_elsewhere: bool,
    /// Path that was tried last, and whether the folder held a result then.
    pub(super) tried: Option<(Option<CameraPath>, bool)>,
    /// True if it is being stored.
    pub(super) is_storing: bool,
    /// True if it waits for another job or program that writes to the scene.
    pub(super) waits: bool,
    /// True if the user knows that it is not stored.
    pub(super) is_told: bool,
}
