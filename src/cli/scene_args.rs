//! Scenes that commands open, and the warnings of their files.

use std::path::Path;

use super::{CliError, output};
use crate::jobs::{Scene, open};
use crate::scene::Axes;

/// Axes of a splat's numbers.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(crate) struct AxesArgs {
    /// Axes of a splat file that says others or none, where x, y and z count to: rdf as in a .ply (right, down, front),
    /// rub as SPZ documents it (right, up, back), luf as in glTF, or any other three
    #[arg(long, value_name = "XYZ")]
    pub(crate) axes: Option<Axes>,
}

impl AxesArgs {
    /// Opens a trained scene or a splat, and prints the warnings of its file.
    pub(crate) fn open(self, path: &Path) -> Result<Scene, CliError> {
        let scene = open::scene_in(path, self.axes)?;
        scene.warnings.iter().for_each(|warning| output::warn(format!("{}: {warning}", path.display())));
        Ok(scene)
    }
}

/// Opens a trained scene or a splat, and prints the warnings of its file.
pub(crate) fn open_scene(path: &Path) -> Result<Scene, CliError> {
    AxesArgs::default().open(path)
}
