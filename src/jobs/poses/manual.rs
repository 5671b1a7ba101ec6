//! Commands for finding poses by hand, for people without any maker.

use std::path::Path;

use super::{IMAGES, SPARSE, colmap};
use crate::io::unposed::Unposed;

/// Returns the commands for finding the poses by hand, and for opening the result.
pub(crate) fn commands(photos: &Unposed) -> Vec<String> {
    let out = if photos.images == photos.folder {
        let name = photos.folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        photos.folder.with_file_name(format!("{name}-posed"))
    } else {
        photos.folder.clone()
    };
    let quoted = |text: &str| {
        let plain = |c: char| c.is_alphanumeric() || "-_./,:+".contains(c);
        if !text.is_empty() && text.chars().all(plain) {
            text.to_owned()
        } else {
            format!("'{}'", text.replace('\'', "'\\''"))
        }
    };
    let at = |path: &Path| quoted(&path.to_string_lossy());
    let mut lines = vec![format!("mkdir -p {}", at(&out.join(SPARSE)))];
    if out.join(IMAGES) != photos.images {
        lines.push(format!("cp -r {} {}", at(&photos.images), at(&out.join(IMAGES))));
    }
    let in_shell = |words: &Vec<String>| words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ");
    lines.extend(colmap::by_hand(&out).iter().map(in_shell));
    lines.push(format!("fmlgs train {}", at(&out)));
    lines
}
