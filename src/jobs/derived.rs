//! A scene that is made of another: it goes into a folder of its own, and the other one stays as it is.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{JobError, Scene, export_splat};
use crate::io::splat_format::SplatFormat;
use crate::io::trained::{self, SceneInfo};
use crate::io::{IoError, SceneFolder, files};
use crate::pipeline::observer::Observer;
use crate::pipeline::train::TrainConfig;
use crate::render::RenderSettings;
use crate::scene::{GaussianCloud, SemanticMap};

/// How a scene is made in which something was moved, recolored or duplicated.
pub(crate) const EDITED: &str = "edited";

/// Refuses a place for the result that is taken or not fit for it: a file of splats where it is called so, else a folder.
pub(crate) fn check_place(scene: &Scene, out: &Path) -> Result<(), JobError> {
    match SplatFormat::of(out) {
        Some(_) => export_splat::check(out, &scene.reads()).map(|_| ()),
        None => check(out),
    }
}

/// Writes Gaussians that were made of `from`, and their objects and parts, to `out`: a file of splats where it is called
/// so, else a scene of its own.
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
    store(from, (format!("{} {how}", from.name), how == EDITED), cloud, map, out)?;
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

/// `desk-cleaned` beside `desk` for `how` "cleaned", with a number if there is one already.
pub(crate) fn free_folder(scene: &Path, how: &str) -> PathBuf {
    folder_beside(scene, how, |_| false)
}

/// The same, or the first one that may be gone on with.
pub(crate) fn folder_beside(scene: &Path, how: &str, goes_on: impl Fn(&Path) -> bool) -> PathBuf {
    let name = if scene.is_dir() { scene.file_name() } else { scene.file_stem() };
    let stem = name.map_or_else(|| "scene".into(), |n| n.to_string_lossy());
    let place = |number: usize| match number {
        1 => scene.with_file_name(format!("{stem}-{how}")),
        n => scene.with_file_name(format!("{stem}-{how}-{n}")),
    };
    (1..).map(place).find(|folder| !folder.exists() || goes_on(folder)).unwrap_or_default()
}

/// The settings of a training whose result is drawn as `from` is.
fn drawn_as(from: &Scene) -> Result<serde_json::Value, JobError> {
    let RenderSettings { antialias, surfels, .. } = from.settings;
    let config = TrainConfig { antialias, surfels, ..from.config.clone() };
    serde_json::to_value(config).map_err(|e| JobError::Output(e.to_string()))
}

/// Stores Gaussians that were made of `from`, and their objects and parts, as the scene `name` in the folder `out`;
/// whether they are `edited`, so that photos show them otherwise. Returns the id of its state.
pub(crate) fn store(
    from: &Scene,
    (name, edited): (String, bool),
    cloud: &GaussianCloud,
    map: Option<&SemanticMap>,
    out: &Path,
) -> Result<String, JobError> {
    let held = SceneFolder::hold(out, "storing a scene")?;
    // Somebody may have made one there since it was looked at.
    check(out)?;
    let mut info = match &from.folder {
        Some(folder) => trained::load_info(folder)?,
        // How a file of splats is drawn is said in its scene's settings from now on.
        None => SceneInfo { config: drawn_as(from)?, ..SceneInfo::default() },
    };
    info.name = name;
    info.edited |= edited;
    // What was measured was measured before.
    info.history.evaluations.clear();
    if let (Some(dataset), Some(path)) = (&mut info.dataset, &from.dataset_path) {
        *dataset = dataset.moved(path, out);
    }
    Ok(held.save(&info, cloud, map)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::splat_ply;
    use crate::jobs::open;
    use crate::scene::SplatRenderMode;

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
