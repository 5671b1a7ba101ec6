//! `scene.json`: description of a trained scene, its photos, settings and history.

use std::fs;
use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::scene_files::SCENE_FILE;
use super::{IoError, files};
use crate::scene::{Camera, Dataset, Evaluation, PhotoFit, StepMetrics, text};

/// Version of the folder's format that this program writes, and the highest it reads.
pub const VERSION: u64 = 1;

/// The contents of `scene.json`. Unknown fields of a later version are ignored; missing fields get their defaults.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneInfo {
    /// Version of the format.
    pub version: u64,
    /// Short name for titles.
    #[serde(default, deserialize_with = "text::read_name")]
    pub name: String,
    /// Training photos, if known.
    #[serde(default)]
    pub dataset: Option<DatasetReference>,
    /// The photos' cameras, in the dataset's order.
    #[serde(default)]
    pub cameras: Vec<SceneCamera>,
    /// Length of a scene unit in meters, if known.
    #[serde(default, rename = "metres_per_unit")]
    pub meters_per_unit: Option<f64>,
    /// Color behind everything.
    #[serde(default)]
    pub background: Option<[f32; 3]>,
    /// Settings of the training run.
    #[serde(default)]
    pub config: serde_json::Value,
    /// Measurements of the training run.
    #[serde(default)]
    pub history: History,
    /// Findings about the training photos, if poses were refined or exposures learned.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub photo_fits: Vec<PhotoFit>,
    /// True if Gaussians were moved, recolored, duplicated or deleted since training, so that the photos differ from
    /// the scene.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub edited: bool,
    /// Id of the save that wrote the file; the other files of the scene carry it too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<String>,
}

/// Location of the photos of a trained scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DatasetReference {
    /// Path of the dataset's folder or file, relative to the scene's folder where it can be.
    pub(crate) path: PathBuf,
    pub(crate) format: String,
}

impl DatasetReference {
    /// Returns the reference to the same dataset at `path`, for a scene in `folder`.
    pub(crate) fn moved(&self, path: &Path, folder: &Path) -> Self {
        Self { path: relative_to(path, folder), format: self.format.clone() }
    }
}

/// The camera of a photo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneCamera {
    /// The photo's name.
    pub name: String,
    /// Its pinhole camera at full resolution.
    pub camera: Camera,
    /// True if the photo was held out from training.
    pub held_out: bool,
}

/// Measurements of a training run, in order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct History {
    /// Training steps (every few).
    #[serde(default)]
    pub steps: Vec<StepMetrics>,
    /// Held-out evaluations.
    #[serde(default)]
    pub evaluations: Vec<Evaluation>,
}

impl SceneInfo {
    /// Makes the description of a scene in `folder` trained on `dataset` without the photos at `held_out`. Settings and
    /// history are empty.
    pub(crate) fn of(dataset: &Dataset, held_out: &[usize], folder: &Path) -> Self {
        let camera = |(i, p): (usize, &crate::scene::Photo)| SceneCamera {
            name: p.name.clone(),
            camera: p.camera.clone(),
            held_out: held_out.contains(&i),
        };
        Self {
            version: VERSION,
            name: dataset.name.clone(),
            dataset: Some(DatasetReference {
                path: relative_to(dataset.source(), folder),
                format: dataset.format.clone(),
            }),
            cameras: dataset.photos.iter().enumerate().map(camera).collect(),
            background: dataset.background,
            meters_per_unit: dataset.meters_per_unit,
            ..Self::default()
        }
    }
}

impl SceneInfo {
    /// Name of the scene in `folder`: its own, or that of its photos where its own says nothing.
    pub(crate) fn name_in(&self, folder: &Path) -> String {
        if !self.name.is_empty() && !files::is_usual_name(&self.name) {
            return self.name.clone();
        }
        let photos = self.dataset.as_ref().map(|dataset| folder.join(&dataset.path)).filter(|path| path.is_dir());
        files::data_set_name(photos.as_deref().unwrap_or(folder))
    }
}

/// Reads `scene.json` alone.
pub fn load_info(folder: &Path) -> Result<SceneInfo, IoError> {
    #[derive(Deserialize)]
    struct Versioned {
        version: u64,
    }
    let path = folder.join(SCENE_FILE);
    let bytes = files::read(&path, files::MAX_TEXT_BYTES)?;
    // The version first: the rest of a newer file may not parse.
    let Versioned { version } = files::json(&bytes, &path)?;
    if version == 0 || version > VERSION {
        return Err(IoError::Version { path, found: version, supported: VERSION });
    }
    let info: SceneInfo = files::json(&bytes, &path)?;
    check(&info, &path)?;
    Ok(info)
}

/// Refuses invalid names and cameras of photos; `path` is for errors.
pub(crate) fn check(info: &SceneInfo, path: &Path) -> Result<(), IoError> {
    for c in &info.cameras {
        files::photo_name(&c.name, path)?;
        c.camera.believe().map_err(|cause| IoError::Camera { path: path.into(), photo: c.name.clone(), cause })?;
    }
    Ok(())
}

/// Returns `path` relative to `folder`; absolute if they have no common root or do not exist.
pub(super) fn relative_to(path: &Path, folder: &Path) -> PathBuf {
    // The scene's folder may not exist yet; its parents do not matter then beyond their names.
    let real = |p: &Path| fs::canonicalize(p).or_else(|_| std::path::absolute(p));
    let (Ok(path), Ok(folder)) = (real(path), real(folder)) else { return path.into() };
    let shared = path.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    if shared <= 1 {
        return path;
    }
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    let relative: PathBuf = up.chain(path.components().skip(shared)).collect();
    if relative.as_os_str().is_empty() { PathBuf::from(".") } else { relative }
}
