//! Training runs of a data set: what is known of each, their names, and deleting one.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::{Folders, JobError};
use crate::io::error::write_error;
use crate::io::folder_lock::FolderHolder;
use crate::io::scene_files::{SCENE_FILE, is_scene};
use crate::io::trained::SceneInfo;
use crate::io::{IoError, SceneFolder, atomic, files, semantic_map, trained};
use crate::math::format;
use crate::scene::text;

/// File in a training run's folder that holds its name, if the user gave it one.
const NAME_FILE: &str = "name.txt";

/// Summary of a training run, or of a scene that was made of one, for lists.
#[derive(Clone, Debug, PartialEq)]
pub struct RunSummary {
    /// Its folder.
    pub folder: PathBuf,
    /// Its name: the user's, or that of its folder.
    pub name: String,
    /// Number of finished steps.
    pub steps: u64,
    /// Number of objects and parts stored with it.
    pub objects: usize,
    /// True if it is a training; false if it was made of one by an edit.
    pub(crate) is_training: bool,
    /// Time of its last save; `None` if a process works on it that has not saved anything yet.
    pub(crate) changed: Option<SystemTime>,
    /// The process that writes to it, such as a training.
    pub(crate) holder: Option<FolderHolder>,
    counted: String,
    psnr: Option<f64>,
}

impl RunSummary {
    fn of(folders: &Folders, folder: PathBuf) -> Option<Self> {
        let holder = SceneFolder::holder(&folder);
        let info = match trained::load_info(&folder) {
            Err(_) if holder.is_some() && !is_scene(&folder) => SceneInfo::default(),
            info => info.ok()?,
        };
        let is_training = folders.is_training(&folder);
        let last = info.history.evaluations.last();
        let steps = info.history.steps.last().map(|s| s.step).or(last.map(|e| e.step)).unwrap_or(0);
        let psnr = last.map(|e| e.psnr).filter(|psnr| psnr.is_finite());
        let identities = semantic_map::identities(&folder);
        let (objects, counted) = (identities.len(), identities.counted());
        let changed = fs::metadata(folder.join(SCENE_FILE)).and_then(|m| m.modified()).ok();
        let name = match is_training {
            true => name_of(&folder),
            false => info.name,
        };
        Some(Self { folder, name, steps, objects, is_training, changed, holder, counted, psnr })
    }

    /// Returns text such as "run-1: 600 steps, 26.6 dB, 13 objects".
    pub(crate) fn text(&self) -> String {
        format!("{}: {}", self.name, self.facts())
    }

    /// Returns text such as "600 steps, 26.6 dB, 13 objects".
    pub(crate) fn facts(&self) -> String {
        self.lines().into_iter().filter(|line| !line.is_empty()).collect::<Vec<_>>().join(", ")
    }

    /// Returns the same as two lines: of the training, and of the objects.
    pub(crate) fn lines(&self) -> [String; 2] {
        if self.changed.is_none() {
            return ["not saved yet".to_owned(), String::new()];
        }
        let quality = self.psnr.map_or_else(String::new, |psnr| format!(", {psnr:.1} dB"));
        let objects = if self.objects == 0 { "no objects".to_owned() } else { self.counted.clone() };
        [format!("{}{quality}", format::things(self.steps as usize, "step")), objects]
    }
}

/// Returns the training runs of the photos at `path`, oldest first, and then what was made of them. Unreadable ones are
/// left out.
pub(crate) fn list(folders: &Folders, path: &Path) -> Vec<RunSummary> {
    let all = folders.trainings(path).into_iter().chain(folders.derived(path));
    all.filter_map(|folder| RunSummary::of(folders, folder)).collect()
}

fn name_of(run: &Path) -> String {
    let given = files::read_text(&run.join(NAME_FILE)).map(|name| text::name(&name)).unwrap_or_default();
    if given.is_empty() { files::folder_name(run) } else { given }
}

/// Gives a training run a name; an empty one gives it back that of its folder. Its folder stays where it is.
///
/// # Errors
/// If it is no training run of this program, or the name cannot be written.
pub(crate) fn rename(folders: &Folders, run: &Path, name: &str) -> Result<(), JobError> {
    if !folders.is_training(run) || !is_scene(run) {
        return Err(JobError::NoScene(run.into()));
    }
    let (name, file) = (text::name(name), run.join(NAME_FILE));
    if name.is_empty() || name == files::folder_name(run) {
        return match fs::remove_file(&file) {
            Err(e) if e.kind() != ErrorKind::NotFound => Err(write_error(&file, e).into()),
            _ => Ok(()),
        };
    }
    Ok(atomic::write(&file, |w| w.write_all(name.as_bytes()))?)
}

/// Deletes a training run, or a scene that was made of one, with everything in its folder.
///
/// # Errors
/// If it is neither, or a process writes to it, such as a training; nothing is deleted then.
pub(crate) fn delete(folders: &Folders, run: &Path) -> Result<(), JobError> {
    if !folders.keeps(run) {
        return Err(JobError::NoScene(run.into()));
    }
    delete_with(folders, run, SceneFolder::delete_all)
}

