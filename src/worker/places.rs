//! Where the window keeps what it makes: demo photos and trained scenes.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use crate::io::data_folder::data_folder;

/// The program's folders, all below one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Places {
    /// The folder that holds the others.
    pub data: PathBuf,
}

impl Places {
    /// Below the user's data folder; below the system's temporary folder where there is none.
    pub fn of_user() -> Self {
        Self { data: data_folder() }
    }

    /// Folder of the demo's photos. Carries the version, because another version may make others.
    pub fn demo(&self) -> PathBuf {
        self.data.join(format!("demo-{}", env!("CARGO_PKG_VERSION")))
    }

    /// Folder of the newest scene trained from the dataset at `root`, whether it exists or not.
    pub fn trained(&self, root: &Path) -> PathBuf {
        let exists = |n: &usize| self.run(root, *n).exists();
        self.run(root, (1..).take_while(exists).last().unwrap_or(1))
    }

    /// A folder for a new training of the dataset at `root`, next to those of earlier ones.
    pub fn fresh(&self, root: &Path) -> PathBuf {
        let exists = |n: &usize| self.run(root, *n).exists();
        self.run(root, 1 + (1..).take_while(exists).count())
    }

    /// Folder for a report of the splat at `path`, which has no folder of its own.
    pub fn report(&self, path: &Path) -> PathBuf {
        self.data.join("reports").join(Self::unique(path))
    }

    /// Folder of the `n`-th training, from 1.
    fn run(&self, root: &Path, n: usize) -> PathBuf {
        self.data.join("trained").join(Self::unique(root)).join(format!("run-{n}"))
    }

    /// A path's last name and a digest of all of it, so that two of one name do not share a folder.
    fn unique(root: &Path) -> String {
        let root = std::path::absolute(root).unwrap_or_else(|_| root.to_path_buf());
        let mut hasher = DefaultHasher::new();
        root.hash(&mut hasher);
        let name = root.file_name().map_or_else(|| "scene".into(), |n| n.to_string_lossy().into_owned());
        format!("{name}-{:08x}", hasher.finish() as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn datasets_of_one_name_do_not_share_a_folder() {
        let places = Places { data: "/data".into() };
        let (a, b) = (places.trained(Path::new("/one/fox")), places.trained(Path::new("/two/fox")));
        assert_ne!(a, b);
        assert_eq!(a, places.trained(Path::new("/one/fox")));
        assert!(a.to_string_lossy().contains("fox-"));
    }

    #[test]
    fn a_fresh_run_never_touches_an_earlier_one() {
        let folder = tempfile::tempdir().expect("folder");
        let places = Places { data: folder.path().into() };
        let root = Path::new("/one/fox");
        let first = places.trained(root);
        assert_eq!(places.fresh(root), first, "nothing is there yet");
        std::fs::create_dir_all(&first).expect("create");
        let second = places.fresh(root);
        assert_ne!(second, first);
        assert_eq!(places.trained(root), first);
        std::fs::create_dir_all(&second).expect("create");
        assert_eq!(places.trained(root), second, "the newest is shown");
    }
}
