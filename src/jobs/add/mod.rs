//! Photos that are added to a trained scene: a new scene that is better where they say more, and the same elsewhere.
//!
//! [`gather`](gather::gather) finds the cameras of the photos. [`begin`](begin::begin) chooses the Gaussians that go on
//! and writes a checkpoint, from which the training resumes as any other. [`finish`](finish::closer_parts) carries
//! identities over and adds the parts that masks of the added photos show. The scene that is added to is only read.

mod align;
mod begin;
mod finish;
mod gather;
mod told;

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;
use serde_json::json;

pub(crate) use self::begin::RefinedShare;
pub(crate) use self::finish::HeldOutScores;
pub(crate) use self::gather::{RefusedPhoto, holds_photos};
use super::refined::at_refined_poses;
use super::train::{IfChanged, TrainStart, Trained};
use super::{JobError, Scene, derived, open, train};
use crate::io::joined::{self, AddedPhoto, JoinedPhotos};
use crate::io::scene_files::CHECKPOINT_FILE;
use crate::io::{SceneFolder, files, trained};
use crate::pipeline::observer::{Interrupted, Observer, Severity};
use crate::pipeline::train::checkpoint;
use crate::render::BackendChoice;
use crate::scene::Dataset;

/// Folder of the list of photos in that of the scene.
const PHOTOS: &str = "photos";
/// Suffix of a scene with added photos.
const CLOSER: &str = "closer";

/// Choices for adding photos.
#[derive(Clone, Debug, Default)]
pub(crate) struct AddOptions {
    /// Training steps; `None` = by the number of photos.
    pub(crate) steps: Option<u64>,
    /// Focal length of photos without poses at full size, px; `None` = found.
    pub(crate) focal_px: Option<f64>,
    /// Data set of the scene; else the one it was trained on.
    pub(crate) dataset: Option<PathBuf>,
    /// Masks of the added photos; else those in the folders of posed ones.
    pub(crate) masks: Option<PathBuf>,
    /// Segmenter of added photos without masks; `None` = they name no parts.
    pub(crate) segmenter: Option<String>,
    pub(crate) backend: Option<BackendChoice>,
}

/// A scene with added photos.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct AddedScene {
    pub(crate) out: PathBuf,
    /// False if the observer stopped it; the same request goes on.
    pub(crate) finished: bool,
    /// Added photos that were trained on, that are held out, and that were located.
    pub(crate) trained: usize,
    pub(crate) held_out: usize,
    pub(crate) located: usize,
    pub(crate) refused: Vec<RefusedPhoto>,
    pub(crate) refined: RefinedShare,
    /// Gaussians now.
    pub(crate) gaussians: usize,
    /// True if all Gaussians that stay are those of the scene before, bit for bit.
    pub(crate) unchanged: bool,
    /// Held-out photos of the scene before, before and now.
    pub(crate) held_out_scores: Option<HeldOutScores>,
    /// Objects and parts that masks of the added photos named.
    pub(crate) new_identities: usize,
    pub(crate) steps: u64,
    pub(crate) secs: f64,
}

/// Adds photos to the scene in `folder` by the usual choices. The result is beside it, in the folder in which the same was
/// begun, or in a new one.
///
/// # Errors
/// As [`run`]; also if the observer stops it, which leaves what the same request goes on from.
pub(crate) fn beside(folder: &Path, paths: &[PathBuf], observer: &mut dyn Observer) -> Result<AddedScene, JobError> {
    let (scene, options) = (open::scene(folder)?, AddOptions::default());
    let request = request(&scene, paths, &options);
    let is_usable = |out: &Path| is_begun(&request, out) || is_bare(out);
    let out = derived::folder_beside(folder, CLOSER, is_usable);
    let done = run(&scene, paths, &options, &out, observer)?;
    if done.finished { Ok(done) } else { Err(Interrupted.into()) }
}