/// Deletes the scene in `folder`: with everything in its folder if this program keeps it, else only if nothing but the
/// scene is there, in the state `known`.
///
/// # Errors
/// If there is anything else, the scene was changed, or a process writes to it; nothing is deleted then.
pub(crate) fn delete_scene(folders: &Folders, folder: &Path, known: Option<&str>) -> Result<(), JobError> {
    if folders.keeps(folder) {
        return delete(folders, folder);
    }
    delete_with(folders, folder, |folder| SceneFolder::delete(folder, known))
}

fn delete_with(
    folders: &Folders,
    run: &Path,
    delete: impl FnOnce(&Path) -> Result<(), IoError>,
) -> Result<(), JobError> {
    // Its name is that of the place, which is known as long as something is there.
    let picture = folders.picture(run);
    delete(run)?;
    // A picture of nothing is not shown.
    let _ = fs::remove_file(picture);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Evaluation, GaussianCloud, Identities, Level, NO_IDENTITY, SemanticMap};

    fn save(folders: &Folders, root: &Path, steps: u64) -> PathBuf {
        let run = folders.fresh(root);
        let mut info = SceneInfo { version: trained::VERSION, name: "fox".into(), ..SceneInfo::default() };
        info.history.evaluations = vec![Evaluation { psnr: 26.56, ..Evaluation::of(Vec::new(), 1, steps, 1.0) }];
        trained::save(&run, &info, &GaussianCloud::isotropic(vec![[0.0; 3]], 0.0, 0.0), None).expect("saved");
        run
    }

    fn texts(folders: &Folders, root: &Path) -> Vec<String> {
        list(folders, root).iter().map(RunSummary::text).collect()
    }

    #[test]
    fn runs_are_listed_with_their_facts_and_renamed_in_place() {
        let folder = tempfile::tempdir().expect("folder");
        let folders = Folders { data: folder.path().into() };
        let root = Path::new("/one/fox");
        let [first, second] = [600, 1].map(|steps| save(&folders, root, steps));
        let mut identities = Identities::default();
        let book = identities.add(Level::Object, NO_IDENTITY, vec!["book".into()]);
        identities.add(Level::Part, book, vec!["cover".into()]);
        let map = SemanticMap::from_identities(identities, vec![book], vec![1.0], vec![]);
        let before = trained::load(&first).expect("loaded");
        trained::save(&first, &before.info, &before.cloud, Some(&map)).expect("saved");
        assert_eq!(
            texts(&folders, root),
            ["run-1: 600 steps, 26.6 dB, 1 object and 1 part", "run-2: 1 step, 26.6 dB, no objects"]
        );
        rename(&folders, &first, "  the good\n one ").expect("renamed");
        assert!(texts(&folders, root)[0].starts_with("the good"), "{:?}", texts(&folders, root));
        assert!(first.is_dir() && trained::load(&first).is_ok(), "it stays where it is");
        rename(&folders, &first, " ").expect("as before");
        assert!(texts(&folders, root)[0].starts_with("run-1: ") && !first.join(NAME_FILE).exists());
        // The control: a scene elsewhere is none of the program's runs.
        let other = folder.path().join("mine");
        trained::save(&other, &before.info, &before.cloud, None).expect("saved");
        assert!(rename(&folders, &other, "x").is_err() && delete(&folders, &other).is_err());
        assert!(other.join(SCENE_FILE).exists() && second.exists());
        // What was made of a run has its own name.
        trained::save(&first.with_file_name("run-1-edited"), &before.info, &before.cloud, None).expect("saved");
        assert!(texts(&folders, root)[2].starts_with("fox: 600 steps"));
    }

    #[test]
    fn a_deleted_run_is_gone_with_all_of_its_folder_and_one_that_is_written_to_stays() {
        let folder = tempfile::tempdir().expect("folder");
        let folders = Folders { data: folder.path().into() };
        let root = Path::new("/one/fox");
        let [first, second] = [600, 700].map(|steps| save(&folders, root, steps));
        fs::create_dir_all(first.join("report")).expect("created");
        fs::write(first.join("report/report.json"), "{}").expect("written");
        let held = SceneFolder::hold(&first, "training").expect("held");
        let third = SceneFolder::hold(&folders.fresh(root), "training").expect("held");
        let all = list(&folders, root);
        assert_eq!(all.iter().map(|run| run.holder.is_some()).collect::<Vec<_>>(), [true, false, true]);
        assert_eq!(all[2].text(), "run-3: not saved yet");
        fs::remove_dir_all(third.path()).expect("gone");
        drop(third);
        let e = delete(&folders, &first).expect_err("it is being trained");
        assert!(matches!(e, JobError::Io(IoError::Busy { .. })) && e.to_string().contains("training"), "{e}");
        assert!(first.join(SCENE_FILE).exists() && first.join("report/report.json").exists());
        drop(held);
        delete(&folders, &first).expect("deleted");
        assert!(delete(&folders, &first).is_err(), "twice");
        let left = fs::read_dir(first.parent().expect("a parent")).expect("list").flatten();
        assert!(left.map(|entry| entry.path()).eq([second.clone()]), "the other one alone");
        assert_eq!((folders.trained(root), folders.trainings(root)), (second.clone(), vec![second]));
    }
}
