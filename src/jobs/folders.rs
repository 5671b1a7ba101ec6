//! Default places of the program's results: demo photos, trained scenes, reports.

use std::fs;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::io::data_folder::{cache_folder, data_folder};
use crate::io::scene_files::{SCENE_FILE, is_scene};
use crate::io::{IoError, atomic, files};

/// Name of a file beside the training runs of a data set; it names the run that was used last.
const USED: &str = "used-last";
/// Beginning of the name of a training run's folder, before its number.
const RUN: &str = "run-";

/// The program's folders, all below one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Folders {
    /// The folder that holds the others.
    pub data: PathBuf,
}

impl Folders {
    /// Folders below the user's data folder; below the system's temporary folder if there is none.
    pub(crate) fn of_user() -> Self {
        Self { data: data_folder() }
    }

    /// Folder of the demo's photos. Carries the version, because another version may make others.
    pub(crate) fn demo(&self) -> PathBuf {
        self.data.join(format!("demo-{}", env!("CARGO_PKG_VERSION")))
    }

    /// Folder of the trained demo that ships with the program and has this digest.
    pub(crate) fn shipped_demo(&self, digest: &str) -> PathBuf {
        self.data.join(format!("demo-{}-trained-{digest}", env!("CARGO_PKG_VERSION")))
    }

    /// Folder of the scene trained from the dataset at `root` that was used last; it need not exist.
    pub(crate) fn trained(&self, root: &Path) -> PathBuf {
        let runs = self.trainings(root);
        // If none is noted, the one that was written last; of two with one time the newer.
        let noted = runs.first().and_then(|run| fs::read_to_string(run.with_file_name(USED)).ok());
        let used = runs.iter().find(|run| noted.as_deref().is_some_and(|name| run.ends_with(name.trim())));
        let written = |run: &&PathBuf| fs::metadata(run.join(SCENE_FILE)).and_then(|m| m.modified()).ok();
        let used = used.filter(|run| is_scene(run)).or_else(|| runs.iter().max_by_key(written));
        used.cloned().unwrap_or_else(|| self.fresh(root))
    }

    /// Folders of all training runs of the dataset at `root`, oldest first.
    pub(crate) fn trainings(&self, root: &Path) -> Vec<PathBuf> {
        let mut all: Vec<_> = self.scenes_of(root).into_iter().filter_map(|run| Some((number(&run)?, run))).collect();
        all.sort();
        all.into_iter().map(|(_, run)| run).collect()
    }

    /// Folders of the scenes that edits and the like made of training runs of the dataset at `root`.
    pub(crate) fn derived(&self, root: &Path) -> Vec<PathBuf> {
        let mut all = self.scenes_of(root);
        all.retain(|scene| number(scene).is_none() && is_scene(scene));
        all.sort();
        all
    }

    fn scenes_of(&self, root: &Path) -> Vec<PathBuf> {
        let all = fs::read_dir(self.all_of(root)).into_iter().flatten().flatten();
        all.map(|entry| entry.path()).filter(|path| path.is_dir() && !is_hidden(path)).collect()
    }

    /// Returns whether a folder is that of a training run.
    pub(crate) fn is_training(&self, run: &Path) -> bool {
        number(run).is_some() && self.keeps(run)
    }

    /// Returns whether a folder is that of a training run, or of a scene made of one.
    pub(crate) fn keeps(&self, scene: &Path) -> bool {
        scene.parent().and_then(Path::parent) == Some(self.data.join("trained").as_path())
    }

    /// Name of the photos at `root` for display.
    pub(crate) fn name_of_photos(&self, root: &Path) -> String {
        let (root, data) = (files::real(root), files::real(&self.data));
        let within = root.strip_prefix(data).ok().and_then(|within| within.components().next());
        match within.is_some_and(|folder| folder.as_os_str().to_string_lossy().starts_with("demo-")) {
            true => "Demo photos".into(),
            false => files::data_set_name(&root),
        }
    }

    /// Notes that a training run is in use; ignores any other folder.
    ///
    /// # Errors
    /// If the note cannot be written.
    pub(crate) fn note_use(&self, run: &Path) -> Result<(), IoError> {
        let Some(name) = run.file_name().filter(|_| self.is_training(run) && is_scene(run)) else { return Ok(()) };
        let path = run.with_file_name(USED);
        let name = name.to_string_lossy();
        if fs::read_to_string(&path).is_ok_and(|noted| noted == name) {
            return Ok(());
        }
        atomic::write(&path, |w| w.write_all(name.as_bytes()))
    }

