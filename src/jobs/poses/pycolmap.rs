//! COLMAP's Python package, by a short script in a process of its own.

use std::path::PathBuf;

use super::maker::{MakerKind, MakerPlaces, PoseMaker};
use super::process::{self, PoseStage};
use super::{ENOUGH, MakerStep, PoseWork, SNAPSHOTS, environment};
use crate::jobs::JobError;
use crate::pipeline::observer::Observer;

/// The script; its first argument is the step.
const SCRIPT: &str = include_str!("pycolmap.py");
/// A program that says on which version it would run.
const ASK: &str = "import importlib.util as u, importlib.metadata as m\n\
                   if u.find_spec('pycolmap'): print('pycolmap', m.version('pycolmap'))";

/// A Python that has the package.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Pycolmap {
    pub(super) python: PathBuf,
    pub(super) version: String,
}

impl Pycolmap {
    /// Asks the active Python, then the one of this program.
    pub(super) fn at(places: &MakerPlaces) -> Option<Self> {
        let active = places.python.iter().filter_map(|environment| environment::python_of(environment));
        let on_path = ["python3", "python"].iter().filter_map(|name| places.program(name)).take(1);
        let own = environment::ready(&places.own_python);
        active.chain(on_path).chain(own).find_map(|python| {
            let said = process::output(&python, &["-c", ASK]);
            let version = said.lines().find_map(|line| line.strip_prefix("pycolmap "))?.trim().to_owned();
            Some(Self { python, version })
        })
    }
}

impl PoseMaker for Pycolmap {
    fn kind(&self) -> MakerKind {
        MakerKind::Pycolmap
    }

    fn name(&self) -> String {
        format!("pycolmap {}", self.version)
    }

    fn run(&self, step: MakerStep, work: &PoseWork<'_>, observer: &mut dyn Observer) -> Result<(), JobError> {
        let flag = |is: bool| if is { "1" } else { "0" }.to_owned();
        let word = match step {
            MakerStep::Features => "features",
            MakerStep::Matches => "matches",
            MakerStep::Mapping => "mapping",
        };
        let path = |path: &std::path::Path| path.to_string_lossy().into_owned();
        let enough = (ENOUGH * work.photos.len() as f64).ceil() as usize;
        let snapshots = (step == MakerStep::Mapping && observer.wants_poses()).then(|| work.at(SNAPSHOTS));
        let args = vec![
            "-u".into(),
            "-c".into(),
            SCRIPT.into(),
            word.into(),
            path(work.out),
            path(&work.sparse),
            flag(work.one_camera),
            flag(work.is_sequential()),
            enough.to_string(),
            flag(work.maps_globally()),
            snapshots.as_deref().map_or_else(String::new, path),
            work.photos_per_snapshot().to_string(),
        ];
        let stage = PoseStage { title: step.title(), program: self.python.clone(), args, snapshots };
        process::run(&stage, work.photos.len(), observer)
    }
}
