//! Snapshots of an incremental mapper: reconstructions that it writes on its way, read while it works.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use crate::io::colmap;
use crate::jobs::sparse_cloud::sparse_cloud;
use crate::pipeline::observer::{FoundSoFar, Observer};

/// Least time between two looks.
const EVERY: Duration = Duration::from_millis(500);
/// Least multiple of the time that a look takes until the next one: the program's lines wait meanwhile.
const REST: u32 = 10;

/// Folder of snapshots, each in a folder of its own.
pub(super) struct Snapshots {
    folder: PathBuf,
    /// Number of all photos.
    photos: usize,
    /// The newest one that was read.
    read: Option<PathBuf>,
    next_look: Instant,
}

impl Snapshots {
    pub(super) fn new(folder: PathBuf, photos: usize) -> Self {
        Self { folder, photos, read: None, next_look: Instant::now() }
    }

    /// Passes on the newest complete snapshot if it is time to look and there is a new one; removes older ones.
    pub(super) fn look(&mut self, observer: &mut dyn Observer) {
        let start = Instant::now();
        if start < self.next_look {
            return;
        }
        let newest_first = by_age(&self.folder);
        for (i, snapshot) in newest_first.iter().enumerate() {
            if self.read.as_ref() == Some(snapshot) {
                break;
            }
            let Some(found) = read(snapshot, self.photos) else { continue };
            observer.poses(found);
            self.read = Some(snapshot.clone());
            // What stays is removed with the whole folder.
            newest_first[i + 1..].iter().for_each(|older| drop(fs::remove_dir_all(older)));
            break;
        }
        self.next_look = Instant::now() + EVERY.max(REST * start.elapsed());
    }
}

/// Folders in a folder, the newest first. Their names are times that overflow in some versions.
fn by_age(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut folders: Vec<(SystemTime, PathBuf)> = entries
        .filter_map(|entry| {
            let about = entry.metadata().ok().filter(fs::Metadata::is_dir)?;
            Some((about.modified().ok()?, entry.path()))
        })
        .collect();
    folders.sort();
    folders.into_iter().rev().map(|(_, path)| path).collect()
}

/// Reads a snapshot; `None` if it is half written.
fn read(snapshot: &Path, photos: usize) -> Option<FoundSoFar> {
    // The last one of its files.
    let is_there = snapshot.join("points3D.bin").is_file();
    let dataset = is_there.then(|| colmap::read(snapshot).ok()).flatten()?;
    Some(FoundSoFar { cameras: dataset.cameras(), cloud: sparse_cloud(&dataset).map(Arc::new), photos })
}
