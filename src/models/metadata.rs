//! The JSON file that describes an exported model, beside its graphs.

use std::path::Path;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::ModelError;

/// Version of the file that this program reads.
const VERSION: u64 = 1;
/// Largest file that is read, bytes.
const MAX_BYTES: u64 = 16 << 20;

/// A graph of a model.
#[derive(Clone, Debug, Deserialize)]
pub struct Graph {
    /// Its file, in the same folder.
    pub file: String,
}

#[derive(Deserialize)]
struct Head {
    version: u64,
    kind: String,
}

/// Reads the metadata of a model of a `kind`: "clip", "sam" or "sam2".
///
/// # Errors
/// If the file cannot be read, is of another kind or version, or lacks something.
pub fn read<T: DeserializeOwned>(path: &Path, kind: &str) -> Result<T, ModelError> {
    let refused = |problem: String| ModelError::Metadata { path: path.into(), problem };
    let bytes = crate::io::files::read(path, MAX_BYTES).map_err(|e| refused(e.to_string()))?;
    let head: Head = serde_json::from_slice(&bytes).map_err(|e| refused(e.to_string()))?;
    if head.version != VERSION {
        return Err(refused(format!("version {}, this program reads {VERSION}; export the model anew", head.version)));
    }
    if head.kind != kind {
        return Err(refused(format!("it describes a '{}' model where '{kind}' is wanted", head.kind)));
    }
    serde_json::from_slice(&bytes).map_err(|e| refused(e.to_string()))
}

/// The kind of model that a metadata file describes.
///
/// # Errors
/// If the file cannot be read or is no metadata.
pub fn kind(path: &Path) -> Result<String, ModelError> {
    let refused = |problem: String| ModelError::Metadata { path: path.into(), problem };
    let bytes = crate::io::files::read(path, MAX_BYTES).map_err(|e| refused(e.to_string()))?;
    serde_json::from_slice::<Head>(&bytes).map(|head| head.kind).map_err(|e| refused(e.to_string()))
}