/// Adds the photos at `paths`, files or folders, to `scene`; the result is the scene in the folder `out`. A stopped run
/// with the same request there is resumed.
pub(crate) fn run(
    scene: &Scene,
    paths: &[PathBuf],
    options: &AddOptions,
    out: &Path,
    observer: &mut dyn Observer,
) -> Result<AddedScene, JobError> {
    let start = Instant::now();
    let folder = scene.folder.as_deref().ok_or_else(|| JobError::NoScene(scene.path.clone()))?;
    let request = request(scene, paths, options);
    check(scene, folder, &request, out)?;
    if (options.masks.is_some() || options.segmenter.is_some()) && scene.known_semantics()?.is_none() {
        return Err(JobError::NoObjects(scene.path.clone()));
    }
    let photos = out.join(PHOTOS);
    let mut refused = Vec::new();
    if !is_begun(&request, out) {
        let given = open::dataset(&scene.photos(options.dataset.as_deref())?)?;
        let mut own = given.clone();
        at_refined_poses(&mut own.photos, &trained::load_info(folder)?);
        let found = gather::gather(scene, &own, paths, options.focal_px, observer)?;
        for photo in &found.refused {
            observer.note(Severity::Warning, format!("{} is not added: {}", photo.photo.display(), photo.reason));
        }
        if !found.added.iter().any(|p| !p.held_out) {
            let why = found.refused.first().map(|r| format!(" ({}: {})", r.photo.display(), r.reason));
            let text = format!("no photo is left to add{}; the scene is as it was", why.unwrap_or_default());
            return Err(JobError::AddPhotos(text));
        }
        refused = found.refused;
        let masks = options.masks.clone().or_else(|| finish::masks_among(&found.roots, &found.added));
        let request = with_masks(request.clone(), masks.as_deref());
        keep(scene, [&given, &own], found.added, request, &photos)?;
    }
    let list = joined::list(&photos)?;
    let dataset = open::dataset(&photos)?;
    let new = || list.added.iter().skip(earlier(&list));
    let names = |wanted: fn(&&AddedPhoto) -> bool| new().filter(wanted).map(|p| p.name.clone()).collect();
    let (added, located): (BTreeSet<String>, BTreeSet<String>) = (names(|_| true), names(|p| p.located));
    let trained_on = new().filter(|p| !p.held_out).count();
    let (mut config, from) = begin::settings(scene, &dataset, trained_on.max(1), options.steps);
    config.backend = options.backend.unwrap_or(config.backend);
    // Their places come from this scene alone; now both are fitted. Other photos keep theirs.
    config.refine_poses = !located.is_empty() && config.backend != BackendChoice::Gpu;
    if !out.join(CHECKPOINT_FILE).is_file() {
        let held = SceneFolder::hold(out, "adding photos")?;
        let before = trained::load(folder)?;
        let begun = begin::begin(&held, (scene, before), &dataset, (&config, from), [&added, &located], observer);
        begun.inspect_err(|e| forget(e, out))?;
    }
    let objects_of = TrainStart { objects_of: Some(folder.into()), if_changed: IfChanged::Ask, more_steps: false };
    let done = train::run(&dataset, &config, [out.to_path_buf()], &objects_of, observer)?;
    let frozen = frozen(out)?;
    let mut report = report(scene, &list, &done, frozen, (refused, start));
    report.unchanged = finish::is_unchanged(&trained::load(folder)?.cloud, &done.outcome.cloud, frozen);
    report.held_out_scores = finish::held_out_scores(scene, &done.outcome.evaluations, &added);
    if report.finished {
        let masks = list.request.get("found_masks").and_then(|m| m.as_str()).map(PathBuf::from);
        let by = (masks.as_deref(), options.segmenter.as_deref());
        report.new_identities = finish::closer_parts((out, &photos), &list, by, frozen, observer)?;
    }
    report.secs = start.elapsed().as_secs_f64();
    Ok(report)
}

/// Returns the number of photos in the list that earlier requests added.
fn earlier(list: &JoinedPhotos) -> usize {
    list.request.get("earlier").and_then(serde_json::Value::as_u64).unwrap_or(0) as usize
}

/// Facts that make a run the same as an earlier one.
fn request(scene: &Scene, paths: &[PathBuf], options: &AddOptions) -> serde_json::Value {
    json!({
        "version": 1, "scene": scene.folder.as_deref().map(files::real), "state": scene.state,
        "photos": paths.iter().map(|p| files::real(p)).collect::<Vec<_>>(), "steps": options.steps,
        "focal_px": options.focal_px, "masks": options.masks,
    })
}

fn with_masks(mut request: serde_json::Value, masks: Option<&Path>) -> serde_json::Value {
    if let (Some(all), Some(masks)) = (request.as_object_mut(), masks) {
        all.insert("found_masks".into(), json!(files::real(masks)));
    }
    request
}

/// Returns whether exactly this was begun in a folder.
fn is_begun(request: &serde_json::Value, out: &Path) -> bool {
    let Ok(list) = joined::list(&out.join(PHOTOS)) else { return false };
    let mut wanted = request.as_object().into_iter().flatten();
    wanted.all(|(key, value)| list.request.get(key) == Some(value))
}

