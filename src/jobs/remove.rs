//! Removal of things from a scene, for good, into another scene.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{JobError, Scene, derived, export, open, photos_without};
use crate::io::{IoError, SceneFolder, scene_info};
use crate::math::format;
use crate::models::catalog::{self, ModelRole};
use crate::models::lama::{LAMA, Lama};
use crate::pipeline::observer::{Interrupted, Observer};
use crate::pipeline::removal;
pub(crate) use crate::pipeline::removal::{Paint, RemovalOptions, RemovalReport};
use crate::pipeline::semantics::lifting::edit;
use crate::scene::{Camera, GaussianCloud, SemanticMap};

/// A scene without some of its things.
#[derive(Clone, Debug)]
pub(crate) struct ReducedScene {
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) map: Arc<SemanticMap>,
    pub(crate) report: RemovalReport,
}

/// Removes things from `scene`, whose objects are those of `map`.
pub(crate) fn run(
    scene: &Scene,
    map: &SemanticMap,
    options: &RemovalOptions,
    observer: &mut dyn Observer,
) -> Result<ReducedScene, JobError> {
    let photos: Vec<Camera> = scene.cameras.iter().filter(|c| !c.held_out).map(|c| c.camera.clone()).collect();
    let mut network = match options.paint {
        Some(Paint::Lama) => Some(Lama::open(&catalog::find(LAMA, ModelRole::Inpainter)?)?),
        _ => None,
    };
    let network = network.as_mut();
    let done = removal::remove(&scene.cloud, map, &photos, &scene.settings, options, network, observer)?;
    let (rest, number) = edit::forget(map, &options.ids);
    let mut new = rest.select_fully(&done.kept);
    for id in done.identity_of.iter().skip(done.kept.len()).map(|id| number[*id as usize]) {
        new.identity_of.push(id);
        // All identities of invented Gaussians are guesses.
        new.margin.push(GUESSED);
        new.codes.push(new.identities.codes(id));
    }
    let mut stays = vec![false; scene.cloud.len()];
    done.kept.iter().for_each(|i| stays[*i] = true);
    let gone: Vec<usize> = (0..stays.len()).filter(|i| !stays[*i]).collect();
    // Photos still show the removed things.
    new.add_removed(scene.cloud.select(&gone));
    Ok(ReducedScene { cloud: done.cloud.into(), map: new.into(), report: done.report })
}

/// Request of the window and the agent: the result goes into a folder beside the scene's.
#[derive(Clone, Debug, PartialEq)]
pub struct RemoveRequest {
    /// Folder of the scene.
    pub(crate) folder: PathBuf,
    pub(crate) options: RemovalOptions,
    /// True if the scene is retrained on its photos without the thing, which takes as long as the first training.
    pub(crate) retrain: bool,
}

/// A stored scene without some things.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredRemoval {
    /// Folder of the new scene.
    pub(crate) folder: PathBuf,
    /// Names of the removed things.
    pub(crate) name: String,
    pub(crate) request: RemoveRequest,
    pub(crate) report: RemovalReport,
    /// State of the stored scene.
    state: Option<String>,
}

impl StoredRemoval {
    /// Deletes it with its folder, if it is unchanged since it was stored, and nothing else is there.
    pub(crate) fn delete(&self) -> Result<(), IoError> {
        SceneFolder::delete(&self.folder, self.state.as_deref())
    }
}

/// Removes things from the scene in a folder and stores the result beside it.
pub(crate) fn run_request(request: &RemoveRequest, observer: &mut dyn Observer) -> Result<StoredRemoval, JobError> {
    let scene = open::scene(&request.folder)?;
    let done = into_new_scene(&scene, &request.options, request.retrain, None, observer)?;
    let NewScene { folder, name, report, .. } = done;
    let state = scene_info::load_info(&folder)?.state;
    Ok(StoredRemoval { folder, name, request: request.clone(), report, state })
}

/// A scene that was just made without some things.
pub(crate) struct NewScene {
    pub(crate) folder: PathBuf,
    /// Names of the removed things.
    pub(crate) name: String,
    pub(crate) gaussians: usize,
    pub(crate) report: RemovalReport,
}

/// Removes things from `scene` and stores the result in `out`, or in a new folder beside the scene. With `retrain` the
/// new scene is trained on photos without the things; a run that was stopped is resumed.
pub(crate) fn into_new_scene(
    scene: &Scene,
    options: &RemovalOptions,
    retrain: bool,
    out: Option<&Path>,
    observer: &mut dyn Observer,
) -> Result<NewScene, JobError> {
    let map = scene.semantics()?;
    let name = removal::names(&map, &options.ids);
    let without = (options, name.as_str());
    let folder = out.map_or_else(|| new_folder(scene, &map, without, retrain), Path::to_path_buf);
    match retrain {
        true => photos_without::check(scene, without, &folder)?,
        false => derived::check(&folder)?,
    }
    let done = run(scene, &map, options, observer)?;
    if !retrain {
        store(scene, &name, &done, &folder)?;
    } else if !photos_without::retrain(scene, &map, without, (&done.cloud, &done.map), &folder, observer)? {
        return Err(Interrupted.into());
    }
    Ok(NewScene { folder, name, gaussians: done.cloud.len(), report: done.report })
}

/// Returns the folder beside the scene for a scene without these things, or one in which that was begun.
fn new_folder(scene: &Scene, map: &SemanticMap, without: (&RemovalOptions, &str), retrain: bool) -> PathBuf {
    let words: Vec<String> = without.0.ids.iter().map(|id| export::identity_name(&map.identities, *id)).collect();
    let how = format!("without-{}", words.join("-"));
    let place = scene.folder.as_ref().unwrap_or(&scene.path);
    let begun = |folder: &Path| photos_without::is_begun(scene, without, folder);
    match retrain {
        true => derived::folder_beside(place, &format!("{how}-retrained"), begun),
        false => derived::free_folder(place, &how),
    }
}

/// Returns a report in words.
pub(crate) fn summary(name: &str, report: &RemovalReport) -> String {
    let count = |n: usize| format::things(n, "Gaussian");
    let mut text = format!("Removed {name} ({}).", count(report.taken()));
    match report.surfaces.iter().map(|s| s.roughness).reduce(f64::max) {
        None => text += " Nothing had to be filled.",
        Some(rough) => {
            let surfaces = format::things(report.surfaces.len(), "surface");
            text += &format!(" Filled {surfaces} ({} new)", format::things(report.invented(), "Gaussian"));
            text += if report.brightened > 0 { ", brightened its shadow." } else { "." };
            if rough > ROUGH {
                text += " A guess: the surroundings are not flat.";
            }
        }
    }
    text
}

/// Unevenness of a surface, as a share of the hole in it, from which its fill is a guess.
const ROUGH: f64 = 0.1;

/// Margin of the identities of invented Gaussians.
const GUESSED: f32 = 0.5;

/// Stores the result, which is without `name`, as a scene in the folder `out`; the one in `from` is unchanged.
fn store(from: &Scene, name: &str, reduced: &ReducedScene, out: &Path) -> Result<(), JobError> {
    let name = format!("{} without {name}", from.name);
    derived::store(from, (name, false), &reduced.cloud, Some(&reduced.map), out)?;
    Ok(())
}
