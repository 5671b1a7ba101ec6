//! A copy of a trained scene's folder with everything in it: complete, or not there at all.

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::error::write_error;
use super::scene_files::{CLOUD_FILE, SCENE_FILE};
use super::scene_info::{load_info, relative_to};
use super::temporary::temporary_folder;
use super::{IoError, SceneFolder, files, splat_ply};

/// Copies the scene in `from` into the folder `to`, which is empty or does not exist; returns that folder. `step` gets
/// the numbers of files that are done and of all, and ends the work by an error.
///
/// # Errors
/// If `from` is no scene or is being written to, `to` holds something, or a file cannot be read or written. There is
/// nothing at `to` then.
pub(crate) fn copy<E: From<IoError>>(
    from: &Path,
    to: &Path,
    step: &mut dyn FnMut(u64, u64) -> Result<(), E>,
) -> Result<PathBuf, E> {
    let info = load_info(from)?;
    let _held = match SceneFolder::hold(from, "copying it") {
        // Nobody writes where writing is not permitted.
        Err(IoError::Write { cause, .. })
            if matches!(cause.kind(), ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem) =>
        {
            None
        }
        held => Some(held?),
    };
    let to = place(from, to)?;
    let failed = |cause| write_error(&to, cause);
    let mut all = Vec::new();
    list(from, Path::new(""), &mut all)?;
    let name = to.file_name().unwrap_or_default().to_string_lossy();
    let draft = temporary_folder(files::folder_of(&to), &name).map_err(failed)?;
    for (done, file) in all.iter().enumerate() {
        step(done as u64, all.len() as u64)?;
        let (source, target) = (from.join(file), draft.folder.path().join(file));
        fs::create_dir_all(files::folder_of(&target)).map_err(failed)?;
        files::copy(&source, &target, |path, cause| match path == source {
            true => IoError::Read { path: path.into(), cause },
            false => write_error(&to, cause),
        })?;
        if file.ends_with(SCENE_FILE) {
            refer_from(&target, files::folder_of(&source), &to.join(files::folder_of(file)))?;
        }
    }
    let path = draft.folder.path().join(CLOUD_FILE);
    if info.state.is_some() && splat_ply::state(&path)? != info.state {
        return Err(IoError::Changed { folder: from.into() }.into());
    }
    step(all.len() as u64, all.len() as u64)?;
    // Not every system puts a folder in the place of an empty one.
    if to.is_dir() {
        fs::remove_dir(&to).map_err(failed)?;
    }
    fs::rename(draft.folder.path(), &to).map_err(failed)?;
    let _ = draft.folder.keep();
    files::sync_folder(files::folder_of(&to)).map_err(failed)?;
    Ok(to)
}

/// Checks the place of the copy, and returns it without links: what refers to files outside is relative to it.
fn place(from: &Path, to: &Path) -> Result<PathBuf, IoError> {
    let occupied = |what| IoError::Occupied { folder: to.into(), what };
    if to.is_file() || fs::read_dir(to).is_ok_and(|mut all| all.next().is_some()) {
        return Err(occupied("holds something already; a copy goes into an empty or a new folder"));
    }
    let failed = |cause| write_error(to, cause);
    let to = std::path::absolute(to).map_err(failed)?;
    let parent = files::folder_of(&to);
    fs::create_dir_all(parent).map_err(failed)?;
    let real = |path: &Path| fs::canonicalize(path).map_err(failed);
    let (parent, from) = (real(parent)?, real(from)?);
    if parent.starts_with(&from) {
        return Err(occupied("lies in the scene itself"));
    }
    Ok(to.file_name().map_or(parent.clone(), |name| parent.join(name)))
}

/// Adds all files in the folder `within` of `root`, relative to `root`, without locks and temporary files.
fn list(root: &Path, within: &Path, all: &mut Vec<PathBuf>) -> Result<(), IoError> {
    let folder = root.join(within);
    let failed = |cause| IoError::Read { path: folder.clone(), cause };
    for name in files::names_in(&folder).map_err(failed)? {
        let (path, file) = (folder.join(&name), within.join(&name));
        match fs::metadata(&path) {
            Ok(about) if about.is_dir() => list(root, &file, all)?,
            Ok(about) if about.is_file() => all.push(file),
            Ok(_) => return Err(IoError::NotAFile { path }),
            Err(cause) => return Err(IoError::Read { path, cause }),
        }
    }
    Ok(())
}

