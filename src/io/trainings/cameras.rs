//! Cameras of a training that has no list of its own: those of its photos.

use crate::io::gs_output::GsOutput;
use crate::io::posed;
use crate::io::trained::SceneCamera;
use crate::scene::Dataset;

/// Adds the cameras of the photos that were found; `held_out` tells which of so many photos were not trained on.
/// Returns the photos.
pub(super) fn add(beside: &mut GsOutput, held_out: impl Fn(usize) -> Vec<bool>) -> Option<Dataset> {
    let path = beside.source.as_ref()?.found.clone()?;
    let dataset = match posed::read(&path) {
        Some(Ok(dataset)) => dataset,
        Some(Err(e)) => {
            beside.warnings.push(format!("its photos cannot be read: {e}"));
            beside.source = None;
            return None;
        }
        None => {
            let path = path.display();
            beside.warnings.push(format!("{path} no longer holds posed photos; put them back to see them"));
            beside.source = None;
            return None;
        }
    };
    let split = dataset.test_photos() > 0;
    let held_out = held_out(dataset.photos.len());
    let camera = |(i, photo): (usize, &crate::scene::Photo)| SceneCamera {
        name: photo.name.clone(),
        camera: photo.camera.clone(),
        held_out: if split { photo.test_split } else { held_out.get(i).copied().unwrap_or_default() },
    };
    beside.cameras = dataset.photos.iter().enumerate().map(camera).collect();
    Some(dataset)
}
