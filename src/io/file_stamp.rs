//! Size and time of a file: it is the same as long as both are.

use std::path::Path;
use std::time::UNIX_EPOCH;

use serde::{Deserialize, Serialize};

use super::IoError;

/// Size and time of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct FileStamp {
    bytes: u64,
    /// Nanoseconds since 1970; 0 where the system does not say.
    modified_nanos: u64,
}

impl FileStamp {
    /// Reads it.
    ///
    /// # Errors
    /// If the file is not there.
    pub(crate) fn of(path: &Path) -> Result<Self, IoError> {
        let meta = path.metadata().map_err(|cause| IoError::Read { path: path.into(), cause })?;
        let since = meta.modified().ok().and_then(|t| t.duration_since(UNIX_EPOCH).ok());
        Ok(Self { bytes: meta.len(), modified_nanos: since.map_or(0, |since| since.as_nanos() as u64) })
    }
}
