//! LERF-Mask's masks: `test_mask/<view>/<prompt>.png`, foreground over 128. A view is named like
//! its photo, or is the number in `test_<number>`.

use std::collections::BTreeMap;
use std::path::Path;

use super::entries;
use super::pictures::{Pictures, png_stem};
use crate::io::IoError;

const FOLDER: &str = "test_mask";

/// Finds the masks of the dataset in `root`, or in the folder `test_mask` itself; `None` if there are none.
pub(crate) fn find(root: &Path) -> Result<Option<Pictures>, IoError> {
    let own = root.file_name().is_some_and(|n| n == FOLDER);
    let folder = if own { root.to_owned() } else { root.join(FOLDER) };
    let mut of = BTreeMap::new();
    for view in entries(&folder) {
        let inner = folder.join(&view);
        let masks: Vec<_> =
            entries(&inner).iter().filter_map(|n| Some((png_stem(n)?.to_owned(), inner.join(n)))).collect();
        if !masks.is_empty() {
            of.insert(view, masks);
        }
    }
    Ok((!of.is_empty()).then_some(Pictures { of, least: 129, level: None, prefix: Some("test_") }))
}
