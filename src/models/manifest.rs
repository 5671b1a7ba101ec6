//! Description of an exported model: a JSON file beside its graphs.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::ModelError;

/// Version of the description that this program reads.
const VERSION: u64 = 1;
pub(crate) const MAX_BYTES: u64 = super::fetch::MOST_UNPROMISED;

/// Graph of a model.
#[derive(Clone, Debug, Deserialize)]
pub struct GraphFile {
    pub(crate) file: String,
    pub(crate) bytes: u64,
    pub(crate) sha256: String,
}

impl GraphFile {
    /// Compares the file's size with the description.
    pub fn check_size(&self, folder: &Path) -> Result<(), ModelError> {
        let path = folder.join(&self.file);
        let refused = |problem: String| ModelError::Metadata { path: path.clone(), problem };
        let about = std::fs::metadata(&path).map_err(|e| refused(e.to_string()))?;
        if !about.is_file() {
            return Err(refused("it is not a regular file".into()));
        }
        let bytes = about.len();
        if bytes != self.bytes {
            let wanted = self.bytes;
            return Err(refused(format!("{bytes} bytes, its description says {wanted}; it is broken or another file")));
        }
        Ok(())
    }

    /// Compares the file's size and SHA-256 with the description.
    pub(crate) fn check(&self, folder: &Path) -> Result<(), ModelError> {
        self.check_size(folder)?;
        let path = folder.join(&self.file);
        let wrong = |e: super::fetch::FetchError| ModelError::Metadata { path: path.clone(), problem: e.to_string() };
        super::fetch::check(&path, &self.sha256).map_err(wrong)
    }
}

/// Largest side of a network's pictures, px: four times that of the largest known network.
const MAX_SIDE_PX: usize = 4096;

/// Checks the input settings in a description: side, mean and standard deviation.
pub(crate) fn check_pictures(path: &Path, side_px: usize, mean: [f32; 3], std: [f32; 3]) -> Result<(), ModelError> {
    let refused = |problem: String| Err(ModelError::Metadata { path: path.into(), problem });
    if !(1..=MAX_SIDE_PX).contains(&side_px) {
        return refused(format!("image_size is {side_px} px; networks take 1 to {MAX_SIDE_PX}"));
    }
    if !mean.iter().all(|v| v.abs() < 1e6) || !std.iter().all(|v| (1e-6..1e6).contains(v)) {
        return refused(format!("mean {mean:?} and std {std:?} do not turn colors into numbers"));
    }
    Ok(())
}

pub(crate) fn check_length(path: &Path, name: &str, length: usize, most: usize) -> Result<(), ModelError> {
    match (1..=most).contains(&length) {
        true => Ok(()),
        false => Err(ModelError::Metadata {
            path: path.into(),
            problem: format!("{name} is {length}; 1 to {most} is possible"),
        }),
    }
}

#[derive(Deserialize)]
struct AnyModel {
    graphs: BTreeMap<String, GraphFile>,
}

/// Reads the graphs that a description names.
pub fn graphs(path: &Path) -> Result<Vec<GraphFile>, ModelError> {
    let kind = kind(path)?;
    let graphs: AnyModel = read(path, &kind)?;
    let all: Vec<GraphFile> = graphs.graphs.into_values().collect();
    // A name with a path in it could lead out of the folder.
    match all.iter().find(|g| Path::new(&g.file).file_name() != Some(std::ffi::OsStr::new(&g.file))) {
        Some(g) => Err(ModelError::Metadata { path: path.into(), problem: format!("'{}' is no file name", g.file) }),
        None => Ok(all),
    }
}

#[derive(Deserialize)]
struct Head {
    version: u64,
    kind: String,
}

/// Reads the metadata of a model of a `kind`: "clip", "sam" or "sam2".
pub(crate) fn read<T: DeserializeOwned>(path: &Path, kind: &str) -> Result<T, ModelError> {
    let refused = |problem: String| ModelError::Metadata { path: path.into(), problem };
    let bytes = crate::io::files::read(path, MAX_BYTES).map_err(|e| refused(e.to_string()))?;
    let head: Head = crate::io::files::json(&bytes, path).map_err(|e| refused(e.to_string()))?;
    if head.version != VERSION {
        return Err(refused(format!("version {}, this program reads {VERSION}; export the model anew", head.version)));
    }
    if head.kind != kind {
        return Err(refused(format!("it describes a '{}' model where '{kind}' is wanted", head.kind)));
    }
    crate::io::files::json(&bytes, path).map_err(|e| refused(e.to_string()))
}

/// Reads the kind of model that a description is for.
pub fn kind(path: &Path) -> Result<String, ModelError> {
    let refused = |problem: String| ModelError::Metadata { path: path.into(), problem };
    let bytes = crate::io::files::read(path, MAX_BYTES).map_err(|e| refused(e.to_string()))?;
    crate::io::files::json::<Head>(&bytes, path).map(|head| head.kind).map_err(|e| refused(e.to_string()))
}
