//! Writing into the folder of a trained scene: by one process at a time, and all files or none.
//!
//! The files of a scene that belong together carry the id of the save that wrote them: `scene.json`
//! as `state`, `point_cloud.ply` in a comment, `semantic_map.safetensors` in its header.
//!
//! A replaced scene that has objects and parts is kept in `earlier/`.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::atomic::Draft;
use super::commit::{self, Commit};
use super::error::write_error;
use super::folder_lock::{self, FolderHolder, FolderLock};
use super::scene_files::{self, CHECKPOINT_FILE, CLOUD_FILE, SCENE_FILE, SELECTION_FILE, is_scene};
use super::scene_info::{SceneInfo, VERSION, load_info, relative_to};
use super::temporary::{sweep, temporary_folder};
use super::{IoError, files, semantic_map, splat_ply};
use crate::scene::{GaussianCloud, SemanticMap};

/// Folder of replaced scenes: `earlier/1`, `earlier/2`, each complete.
const EARLIER: &str = "earlier";

/// A scene's folder, held for writing.
#[derive(Debug)]
pub struct SceneFolder {
    lock: FolderLock,
}

impl SceneFolder {
    /// Holds `folder`, which is created if need be, for `what` ("training"). An interrupted save is completed first,
    /// and temporary files of dead processes are removed.
    pub fn hold(folder: &Path, what: &str) -> Result<Self, IoError> {
        fs::create_dir_all(folder).map_err(|cause| IoError::Write {
            path: folder.into(),
            remedy: "the folder cannot be created: choose another place",
            cause,
        })?;
        let lock = FolderLock::take(folder, what)?;
        commit::carry_out(folder)?;
        [folder, &folder.join(EARLIER), &folder.join("cache")].into_iter().for_each(sweep);
        Ok(Self { lock })
    }

    /// Returns the process that holds `folder`, if one does.
    pub(crate) fn holder(folder: &Path) -> Option<FolderHolder> {
        folder_lock::holder(folder)
    }

    /// Moves a scene to a folder beside it, away from a process that may still write to it; later writes of that
    /// process have no folder. `to` must not exist.
    pub(crate) fn move_away(from: &Path, to: &Path) -> Result<(), IoError> {
        let moved = fs::rename(from, to).and_then(|()| {
            // The lock file is that of the other process; the next holder creates its own.
            let _ = fs::remove_file(to.join(folder_lock::FILE));
            files::sync_folder(files::folder_of(to))
        });
        moved.map_err(|cause| write_error(to, cause))
    }

    /// Deletes the scene in `folder`, which must be in the state `known`, with the folder.
    ///
    /// # Errors
    /// [`IoError::Changed`] if it is not in that state any more, [`IoError::HoldsMore`] if the folder holds anything
    /// else; nothing is deleted then.
    pub(crate) fn delete(folder: &Path, known: Option<&str>) -> Result<(), IoError> {
        // Holding would create the folder again if another process deleted it.
        load_info(folder)?;
        let held = Self::hold(folder, "deleting")?;
        let folder = folder.to_path_buf();
        if load_info(&folder)?.state.as_deref() != known {
            return Err(IoError::Changed { folder });
        }
        let entries = fs::read_dir(&folder).and_then(Iterator::collect::<io::Result<Vec<_>>>);
        let entries = entries.map_err(|cause| write_error(&folder, cause))?;
        let mut names = entries.iter().map(fs::DirEntry::file_name);
        let made_anew = [folder_lock::FILE, SELECTION_FILE];
        if !names.all(|name| scene_files::FILES.iter().chain(&made_anew).any(|file| name == *file)) {
            return Err(IoError::HoldsMore { folder });
        }
        held.take_away()
    }

    /// Deletes the scene in `folder` with everything else in the folder.
    ///
    /// # Errors
    /// If it is no scene, or another process writes to it; nothing is deleted then.
    pub(crate) fn delete_all(folder: &Path) -> Result<(), IoError> {
        load_info(folder)?;
        Self::hold(folder, "deleting")?.take_away()
    }

    /// Deletes the folder: its path is free at once; files left by a killed process are swept later.
    fn take_away(self) -> Result<(), IoError> {
        let folder = self.path().to_path_buf();
        // Windows does not move a folder in which a file is open.
        let _held = (!cfg!(windows)).then_some(self);
        let gone = temporary_folder(files::folder_of(&folder), "deleted");
        gone.and_then(|gone| fs::rename(&folder, gone.folder.path().join("scene"))).map_err(|e| write_error(&folder, e))
    }

