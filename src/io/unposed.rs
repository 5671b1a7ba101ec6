//! Photos whose camera poses nobody knows yet.

use std::path::{Path, PathBuf};

/// Endings of photos.
const ENDINGS: [&str; 4] = ["jpg", "jpeg", "png", "webp"];
/// Where they may lie in a folder.
const FOLDERS: [&str; 3] = [".", "images", "input"];
/// From how many on a folder of pictures is taken for photos of a scene.
const FEWEST: usize = 2;

/// A folder of photos without camera poses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unposed {
    /// The folder that was opened.
    pub folder: PathBuf,
    /// The folder in which the photos lie, the same or one below.
    pub images: PathBuf,
    /// Names of the photos in it, in order.
    pub photos: Vec<String>,
}

/// The photos in `folder`, if there are any.
pub(super) fn find(folder: &Path) -> Option<Unposed> {
    FOLDERS.iter().find_map(|below| {
        let images = if *below == "." { folder.to_path_buf() } else { folder.join(below) };
        let entries = std::fs::read_dir(&images).ok()?.flatten();
        let is_photo = |name: &str| {
            let ending = Path::new(name).extension().map(|e| e.to_string_lossy().to_lowercase());
            !name.starts_with('.') && ending.is_some_and(|e| ENDINGS.contains(&e.as_str()))
        };
        let names = entries.filter(|e| e.path().is_file()).filter_map(|e| e.file_name().into_string().ok());
        let mut photos: Vec<String> = names.filter(|name| is_photo(name)).collect();
        photos.sort();
        (photos.len() >= FEWEST).then(|| Unposed { folder: folder.into(), images, photos })
    })
}
