//! Saving a copy of a trained scene, with everything in its folder.

use std::path::{Path, PathBuf};

use super::JobError;
use crate::io::scene_copy;
use crate::io::scene_files::is_scene;
use crate::pipeline::observer::{Observer, Ticker};

/// Copies the scene in the folder `from` to the folder `to`, which is empty or does not exist; returns that folder.
///
/// # Errors
/// If there is no scene, it is being written to, the place is taken, or the observer asks to stop. There is nothing at
/// `to` then.
pub(crate) fn run(from: &Path, to: &Path, observer: &mut dyn Observer) -> Result<PathBuf, JobError> {
    if !is_scene(from) {
        return Err(JobError::NoScene(from.into()));
    }
    let mut ticker = Ticker::new("Copying files", 0);
    scene_copy::copy(from, to, &mut |done, all| {
        ticker.total = all;
        Ok(ticker.tick(done as usize, observer)?)
    })
}