/// Refuses scenes that nothing can be added to, and folders for the result that hold anything but a run that this
/// request began.
fn check(scene: &Scene, folder: &Path, request: &serde_json::Value, out: &Path) -> Result<(), JobError> {
    if scene.edited {
        let text = format!(
            "{}: its Gaussians were edited, so its photos show it otherwise, and training on them would undo that; add the \
             photos to the scene before the edit",
            scene.path.display()
        );
        return Err(JobError::AddPhotos(text));
    }
    if files::real(out) == files::real(folder) {
        let text = format!("{} is the scene itself, which stays; choose a new folder", out.display());
        return Err(JobError::Output(text));
    }
    if is_begun(request, out) || is_bare(out) { Ok(()) } else { derived::check(out) }
}

/// Returns whether a folder holds nothing, or a place for photos without a list, as after a kill at the begin.
fn is_bare(out: &Path) -> bool {
    let is_ours = |name: &OsStr| name == PHOTOS || name.to_string_lossy().starts_with('.');
    let is_alone = std::fs::read_dir(out).is_ok_and(|all| all.flatten().all(|entry| is_ours(&entry.file_name())));
    is_alone && !files::holds_something(&out.join(PHOTOS))
}

/// Removes the list of photos that cannot be added, with its folder if that holds nothing else.
fn forget(error: &JobError, out: &Path) {
    if matches!(error, JobError::AddPhotos(_)) {
        let _ = std::fs::remove_file(out.join(PHOTOS).join(joined::JOINED_FILE));
        let _ = std::fs::remove_dir(out.join(PHOTOS));
    }
}

/// Writes the list of all photos: the scene's own, as given and at the poses that its training refined, those that were
/// added before, and those that are new.
fn keep(
    scene: &Scene,
    [given, own]: [&Dataset; 2],
    added: Vec<AddedPhoto>,
    mut request: serde_json::Value,
    folder: &Path,
) -> Result<(), JobError> {
    let earlier = joined::list(&own.root).ok();
    let held = super::held_out::held_out(own, &scene.cameras, None, scene.config.holdout_every);
    let (before, mut refined) = earlier.map_or_else(Default::default, |list| (list.added, list.refined));
    let camera = |name: &str| own.photos.iter().find(|p| p.name == name).map(|p| p.camera.clone());
    let moved = |p: AddedPhoto| {
        let photo = p.photo(&own.root);
        let camera = camera(&p.name).unwrap_or_else(|| p.camera.clone());
        AddedPhoto { path: photo.path, mask: photo.mask, camera, ..p }
    };
    let is_earlier = |name: &str| before.iter().any(|p| p.name == name);
    let pairs = given.photos.iter().zip(&own.photos);
    let moved_since = pairs.filter(|(given, own)| given.camera != own.camera && !is_earlier(&own.name));
    refined.extend(moved_since.map(|(_, own)| (own.name.clone(), own.camera.clone())));
    if let Some(all) = request.as_object_mut() {
        all.insert("earlier".into(), json!(before.len()));
    }
    let base = joined::list(&own.root).map_or_else(|_| own.source().into(), |list| own.root.join(list.photos));
    let list = JoinedPhotos {
        name: derived::name(&scene.name, CLOSER, folder.parent().unwrap_or(folder)),
        photos: files::real(&base),
        held_out: held.iter().map(|&i| own.photos[i].name.clone()).collect(),
        refined,
        added: before.iter().cloned().map(moved).chain(added).collect(),
        request,
        ..JoinedPhotos::default()
    };
    std::fs::create_dir_all(folder).map_err(|cause| crate::io::error::write_error(folder, cause))?;
    Ok(joined::write(folder, &list)?)
}

/// Returns the number of Gaussians at the front of a scene in `out` that stay.
fn frozen(out: &Path) -> Result<usize, JobError> {
    let saved = checkpoint::load(&out.join(CHECKPOINT_FILE)).map_err(crate::pipeline::train::TrainError::from)?;
    Ok(saved.and_then(|s| s.header.refinement).map_or(0, |r| r.frozen))
}

fn report(
    scene: &Scene,
    list: &JoinedPhotos,
    done: &Trained,
    frozen: usize,
    (refused, start): (Vec<RefusedPhoto>, Instant),
) -> AddedScene {
    let new = &list.added[earlier(list).min(list.added.len())..];
    AddedScene {
        out: done.out.clone(),
        finished: done.is_finished(),
        trained: new.iter().filter(|p| !p.held_out).count(),
        held_out: new.iter().filter(|p| p.held_out).count(),
        located: new.iter().filter(|p| p.located).count(),
        refused,
        refined: RefinedShare { gaussians: scene.cloud.len(), frozen },
        gaussians: done.outcome.cloud.len(),
        unchanged: false,
        held_out_scores: None,
        new_identities: 0,
        steps: done.outcome.steps,
        secs: start.elapsed().as_secs_f64(),
    }
}

#[cfg(test)]
mod tests;
