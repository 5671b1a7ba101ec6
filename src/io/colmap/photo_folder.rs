//! Location of a reconstruction's photos, found by their names: beside it, in the folders that COLMAP and its users
//! fill, or close to them.

use std::path::{Path, PathBuf};

use super::Image;
use crate::io::photo_list::{self, Lookup, PhotoFinder, reduction};
use crate::io::{IoError, files};

/// Photo names looked for in each folder.
const SAMPLE: usize = 32;
/// Most folders searched, and their greatest depth.
const MOST: usize = 500;
const DEEPEST: usize = 3;
/// Levels above a reconstruction, opened on its own, at which its dataset is searched.
const ABOVE: usize = 3;
/// Subfolders of a dataset that hold no photos; a user who opens one means the dataset around it.
const INNER: [&str; 7] = ["sparse", "colmap", "distorted", "dense", "undistorted", "aligned", "sfm"];

/// A dataset's folder, and the photos' folder relative to it.
pub(super) struct PhotoFolder {
    pub(super) root: PathBuf,
    pub(super) below: String,
}

/// Finds the photos' folder of the reconstruction in `model`, which belongs to the dataset in `root` or lies there.
/// `source` is the file that lists the photos.
pub(super) fn find(root: &Path, model: &Path, images: &[Image], source: &Path) -> Result<PhotoFolder, IoError> {
    let names: Vec<&str> = sample(images);
    let usual = best(root, &near(root, model), &names)?;
    if let Some(below) = usual.map_or_else(|| best(root, &anywhere(root), &names), |below| Ok(Some(below)))? {
        return Ok(PhotoFolder { root: root.into(), below });
    }
    let whole = std::path::absolute(root).unwrap_or_else(|_| root.into());
    let is_inner = whole.file_name().is_some_and(|name| INNER.iter().any(|inner| name.eq_ignore_ascii_case(inner)));
    if is_inner || model == root {
        for above in whole.ancestors().skip(1).take(ABOVE) {
            let inside = model.strip_prefix(root).map_or_else(|_| model.into(), |rest| whole.join(rest));
            if let Some(below) = best(above, &near(above, &inside), &names)? {
                return Ok(PhotoFolder { root: above.into(), below });
            }
        }
    }
    // No photos are there: the error names the expected folder.
    Ok(PhotoFolder { root: root.into(), below: photo_list::photo_folder(root, source)? })
}

fn sample(images: &[Image]) -> Vec<&str> {
    let step = images.len().div_ceil(SAMPLE).max(1);
    images.iter().step_by(step).map(|image| image.name.as_str()).collect()
}

/// Returns the first of the folders with the most of the named files; `None` if there are none.
fn best(root: &Path, folders: &[String], names: &[&str]) -> Result<Option<String>, IoError> {
    let finder = PhotoFinder::new(root)?;
    let mut best: Option<(usize, &String)> = None;
    for folder in folders {
        let there = names.iter().filter(|name| matches!(finder.find(folder, name), Lookup::Found(_))).count();
        if there > best.map_or(0, |(most, _)| most) {
            best = Some((there, folder));
        }
        if there == names.len() {
            break;
        }
    }
    Ok(best.map(|(_, folder)| folder.clone()))
}

/// Lists the usual folders of photos that exist, from the reconstruction up to the dataset's folder.
fn near(root: &Path, model: &Path) -> Vec<String> {
    let inside = model.strip_prefix(root).unwrap_or(Path::new(""));
    // Distorted photos, as of the reconstruction, lie apart from photos undistorted later.
    let usual = match inside.components().any(|part| part.as_os_str().eq_ignore_ascii_case("distorted")) {
        true => ["input", "images"],
        false => ["images", "input"],
    };
    let mut all = Vec::new();
    for at in inside.ancestors() {
        let folder = root.join(at);
        let names: Vec<String> = files::names_in(&folder).unwrap_or_default();
        let mut reduced: Vec<(u32, &String)> = names.iter().filter_map(|n| Some((reduction(n)?, n))).collect();
        reduced.sort();
        let mut add = |name: &str| {
            let path = at.join(name);
            if let Some(path) = path.to_str().filter(|_| root.join(&path).is_dir()) {
                all.push(path.replace('\\', "/").trim_end_matches('/').to_owned());
            }
        };
        for usual in usual {
            let alike = names.iter().filter(|name| name.eq_ignore_ascii_case(usual));
            alike.for_each(|name| add(name));
            if usual == "images" {
                reduced.iter().for_each(|(_, name)| add(name));
            }
        }
        add("");
    }
    all
}

/// Lists folders in a folder, the shallowest first.
fn anywhere(root: &Path) -> Vec<String> {
    let mut all: Vec<String> = vec![String::new()];
    let mut next = 0;
    while let Some(at) = all.get(next).cloned() {
        next += 1;
        let depth = if at.is_empty() { 0 } else { at.matches('/').count() + 1 };
        if depth == DEEPEST {
            continue;
        }
        let folder = root.join(&at);
        for name in files::names_in(&folder).unwrap_or_default() {
            if all.len() < MOST && folder.join(&name).is_dir() {
                all.push(if at.is_empty() { name } else { format!("{at}/{name}") });
            }
        }
    }
    all
}
