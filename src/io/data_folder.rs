//! Location of the user's data, and of what can be fetched again.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Returns the folder for the program's data: below the user's data folder, or below the system's temporary folder if
/// there is none.
pub(crate) fn data_folder() -> PathBuf {
    base(|name| std::env::var_os(name)).unwrap_or_else(std::env::temp_dir).join("fmlgs")
}

/// Returns the folder for what can be fetched again: below the user's cache folder, or else beside the `data`.
pub(crate) fn cache_folder(data: &Path) -> PathBuf {
    cache_base(|name| std::env::var_os(name)).map_or_else(|| data.join("cache"), |base| base.join("fmlgs"))
}

fn cache_base(var: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let absolute = |name: &str| var(name).map(PathBuf::from).filter(|p| p.is_absolute());
    absolute("XDG_CACHE_HOME").or_else(|| absolute("LOCALAPPDATA")).or_else(|| {
        let home = absolute("HOME")?;
        Some(if cfg!(target_os = "macos") { home.join("Library").join("Caches") } else { home.join(".cache") })
    })
}

fn base(var: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let absolute = |name: &str| var(name).map(PathBuf::from).filter(|p| p.is_absolute());
    absolute("XDG_DATA_HOME").or_else(|| absolute("LOCALAPPDATA")).or_else(|| {
        let home = absolute("HOME")?;
        let mac = home.join("Library").join("Application Support");
        Some(if cfg!(target_os = "macos") { mac } else { home.join(".local").join("share") })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_data_folder_follows_the_environment() {
        let home = |name: &str| (name == "HOME").then(|| OsString::from("/home/someone"));
        assert!(base(home).expect("a home").starts_with("/home/someone"));
        assert!(cache_base(home).expect("a home").starts_with("/home/someone"));
        assert_ne!(cache_base(home), base(home));
        let relative = |name: &str| (name == "XDG_DATA_HOME").then(|| OsString::from("relative"));
        assert_eq!(base(relative), None);
    }
}