    pub(crate) fn path(&self) -> &Path {
        self.lock.folder()
    }

    /// Saves the scene: all of its files change, or none. Without a map, the folder has none afterwards.
    /// Returns the id of this state.
    pub fn save(&self, info: &SceneInfo, cloud: &GaussianCloud, map: Option<&SemanticMap>) -> Result<String, IoError> {
        let state = format!("{:032x}", rand::random::<u128>());
        let info = SceneInfo { version: VERSION, state: Some(state.clone()), ..info.clone() };
        let stored = map.map(|map| {
            let mut stored = cloud.clone();
            map.store(&mut stored);
            stored
        });
        let cloud = stored.as_ref().unwrap_or(cloud);
        splat_ply::check(&self.path().join(CLOUD_FILE), cloud)?;
        let mut commit = Commit::new(self.path());
        commit.add(CLOUD_FILE, |w| splat_ply::encode(w, cloud, Some(&state)))?;
        match map {
            Some(map) => {
                let bytes = semantic_map::encode(map, Some(&state), &self.path().join(semantic_map::FILE))?;
                commit.add(semantic_map::FILE, |w| w.write_all(&bytes))?;
            }
            None => commit.remove(semantic_map::FILE),
        }
        commit.add(SCENE_FILE, |w| write_info(w, &info))?;
        commit.finish()?;
        Ok(state)
    }

    /// Stores the length of a scene unit in meters; the state id stays the same.
    ///
    /// # Errors
    /// If it cannot be written; [`IoError::Changed`] if the scene is not in the state `known` any more.
    pub(crate) fn save_scale(&self, known: Option<&str>, meters_per_unit: f64) -> Result<(), IoError> {
        let info = SceneInfo { meters_per_unit: Some(meters_per_unit), ..load_info(self.path())? };
        if info.state.as_deref() != known {
            return Err(IoError::Changed { folder: self.path().into() });
        }
        let mut commit = Commit::new(self.path());
        commit.add(SCENE_FILE, |w| write_info(w, &info))?;
        commit.finish()
    }

