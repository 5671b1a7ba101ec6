//! Errors of reading and writing files: each names the file, the place in it and, if there is one, the remedy.

use std::io;
use std::path::{Path, PathBuf};

use super::unposed::Unposed;
use super::video::footage::FootageError;
use crate::scene::{CameraError, CloudError};

/// A file that could not be read or written.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum IoError {
    #[error("cannot read {path}: {cause}")]
    Read {
        path: PathBuf,
        #[source]
        cause: io::Error,
    },
    /// The operating system refused to write. The old content is untouched.
    #[error("cannot write {path}: {cause}; {remedy}")]
    Write {
        path: PathBuf,
        remedy: &'static str,
        #[source]
        cause: io::Error,
    },
    #[error("{path} is a file of the trained scene in {folder} and is not replaced; choose another name")]
    Protected { path: PathBuf, folder: PathBuf },
    #[error("{folder} is being written by {holder}; wait until that is done, or choose another folder")]
    Busy { folder: PathBuf, holder: String },
    #[error("the scene in {folder} was changed by another program since it was opened; open it again")]
    Changed { folder: PathBuf },
    #[error("{path} was not saved together with {with}: {remedy}")]
    Torn { path: PathBuf, with: &'static str, remedy: &'static str },
    #[error("{folder} {what}; choose another folder")]
    Occupied { folder: PathBuf, what: &'static str },
    #[error(
        "{folder} holds more than the scene, so nothing was deleted; delete the folder yourself if none of it is needed"
    )]
    HoldsMore { folder: PathBuf },
    #[error("{path} is not a regular file but a folder, a pipe or a device; give the path of a file")]
    NotAFile { path: PathBuf },
    #[error("{path}: {what} needs {bytes} bytes, over the limit of {limit} bytes; {remedy}")]
    OverBudget { path: PathBuf, what: &'static str, bytes: u64, limit: u64, remedy: &'static str },
    #[error("{path} ends early: {place} needs {need} more bytes, {have} are left")]
    Truncated { path: PathBuf, place: String, need: u64, have: u64 },
    #[error("{path} is cut off or damaged: {claimed} {what} announced, {possible} present at most")]
    Count { path: PathBuf, what: String, claimed: u64, possible: u64 },
    #[error("{path}, {place}: {reason}")]
    Syntax { path: PathBuf, place: String, reason: String },
    #[error("{path}: {property} of {element} {index} is not finite")]
    NotFinite { path: PathBuf, element: &'static str, index: usize, property: String },
    #[error("{path}, photo '{photo}': {cause}")]
    Camera { path: PathBuf, photo: String, cause: CameraError },
    #[error("{path} uses {what}, which is not supported; {remedy}")]
    Unsupported { path: PathBuf, what: String, remedy: &'static str },
    #[error(
        "{path} holds no labels{passed}: looked for identities.json with id maps (fmlgs synth), images_<factor>/label/*.png \
         (SPIn-NeRF), segmentations/classes.txt (3D-OVS), test_mask/<view>/*.png (LERF-Mask), json/ with mask/ \
         (Ref-LERF), <photo>_s.npy with <photo>_f.npy (language_features of LangSplat), and label files in it and the folders below: .json of ISAT (as in lerf_ovs), LabelMe, COCO \
         (instances) or SA-V (masklets), .txt of YOLO (segments)"
    )]
    NoLabels { path: PathBuf, passed: String },
    #[error("{path} refers to '{entry}', which lies outside the folder {folder}; copy the file into it")]
    Outside { path: PathBuf, entry: String, folder: PathBuf },
    #[error("{path} lists the photo '{photo}' twice")]
    Duplicate { path: PathBuf, photo: String },
    #[error("{path} is {} x {} px, but its camera is for {} x {} px and no scaled version of that",
        found.0, found.1, expected.0, expected.1)]
    PhotoSize { path: PathBuf, found: (u32, u32), expected: (u32, u32) },
    #[error("{path} is an image of {width_px} x {height_px} px")]
    EmptyPicture { path: PathBuf, width_px: u32, height_px: u32 },
    #[error(
        "{path} shows nothing: every pixel is transparent, outside of its lens or black in its mask; take it out of the data set"
    )]
    NothingShown { path: PathBuf },
    #[error("{path} cannot be decoded: {reason}")]
    Picture { path: PathBuf, reason: String },
    #[error("{path} lists {listed} photos and none of them exists (first: '{first}')")]
    NoPhotos { path: PathBuf, listed: usize, first: String },
    #[error("{path}: {cause}")]
    Cloud { path: PathBuf, cause: CloudError },
    #[error("{path} has format version {found}; this program reads versions up to {supported}; {}", version_remedy(*found, *supported))]
    Version { path: PathBuf, found: u64, supported: u64 },
}

impl IoError {
    /// Makes an error about `place` of a file that does not follow its format.
    pub(crate) fn syntax(path: &Path, place: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::Syntax { path: path.into(), place: place.into(), reason: reason.into() }
    }
}

/// Reason why a path could not be opened.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum OpenError {
    #[error("{path} does not exist")]
    NotFound { path: PathBuf },
    #[error("{path} is not a scene, splat or photo set that FMLGS can open. Looked for: {looked_for}. Found: {found}.")]
    Unrecognized { path: PathBuf, looked_for: String, found: String },
    /// Photos or a video without camera poses.
    #[error("{}", .0.found())]
    NoPoses(Box<Unposed>),
    #[error(transparent)]
    Footage(#[from] FootageError),
    #[error("{path} is {what}; unpack it, with {command}, and open the folder")]
    Packed { path: PathBuf, what: String, command: String },
    #[error(transparent)]
    Io(#[from] IoError),
}

pub(crate) fn write_error(path: &Path, cause: io::Error) -> IoError {
    IoError::Write { path: path.into(), remedy: remedy(cause.kind()), cause }
}

/// Remedy for an unsupported version.
fn version_remedy(found: u64, supported: u64) -> &'static str {
    if found > supported { "update the program" } else { "there was never such a version: the file is damaged" }
}

/// Remedy for a failed write.
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
        let of = |found| IoError::Version { path: "x".into(), found, supported: 2 }.to_string();
        assert!(of(3).ends_with("update the program") && of(0).ends_with("the file is damaged"), "{}", of(0));
    }
}
