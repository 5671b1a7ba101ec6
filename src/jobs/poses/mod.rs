//! Camera poses of photos that have none, by three makers behind one trait: COLMAP as a program, pycolmap in Python, and
//! the built-in one.
//!
//! All write COLMAP's layout, `images` and `sparse/0`, in a folder of their own. Finished steps are noted there
//! ([`state`]) and not done again.

#[cfg(feature = "sfm")]
mod built_in;
mod colmap;
pub(crate) mod compare;
pub(crate) mod environment;
mod findings;
pub(crate) mod front_door;
mod maker;
mod makers;
pub(crate) mod manual;
mod process;
mod pycolmap;
mod snapshots;
pub(crate) mod source;
mod state;
#[cfg(test)]
mod tests;

use std::fs;
use std::path::{Path, PathBuf};

use super::{Folders, JobError, export};
use crate::io::error::write_error;
use crate::io::folder_lock::FolderLock;
use crate::io::unposed::Unposed;
use crate::io::{self, exif, files, photo};
use crate::pipeline::observer::{Observer, Severity};
pub(crate) use findings::FoundPoses;
pub(crate) use maker::{MakerKind, PoseMaker};
use state::PoseState;

/// Folder of the reconstructions in the folder of poses.
const SPARSE: &str = "sparse";
/// Folder of the photos in the folder of poses.
const IMAGES: &str = "images";
/// Database of COLMAP in the folder of poses.
const DATABASE: &str = "database.db";
/// Folder of snapshots in the folder of poses, while a maker maps.
const SNAPSHOTS: &str = "snapshots";
/// Share of the photos with a pose, below which a maker tries its next way to map.
const ENOUGH: f64 = 0.8;

/// Step on the way to camera poses; the result of each is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum MakerStep {
    /// Finds features in each photo.
    Features,
    /// Finds the same features in pairs of photos.
    Matches,
    /// Finds poses and points.
    Mapping,
}

impl MakerStep {
    /// Its task, for display.
    fn title(self) -> &'static str {
        match self {
            Self::Features => "Finding features",
            Self::Matches => "Matching photos",
            Self::Mapping => "Finding camera poses",
        }
    }
}

/// Work of a maker.
pub(crate) struct PoseWork<'a> {
    /// Folder with the photos in `images`.
    out: &'a Path,
    /// Names of the photos, in order.
    photos: &'a [String],
    /// True if all photos have one size.
    one_camera: bool,
    /// True if the photos are frames of a video, in order.
    is_video: bool,
    /// Folder for reconstructions, empty at first.
    sparse: PathBuf,
}

impl PoseWork<'_> {
    fn at(&self, name: &str) -> PathBuf {
        self.out.join(name)
    }

    /// Number of photos between two snapshots, which cost time.
    fn photos_per_snapshot(&self) -> usize {
        /// Snapshots of a search.
        const ALL: usize = 50;
        self.photos.len().div_ceil(ALL).max(1)
    }

    /// True if neighbors in the list are matched only, not all pairs.
    fn is_sequential(&self) -> bool {
        /// Photos up to which all pairs of a video are matched, so that it may come back to where it was.
        const ALL_PAIRS: usize = 150;
        self.is_video && self.photos.len() > ALL_PAIRS
    }

    /// True if all photos are placed at once, not one by one. This is faster, but may place photos on a handful of
    /// points and bend all with them: by half the scene's radius, in a video of 50 frames.
    fn maps_globally(&self) -> bool {
        /// Photos up to which the slower way takes minutes.
        const ONE_BY_ONE: usize = 150;
        self.photos.len() > ONE_BY_ONE
    }
}

