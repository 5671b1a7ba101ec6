//! Checkpoints of the levels of one result: folders `<scene>_1`, `_2`, `_3`, found from any of them or from their parent,
//! or files of the levels in one folder.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::folder::{highest, number_in};
use crate::io::{IoError, files};

/// Most levels.
const LEVELS: [(char, &str); 4] = [('0', "whole picture"), ('1', "small"), ('2', "medium"), ('3', "large")];

/// Checkpoint of a level.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LevelRun {
    /// Name of the level.
    pub(super) name: String,
    pub(super) checkpoint: PathBuf,
}

/// Checkpoints of a result's levels, in order.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LevelRuns {
    /// Name of the scene, without the number of a level.
    pub(super) scene: String,
    /// Folder of a level.
    pub(super) folder: PathBuf,
    pub(super) levels: Vec<LevelRun>,
}

/// Finds the checkpoints of the levels around a folder or a checkpoint; `None` if there are none.
///
/// # Errors
/// If the folder holds several results.
pub(super) fn find(path: &Path) -> Result<Option<LevelRuns>, IoError> {
    let folder = if path.is_dir() { path.to_owned() } else { files::folder_of(path).to_owned() };
    let folder = std::path::absolute(&folder).unwrap_or(folder);
    if let Some(in_one) = in_one_folder(&folder) {
        return Ok(Some(in_one));
    }
    let name = folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    if let (Some((scene, _)), Some(parent)) = (level_of(&name), folder.parent())
        && last_checkpoint(&folder).is_some()
    {
        let found = beside(parent).remove(scene).map(|levels| LevelRuns {
            scene: scene.into(),
            folder: folder.clone(),
            levels,
        });
        return Ok(found);
    }
    if let Some(checkpoint) = last_checkpoint(&folder) {
        let levels = vec![LevelRun { name: "features".into(), checkpoint }];
        return Ok(Some(LevelRuns { scene: name, folder, levels }));
    }
    let mut scenes = beside(&folder);
    if scenes.len() > 1 {
        let names: Vec<String> = scenes.into_keys().collect();
        let what = format!("results of several scenes ({})", names.join(", "));
        return Err(IoError::Unsupported {
            path: path.into(),
            what,
            remedy: "open the folder of a level of one of them",
        });
    }
    Ok(scenes.pop_first().map(|(scene, levels)| LevelRuns { scene, folder, levels }))
}

/// Splits a name into that of the scene and the number of the level.
fn level_of(name: &str) -> Option<(&str, &'static str)> {
    let (scene, level) = name.rsplit_once('_')?;
    let known = LEVELS.iter().find(|(digit, _)| level.len() == 1 && level.starts_with(*digit));
    known.filter(|_| !scene.is_empty()).map(|(_, level)| (scene, *level))
}

/// Levels of all scenes whose folders lie in `parent`.
fn beside(parent: &Path) -> BTreeMap<String, Vec<LevelRun>> {
    let mut scenes: BTreeMap<String, Vec<LevelRun>> = BTreeMap::new();
    for name in files::names_in(parent).unwrap_or_default() {
        if let Some((scene, level)) = level_of(&name)
            && let Some(checkpoint) = last_checkpoint(&parent.join(&name))
        {
            scenes.entry(scene.to_owned()).or_default().push(LevelRun { name: level.into(), checkpoint });
        }
    }
    scenes
}

fn last_checkpoint(folder: &Path) -> Option<PathBuf> {
    highest(&[folder], |name| number_in(name, "chkpnt", ".pth"))
}

/// Occam's LGS: `chkpnt<n>_langfeat_<level>.pth`.
fn in_one_folder(folder: &Path) -> Option<LevelRuns> {
    let of = |digit: char| highest(&[folder], |name| number_in(name, "chkpnt", &format!("_langfeat_{digit}.pth")));
    let level = |(digit, name): &(char, &str)| Some(LevelRun { name: (*name).into(), checkpoint: of(*digit)? });
    let levels: Vec<LevelRun> = LEVELS.iter().filter_map(level).collect();
    let scene = folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    (!levels.is_empty()).then(|| LevelRuns { scene, folder: folder.into(), levels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_found_from_any_of_them_and_from_their_parent() {
        let parent = tempfile::tempdir().expect("folder");
        let file = |name: &str| {
            let path = parent.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a parent")).expect("create");
            std::fs::write(path, "x").expect("write");
        };
        for level in 1..4 {
            file(&format!("ramen_{level}/chkpnt7000.pth"));
            file(&format!("ramen_{level}/chkpnt30000.pth"));
        }
        let names = |runs: &LevelRuns| runs.levels.iter().map(|l| l.name.clone()).collect::<Vec<_>>();
        for place in ["", "ramen_1", "ramen_3", "ramen_2/chkpnt7000.pth"] {
            let found = find(&parent.path().join(place)).expect("one scene").expect("levels");
            assert_eq!(
                (found.scene.as_str(), names(&found)),
                ("ramen", ["small", "medium", "large"].map(str::to_owned).to_vec())
            );
            assert!(found.levels[1].checkpoint.ends_with("ramen_2/chkpnt30000.pth"), "{found:?}");
        }
        file("figurines_1/chkpnt30000.pth");
        let several = find(parent.path()).expect_err("two scenes").to_string();
        assert!(several.contains("figurines, ramen"), "{several}");
        assert_eq!(find(&parent.path().join("figurines_1")).expect("one").expect("levels").levels.len(), 1);
        file("occam/chkpnt30000_langfeat_1.pth");
        file("occam/chkpnt30000_langfeat_2.pth");
        file("occam/chkpnt30000.pth");
        let occam = find(&parent.path().join("occam")).expect("one").expect("levels");
        assert_eq!(names(&occam), ["small", "medium"]);
        file("other/readme.txt");
        assert_eq!(find(&parent.path().join("other")).expect("nothing"), None);
    }
}
