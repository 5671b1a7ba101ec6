//! Location of the user's data.

use std::ffi::OsString;
use std::path::PathBuf;

/// Returns the folder for the program's data: below the user's data folder, or below the system's temporary folder if
/// there is none.
pub(crate) fn data_folder() -> PathBuf {
    base(|name| std::env::var_os(name)).unwrap_or_else(std::env::temp_dir).join("fmlgs")
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
        let relative = |name: &str| (name == "XDG_DATA_HOME").then(|| OsString::from("relative"));
        assert_eq!(base(relative), None);
    }
}
