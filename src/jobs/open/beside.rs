//! Files beside a splat of 3D Gaussian Splatting: cameras to view it from, and the photos if they still exist.

use std::path::{Path, PathBuf};

use super::Scene;
use crate::io::gs_output::{self, GsOutput};
use crate::scene::{Dataset, Photo};

/// Returns the splat of a folder that 3D Gaussian Splatting wrote, else the path itself.
pub(super) fn splat_of(path: &Path) -> PathBuf {
    let is_dataset = || path.join("transforms.json").is_file() || path.join("scene.json").is_file();
    let latest = path.is_dir().then(|| gs_output::latest(path)).flatten();
    latest.filter(|_| !is_dataset()).unwrap_or_else(|| path.into())
}

impl Scene {
    /// Adds the files beside the scene's file.
    pub(super) fn with_what_lies_beside(mut self) -> Self {
        let Some(GsOutput { folder, cameras, source, white_background, warnings }) = gs_output::beside(&self.path)
        else {
            return self;
        };
        self.dataset_path = source.clone().filter(|source| source.is_dir());
        self.warnings.extend(warnings);
        if let Some(gone) = source.as_ref().filter(|_| self.dataset_path.is_none()) {
            self.warnings.push(format!("its photos were in {}, which is not here", gone.display()));
        }
        self.photos = source;
        self.cameras = cameras;
        self.cameras_from = Some(folder);
        if white_background {
            self.settings.background = [1.0; 3];
            self.says_background = true;
        }
        self
    }

    /// Returns its cameras as photos without files, if it has cameras beside it.
    pub(super) fn photos_unseen(&self) -> Option<Dataset> {
        let root = self.cameras_from.clone()?;
        let photo = |c: &crate::io::trained::SceneCamera| Photo::new(&*c.name, PathBuf::new(), c.camera.clone());
        let photos: Vec<Photo> = self.cameras.iter().map(photo).collect();
        let (name, format) = (self.name.clone(), "cameras.json of 3D Gaussian Splatting".into());
        (!photos.is_empty()).then(|| Dataset { name, root, format, photos, ..Dataset::default() })
    }
}
