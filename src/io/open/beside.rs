//! Poses beside the opened folder: a list of another name, or the data set that a folder of photos belongs to.

use std::fs;
use std::path::{Path, PathBuf};

use crate::io::{IoError, files, posed, transforms};
use crate::scene::Dataset;

/// Reads the data set of the only `transforms*.json` in a folder without one of the usual name.
///
/// # Errors
/// If there are several, or the only one cannot be read.
pub(super) fn other_list(folder: &Path) -> Result<Option<Dataset>, IoError> {
    let is_list = |name: &String| {
        let name = name.to_lowercase();
        name.ends_with(".json") && (name.starts_with("transforms") || name == "transform.json")
    };
    let lists: Vec<String> = files::names_in(folder).unwrap_or_default().into_iter().filter(is_list).collect();
    match lists.as_slice() {
        [] => Ok(None),
        [one] => transforms::read(&folder.join(one)).map(Some),
        several => Err(IoError::syntax(
            folder,
            several.join(" and "),
            "each may list photos with poses; open the file that is meant",
        )),
    }
}

/// Reads the data set beside or above a folder of photos, if its photos lie in that folder.
///
/// # Errors
/// A sentence about a data set there that cannot be read.
pub(super) fn of_photos(folder: &Path) -> Result<Option<Dataset>, String> {
    let Ok(real) = fs::canonicalize(folder) else { return Ok(None) };
    let mut broken = None;
    // By its own name first: poses lie beside the link to a folder of photos, not beside its target.
    let named = std::path::absolute(folder).unwrap_or_else(|_| real.clone());
    let mut above: Vec<PathBuf> = [&named, &real].into_iter().filter_map(|p| Some(p.parent()?.to_path_buf())).collect();
    above.dedup();
    for root in above {
        let mut dataset = match posed::read(&root) {
            None => continue,
            Some(Ok(dataset)) => dataset,
            Some(Err(e)) => {
                broken.get_or_insert(format!("{} holds poses that cannot be read: {e}", root.display()));
                continue;
            }
        };
        let is_here = |path: &Path| fs::canonicalize(path).is_ok_and(|path| path.starts_with(&real));
        if dataset.photos.iter().any(|photo| is_here(&photo.path)) {
            let text = format!("the poses of the photos in {} are those of {}", folder.display(), root.display());
            dataset.warnings.insert(0, text);
            return Ok(Some(dataset));
        }
    }
    broken.map_or(Ok(None), Err)
}
