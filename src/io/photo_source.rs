//! Photos of another program's training: where its settings say, or beside it.

use std::path::{Path, PathBuf};

use super::posed;

/// Folders above a training in which a path of its settings may begin.
const ABOVE: usize = 6;
/// Folders above a training in which its photos may lie under their own name.
const BESIDE: usize = 4;

/// Photos of a training.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct PhotoSource {
    /// Path in its settings.
    pub(crate) stated: PathBuf,
    /// Path of the photos that are here.
    pub(crate) found: Option<PathBuf>,
    /// True if they were found elsewhere, by their folder's name.
    pub(crate) is_elsewhere: bool,
}

impl PhotoSource {
    /// Looks for the photos of a training in the folder `run`, whose settings name the path `stated`.
    pub(crate) fn find(stated: &Path, run: &Path) -> Self {
        let whole = std::path::absolute(run).unwrap_or_else(|_| run.into());
        let above: Vec<&Path> = whole.ancestors().collect();
        let written = above.iter().take(ABOVE).map(|a| a.join(stated)).find(|path| path.is_dir() || path.is_file());
        let is_elsewhere = written.is_none();
        let beside = || {
            let name = stated.file_name()?;
            let called = above.iter().take(BESIDE).map(|a| a.join(name)).filter(|path| *path != whole);
            let around = above.iter().take(BESIDE).filter(|a| a.file_name() == Some(name)).map(|a| a.to_path_buf());
            called.chain(around).find(|path| posed::are_in(path))
        };
        Self { stated: stated.into(), found: written.or_else(beside), is_elsewhere }
    }

    /// Returns a warning in words if the photos are not where the settings say.
    pub(crate) fn warning(&self) -> Option<String> {
        let stated = self.stated.display();
        match &self.found {
            None => {
                let name = self.stated.file_name().unwrap_or_default().to_string_lossy();
                Some(format!(
                    "its photos were in {stated}, which is not here; put that folder back, or beside the training as \
                     '{name}'"
                ))
            }
            Some(found) if self.is_elsewhere => {
                Some(format!("its photos were in {stated}, which is not here; those in {} are shown", found.display()))
            }
            Some(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn photos_are_found_where_the_settings_say_and_else_beside_by_their_name() {
        let place = tempfile::tempdir().expect("folder");
        let root = place.path().canonicalize().expect("there");
        let run = root.join("outputs/garden/run");
        let data = root.join("data/garden");
        fs::create_dir_all(&run).expect("made");
        fs::create_dir_all(&data).expect("made");
        let found = |stated: &str| PhotoSource::find(Path::new(stated), &run);
        assert_eq!(found("data/garden").found.as_ref(), Some(&data), "a path that began above");
        assert_eq!(found(&data.display().to_string()).found.as_ref(), Some(&data));
        assert_eq!(found("data/garden").warning(), None);
        let gone = found("/gone/garden");
        assert_eq!(gone.found, None);
        assert!(gone.warning().expect("told").contains("beside the training as 'garden'"));
        // The folder of that name is the training's own: not without photos in it.
        fs::write(root.join("outputs/garden/transforms.json"), "{}").expect("written");
        assert_eq!(found("/gone/garden").found, Some(root.join("outputs/garden")));
        let beside = root.join("outputs/plush");
        fs::create_dir(&beside).expect("made");
        assert_eq!(found("/gone/plush").found, None, "an empty folder holds no photos");
        fs::write(beside.join("transforms.json"), "{}").expect("written");
        let elsewhere = found("/gone/plush");
        assert_eq!(elsewhere.found.as_ref(), Some(&beside));
        assert!(elsewhere.warning().expect("told").contains("are shown"));
    }
}
