//! Cleaning a scene: measures of its Gaussians, and the scene without the chosen ones.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{JobError, Scene, derived, open, rearrange};
use crate::pipeline::cleaning::{self, CleanView};
pub(crate) use crate::pipeline::cleaning::{CleanRule, CloudMeasures, SplatMeasure};
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::splat_edit::SplatEdit;
use crate::scene::{Dataset, GaussianCloud};

/// Measures the Gaussians of `scene`, with its training photos if they are available; `photos` is their place if it
/// differs from the scene's record.
pub(crate) fn measure(
    scene: &Scene,
    photos: Option<&Path>,
    observer: &mut dyn Observer,
) -> Result<CloudMeasures, JobError> {
    let dataset = match (photos, &scene.dataset_path) {
        (Some(path), _) => Some(open::dataset(path)?),
        (None, Some(path)) => match open::dataset(path) {
            Ok(dataset) => Some(dataset),
            Err(e) => {
                observer.note(Severity::Warning, format!("the photos are left out: {e}"));
                None
            }
        },
        (None, None) => None,
    };
    let views = views(scene, dataset.as_ref());
    Ok(cleaning::measure(&scene.cloud, &views, &scene.settings, observer)?)
}

/// Request of the window to measure Gaussians.
#[derive(Clone, Debug)]
pub struct MeasureRequest {
    /// Path of the scene.
    pub(crate) path: PathBuf,
    /// Its Gaussians as they are now.
    pub(crate) cloud: Arc<GaussianCloud>,
}

/// Gaussians and their measures.
#[derive(Clone, Debug)]
pub struct MeasuredCloud {
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) measures: CloudMeasures,
}

/// Measures the Gaussians on screen.
pub(crate) fn measured(request: MeasureRequest, observer: &mut dyn Observer) -> Result<MeasuredCloud, JobError> {
    let MeasureRequest { path, cloud } = request;
    let scene = Scene { cloud: Arc::clone(&cloud), ..open::scene(&path)? };
    Ok(MeasuredCloud { cloud, measures: measure(&scene, None, observer)? })
}

/// Returns the training views of the scene, without held-out ones; each has its photo if the dataset has it.
fn views(scene: &Scene, dataset: Option<&Dataset>) -> Vec<CleanView> {
    let photo = |name: &str| dataset.and_then(|d| d.photos.iter().find(|p| p.name == name)).cloned();
    let trained = scene.cameras.iter().filter(|c| !c.held_out);
    trained.map(|c| CleanView { camera: c.camera.clone(), photo: photo(&c.name) }).collect()
}

/// Returns for each Gaussian whether any of the rules chooses it.
pub(crate) fn choose(rules: &[CleanRule], of: &CloudMeasures) -> Result<Vec<bool>, JobError> {
    let mut gone: Vec<bool> = Vec::new();
    for rule in rules {
        let chosen = rule.choose(of)?;
        gone = if gone.is_empty() { chosen } else { gone.iter().zip(&chosen).map(|(a, b)| a | b).collect() };
    }
    Ok(gone)
}

/// Writes `scene` without the `gone` Gaussians to `out`, as [`derived::write`] does. Returns the number of Gaussians
/// left.
pub(crate) fn store(
    scene: &Scene,
    gone: Vec<bool>,
    out: &Path,
    observer: &mut dyn Observer,
) -> Result<usize, JobError> {
    let (cloud, map) = rearrange::applied(scene, &SplatEdit::Delete(gone))?;
    let cloud = Arc::new(cloud);
    derived::write(scene, "cleaned", &cloud, map.as_ref(), out, observer)?;
    Ok(cloud.len())
}
