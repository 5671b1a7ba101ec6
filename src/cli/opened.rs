//! What the subcommands need of a path, whatever kind of thing it holds.

use std::path::Path;

use super::CliError;
use crate::jobs::open;
use crate::scene::Dataset;

pub use crate::jobs::Scene as DrawableScene;

/// Opens a trained scene or a splat.
pub fn drawable(path: &Path) -> Result<DrawableScene, CliError> {
    Ok(open::scene(path)?)
}

/// Opens posed photos.
pub fn dataset(path: &Path) -> Result<Dataset, CliError> {
    Ok(open::dataset(path)?)
}
