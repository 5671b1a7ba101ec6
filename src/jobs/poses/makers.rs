//! Makers of camera poses, and which of them are here.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::colmap::Colmap;
use super::pycolmap::Pycolmap;
use super::{DATABASE, PoseStep, PoseWork};
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
    fn steps(&self) -> &'static [PoseStep] {
        &[PoseStep::Features, PoseStep::Matches, PoseStep::Mapping]
    }
    /// File in the folder of poses with what comes before poses.
    fn keeps(&self) -> &'static str {
        DATABASE
    }
    /// Does a step.
    ///
    /// # Errors
    /// If it fails, or the observer asks to stop.
    fn run(&self, step: PoseStep, work: &PoseWork<'_>, observer: &mut dyn Observer) -> Result<(), JobError>;
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
pub(crate) struct Places {
    /// The variable PATH.
    pub(crate) path: std::ffi::OsString,
    /// The folder of the active Python environment.
    pub(crate) python: Option<PathBuf>,
    /// The folder of the environment that this program makes.
    pub(crate) own_python: PathBuf,
}

impl Places {
    /// The places of this process.
    pub(crate) fn usual(folders: &Folders) -> Self {
        Self {
            path: std::env::var_os("PATH").unwrap_or_default(),
            python: std::env::var_os("VIRTUAL_ENV").map(PathBuf::from).filter(|p| p.is_absolute()),
            own_python: super::environment::folder(folders),
        }
    }

    /// Path of a program; relative entries of PATH are not believed.
    pub(super) fn program(&self, name: &str) -> Option<PathBuf> {
        program::on_path(&self.path, name)
    }
}

/// Makers that are here, the best first. Python is started to ask for its package.
pub(crate) fn installed(places: &Places) -> Vec<Box<dyn PoseMaker>> {
    let mut all: Vec<Box<dyn PoseMaker>> = Vec::new();
    if let Some(colmap) = Colmap::at(places) {
        all.push(Box::new(colmap));
    }
    if let Some(pycolmap) = Pycolmap::at(places) {
        all.push(Box::new(pycolmap));
    }
    #[cfg(feature = "sfm")]
    all.push(Box::new(super::built_in::BuiltIn));
    all
}

/// The wanted maker, or the best one that is here.
///
/// # Errors
/// If it is not here; the error says how to get it.
pub(crate) fn choose(wanted: Option<MakerKind>, places: &Places) -> Result<Box<dyn PoseMaker>, JobError> {
    let found = installed(places).into_iter().find(|maker| wanted.is_none_or(|kind| kind == maker.kind()));
    found.ok_or(JobError::NoPoseMaker(wanted))
}
