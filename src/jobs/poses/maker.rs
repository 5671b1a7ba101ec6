//! Contract of a maker of camera poses, and the places where makers are looked for.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::{DATABASE, MakerStep, PoseWork};
use crate::io::program;
use crate::jobs::{Folders, JobError};
use crate::pipeline::observer::Observer;

/// Finder of camera poses.
pub(crate) trait PoseMaker {
    /// Kind, which is noted with the result.
    fn kind(&self) -> MakerKind;
    /// Name, for display.
    fn name(&self) -> String;
    /// Steps, in order.
    fn steps(&self) -> &'static [MakerStep] {
        &[MakerStep::Features, MakerStep::Matches, MakerStep::Mapping]
    }
    /// File in the folder of poses with what comes before poses.
    fn keeps(&self) -> &'static str {
        DATABASE
    }
    /// Does a step.
    ///
    /// # Errors
    /// If it fails, or the observer asks to stop.
    fn run(&self, step: MakerStep, work: &PoseWork<'_>, observer: &mut dyn Observer) -> Result<(), JobError>;
}

/// Kinds of makers, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MakerKind {
    /// The program COLMAP, with its own global mapper or GLOMAP where there is one
    Colmap,
    /// COLMAP as a Python package, in the active Python or in an environment of this program
    Pycolmap,
    /// Built into this program, if it was built with the feature 'sfm'
    BuiltIn,
}

/// Places where makers are looked for.
#[derive(Clone, Debug, Default)]
pub(crate) struct MakerPlaces {
    /// The variable PATH.
    pub(crate) path: std::ffi::OsString,
    /// The folder of the active Python environment.
    pub(crate) python: Option<PathBuf>,
    /// The folder of the environment that this program makes.
    pub(crate) own_python: PathBuf,
}

impl MakerPlaces {
    /// The places of this process.
    pub(crate) fn usual(folders: &Folders) -> Self {
        Self {
            path: std::env::var_os("PATH").unwrap_or_default(),
            python: std::env::var_os("VIRTUAL_ENV").map(PathBuf::from).filter(|p| p.is_absolute()),
            own_python: folders.cache().join("pycolmap"),
        }
    }

    /// Path of a program; relative entries of PATH are not believed.
    pub(super) fn program(&self, name: &str) -> Option<PathBuf> {
        program::on_path(&self.path, name)
    }
}