/// Finds the poses of photos with this maker, in `out`. Steps that an earlier call finished there are not done again.
///
/// # Errors
/// If the maker fails or finds nothing, `out` holds something else, or the observer asks to stop.
pub(crate) fn find(
    photos: &Unposed,
    maker: &dyn PoseMaker,
    out: &Path,
    observer: &mut dyn Observer,
) -> Result<FoundPoses, JobError> {
    check_out(photos, out)?;
    export::make_folder(out)?;
    let _lock = FolderLock::take(out, "camera poses")?;
    let mut state = PoseState::resume(photos, maker, out)?;
    if let Some(found) = state.found.take() {
        return Ok(found);
    }
    let one_camera = gather(photos, out, observer)?;
    let (sparse, part, snapshots) = (out.join(SPARSE), out.join("sparse.part"), out.join(SNAPSHOTS));
    let work =
        PoseWork { out, photos: &photos.photos, one_camera, is_video: photos.video.is_some(), sparse: part.clone() };
    for &step in maker.steps() {
        if state.done.contains(&step) {
            continue;
        }
        if step == MakerStep::Mapping {
            remove(&part)?;
            // Of a search that was killed.
            remove(&snapshots)?;
            export::make_folder(&part)?;
        }
        let done = maker.run(step, &work, observer);
        let cleared = remove(&snapshots);
        done?;
        cleared?;
        if step == MakerStep::Mapping {
            largest_first(&part)?;
            if !io::colmap::is_colmap(&part) {
                return Err(JobError::NoPosesFound(photos.folder.clone()));
            }
            remove(&sparse)?;
            fs::rename(&part, &sparse).map_err(|e| write_error(&sparse, e))?;
        }
        state.finish(step, out)?;
    }
    let found = findings::of(photos, maker, out, observer)?;
    state.found = Some(found.clone());
    state.write(out)?;
    Ok(found)
}

/// Folder for the poses of photos that are given no other. Its own name is that of the photos, as a scene's title.
pub(crate) fn usual_out(photos: &Unposed, folders: &Folders) -> PathBuf {
    folders.poses(photos.video.as_deref().unwrap_or(&photos.folder)).join(front_door::name_of(photos))
}

/// Refuses a folder that holds something else than poses of these photos.
fn check_out(photos: &Unposed, out: &Path) -> Result<(), JobError> {
    let real = files::real(out);
    if real == files::real(&photos.folder) || real.join(IMAGES) == files::real(&photos.images) {
        return Err(JobError::Output(format!(
            "'{}' is the folder of the photos themselves; choose another one for their poses",
            out.display()
        )));
    }
    if files::holds_something(out) && !PoseState::is_in(out) {
        return Err(JobError::Output(format!(
            "'{}' holds something else than camera poses that this program found; choose another folder",
            out.display()
        )));
    }
    Ok(())
}

/// Puts the photos into `out/images`; returns true if all have one size.
fn gather(photos: &Unposed, out: &Path, observer: &mut dyn Observer) -> Result<bool, JobError> {
    let images = out.join(IMAGES);
    export::make_folder(&images)?;
    let (mut sizes, mut absurd) = (Vec::new(), Vec::new());
    for name in &photos.photos {
        let (from, to) = (photos.images.join(name), images.join(name));
        let size = photo::size(&from)?;
        sizes.push(size);
        let is_absurd = matches!(exif::focal(&from, size), Ok(exif::ExifFocal::Absurd(_)));
        absurd.extend(is_absurd.then(|| name.clone()));
        if to.exists() {
            continue;
        }
        if is_absurd {
            // Makers would believe it.
            let bytes = files::read(&from, files::MAX_PICTURE_BYTES)?;
            io::atomic::write(&to, |w| w.write_all(&exif::without(&bytes)))?;
        } else {
            // A hard link on the same disk, so that nothing outside the folder is needed.
            fs::hard_link(&from, &to).or_else(|_| fs::copy(&from, &to).map(drop)).map_err(|e| write_error(&to, e))?;
        }
    }
    if let Some(first) = absurd.first() {
        let n = absurd.len();
        let text = format!("{n} photos (first: {first}) state a focal length that no lens has; it is not used");
        observer.note(Severity::Warning, text);
    }
    Ok(sizes.windows(2).all(|s| s[0] == s[1]))
}

/// Removes a folder or file of this program, if it is there.
fn remove(path: &Path) -> Result<(), JobError> {
    let gone = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    match gone {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(write_error(path, e).into()),
        _ => Ok(()),
    }
}

/// Makes the reconstruction of most photos `0`: photos without overlap become several reconstructions.
fn largest_first(sparse: &Path) -> Result<(), JobError> {
    let size = |folder: &Path| fs::metadata(folder.join("images.bin")).map_or(0, |m| m.len());
    let all = fs::read_dir(sparse).into_iter().flatten().flatten().map(|e| e.path()).filter(|p| p.is_dir());
    let (first, spare) = (sparse.join("0"), sparse.join("swapped"));
    let Some(largest) = all.max_by_key(|p| (size(p), *p == first)).filter(|p| *p != first && size(p) > 0) else {
        return Ok(());
    };
    let swap = || {
        if first.exists() {
            fs::rename(&first, &spare)?;
        }
        fs::rename(&largest, &first)?;
        if spare.exists() { fs::rename(&spare, &largest) } else { Ok(()) }
    };
    Ok(swap().map_err(|e| write_error(sparse, e))?)
}
