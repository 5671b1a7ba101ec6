//! What can go wrong with files: every error names the file, the place in it and, where there is
//! one, the remedy.

use std::io;
use std::path::{Path, PathBuf};

use super::unposed::Unposed;
use crate::scene::{CameraError, CloudError};

/// A file that could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum IoError {
    /// The operating system refused to read.
    #[error("cannot read {path}: {cause}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        cause: io::Error,
    },
    /// The operating system refused to write. What was there before is untouched.
    #[error("cannot write {path}: {cause}; {remedy}")]
    Write {
        /// The file that was to be written.
        path: PathBuf,
        /// What the person can do.
        remedy: &'static str,
        /// What the system says.
        cause: io::Error,
    },
    /// A file that a scene consists of, as the place for something else.
    #[error("{path} is a file of the trained scene in {folder} and is not replaced; choose another name")]
    Protected {
        /// The file.
        path: PathBuf,
        /// The scene's folder.
        folder: PathBuf,
    },
    /// Somebody else writes there.
    #[error("{folder} is being written by {holder}; wait until that is done, or choose another folder")]
    Busy {
        /// The folder.
        folder: PathBuf,
        /// Who.
        holder: String,
    },
    /// A scene that somebody else has saved in the meantime.
    #[error("the scene in {folder} was saved by somebody else since it was opened; open it again")]
    Changed {
        /// The folder.
        folder: PathBuf,
    },
    /// Files of a scene that were not saved together.
    #[error("{path} was not saved together with {with}: {remedy}")]
    Torn {
        /// The file that does not fit.
        path: PathBuf,
        /// The file that it should fit.
        with: &'static str,
        /// The way back.
        remedy: &'static str,
    },
    /// A folder for a result that holds something else.
    #[error("{folder} {what}; choose another folder")]
    Occupied {
        /// The folder.
        folder: PathBuf,
        /// What it holds.
        what: &'static str,
    },
    /// A folder, pipe or device where a file is expected.
    #[error("{path} is not a regular file but a folder, a pipe or a device; give the path of a file")]
    NotAFile {
        /// The path.
        path: PathBuf,
    },
    /// More memory than the reader may use.
    #[error("{path}: {what} needs {bytes} bytes, over the limit of {limit} bytes; {remedy}")]
    OverBudget {
        /// The file.
        path: PathBuf,
        /// What needs it.
        what: &'static str,
        /// How much it needs.
        bytes: u64,
        /// How much it may have.
        limit: u64,
        /// What the person can do.
        remedy: &'static str,
    },
    /// The file ends too early.
    #[error("{path} ends early: {place} needs {need} more bytes, {have} are left")]
    Truncated {
        /// The file.
        path: PathBuf,
        /// What was being read.
        place: String,
        /// Bytes it needs.
        need: u64,
        /// Bytes left.
        have: u64,
    },
    /// A count that the rest of the file cannot hold.
    #[error("{path} claims {claimed} {what}, but what follows holds {possible} at most")]
    Count {
        /// The file.
        path: PathBuf,
        /// Of what.
        what: String,
        /// What the file says.
        claimed: u64,
        /// What it can hold.
        possible: u64,
    },
    /// Something that does not follow the format.
    #[error("{path}, {place}: {reason}")]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Where: a line, an element, a key.
        place: String,
        /// What is wrong.
        reason: String,
    },
    /// A number that is NaN or infinite.
    #[error("{path}: {property} of {element} {index} is not finite")]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// Kind of thing: "vertex", "point", "pose".
        element: &'static str,
        /// Which, from 0.
        index: usize,
        /// Which of its properties.
        property: String,
    },
    /// A camera that is none.
    #[error("{path}, photo '{photo}': {cause}")]
    Camera {
        /// The file that describes it.
        path: PathBuf,
        /// The photo.
        photo: String,
        /// What is wrong.
        cause: CameraError,
    },
    /// A lens or file variant that the program does not handle.
    #[error("{path} uses {what}, which is not supported; {remedy}")]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The variant.
        what: String,
        /// What the person can do.
        remedy: &'static str,
    },
    /// A folder without masks.
    #[error(
        "{path} holds no labels: looked for identities.json with id maps (fmlgs synth), images_<factor>/label/*.png \
         (SPIn-NeRF), segmentations/classes.txt (3D-OVS), test_mask/<view>/*.png (LERF-Mask), and .json files with \
         polygons (ISAT, as in lerf_ovs) or masklets (SA-V)"
    )]
    NoLabels {
        /// The folder.
        path: PathBuf,
    },
    /// A path in a dataset that leads out of the dataset's folder.
    #[error("{path} refers to '{entry}', which lies outside the folder {folder}; copy the file into it")]
    Outside {
        /// The file with the reference.
        path: PathBuf,
        /// The reference.
        entry: String,
        /// The dataset's folder.
        folder: PathBuf,
    },
    /// The same photo listed twice.
    #[error("{path} lists the photo '{photo}' twice")]
    Duplicate {
        /// The file.
        path: PathBuf,
        /// The photo.
        photo: String,
    },
    /// A photo whose size is no scaled version of what its camera says.
    #[error("{path} is {} x {} px, but its camera is for {} x {} px and no scaled version of that",
        found.0, found.1, expected.0, expected.1)]
    PhotoSize {
        /// The picture file.
        path: PathBuf,
        /// Its size.
        found: (u32, u32),
        /// The camera's size.
        expected: (u32, u32),
    },
    /// A picture with no pixels.
    #[error("{path} is a picture of {width_px} x {height_px} px")]
    EmptyPicture {
        /// The picture file.
        path: PathBuf,
        /// Its width.
        width_px: u32,
        /// Its height.
        height_px: u32,
    },
    /// A photo without a pixel that counts.
    #[error("{path} shows nothing: every pixel is transparent or outside of its lens; take it out of the data set")]
    NothingShown {
        /// The picture file.
        path: PathBuf,
    },
    /// A picture that does not decode.
    #[error("{path} cannot be decoded: {reason}")]
    Picture {
        /// The picture file.
        path: PathBuf,
        /// What the decoder says.
        reason: String,
    },
    /// A dataset without a single photo.
    #[error("{path} lists {listed} photos and none of them exists (first: '{first}')")]
    NoPhotos {
        /// The file that lists them.
        path: PathBuf,
        /// How many it lists.
        listed: usize,
        /// The first of them.
        first: String,
    },
    /// A cloud that violates its own invariants.
    #[error("{path}: {cause}")]
    Cloud {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        cause: CloudError,
    },
    /// A scene folder of another version of the program.
    #[error("{path} has format version {found}; this program reads versions up to {supported}; update the program")]
    Version {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u64,
        /// The highest version understood.
        supported: u64,
    },
}

