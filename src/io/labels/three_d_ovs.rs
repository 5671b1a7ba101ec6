//! 3D-OVS's masks: `segmentations/classes.txt` with a class a line, and `segmentations/<NN>/<class>.png` where only 255
//! is foreground. `NN` is the index of the photo in the sorted list of the dataset's photos, from 0.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::pictures::{Pictures, png_stem};
use super::{entries, stem};
use crate::io::{IoError, files, llff, photo_list};
use crate::scene::Level;

const FOLDER: &str = "segmentations";
const LIST_FILE: &str = "classes.txt";

/// Finds the masks of the dataset in `root`, or in the folder `segmentations` itself; `None` if there are none.
pub(crate) fn find(root: &Path) -> Result<Option<Pictures>, IoError> {
    // A folder given as `.` has a name only as an absolute path.
    let whole = std::path::absolute(root).unwrap_or_else(|_| root.into());
    let (root, folder) = match (whole.parent(), whole.file_name()) {
        (Some(parent), Some(name)) if name == FOLDER => (parent, whole.clone()),
        _ => (root, root.join(FOLDER)),
    };
    let list = folder.join(LIST_FILE);
    if !list.is_file() {
        return Ok(None);
    }
    let text = files::read_text(&list)?;
    let classes: BTreeSet<&str> = text.lines().map(str::trim).filter(|l| !l.is_empty()).collect();
    let photos = llff::names(&root.join(photo_list::photo_folder(root, &list)?))?;
    let mut of = BTreeMap::new();
    for name in entries(&folder) {
        let Ok(index) = name.parse::<usize>() else { continue };
        let inner = folder.join(&name);
        let named = |file: &String| {
            let class = png_stem(file).filter(|c| classes.contains(c))?;
            Some((class.to_owned(), inner.join(file)))
        };
        let masks: Vec<_> = entries(&inner).iter().filter_map(named).collect();
        let Some(photo) = photos.get(index) else {
            let reason = format!("masks of photo {index}, counted from 0, but there are {} photos", photos.len());
            return Err(IoError::Syntax { path: inner, place: "its name".into(), reason });
        };
        if !masks.is_empty() {
            of.insert(stem(photo), masks);
        }
    }
    if of.is_empty() {
        let reason = "no image in the folders beside it is named after one of its classes".into();
        return Err(IoError::Syntax { path: list, place: format!("{} classes", classes.len()), reason });
    }
    Ok(Some(Pictures { of, least: u8::MAX, level: Some(Level::Object), prefix: None }))
}
