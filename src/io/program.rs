//! Programs of the system, looked up on the PATH.

use std::ffi::OsStr;
use std::path::PathBuf;

/// Path of a program on a PATH; entries that are not absolute are not believed.
pub(crate) fn on_path(path: &OsStr, name: &str) -> Option<PathBuf> {
    let names = if cfg!(windows) { vec![format!("{name}.exe"), format!("{name}.bat")] } else { vec![name.into()] };
    let places = std::env::split_paths(path).filter(|p| p.is_absolute());
    places.flat_map(|p| names.iter().map(move |n| p.join(n)).collect::<Vec<_>>()).find(|p| p.is_file())
}
