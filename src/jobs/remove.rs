//! Taking things out of a scene, for good, into a scene of its own.

use std::path::Path;
use std::sync::Arc;

use super::{JobError, Scene};
use crate::io::trained;
use crate::io::{IoError, SceneFolder};
use crate::pipeline::observer::Observer;
use crate::pipeline::removal;
pub(crate) use crate::pipeline::removal::{Paint, RemovalOptions, RemovalReport};
use crate::pipeline::semantics::edit;
use crate::scene::{Camera, GaussianCloud, SemanticMap};

/// A scene without some of its things.
#[derive(Clone, Debug)]
pub(crate) struct Reduced {
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) map: Arc<SemanticMap>,
    pub(crate) report: RemovalReport,
}

/// Takes things out of `scene`, whose objects are those of `map`.
pub(crate) fn run(
    scene: &Scene,
    map: &SemanticMap,
    options: &RemovalOptions,
    observer: &mut dyn Observer,
) -> Result<Reduced, JobError> {
    let photos: Vec<Camera> = scene.cameras.iter().filter(|c| !c.held_out).map(|c| c.camera.clone()).collect();
    let done = removal::remove(&scene.cloud, map, &photos, &scene.settings, options, observer)?;
    let (rest, number) = edit::forget(map, &options.ids);
    let mut new = rest.select(&done.kept);
    (new.language, new.findings) = (rest.language, rest.findings);
    for id in done.identity_of.iter().skip(done.kept.len()).map(|id| number[*id as usize]) {
        new.identity_of.push(id);
        // Whose it is was guessed, as all of it was.
        new.margin.push(GUESSED);
        new.codes.push(new.identities.codes(id));
    }
    Ok(Reduced { cloud: done.cloud.into(), map: new.into(), report: done.report })
}

/// How sure it is whose invented Gaussians are.
const GUESSED: f32 = 0.5;

/// Refuses a folder for the result that holds anything.
pub(crate) fn check(out: &Path) -> Result<(), JobError> {
    let holds_something = std::fs::read_dir(out).is_ok_and(|mut all| all.next().is_some());
    if holds_something || out.is_file() {
        let what = "holds something already; the scene that is made goes into a new folder";
        return Err(IoError::Occupied { folder: out.into(), what }.into());
    }
    Ok(())
}

/// Stores the result as a scene in the folder `out`, beside which that in `from` stays as it is.
pub(crate) fn store(from: &Scene, reduced: &Reduced, out: &Path) -> Result<(), JobError> {
    let Some(folder) = &from.folder else { return Err(JobError::NoScene(from.path.clone())) };
    check(out)?;
    let held = SceneFolder::hold(out, "storing a scene")?;
    let mut info = trained::load_info(folder)?;
    if let (Some(dataset), Some(path)) = (&mut info.dataset, &from.dataset_path) {
        *dataset = dataset.moved(path, out);
    }
    held.save(&info, &reduced.cloud, Some(&reduced.map))?;
    Ok(())
}