    /// Replaces a file that belongs to no state of the scene. Returns its path.
    pub(super) fn save_beside(
        &self,
        name: &str,
        fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<PathBuf, IoError> {
        let path = self.path().join(name);
        let mut draft = Draft::beside(&path)?;
        fill(&mut draft).map_err(|cause| write_error(&path, cause))?;
        draft.commit()?;
        Ok(path)
    }

    /// Saves another map of the Gaussians `cloud`, which must be those of the scene in the state `known`.
    /// Returns the id of the new state.
    pub(crate) fn save_map(
        &self,
        known: Option<&str>,
        map: &SemanticMap,
        cloud: &GaussianCloud,
    ) -> Result<String, IoError> {
        self.save_edited(known, Some(map), cloud)
    }

    /// As [`Self::save_map`], for other Gaussians, with their map if they have one.
    pub(crate) fn save_edited(
        &self,
        known: Option<&str>,
        map: Option<&SemanticMap>,
        cloud: &GaussianCloud,
    ) -> Result<String, IoError> {
        let info = load_info(self.path())?;
        if splat_ply::state(&self.path().join(CLOUD_FILE))?.as_deref() != known {
            return Err(IoError::Changed { folder: self.path().into() });
        }
        self.save(&info, cloud, map)
    }

    /// As [`Self::save_map`], but the earlier scene is kept (see [`Self::keep_earlier`]); returns its folder and the id
    /// of the new state. A map equal to the stored one changes nothing.
    pub(crate) fn replace_map(
        &self,
        known: Option<&str>,
        map: &SemanticMap,
        cloud: &GaussianCloud,
    ) -> Result<(Option<PathBuf>, String), IoError> {
        if let Some(state) = self.has(map)? {
            return Ok((None, state));
        }
        let kept = self.keep_earlier()?;
        Ok((kept, self.save_map(known, map, cloud)?))
    }

    /// Returns the scene's state if `map` equals the stored map.
    fn has(&self, map: &SemanticMap) -> Result<Option<String>, IoError> {
        let path = self.path().join(semantic_map::FILE);
        let cloud = self.path().join(CLOUD_FILE);
        let (Ok(bytes), Ok(info), Ok(of_cloud)) = (fs::read(&path), load_info(self.path()), splat_ply::state(&cloud))
        else {
            return Ok(None);
        };
        let (Some(state), Ok(cloud)) = (info.state.filter(|s| Some(s) == of_cloud.as_ref()), splat_ply::read(&cloud))
        else {
            return Ok(None);
        };
        let stored = semantic_map::load(self.path(), Some(&state), &cloud).ok().flatten();
        let gaussians = |m: &SemanticMap| (m.identity_of.clone(), m.margin.clone(), m.codes.clone());
        let same = stored.is_some_and(|s| gaussians(&s) == gaussians(map));
        Ok((same && semantic_map::encode(map, Some(&state), &path)? == bytes).then_some(state))
    }

    /// Replaces the checkpoint.
    ///
    /// # Errors
    /// If it cannot be written; the earlier checkpoint is then unchanged.
    pub(crate) fn save_checkpoint(&self, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), IoError> {
        self.save_beside(CHECKPOINT_FILE, fill).map(drop)
    }

    /// Keeps a copy of the current scene before it is replaced and returns its folder; `None` if it has no objects and
    /// parts, as only these are worth keeping.
    pub(crate) fn keep_earlier(&self) -> Result<Option<PathBuf>, IoError> {
        if !self.path().join(semantic_map::FILE).exists() || !is_scene(self.path()) {
            return Ok(None);
        }
        let mut info = load_info(self.path())?;
        let all = self.path().join(EARLIER);
        let place = (1..).map(|n: u32| all.join(n.to_string())).find(|p| !p.exists()).unwrap_or_else(|| all.clone());
        if let Some(dataset) = &mut info.dataset {
            dataset.path = relative_to(&self.path().join(&dataset.path), &place);
        }
        let keep = || {
            fs::create_dir_all(&all)?;
            let draft = temporary_folder(&all, "kept")?;
            for name in [CLOUD_FILE, semantic_map::FILE] {
                let (from, to) = (self.path().join(name), draft.folder.path().join(name));
                // Files of a scene are replaced, never written into, so a second name keeps the content.
                fs::hard_link(&from, &to).or_else(|_| fs::copy(&from, &to).map(drop))?;
            }
            let file = fs::File::create(draft.folder.path().join(SCENE_FILE))?;
            serde_json::to_writer_pretty(&file, &info)?;
            file.sync_all()?;
            fs::rename(draft.folder.path(), &place)?;
            let _ = draft.folder.keep();
            Ok(())
        };
        keep().map_err(|cause| write_error(&place, cause))?;
        Ok(Some(place))
    }
}

fn write_info(w: &mut dyn Write, info: &SceneInfo) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *w, info)?;
    w.write_all(b"\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::scene_files::FILES;
    use crate::io::{atomic, trained};
    use crate::scene::{Identities, Level, NO_IDENTITY};

    fn cloud(x: f32) -> GaussianCloud {
        GaussianCloud::isotropic(vec![[x; 3]], 0.0, 0.0)
    }

    fn named(name: &str) -> SemanticMap {
        let mut identities = Identities::default();
        let id = identities.add(Level::Object, NO_IDENTITY, vec![name.into()]);
        SemanticMap::from_identities(identities, vec![id], vec![1.0], vec![])
    }

    /// The name of the only object of the scene in `folder`.
    fn stored(folder: &Path) -> Result<String, IoError> {
        let scene = trained::load(folder)?;
        let map = semantic_map::load(folder, scene.state.as_deref(), &scene.cloud)?;
        Ok(map.map(|m| m.identities.name(1)).unwrap_or_default())
    }

    #[test]
    fn files_of_different_saves_are_refused() {
        let folder = tempfile::tempdir().expect("folder");
        let (a, b) = (folder.path().join("a"), folder.path().join("b"));
        trained::save(&a, &SceneInfo::default(), &cloud(0.0), Some(&named("lamp"))).expect("saved");
        trained::save(&b, &SceneInfo::default(), &cloud(0.0), Some(&named("kettle"))).expect("saved");
        assert_eq!((stored(&a).expect("a"), stored(&b).expect("b")), ("lamp".into(), "kettle".into()));
        for name in [CLOUD_FILE, semantic_map::FILE, SCENE_FILE] {
            let own = fs::read(a.join(name)).expect("read");
            fs::copy(b.join(name), a.join(name)).expect("swapped");
            let e = stored(&a).expect_err(name);
            assert!(matches!(e, IoError::Torn { .. }), "{name}: {e}");
            assert!(e.to_string().contains("put back"), "{e}");
            fs::write(a.join(name), own).expect("put back");
            assert_eq!(stored(&a).expect(name), "lamp");
        }
        // Folders of the first versions have no ids, and are still read.
        let text = fs::read_to_string(a.join(SCENE_FILE)).expect("read");
        let state = trained::load(&a).expect("loaded").state.expect("a state");
        fs::write(a.join(SCENE_FILE), text.replace(&format!(",\n  \"state\": \"{state}\""), "")).expect("written");
        assert_eq!(trained::load_info(&a).expect("read").state, None);
        assert_eq!(stored(&a).expect("without the line"), "lamp");
    }

    #[test]
    fn what_others_saved_is_not_written_over() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path();
        let first = trained::save(path, &SceneInfo::default(), &cloud(0.0), Some(&named("lamp"))).expect("saved");
        let other = |name: &str, known: &str| {
            SceneFolder::hold(path, "test").expect("held").save_map(Some(known), &named(name), &cloud(0.0))
        };
        let second = other("kettle", &first).expect("saved");
        assert!(matches!(other("mug", &first), Err(IoError::Changed { .. })));
        assert_eq!(stored(path).expect("read"), "kettle");
        other("mug", &second).expect("saved");
    }

    #[test]
    fn what_is_replaced_is_kept_and_the_same_changes_nothing() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("scene");
        let photos = folder.path().join("photos");
        fs::create_dir(&photos).expect("created");
        let dataset = trained::DatasetReference { path: "../photos".into(), format: "x".into() };
        let info = SceneInfo { dataset: Some(dataset), ..SceneInfo::default() };
        let state = trained::save(&path, &info, &cloud(0.0), Some(&named("lamp"))).expect("saved");
        let scene = SceneFolder::hold(&path, "test").expect("held");
        let same = scene.replace_map(Some(&state), &named("lamp"), &cloud(0.0)).expect("the same");
        assert_eq!(same, (None, state.clone()));
        let (kept, _) = scene.replace_map(Some(&state), &named("kettle"), &cloud(0.0)).expect("replaced");
        let kept = kept.expect("kept");
        assert_eq!((stored(&path).expect("new"), stored(&kept).expect("old")), ("kettle".into(), "lamp".into()));
        let found = trained::load(&kept).expect("loaded").dataset_path().expect("its photos");
        assert_eq!(fs::canonicalize(found).expect("real"), fs::canonicalize(photos).expect("real"));
    }

    #[test]
    fn the_files_of_a_scene_are_no_place_for_anything_else() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| folder.path().join(name);
        atomic::write(&at(CLOUD_FILE), |w| w.write_all(b"x")).expect("no scene yet");
        fs::remove_file(at(CLOUD_FILE)).expect("removed");
        trained::save(folder.path(), &SceneInfo::default(), &cloud(0.0), None).expect("saved");
        for name in FILES {
            let e = atomic::write(&at(name), |w| w.write_all(b"x")).expect_err(name);
            assert!(matches!(e, IoError::Protected { .. }), "{e}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(at(SCENE_FILE), at("link.json")).expect("link");
            assert!(atomic::write(&at("link.json"), |w| w.write_all(b"x")).is_err(), "through a link");
        }
        atomic::write(&at("path.json"), |w| w.write_all(b"x")).expect("another file");
        assert!(trained::load(folder.path()).is_ok());
    }

    #[test]
    fn a_checkpoint_is_replaced_and_a_scene_without_objects_is_not_kept() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path();
        trained::save(path, &SceneInfo::default(), &cloud(0.0), None).expect("saved");
        let scene = SceneFolder::hold(path, "test").expect("held");
        for content in [b"one", b"two"] {
            scene.save_checkpoint(|w| w.write_all(content)).expect("saved");
            assert_eq!(fs::read(path.join(CHECKPOINT_FILE)).expect("read"), content);
        }
        assert_eq!(scene.keep_earlier().expect("nothing to keep"), None);
        assert!(!path.join(EARLIER).exists());
    }
}
