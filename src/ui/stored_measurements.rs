//! Measurements as they are stored, to know what was changed since.

use std::path::PathBuf;

use crate::scene::measurement::Measurement;

/// Stored measurements of the open scene.
#[derive(Default)]
pub(super) struct StoredMeasurements {
    /// Number and folder of their scene.
    pub(super) of: (u64, PathBuf),
    pub(super) stored: Vec<Measurement>,
    /// Measurements that were tried last, and whether the folder held a result then.
    pub(super) tried: Option<(Vec<Measurement>, bool)>,
    /// True if they are being stored.
    pub(super) is_storing: bool,
    /// True if the user knows that they are not stored.
    pub(super) is_told: bool,
}
