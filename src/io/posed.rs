//! Folders of posed photos: the usual layouts, for lookups beside other files.

use std::path::Path;

use super::{IoError, colmap, files, llff, transforms};
use crate::scene::Dataset;

/// Reads the posed photos of a folder, or of a list; `None` if it holds none of the usual layouts.
pub(super) fn read(root: &Path) -> Option<Result<Dataset, IoError>> {
    let list = if root.is_file() { Some(root.to_path_buf()) } else { files::called(root, transforms::USUAL) };
    Some(match list {
        Some(list) => transforms::read(&list),
        None if root.join("transforms_train.json").is_file() => transforms::read_blender(root),
        None if colmap::is_colmap(root) => colmap::read(root),
        None if root.join(llff::POSES_FILE).is_file() => llff::read(root),
        None => return None,
    })
}

/// Returns whether a folder holds posed photos in one of the usual layouts.
pub(super) fn are_in(root: &Path) -> bool {
    let lists = [transforms::USUAL, "transforms_train.json", llff::POSES_FILE];
    root.is_dir() && (lists.iter().any(|list| root.join(list).is_file()) || colmap::is_colmap(root))
}
