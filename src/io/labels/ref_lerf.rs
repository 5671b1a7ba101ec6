//! Ref-LERF's sentences and masks, as ReferSplat's code reads them. The real data set was never opened with this code.
//!
//! The list of a photo is `json/test_json/<photo>.json` or `json/train_json/<photo>.json`, with or without `json/`.
//! Each `object` has a `category`, a `segmentation` (the picture of its mask in `mask/` or `gt_mask/`, everything over
//! 0) and `sentence`s. Lists of all photos may also lie together in `json/`; then ReferSplat's own numbers say which
//! photos are tested.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::Value;

use super::pictures::Pictures;
use super::{entries, stem};
use crate::io::{IoError, files};
use crate::scene::{Level, text};

/// Folder of all lists, if test photos have none of their own.
const TOGETHER: &str = "json";
/// Folders of lists, those of test photos first.
const LISTS: [&str; 5] = ["json/test_json", "test_json", "json/train_json", "train_json", TOGETHER];
/// Folders of masks: of test photos, and of all.
const MASKS: [&str; 2] = ["mask", "gt_mask"];
/// Form of a list, for errors.
const FORM: &str = r#"{"object": [{"category": "cup", "segmentation": "cup.png", "sentence": ["the cup"]}]}"#;

/// Numbers of ReferSplat's test photos, by scene.
const TESTS: [(&str, &[u32]); 4] = [
    ("figurines", &[83, 97, 146, 179]),
    ("ramen", &[6, 24, 60, 65, 81, 119, 128]),
    ("teatime", &[2, 25, 43, 107, 129, 140]),
    ("waldo_kitchen", &[19, 35, 67, 105, 162]),
];

/// Objects of a photo that sentences refer to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ReferredPhoto {
    /// True if the data set tests with this photo.
    pub(crate) is_test: bool,
    pub(crate) objects: Vec<ReferredObject>,
}

/// An object of a photo and the sentences that refer to it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ReferredObject {
    /// Name of its region.
    pub(crate) name: String,
    pub(crate) sentences: Vec<String>,
    /// Picture of its mask; photos to train on may have none.
    pub(crate) mask: Option<PathBuf>,
}

#[derive(Deserialize)]
struct ListFile {
    object: Vec<ListedObject>,
}

#[derive(Deserialize)]
struct ListedObject {
    category: String,
    segmentation: String,
    sentence: Vec<String>,
}

/// Returns whether a folder has a folder of lists.
pub(crate) fn has_lists(scene: &Path) -> bool {
    LISTS.iter().any(|folder| scene.join(folder).is_dir())
}

/// Reads the lists of a scene, by the name of the photo without ending.
///
/// # Errors
/// If a list is malformed, or a mask of a test photo is missing.
pub(crate) fn photos(scene: &Path) -> Result<BTreeMap<String, ReferredPhoto>, IoError> {
    let mut all = BTreeMap::new();
    for (list, photo, is_test) in lists(scene) {
        let objects = read(scene, &list, is_test)?;
        all.entry(photo).or_insert(ReferredPhoto { is_test, objects });
    }
    Ok(all)
}

/// Finds the masks of the scene in `root`; `None` if there are none.
pub(crate) fn find(root: &Path) -> Result<Option<Pictures>, IoError> {
    let Some((first, ..)) = lists(root).into_iter().next() else { return Ok(None) };
    let has_masks = MASKS.iter().any(|folder| root.join(folder).is_dir());
    if !has_masks || !files::read_json::<Value>(&first)?["object"].is_array() {
        return Ok(None);
    }
    let mut of = BTreeMap::new();
    for (photo, referred) in photos(root)? {
        let masks: Vec<_> = referred.objects.into_iter().filter_map(|o| Some((o.name, o.mask?))).collect();
        if !masks.is_empty() {
            of.insert(photo, masks);
        }
    }
    Ok((!of.is_empty()).then_some(Pictures { of, least: 1, level: Some(Level::Object), prefix: None }))
}

/// Returns the lists of a scene, with the name of the photo and true for a test photo.
fn lists(scene: &Path) -> Vec<(PathBuf, String, bool)> {
    let name = files::folder_name(scene);
    let tests = TESTS.iter().find(|(scene, _)| *scene == name).map_or(&[][..], |known| known.1);
    let mut all = Vec::new();
    for folder in LISTS {
        for file in entries(&scene.join(folder)) {
            let Some(photo) = file.strip_suffix(".json") else { continue };
            let number = photo.rsplit('_').next().and_then(|number| number.parse::<u32>().ok());
            let is_known = || folder == TOGETHER && number.is_some_and(|number| tests.contains(&number));
            let is_test = folder.ends_with("test_json") || is_known();
            all.push((scene.join(folder).join(&file), photo.to_owned(), is_test));
        }
    }
    all
}

fn read(scene: &Path, list: &Path, is_test: bool) -> Result<Vec<ReferredObject>, IoError> {
    let parsed: ListFile = files::read_json(list).map_err(|e| match e {
        IoError::Syntax { path, place, reason } => {
            IoError::Syntax { path, place, reason: format!("{reason}; a list looks like {FORM}") }
        }
        other => other,
    })?;
    let mut objects: Vec<ReferredObject> = Vec::new();
    for (i, listed) in parsed.object.into_iter().enumerate() {
        let picture = files::relative(scene, &listed.segmentation, list)?;
        let mask = MASKS.iter().map(|folder| scene.join(folder).join(&picture)).find(|path| path.is_file());
        if mask.is_none() && is_test {
            let folders = MASKS.map(|folder| scene.join(folder).display().to_string()).join(" or ");
            let reason = format!("there is no '{picture}' in {folders}; copy the masks of the data set there");
            return Err(IoError::syntax(list, format!("object[{i}].segmentation"), reason));
        }
        if let Some(same) = objects.iter().position(|o| mask.is_some() && o.mask == mask) {
            objects[same].sentences.extend(listed.sentence);
            continue;
        }
        // Another thing of the same category.
        let is_taken = objects.iter().any(|o| o.name == text::name(&listed.category));
        let name = if is_taken { stem(&picture) } else { listed.category };
        objects.push(ReferredObject { name: text::name(&name), sentences: listed.sentence, mask });
    }
    Ok(objects)
}
