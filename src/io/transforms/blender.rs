//! Blender's synthetic scenes: a list of photos for each of `train`, `test` and `val`.

use std::path::Path;

use super::File;
use crate::io::photo_list::{ListedPhoto, photos};
use crate::io::{IoError, files, lenses, points_ply};
use crate::scene::{Dataset, Photo};

/// Background of Blender's synthetic scenes, which have none; the literature shows them on white.
const WHITE: [f32; 3] = [1.0; 3];
/// Lists of held-out photos; the first that has photos is used.
const HELD_OUT: [&str; 2] = ["transforms_test.json", "transforms_val.json"];

/// Reads a Blender dataset: training photos of `transforms_train.json`; photos of `transforms_test.json` (or else of
/// `transforms_val.json`) are marked as test.
pub fn read_blender(root: &Path) -> Result<Dataset, IoError> {
    let mut warnings = Vec::new();
    let mut all = listed(root, "transforms_train.json", false, &mut warnings)?;
    let mut is_held_out = false;
    for name in HELD_OUT.iter().filter(|name| root.join(name).is_file()) {
        if is_held_out {
            warnings.push(match File::read(&root.join(name)) {
                Ok(list) => {
                    let n = list.frames.len();
                    format!("{n} photos of {name} are left out; those of transforms_test.json are held out")
                }
                Err(e) => format!("{name} is left out: {e}"),
            });
            continue;
        }
        match listed(root, name, true, &mut warnings) {
            Ok(photos) => {
                all.extend(photos);
                is_held_out = true;
            }
            Err(IoError::NoPhotos { listed, first, .. }) => {
                warnings.push(format!("{name} lists {listed} photos and none of them exists (first: {first})"));
            }
            Err(e) => return Err(e),
        }
    }
    all.sort_by(|a, b| a.name.cmp(&b.name));
    if let Some(pair) = all.windows(2).find(|w| w[0].name == w[1].name) {
        return Err(IoError::Duplicate { path: root.into(), photo: pair[0].name.clone() });
    }
    let points = points_ply::beside(root).map(|path| points_ply::read(&path)).transpose()?.unwrap_or_default();
    Ok(Dataset {
        name: files::data_set_name(root),
        root: root.into(),
        format: "Blender synthetic".into(),
        photos: all,
        points,
        background: Some(WHITE),
        warnings,
        ..Dataset::default()
    })
}

/// Reads the photos of one list.
fn listed(root: &Path, name: &str, test_split: bool, warnings: &mut Vec<String>) -> Result<Vec<Photo>, IoError> {
    let file = root.join(name);
    let parsed = File::read(&file)?;
    let mut listed = Vec::with_capacity(parsed.frames.len());
    for frame in &parsed.frames {
        let l = frame.listed(&parsed.lens, &file)?;
        listed.push(l.map(|l| ListedPhoto { test_split, background: Some(WHITE), ..l }));
    }
    let mut told = Vec::new();
    let listed = lenses::readable(listed, &file, &mut told)?;
    let photos = photos(listed, root, &file, &mut told)?;
    warnings.extend(told.iter().map(|text| format!("{name}: {text}")));
    Ok(photos)
}