/// Lets the copied description of a scene, which was in the folder `before`, refer to the same photos from `now`.
fn refer_from(file: &Path, before: &Path, now: &Path) -> Result<(), IoError> {
    let mut info: serde_json::Value = files::read_json(file)?;
    let Some(path) = info.pointer_mut("/dataset/path") else { return Ok(()) };
    let Some(photos) = path.as_str().map(|path| before.join(path)) else { return Ok(()) };
    *path = relative_to(&photos, now).to_string_lossy().into();
    let text = serde_json::to_vec_pretty(&info).map_err(|e| files::json_error(file, &e))?;
    let write = || {
        let mut to = fs::File::create(file)?;
        to.write_all(&text)?;
        to.sync_all()
    };
    write().map_err(|cause| write_error(file, cause))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::semantic_map;
    use crate::io::trained::{self, DatasetReference, SceneInfo};
    use crate::scene::{GaussianCloud, Identities, Level, NO_IDENTITY, SemanticMap};

    /// A scene with objects, an earlier state, settings and a report, and the photos beside it.
    fn scene(folder: &Path) -> PathBuf {
        let (path, photos) = (folder.join("made/scene"), folder.join("photos"));
        fs::create_dir_all(&photos).expect("created");
        fs::create_dir_all(&path).expect("created");
        let dataset = DatasetReference { path: "../../photos".into(), format: "x".into() };
        let info = SceneInfo { dataset: Some(dataset), name: "desk".into(), ..SceneInfo::default() };
        let cloud = GaussianCloud::isotropic(vec![[0.0; 3]], 0.0, 0.0);
        let named = |name: &str| {
            let mut identities = Identities::default();
            let id = identities.add(Level::Object, NO_IDENTITY, vec![name.into()]);
            SemanticMap::from_identities(identities, vec![id], vec![1.0], vec![])
        };
        let state = trained::save(&path, &info, &cloud, Some(&named("lamp"))).expect("saved");
        let held = SceneFolder::hold(&path, "test").expect("held");
        held.replace_map(Some(&state), &named("mug"), &cloud).expect("replaced");
        for (name, content) in [("training.toml", "steps = 5"), ("path.json", "{}"), ("report/report.json", "{}")] {
            fs::create_dir_all(path.join("report")).expect("created");
            fs::write(path.join(name), content).expect("written");
        }
        path
    }

    fn to_the_end(from: &Path, to: &Path) -> Result<PathBuf, IoError> {
        copy(from, to, &mut |_, _| Ok(()))
    }

    fn names(folder: &Path) -> Vec<PathBuf> {
        let mut all = Vec::new();
        list(folder, Path::new(""), &mut all).expect("listed");
        all
    }

    #[test]
    fn a_copy_is_complete_and_knows_its_photos() {
        let folder = tempfile::tempdir().expect("folder");
        let from = scene(folder.path());
        for to in ["copies/deep/er/desk", "desk"].map(|to| folder.path().join(to)) {
            let made = to_the_end(&from, &to).expect("copied");
            assert_eq!(names(&made), names(&from));
            assert!(names(&made).len() > 7 && made.join("earlier/1/scene.json").exists());
            for (now, then) in [(made.clone(), from.clone()), (made.join("earlier/1"), from.join("earlier/1"))] {
                let (copied, scene) = (trained::load(&now).expect("copied"), trained::load(&then).expect("there"));
                assert_eq!((&copied.cloud, &copied.state), (&scene.cloud, &scene.state));
                let map = semantic_map::load(&now, copied.state.as_deref(), &copied.cloud).expect("read");
                assert_eq!(map, semantic_map::load(&then, scene.state.as_deref(), &scene.cloud).expect("read"));
                let real = |of: &trained::TrainedScene| fs::canonicalize(of.dataset_path().expect("photos")).ok();
                assert_eq!(real(&copied), real(&scene));
            }
        }
    }

    #[test]
    fn only_an_empty_place_outside_of_the_scene_is_filled() {
        let folder = tempfile::tempdir().expect("folder");
        let from = scene(folder.path());
        let (full, empty) = (folder.path().join("full"), folder.path().join("empty"));
        fs::create_dir_all(&full).expect("created");
        fs::write(full.join(".mine"), "x").expect("written");
        for to in [&full, &full.join(".mine"), &from, &from.join("copy")] {
            let e = to_the_end(&from, to).expect_err("refused");
            assert!(e.to_string().contains("choose another folder"), "{e}");
        }
        assert_eq!(fs::read_dir(&full).expect("list").count(), 1, "nothing was added");
        assert!(!from.join("copy").exists());
        fs::create_dir(&empty).expect("created");
        to_the_end(&from, &empty).expect("the control: an empty one");
        assert!(to_the_end(&from, &empty).is_err(), "twice");
        assert!(to_the_end(&folder.path().join("photos"), &folder.path().join("x")).is_err(), "no scene");
    }

    #[test]
    fn a_copy_that_ends_early_leaves_nothing_and_a_scene_that_is_written_to_is_not_copied() {
        let folder = tempfile::tempdir().expect("folder");
        let from = scene(folder.path());
        let all = names(&from).len() as u64;
        let to = folder.path().join("out/copy");
        for last in 0..=all {
            let ends = copy(&from, &to, &mut |done, of| {
                assert_eq!(of, all);
                assert!(!to.exists(), "not before it is complete");
                if done == last { Err(IoError::NotAFile { path: "x".into() }) } else { Ok(()) }
            });
            assert!(ends.is_err() && !to.exists(), "{last}");
            assert_eq!(fs::read_dir(folder.path().join("out")).expect("list").count(), 0);
        }
        let held = SceneFolder::hold(&from, "training").expect("held");
        assert!(matches!(to_the_end(&from, &to), Err(IoError::Busy { .. })) && !to.exists());
        drop(held);
        to_the_end(&from, &to).expect("the control");
    }
}
