//! Location of COLMAP's reconstructions: in the folders that COLMAP and its users write, or close to them. The one with
//! the most photos is used.

use std::path::{Path, PathBuf};

use super::{Image, binary, text};
use crate::io::{IoError, files, photo};

/// Folders of reconstructions relative to a dataset's folder, the most likely first; each may also hold them in
/// subfolders. Of two with as many photos the first is used: undistorted photos come before distorted ones.
const PLACES: [&str; 14] = [
    "sparse",
    "",
    "colmap/sparse",
    "colmap",
    "dense/sparse",
    "dense",
    "undistorted/sparse",
    "aligned/sparse",
    "reconstruction",
    "sfm",
    "distorted/sparse",
    "colmap_sparse",
    "colmap_text",
    "sparse_txt",
];
/// Most subfolders searched in one place.
const MOST: usize = 1000;

/// Files of a reconstruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ModelFolder {
    pub(super) folder: PathBuf,
    pub(super) is_binary: bool,
    /// Index of the place in [`PLACES`].
    place: usize,
}

impl ModelFolder {
    /// Returns the reconstruction with files in `folder` itself.
    pub(super) fn at(folder: &Path, place: usize) -> Option<Self> {
        let has = |ending: &str| ["cameras", "images"].iter().all(|n| folder.join(format!("{n}.{ending}")).is_file());
        let is_binary = has("bin");
        (is_binary || has("txt")).then(|| Self { folder: folder.into(), is_binary, place })
    }

    pub(super) fn file(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.{}", if self.is_binary { "bin" } else { "txt" }))
    }

    /// Reads names and poses of its photos.
    pub(super) fn images(&self) -> Result<Vec<Image>, IoError> {
        let file = self.file("images");
        match self.is_binary {
            true => binary::images(&files::read(&file, u64::MAX)?, &file),
            false => text::images(&files::read_text(&file)?, &file),
        }
    }

    /// Reads the number of its photos, in a binary file from the start alone.
    fn count(&self) -> Result<u64, IoError> {
        if !self.is_binary {
            return Ok(self.images()?.len() as u64);
        }
        let start = files::read_start(&self.file("images"), 8)?;
        Ok(start.first_chunk().map_or(0, |count| u64::from_le_bytes(*count)))
    }
}

/// A reconstruction that is not used, and its description.
pub(super) struct Other {
    pub(super) folder: PathBuf,
    pub(super) what: String,
}

/// Returns whether there is any reconstruction of the dataset in `root`.
pub(super) fn any(root: &Path) -> bool {
    !models(root).is_empty()
}

/// Finds all reconstructions of the dataset in `root`, in the order of [`PLACES`].
fn models(root: &Path) -> Vec<ModelFolder> {
    let mut found: Vec<ModelFolder> = Vec::new();
    for (place, name) in PLACES.iter().enumerate() {
        let Some(folder) = files::called(root, name) else { continue };
        let folder = if name.is_empty() { root.to_path_buf() } else { folder };
        let mut below: Vec<String> = files::names_in(&folder).unwrap_or_default();
        // 0, 1, 2, ..., 10.
        below.sort_by_key(|name| (name.parse::<u64>().unwrap_or(u64::MAX), name.clone()));
        let below = below.iter().take(MOST).map(|name| folder.join(name));
        let mut folders: Vec<PathBuf> = std::iter::once(folder.clone()).chain(below).collect();
        if !name.is_empty() {
            // `sparse/0` before copies of it in `sparse` itself.
            folders.rotate_left(1);
        }
        for folder in folders {
            // The dataset's `sparse` is also a subfolder of its root.
            let is_new = |model: &ModelFolder| found.iter().all(|other| other.folder != model.folder);
            // A folder with photos of its own is another dataset.
            let is_here = |model: &ModelFolder| !name.is_empty() || model.folder == root || !has_photos(&model.folder);
            let model = ModelFolder::at(&folder, place).filter(|model| is_new(model) && is_here(model));
            found.extend(model);
        }
    }
    found
}

fn has_photos(folder: &Path) -> bool {
    let is_photo = |name: &String| photo::is_photo(name) || name.eq_ignore_ascii_case("images");
    files::names_in(folder).is_ok_and(|names| names.iter().any(is_photo))
}

/// The reconstruction that is used.
pub(super) struct Largest {
    pub(super) model: ModelFolder,
    pub(super) images: Vec<Image>,
    /// Reconstructions that have other photos, or cannot be read.
    pub(super) others: Vec<Other>,
}

/// Finds the reconstruction with the most photos of the dataset in `root`; `None` if there is none.
///
/// # Errors
/// If none can be read.
pub(super) fn largest(root: &Path) -> Result<Option<Largest>, IoError> {
    let mut all = models(root);
    if all.len() <= 1 {
        let Some(model) = all.pop() else { return Ok(None) };
        return Ok(Some(Largest { images: model.images()?, model, others: Vec::new() }));
    }
    let mut counted: Vec<_> = all.into_iter().map(|model| (model.count(), model)).collect();
    counted.sort_by_key(|(count, _)| std::cmp::Reverse(count.as_ref().ok().copied()));
    let mut taken: Option<(ModelFolder, Vec<Image>)> = None;
    let (mut others, mut failed) = (Vec::new(), None);
    for (count, model) in counted {
        let what = match (count, &taken) {
            (Ok(_), None) => match model.images() {
                Ok(images) => {
                    taken = Some((model, images));
                    continue;
                }
                Err(e) => Err(e),
            },
            // The same reconstruction again: before its photos were undistorted, or as text.
            (Ok(n), Some((taken, images))) if n == images.len() as u64 && model.place != taken.place => continue,
            (Ok(n), Some(_)) => Ok(format!("{n} photos")),
            (Err(e), _) => Err(e),
        };
        let what = what.unwrap_or_else(|e| {
            let text = format!("cannot be read: {e}");
            failed.get_or_insert(e);
            text
        });
        others.push(Other { folder: model.folder, what });
    }
    match (taken, failed) {
        (Some((model, images)), _) => Ok(Some(Largest { model, images, others })),
        (None, Some(e)) => Err(e),
        (None, None) => Ok(None),
    }
}
