//! Finished steps on the way to poses, noted beside them, so that a canceled search goes on where it stopped.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{DATABASE, FoundPoses, IMAGES, MakerKind, MakerStep, PoseMaker, SPARSE, remove};
use crate::io::file_stamp::FileStamp;
use crate::io::files;
use crate::io::unposed::Unposed;
use crate::jobs::{JobError, export};

/// Name of the note.
pub(super) const FILE: &str = "poses.json";

/// Photo as it was when its poses were sought.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct KnownPhoto {
    name: String,
    #[serde(flatten)]
    stamp: FileStamp,
}

/// Note on poses in a folder.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct PoseState {
    maker: MakerKind,
    photos: Vec<KnownPhoto>,
    /// Finished steps.
    pub(super) done: Vec<MakerStep>,
    /// Result, once all steps are done.
    pub(super) found: Option<FoundPoses>,
}

impl PoseState {
    /// True if a folder has such a note.
    pub(super) fn is_in(out: &Path) -> bool {
        out.join(FILE).is_file()
    }

    /// Reads the note in `out`. If it is of other photos or another maker, or there is none, the work there is removed.
    pub(super) fn resume(photos: &Unposed, maker: &dyn PoseMaker, out: &Path) -> Result<Self, JobError> {
        let listed = known(photos)?;
        let earlier: Option<Self> = files::read_json(&out.join(FILE)).ok();
        if let Some(earlier) = earlier.filter(|e| e.maker == maker.kind() && e.photos == listed) {
            let is_there = |step: &MakerStep| match step {
                MakerStep::Mapping => out.join(SPARSE).join("0").is_dir(),
                _ => out.join(maker.keeps()).is_file(),
            };
            if earlier.done.iter().all(is_there) {
                return Ok(earlier);
            }
        }
        for name in [maker.keeps(), DATABASE, "database.db-wal", "database.db-shm", SPARSE, IMAGES] {
            remove(&out.join(name))?;
        }
        let new = Self { maker: maker.kind(), photos: listed, done: Vec::new(), found: None };
        new.write(out)?;
        Ok(new)
    }

    /// Notes that a step is finished.
    pub(super) fn finish(&mut self, step: MakerStep, out: &Path) -> Result<(), JobError> {
        self.done.push(step);
        self.write(out)
    }

    pub(super) fn write(&self, out: &Path) -> Result<(), JobError> {
        Ok(export::json(&out.join(FILE), self)?)
    }
}

fn known(photos: &Unposed) -> Result<Vec<KnownPhoto>, JobError> {
    let of = |name: &String| {
        let stamp = FileStamp::of(&photos.images.join(name))?;
        Ok(KnownPhoto { name: name.clone(), stamp })
    };
    photos.photos.iter().map(of).collect()
}
