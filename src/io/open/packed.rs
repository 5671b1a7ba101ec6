//! Archives: a bundled splat is read directly, all others have to be unpacked first.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use zip::ZipArchive;

use crate::io::{IoError, OpenError, files, sog};

/// Endings of archives that are recognized by name, and the command that unpacks each.
const ARCHIVES: [(&str, &str); 8] = [
    (".tar.gz", "tar xf"),
    (".tgz", "tar xf"),
    (".tar", "tar xf"),
    (".tar.xz", "tar xf"),
    (".tar.bz2", "tar xf"),
    (".tar.zst", "tar xf"),
    (".7z", "7z x"),
    (".rar", "unrar x"),
];
/// File names that mark a data set in an archive.
const LISTS: [&str; 8] = [
    "transforms.json",
    "transforms_train.json",
    "images.bin",
    "images.txt",
    "poses_bounds.npy",
    "scene.json",
    "cfg_args",
    "point_cloud.ply",
];
/// Most files listed of an archive.
const MOST: usize = 100_000;

/// Refuses an archive without a bundled splat, with the command that unpacks it; `name` is in lowercase.
pub(super) fn refuse(path: &Path, name: &str, start: &[u8]) -> Result<(), OpenError> {
    if let Some((ending, command)) = ARCHIVES.iter().find(|(ending, _)| name.ends_with(ending)) {
        return Err(packed(path, format!("a {ending} archive"), command));
    }
    if !start.starts_with(b"PK\x03\x04") || name.ends_with(".sog") {
        return Ok(());
    }
    let file = BufReader::new(files::open(path)?);
    let listed = names(file).map_err(|reason| IoError::syntax(path, "the archive", reason))?;
    let end = |name: &String| name.rsplit('/').next().unwrap_or(name).to_lowercase();
    if listed.iter().any(|name| end(name) == sog::META_FILE) {
        return Ok(());
    }
    let known = listed.iter().find(|name| LISTS.contains(&end(name).as_str()));
    let with = known.map_or_else(String::new, |name| format!(", {name} among them"));
    Err(packed(path, format!("a zip archive of {} files{with}", listed.len()), "unzip"))
}

fn packed(path: &Path, what: String, command: &str) -> OpenError {
    OpenError::Packed { path: path.into(), what, command: format!("{command} '{}'", path.display()) }
}

/// Lists the names of an archive's files, without debris of systems.
fn names(file: BufReader<File>) -> Result<Vec<String>, String> {
    let zip = ZipArchive::new(file).map_err(|e| e.to_string())?;
    let is_file = |name: &String| !name.ends_with('/') && !name.split('/').any(files::is_debris);
    Ok(zip.file_names().take(MOST).filter_map(|name| Some(name.ok()?.to_string())).filter(is_file).collect())
}
