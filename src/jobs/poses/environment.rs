//! A Python environment of this program with pycolmap in it, made on request only.

use std::path::{Path, PathBuf};

use super::maker::MakerPlaces;
use super::process::{self, PoseStage};
use crate::jobs::{JobError, export};
use crate::pipeline::observer::Observer;

/// Sentence to agree to before it is made.
pub(crate) const TERMS: &str = "downloads the Python package pycolmap (COLMAP; BSD 3-clause license) from pypi.org, \
                                about 135 MB on the disk";
/// Name of the file that says that the environment is complete.
const READY: &str = "ready";
/// Requirement that pip is given.
const PACKAGE: &str = "pycolmap>=3.11";

/// Python of an environment, if there is one.
pub(super) fn python_of(environment: &Path) -> Option<PathBuf> {
    let places = if cfg!(windows) { ["Scripts/python.exe"; 2] } else { ["bin/python3", "bin/python"] };
    places.iter().map(|place| environment.join(place)).find(|python| python.is_file())
}

/// Python of the environment of this program, if it is complete.
pub(super) fn ready(environment: &Path) -> Option<PathBuf> {
    environment.join(READY).is_file().then(|| python_of(environment)).flatten()
}

/// Makes the environment. One that is not complete is made anew.
///
/// # Errors
/// If there is no Python, pip fails, or the observer asks to stop.
pub(crate) fn install(places: &MakerPlaces, observer: &mut dyn Observer) -> Result<(), JobError> {
    let environment = &places.own_python;
    if ready(environment).is_some() {
        return Ok(());
    }
    let python = ["python3", "python"].iter().find_map(|name| places.program(name)).ok_or(JobError::NoPython)?;
    super::remove(environment)?;
    export::make_parent(environment)?;
    let title = "Installing pycolmap";
    let at = environment.to_string_lossy().into_owned();
    let words = |all: &[&str]| -> Vec<String> { all.iter().map(|word| (*word).to_owned()).collect() };
    process::run(&PoseStage::new(title, python, words(&["-m", "venv", &at])), 0, observer)?;
    let program = python_of(environment).ok_or(JobError::NoPython)?;
    let pip = ["-m", "pip", "install", "--no-input", "--disable-pip-version-check", "--only-binary", ":all:", PACKAGE];
    process::run(&PoseStage::new(title, program, words(&pip)), 0, observer)?;
    Ok(export::text(&environment.join(READY), "pycolmap\n")?)
}