    /// Returns a folder for a new training run of the dataset at `root`, next to the earlier ones.
    pub(crate) fn fresh(&self, root: &Path) -> PathBuf {
        let last = self.trainings(root).last().and_then(|run| number(run)).unwrap_or(0);
        self.all_of(root).join(format!("{RUN}{}", last + 1))
    }

    /// Folder for a report of the splat at `path`, which has no folder of its own.
    pub(crate) fn report(&self, path: &Path) -> PathBuf {
        unique(&self.data.join("reports"), path)
    }

    /// Folder for local results of a scene that another computer serves at `host`.
    pub(crate) fn of_remote(&self, host: &str) -> PathBuf {
        let name: String = host.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
        self.data.join("remote").join(name)
    }

    /// Folder for what can be fetched again.
    pub(crate) fn cache(&self) -> PathBuf {
        cache_folder(&self.data)
    }

    /// Folder for the camera poses of the photos at `root`.
    pub(crate) fn poses(&self, root: &Path) -> PathBuf {
        unique(&self.data.join("poses"), root)
    }

    /// File of the small picture of the scene at `path`.
    pub(crate) fn picture(&self, path: &Path) -> PathBuf {
        unique(&self.data.join("pictures"), path).with_added_extension("png")
    }

    /// Folder of all training runs of the dataset at `root`.
    fn all_of(&self, root: &Path) -> PathBuf {
        unique(&self.data.join("trained"), root)
    }
}

/// Number of a training run, by the name of its folder.
fn number(run: &Path) -> Option<usize> {
    let name = run.file_name()?.to_str()?;
    let number = name.strip_prefix(RUN)?.parse().ok()?;
    (name == format!("{RUN}{number}")).then_some(number)
}

fn is_hidden(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'))
}

/// Returns the folder in `parent` that belongs to `path`: named by its last name and a digest of all of it, so that two
/// paths with one name do not share it, and two paths to one place do.
fn unique(parent: &Path, path: &Path) -> PathBuf {
    let typed = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let named = |path: &Path| {
        let name = last_name(path);
        let digest = Sha256::digest(path.as_os_str().as_encoded_bytes());
        parent.join(format!("{name}-{}", files::hex(&digest[..8])))
    };
    // Earlier versions named it by the path as it was typed.
    let now = files::renamed(named(&files::real(&typed)), named(&typed));
    files::renamed(now, parent.join(first_name(&last_name(&typed), &typed)))
}

fn last_name(path: &Path) -> String {
    path.file_name().map_or_else(|| "scene".into(), |n| n.to_string_lossy().into_owned())
}

