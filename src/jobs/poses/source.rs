//! Photos of a video: the sharpest frames become photos in a folder beside it, once.

use std::fs;
use std::path::{Path, PathBuf};

use image::codecs::jpeg::JpegEncoder;
use serde::{Deserialize, Serialize};

use crate::io::error::write_error;
use crate::io::file_stamp::FileStamp;
use crate::io::temporary::temporary_folder;
use crate::io::unposed::Unposed;
use crate::io::video::footage::{Footage, FootageError, VideoFrame};
use crate::io::{IoError, files};
use crate::jobs::{JobError, export};
use crate::pipeline::frames::{FrameWatch, Gray, choose};
use crate::pipeline::observer::{Observer, Ticker};

/// Name of the note beside the photos.
const NOTE: &str = "video.json";
/// Beginning of the names of its photos.
const FRAME: &str = "frame_";
/// Quality of the photos as JPEG.
const QUALITY: u8 = 95;
/// Fewest photos that poses are found of.
const FEWEST: usize = 3;

/// Note on the video that photos are from.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct VideoNote {
    video: String,
    #[serde(flatten)]
    stamp: FileStamp,
    /// Number of photos that was asked for.
    wanted: Option<usize>,
}

/// Name of a video without its ending.
pub(super) fn stem(video: &Path) -> String {
    video.file_stem().map_or_else(|| "video".into(), |stem| stem.to_string_lossy().into_owned())
}

/// Folder beside a video for its photos.
pub(crate) fn folder_of(video: &Path) -> PathBuf {
    video.with_file_name(format!("{}-photos", stem(video)))
}

/// Takes photos from a video. Photos that an earlier call took are used again.
///
/// # Errors
/// If the video cannot be read or shows too little, its folder holds something else, or the observer asks to stop.
pub(crate) fn photos_of(video: &Path, wanted: Option<usize>, observer: &mut dyn Observer) -> Result<Unposed, JobError> {
    let folder = folder_of(video);
    let note = note(video, wanted)?;
    let earlier = files::read_json::<VideoNote>(&folder.join(NOTE)).ok();
    // What somebody put beside the photos would go with those of an earlier state of the video.
    let is_of_video = |name: &String| name == NOTE || name.starts_with(FRAME);
    let is_ours = earlier.is_some() && files::names_in(&folder).is_ok_and(|names| names.iter().all(is_of_video));
    if files::holds_something(&folder) && earlier.as_ref() != Some(&note) && !is_ours {
        return Err(JobError::Output(format!(
            "the photos of '{}' belong into '{}', which holds something else; rename one of the two",
            video.display(),
            folder.display()
        )));
    }
    if earlier.as_ref() != Some(&note) {
        take(video, &note, &folder, observer)?;
    }
    let names = files::names_in(&folder).map_err(|cause| IoError::Read { path: folder.clone(), cause })?;
    let photos: Vec<String> = names.into_iter().filter(|name| crate::io::photo::is_photo(name)).collect();
    if photos.len() < FEWEST {
        return Err(JobError::StillVideo(video.into()));
    }
    Ok(Unposed { folder: folder.clone(), images: folder, photos, video: Some(video.into()), ..Unposed::default() })
}

fn note(video: &Path, wanted: Option<usize>) -> Result<VideoNote, JobError> {
    let name = video.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(VideoNote { video: name, stamp: FileStamp::of(video)?, wanted })
}

/// Reads the video twice: to look at all frames, and to store the chosen ones.
fn take(video: &Path, note: &VideoNote, folder: &Path, observer: &mut dyn Observer) -> Result<(), JobError> {
    let footage = Footage::open(video, &std::env::var_os("PATH").unwrap_or_default())?;
    let mut ticker = Ticker::new("Looking at the video", footage.frames().unwrap_or(0));
    let (mut watch, mut looks) = (FrameWatch::default(), Vec::new());
    footage.visit(&mut |i: usize, frame: &VideoFrame<'_>| -> Result<(), JobError> {
        ticker.tick(i, observer)?;
        let (luma, size) = frame.luma();
        looks.push(watch.look(&Gray::new(luma, size)));
        Ok(())
    })?;
    let chosen = choose(&looks, note.wanted);
    if chosen.len() < FEWEST {
        return Err(JobError::StillVideo(video.into()));
    }
    let failed = |cause| write_error(folder, cause);
    let draft = temporary_folder(files::folder_of(folder), "photos").map_err(failed)?;
    let mut ticker = Ticker::new("Taking photos from the video", looks.len());
    footage.visit(&mut |i: usize, frame: &VideoFrame<'_>| -> Result<(), JobError> {
        ticker.tick(i, observer)?;
        if chosen.binary_search(&i).is_err() {
            return Ok(());
        }
        let reason = |reason: String| FootageError::Decoder { path: video.into(), frame: i + 1, reason };
        let picture = frame.picture().ok_or_else(|| reason("it has no pixels".into()))?;
        let mut bytes = Vec::new();
        let encoder = JpegEncoder::new_with_quality(&mut bytes, QUALITY);
        picture.write_with_encoder(encoder).map_err(|e| reason(e.to_string()))?;
        let path = draft.folder.path().join(format!("{FRAME}{i:06}.jpg"));
        Ok(fs::write(&path, bytes).map_err(|cause| write_error(&folder.join(format!("{FRAME}{i:06}.jpg")), cause))?)
    })?;
    export::json(&draft.folder.path().join(NOTE), note)?;
    // Photos of an earlier state of the video go with this folder.
    let before = temporary_folder(files::folder_of(folder), "photos").map_err(failed)?;
    let put = || {
        if folder.exists() {
            fs::rename(folder, before.folder.path().join("before"))?;
        }
        fs::rename(draft.folder.path(), folder)?;
        files::sync_folder(files::folder_of(folder))
    };
    put().map_err(failed)?;
    // There is nothing left to remove.
    let _ = draft.folder.keep();
    Ok(())
}
