//! Photos that lie among those of a data set but are missing from its list.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;

use super::{fold, some_of};
use crate::io::{files, photo};
use crate::scene::Photo;

/// Ends of names of pictures that accompany a photo: `0001_depth.png`, `0001.mask.png`.
const COMPANIONS: [&str; 9] =
    ["depth", "mask", "masks", "normal", "normals", "label", "alpha", "confidence", "segmentation"];

/// Returns a warning that counts the photos beside `photos` that are not in the list of these names, if there are any.
pub(crate) fn unlisted<'a>(photos: &[Photo], listed: impl Iterator<Item = &'a str>, root: &Path) -> Option<String> {
    let mut folders: BTreeMap<&Path, HashSet<&str>> = BTreeMap::new();
    for photo in photos {
        folders.entry(photo.path.parent()?).or_default().insert(photo.path.file_name()?.to_str()?);
    }
    // Listed photos that were left out already have a warning; a list may name photos without their ending.
    let key = |name: &str| fold(photo::stem(name).unwrap_or(name));
    let known: HashSet<String> = listed.map(|name| key(name.rsplit(['/', '\\']).next().unwrap_or(name))).collect();
    let mut rest = Vec::new();
    for (folder, used) in folders {
        for name in files::names_in(folder).unwrap_or_default() {
            let Some(stem) = photo::stem(&name) else { continue };
            let companion =
                |end: &str| stem.to_lowercase().strip_suffix(end).is_some_and(|s| s.ends_with(['_', '.', '-']));
            let is_listed = used.contains(&*name);
            if !is_listed && (used.contains(stem) || is_helper(&name) || COMPANIONS.into_iter().any(companion)) {
                continue;
            }
            if !is_listed && !known.contains(&key(&name)) {
                let path = folder.join(name);
                rest.push(path.strip_prefix(root).unwrap_or(&path).display().to_string());
            }
        }
    }
    let (n, all) = (rest.len(), photos.len() + rest.len());
    (n > 0).then(|| format!("{n} of {all} photos have no pose and were left out: {}", some_of(&rest, ", ")))
}

/// Returns whether this is one of SPIn-NeRF's pictures that are neither photo nor mask.
pub(crate) fn is_helper(name: &str) -> bool {
    name.contains("cutout") || name.contains("pseudo")
}