/// Why a path could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// Nothing is there.
    #[error("{path} does not exist")]
    NotFound {
        /// The path.
        path: PathBuf,
    },
    /// Nothing that the program knows.
    #[error("{path} is nothing that can be opened. Looked for: {looked_for}. Found: {found}.")]
    Unrecognized {
        /// The path.
        path: PathBuf,
        /// Every layout or format tried.
        looked_for: String,
        /// What is there instead.
        found: String,
    },
    /// Photos alone.
    #[error("{}: {} photos, no camera poses", .0.images.display(), .0.photos.len())]
    NoPoses(Box<Unposed>),
    /// Recognised, but broken.
    #[error(transparent)]
    Io(#[from] IoError),
}

/// The error of a failed write, with its remedy.
pub(crate) fn write_error(path: &Path, cause: io::Error) -> IoError {
    IoError::Write { path: path.into(), remedy: remedy(cause.kind()), cause }
}

/// What the user can do about a failed write.
fn remedy(kind: io::ErrorKind) -> &'static str {
    use io::ErrorKind as K;
    match kind {
        K::StorageFull | K::QuotaExceeded => "the disk is full: free some space or choose another folder",
        K::FileTooLarge => "the disk does not hold files of this size: choose another folder",
        K::PermissionDenied | K::ReadOnlyFilesystem => "the folder cannot be written to: choose another folder",
        K::NotFound | K::NotADirectory => "the folder does not exist: create it or choose another one",
        _ => "what was there before is unchanged",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_has_its_remedy() {
        assert!(remedy(io::ErrorKind::FileTooLarge).contains("files of this size"));
        assert!(remedy(io::ErrorKind::QuotaExceeded).contains("disk is full"));
    }
}
