//! Photos without known camera poses, or a video that photos are taken from.

use std::path::{Path, PathBuf};

use super::{IoError, files, photo};

/// Folders searched for the photos.
const FOLDERS: [&str; 3] = [".", "images", "input"];
/// Fewest pictures of a folder that is taken for photos of a scene.
const FEWEST: usize = 2;
/// Endings of files in which other programs store poses.
const POSES: [&str; 7] = ["nvm", "out", "sfm", "psx", "xml", "rcproj", "p4d"];
/// Names of files in which other programs store poses.
const POSE_FILES: [&str; 5] = ["cameras.json", "sfm_data.json", "reconstruction.json", "images.txt", "images.bin"];

/// A folder of photos without camera poses.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Unposed {
    /// The folder that was opened.
    pub folder: PathBuf,
    /// The folder in which the photos lie, the same or one below.
    pub images: PathBuf,
    /// Names of the photos in it, in order.
    pub photos: Vec<String>,
    /// The video that the photos are frames of, or will be: then there may be none yet.
    pub video: Option<PathBuf>,
    /// Sentences on other findings: pictures that cannot be read, poses in formats of other programs; may be empty.
    pub(crate) beside: String,
}

impl Unposed {
    /// A video, from which no photos were taken yet.
    pub(crate) fn of_video(path: &Path) -> Self {
        Self { folder: path.into(), images: path.into(), video: Some(path.into()), ..Self::default() }
    }

    /// Sentence on what was found.
    pub(crate) fn found(&self) -> String {
        match &self.video {
            Some(video) => format!("{}: a video, no camera poses", video.display()),
            None => {
                format!(
                    "{}: {} photos, no camera poses{}",
                    self.images.display(),
                    self.photos.len(),
                    self.in_brackets()
                )
            }
        }
    }

    /// Adds one more sentence to [`Self::beside`].
    pub(super) fn with(self, sentence: Option<String>) -> Self {
        let all: Vec<String> = sentence.into_iter().chain(Some(self.beside).filter(|b| !b.is_empty())).collect();
        Self { beside: all.join(". "), ..self }
    }

    /// Other findings, in brackets after a sentence.
    fn in_brackets(&self) -> String {
        if self.beside.is_empty() { String::new() } else { format!(" ({})", self.beside) }
    }
}

/// Finds the photos in `folder`, if there are any.
///
/// # Errors
/// If there are pictures, and none that can be read.
pub(super) fn find(folder: &Path) -> Result<Option<Unposed>, IoError> {
    for below in FOLDERS {
        let images = if below == "." { folder.to_path_buf() } else { folder.join(below) };
        let Ok(names) = files::names_in(&images) else { continue };
        let (photos, others): (Vec<String>, Vec<String>) =
            names.into_iter().filter(|name| images.join(name).is_file()).partition(|name| photo::is_photo(name));
        let unread: Vec<&String> = others.iter().filter(|name| photo::is_unread(name)).collect();
        if photos.len() >= FEWEST {
            let mut beside: Vec<String> = unread
                .first()
                .map(|first| {
                    format!("{} pictures are of formats that are not read ({first}): {}", unread.len(), photo::CONVERT)
                })
                .into_iter()
                .collect();
            beside.extend(poses(&[folder, &images]));
            return Ok(Some(Unposed { folder: folder.into(), images, photos, video: None, beside: beside.join(". ") }));
        }
        if unread.len() + photos.len() >= FEWEST {
            let n = unread.len();
            let what = format!("{n} pictures of formats that are not read (first: {})", unread[0]);
            return Err(IoError::Unsupported { path: images, what, remedy: photo::CONVERT });
        }
    }
    Ok(None)
}

/// Returns a sentence about a file with poses of another program, if there is one.
fn poses(folders: &[&Path]) -> Option<String> {
    let has_poses = |name: &String| {
        let ending = Path::new(name).extension().map(|e| e.to_string_lossy().to_lowercase());
        POSE_FILES.contains(&name.as_str()) || ending.is_some_and(|e| POSES.contains(&e.as_str()))
    };
    let file = folders.iter().find_map(|folder| files::names_in(folder).ok()?.into_iter().find(has_poses))?;
    Some(format!(
        "{file} may hold poses, in a form that is not read by itself: export them from that program for COLMAP (cameras, \
         images and points3D)"
    ))
}
