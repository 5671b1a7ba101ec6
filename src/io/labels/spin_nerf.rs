//! SPIn-NeRF's masks: `images_<factor>/label/*.png`, named like the photos, of one object; every value over 0 is the
//! object. Helper pictures (`cutout`, `pseudo`) are skipped.

use std::collections::BTreeMap;
use std::path::Path;

use super::entries;
use super::pictures::{Pictures, png_stem};
use crate::io::IoError;
use crate::io::photo_list::is_helper;
use crate::scene::Level;

/// Finds the masks of the dataset in `root`, or in the folder `label` itself. Of several, the masks of the least
/// reduced photos are used. `None` if there are none.
pub(crate) fn find(root: &Path) -> Result<Option<Pictures>, IoError> {
    let own = root.file_name().is_some_and(|n| n == "label").then(|| (1, root.to_owned()));
    let factor = |name: &str| -> Option<u32> {
        let rest = name.strip_prefix("images")?;
        if rest.is_empty() { Some(1) } else { rest.strip_prefix('_')?.parse().ok() }
    };
    let below = entries(root).into_iter().filter_map(|n| Some((factor(&n)?, root.join(n).join("label"))));
    let mut folders: Vec<_> = own.into_iter().chain(below).collect();
    folders.sort();
    for (_, folder) in folders {
        let mut of = BTreeMap::new();
        for name in entries(&folder).into_iter().filter(|n| !is_helper(n)) {
            if let Some(stem) = png_stem(&name) {
                of.insert(stem.to_owned(), vec![(String::new(), folder.join(&name))]);
            }
        }
        if !of.is_empty() {
            return Ok(Some(Pictures { of, least: 1, level: Some(Level::Object), prefix: None }));
        }
    }
    Ok(None)
}
