//! A scene that is derived from another: it goes into its own folder, and the other one stays unchanged.
//!
//! Removal, cleaning and edits never change the Gaussians of an opened scene. The window's first edit derives a scene;
//! later ones are stored in it ([`super::rearrange`]).

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::held_out::held_out;
use super::{JobError, Scene, camera_path, export_splat, measurements, open};
use crate::io::splat_format::SplatFormat;
use crate::io::trained::{self, SceneInfo};
use crate::io::{IoError, SceneFolder, files};
use crate::pipeline::observer::Observer;
use crate::pipeline::train::TrainConfig;
use crate::render::RenderSettings;
use crate::scene::{GaussianCloud, SemanticMap};

/// Suffix of a scene in which things were moved, recolored or duplicated.
pub(crate) const EDITED: &str = "edited";

/// Refuses a place for the result that is taken or not fit: a splat file if the path names one, else a folder.
pub(crate) fn check_place(scene: &Scene, out: &Path) -> Result<(), JobError> {
    match SplatFormat::of(out) {
        Some(_) => export_splat::check(out, &scene.reads()).map(|_| ()),
        None => check(out),
    }
}

/// Writes Gaussians that were derived from `from`, with their objects and parts, to `out`: a splat file if the path
/// names one, else a scene folder.
pub(crate) fn write(
    from: &Scene,
    how: &str,
    cloud: &Arc<GaussianCloud>,
    map: Option<&SemanticMap>,
    out: &Path,
    observer: &mut dyn Observer,
) -> Result<(), JobError> {
    if SplatFormat::of(out).is_some() {
        export_splat::run(cloud, out, None, observer)?.tell_loss(observer);
        return Ok(());
    }
    store(from, (name(&from.name, how, out), how == EDITED), cloud, map, out)?;
    Ok(())
}

/// Refuses a folder for the result that holds anything.
pub(crate) fn check(out: &Path) -> Result<(), JobError> {
    if files::holds_something(out) || out.is_file() {
        let what = "holds something already; the scene that is made goes into a new folder";
        return Err(IoError::Occupied { folder: out.into(), what }.into());
    }
    Ok(())
}

/// Returns `desk-cleaned` beside `desk` for `how` "cleaned", with a number if that exists.
pub(crate) fn free_folder(scene: &Path, how: &str) -> PathBuf {
    folder_beside(scene, how, |_| false)
}

/// Returns the name of a scene that is derived into `folder`: "Desk edited", or "Desk edited 2" if that is the number
/// of its folder. What was derived in the same way before keeps its name but for the number.
pub(crate) fn name(from: &str, how: &str, folder: &Path) -> String {
    let base = without(from, &format!(" {how}"), " ");
    let number = folder.file_name().and_then(|n| n.to_str()).and_then(|n| n.rsplit_once(&format!("-{how}-")));
    match number.filter(|(_, n)| is_number(n)) {
        Some((_, n)) => format!("{base} {how} {n}"),
        None => format!("{base} {how}"),
    }
}

/// Text without an ending, which may have a number behind `gap`.
fn without<'t>(text: &'t str, ending: &str, gap: &str) -> &'t str {
    let numbered = text.rsplit_once(gap).filter(|(_, n)| is_number(n)).map(|(rest, _)| rest);
    [Some(text), numbered].into_iter().flatten().find_map(|t| t.strip_suffix(ending)).unwrap_or(text)
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())
}

/// Returns the same, or the first folder that may be resumed.
pub(crate) fn folder_beside(scene: &Path, how: &str, goes_on: impl Fn(&Path) -> bool) -> PathBuf {
    let name = if scene.is_dir() { scene.file_name() } else { scene.file_stem() };
    let stem = name.map_or_else(|| "scene".into(), |n| n.to_string_lossy());
    // What is derived once more in the same way has another number, not the word twice.
    let stem = without(&stem, &format!("-{how}"), "-");
    let place = |number: usize| match number {
        1 => scene.with_file_name(format!("{stem}-{how}")),
        n => scene.with_file_name(format!("{stem}-{how}-{n}")),
    };
    (1..).map(place).find(|folder| !folder.exists() || goes_on(folder)).unwrap_or_default()
}