/// Returns the first version's name of the folder, by a digest that the standard library does not promise to keep.
fn first_name(name: &str, path: &Path) -> String {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    path.hash(&mut hasher);
    format!("{name}-{:08x}", hasher.finish() as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn datasets_of_one_name_do_not_share_a_folder() {
        let places = Folders { data: "/data".into() };
        let (a, b) = (places.trained(Path::new("/one/fox")), places.trained(Path::new("/two/fox")));
        assert_ne!(a, b);
        assert_eq!(a, places.trained(Path::new("/one/fox")));
        assert!(a.to_string_lossy().contains("fox-"));
    }

    #[cfg(unix)]
    #[test]
    fn one_place_has_one_folder_by_whichever_path() {
        let folder = tempfile::tempdir().expect("folder");
        let folders = Folders { data: folder.path().join("data") };
        let (photos, link) = (folder.path().join("fox"), folder.path().join("link"));
        fs::create_dir(&photos).expect("created");
        std::os::unix::fs::symlink(&photos, &link).expect("linked");
        let own = folders.fresh(&photos);
        assert_eq!(own, folders.fresh(&folder.path().join("fox/../fox")), "as scenes refer to it");
        assert_eq!(own, folders.fresh(&link));
        let other = folder.path().join("other/fox");
        fs::create_dir_all(&other).expect("created");
        assert_ne!(own, folders.fresh(&other), "the control: another place of this name");
        // What an earlier version named by the link is found.
        let typed = Sha256::digest(link.as_os_str().as_encoded_bytes());
        let old = folders.data.join("trained").join(format!("link-{}", files::hex(&typed[..8]))).join("run-1");
        fs::create_dir_all(old).expect("created");
        assert_eq!(folders.trainings(&link), std::slice::from_ref(&own));
        assert_eq!(folders.trainings(&photos), [own]);
    }

    #[test]
    fn a_fresh_run_never_touches_an_earlier_one() {
        let folder = tempfile::tempdir().expect("folder");
        let places = Folders { data: folder.path().into() };
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

    #[test]
    fn the_training_that_was_used_last_is_shown_not_the_highest_number() {
        let folder = tempfile::tempdir().expect("folder");
        let folders = Folders { data: folder.path().into() };
        let root = Path::new("/one/fox");
        let runs: Vec<PathBuf> = (0..3)
            .map(|_| {
                let run = folders.fresh(root);
                fs::create_dir_all(&run).expect("created");
                fs::write(run.join(SCENE_FILE), "{}").expect("written");
                run
            })
            .collect();
        assert_eq!((folders.trainings(root), folders.trained(root)), (runs.clone(), runs[2].clone()));
        folders.note_use(&runs[0]).expect("noted");
        assert_eq!(folders.trained(root), runs[0]);
        folders.note_use(&folder.path().join("elsewhere/run-2")).expect("none of them");
        assert_eq!(folders.trained(root), runs[0], "the control");
        fs::remove_file(runs[0].join(SCENE_FILE)).expect("removed");
        assert_eq!(folders.trained(root), runs[2], "what is no scene any more is not shown");
        // As earlier versions left it: no note, and the first was written last.
        fs::remove_file(runs[0].with_file_name(USED)).expect("removed");
        let later = std::time::SystemTime::now() + std::time::Duration::from_secs(5);
        fs::File::options()
            .write(true)
            .open(runs[1].join(SCENE_FILE))
            .and_then(|f| f.set_modified(later))
            .expect("set");
        assert_eq!(folders.trained(root), runs[1]);
    }

    #[test]
    fn runs_with_a_gap_are_all_there_in_order_and_no_number_is_used_twice() {
        let folder = tempfile::tempdir().expect("folder");
        let folders = Folders { data: folder.path().into() };
        let root = Path::new("/one/fox");
        let all = folders.fresh(root).parent().expect("a parent").to_path_buf();
        for name in ["run-2", "run-10", "run-10-edited", "run-007", "other", ".run-3.fmlgs-1.tmp"] {
            fs::create_dir_all(all.join(name)).expect("created");
        }
        fs::write(all.join("run-10-edited").join(SCENE_FILE), "{}").expect("written");
        assert_eq!(folders.trainings(root), ["run-2", "run-10"].map(|name| all.join(name)));
        assert_eq!(folders.fresh(root), all.join("run-11"));
        assert_eq!(folders.derived(root), [all.join("run-10-edited")], "what is no scene is not shown");
        let (run, edited) = (all.join("run-2"), all.join("run-10-edited"));
        assert_eq!([&run, &edited].map(|path| folders.is_training(path)), [true, false]);
        assert_eq!([&run, &edited, &all].map(|path| folders.keeps(path)), [true, true, false]);
    }

    #[test]
    fn folders_of_the_first_version_are_used_on() {
        let folder = tempfile::tempdir().expect("folder");
        let folders = Folders { data: folder.path().into() };
        let root = Path::new("/one/fox");
        assert_eq!(first_name("fox", root), "fox-a33b0693", "as the first version called it");
        for (kind, found) in
            [("trained", &Folders::trained as &dyn Fn(&Folders, &Path) -> PathBuf), ("reports", &Folders::report)]
        {
            let old = folders.data.join(kind).join("fox-a33b0693");
            std::fs::create_dir_all(old.join("run-1")).expect("create");
            std::fs::write(old.join("run-1").join("kept"), "x").expect("write");
            let now = found(&folders, root);
            assert!(now.join("kept").exists() || now.join("run-1").join("kept").exists(), "{}", now.display());
            assert!(!old.exists(), "it has one name");
            assert_eq!(found(&folders, root), now, "and keeps it");
            assert!(!found(&folders, Path::new("/two/fox")).exists(), "the control");
        }
    }
}