/// Returns the settings of a training run whose result is drawn as `from` is.
fn drawn_as(from: &Scene) -> Result<serde_json::Value, JobError> {
    let RenderSettings { antialias, surfels, .. } = from.settings;
    let config = TrainConfig { antialias, surfels, ..from.config.clone() };
    serde_json::to_value(config).map_err(|e| JobError::Output(e.to_string()))
}

/// Describes a scene that is made of a splat, with the cameras and photos that were found beside it. A splat file does
/// not say how it is drawn; the scene's settings do from now on.
fn of_bare(from: &Scene, out: &Path) -> Result<SceneInfo, JobError> {
    let dataset = from.dataset_path.as_ref().and_then(|path| open::dataset(path).ok());
    let found = dataset.map(|dataset| {
        let known = !from.cameras.is_empty();
        let held_out = if known { held_out(&dataset, &from.cameras, None, 0) } else { Vec::new() };
        SceneInfo::of(&dataset, &held_out, out)
    });
    let without = || SceneInfo { cameras: from.cameras.clone(), ..SceneInfo::default() };
    Ok(SceneInfo {
        background: from.says_background.then_some(from.settings.background),
        config: drawn_as(from)?,
        ..found.unwrap_or_else(without)
    })
}

/// Stores Gaussians that were derived from `from`, with their objects and parts, as the scene `name` in the folder
/// `out`. `edited` marks that photos show the scene as it was before. Returns the id of its state.
pub(crate) fn store(
    from: &Scene,
    (name, edited): (String, bool),
    cloud: &GaussianCloud,
    map: Option<&SemanticMap>,
    out: &Path,
) -> Result<String, JobError> {
    let held = SceneFolder::hold(out, "storing a scene")?;
    // Another process may have made one there since the earlier check.
    check(out)?;
    let mut info = match &from.folder {
        Some(folder) => trained::load_info(folder)?,
        None => of_bare(from, out)?,
    };
    info.name = name;
    info.edited |= edited;
    // Quality was measured before the change.
    info.history.evaluations.clear();
    if let (Some(dataset), Some(path)) = (&mut info.dataset, &from.dataset_path) {
        *dataset = dataset.moved(path, out);
    }
    let state = held.save(&info, cloud, map)?;
    if let Some(folder) = &from.folder {
        measurements::carry_over(folder, [&from.cloud, cloud], &held)?;
        camera_path::carry_over(folder, &held)?;
    }
    Ok(state)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::splat_ply;
    use crate::scene::SplatRenderMode;

    #[test]
    fn what_is_derived_in_the_same_way_again_has_a_number() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut scene = folder.path().join("scene");
        let mut name = "Demo".to_owned();
        for (file, called) in
            [("scene-edited", "Demo edited"), ("scene-edited-2", "Demo edited 2"), ("scene-edited-3", "Demo edited 3")]
        {
            std::fs::create_dir(&scene).expect("made");
            let next = free_folder(&scene, EDITED);
            name = super::name(&name, EDITED, &next);
            assert_eq!((next.file_name().and_then(|n| n.to_str()), name.as_str()), (Some(file), called));
            scene = next;
        }
        let cleaned = free_folder(&scene, "cleaned");
        assert!(cleaned.ends_with("scene-edited-3-cleaned"));
        assert_eq!(super::name(&name, "cleaned", &cleaned), "Demo edited 3 cleaned");
        assert_eq!(super::name("Room 12", EDITED, Path::new("room-12-edited")), "Room 12 edited");
    }

    #[test]
    fn a_scene_made_of_a_file_is_drawn_as_the_file_is() {
        let folder = tempfile::tempdir().expect("a folder");
        for mode in [SplatRenderMode::Plain, SplatRenderMode::Mip, SplatRenderMode::Surfels] {
            let (file, out) = (folder.path().join("a.ply"), folder.path().join(format!("{mode:?}")));
            let cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 3], -3.0, 1.0);
            splat_ply::write(&file, &GaussianCloud { render_mode: mode, ..cloud }).expect("written");
            let from = open::scene(&file).expect("opened");
            store(&from, ("a".into(), false), &from.cloud, None, &out).expect("stored");
            let made = open::scene(&out).expect("opened");
            assert_eq!((&made.settings, made.cloud.render_mode), (&from.settings, mode));
            assert!(store(&from, ("a".into(), false), &from.cloud, None, &out).is_err(), "nothing is written over");
        }
    }
}
