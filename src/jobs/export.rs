//! Writes results for users: Gaussians for other viewers, pictures, arrays.
//!
//! An output is never an input or a file of a scene.

use std::io::Write;
use std::ops::Range;
use std::path::Path;

use image::codecs::png::PngEncoder;
use image::{ColorType, ImageEncoder};
use npyz::WriterBuilder;
use serde::Serialize;

use super::JobError;
use crate::io::splat_format::SplatFormat;
use crate::io::{self, IoError, atomic, files, scene_files, trained};
use crate::navigate::{CameraSpline, Pose, Speed};
use crate::scene::{CameraPath, CropBox, GaussianCloud, Identities, IdentityId, PathKey, PhotoPixels};

/// Rows of an array that are in memory at a time.
const BLOCK_ROWS: usize = 1 << 12;

/// Writes Gaussians as a `.ply` for any viewer.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn ply(path: &Path, cloud: &GaussianCloud) -> Result<(), IoError> {
    make_parent(path)?;
    SplatFormat::Ply.write(path, cloud, &mut |_| Ok(()))
}

/// Returns the Gaussians that a crop box keeps; an error if it keeps none.
pub(crate) fn cropped(cloud: &GaussianCloud, crop: &CropBox) -> Result<GaussianCloud, JobError> {
    let kept = crop.crop(cloud);
    if kept.is_empty() { Err(JobError::NoGaussians) } else { Ok(kept) }
}

pub(crate) fn text(path: &Path, text: &str) -> Result<(), IoError> {
    bytes(path, text.as_bytes())
}

pub(crate) fn bytes(path: &Path, bytes: &[u8]) -> Result<(), IoError> {
    make_parent(path)?;
    atomic::write(path, |w| w.write_all(bytes))
}

/// Writes a value as indented JSON.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn json(path: &Path, value: &impl Serialize) -> Result<(), IoError> {
    make_parent(path)?;
    atomic::write(path, |w| Ok(serde_json::to_writer_pretty(w, value)?))
}

/// Writes pixels as a `.png`.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn picture(path: &Path, pixels: &PhotoPixels) -> Result<(), IoError> {
    png(path, pixels.rgb.as_flattened(), [pixels.width_px, pixels.height_px], ColorType::Rgb8)
}

/// Writes a `.png` of `size_px` from raw samples, those of 16 bits in the machine's byte order.
pub(crate) fn png(path: &Path, samples: &[u8], size_px: [u32; 2], color: ColorType) -> Result<(), IoError> {
    atomic::write(path, |w| encode_png(w, samples, size_px, color))
}

/// Encodes a `.png` as [`png`] writes it.
pub(super) fn encode_png(out: impl Write, samples: &[u8], size_px: [u32; 2], color: ColorType) -> std::io::Result<()> {
    PngEncoder::new(out).write_image(samples, size_px[0], size_px[1], color.into()).map_err(std::io::Error::other)
}

/// Writes rows of values as a NumPy array of shape `[height, width]`.
pub(crate) fn npy<T: npyz::AutoSerialize + Copy>(path: &Path, values: &[T], size_px: [u32; 2]) -> Result<(), IoError> {
    npy_blocks(path, &[size_px[1] as usize, size_px[0] as usize], |rows| {
        values[rows.start * size_px[0] as usize..rows.end * size_px[0] as usize].to_vec()
    })
}

/// Writes a NumPy array; `block` makes the values of some rows of its first axis at a time.
pub(crate) fn npy_blocks<T: npyz::AutoSerialize>(
    path: &Path,
    shape: &[usize],
    mut block: impl FnMut(Range<usize>) -> Vec<T>,
) -> Result<(), IoError> {
    atomic::write(path, |w: &mut dyn Write| {
        let lengths: Vec<u64> = shape.iter().map(|n| *n as u64).collect();
        let mut array = npyz::WriteOptions::new().default_dtype().shape(&lengths).writer(w).begin_nd()?;
        let rows = shape.first().copied().unwrap_or(0);
        for from in (0..rows).step_by(BLOCK_ROWS) {
            array.extend(block(from..rows.min(from + BLOCK_ROWS)))?;
        }
        array.finish()
    })
}

/// Writes a camera path: this program's `.json`, or frames of this `aspect` for nerfstudio if the name ends in
/// `.nerfstudio.json`.
pub(crate) fn camera_path(file: &Path, path: &CameraPath, aspect: f64) -> Result<(), IoError> {
    make_parent(file)?;
    if !file.to_string_lossy().ends_with(".nerfstudio.json") {
        return io::camera_path::write(file, path);
    }
    let spline = CameraSpline::new(path, Speed::Constant);
    let poses = spline.map_or_else(Vec::new, |spline| spline.poses(path.fps, CameraPath::MAX_KEYS as f64));
    let frames: Vec<PathKey> = poses.iter().map(Pose::key).collect();
    io::camera_path::nerfstudio::write(file, path, &frames, (1280, (1280.0 / aspect.max(0.01)) as u32))
}

/// Returns a unique file name for an identity's Gaussians, of its number and full name.
pub(crate) fn identity_file(all: &Identities, id: IdentityId, ending: &str) -> String {
    format!("{id}-{}{ending}", identity_name(all, id))
}

/// Returns a full name that is valid in file names on every system.
pub(crate) fn identity_name(all: &Identities, id: IdentityId) -> String {
    let name = all.full_name(id);
    let words: Vec<&str> = name.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect();
    // Four bytes each at most: systems take 255.
    words.join("-").chars().take(60).collect()
}

pub(crate) fn make_parent(path: &Path) -> Result<(), IoError> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => make_folder(folder),
        _ => Ok(()),
    }
}

/// Makes `folder` and those above it.
pub(crate) fn make_folder(folder: &Path) -> Result<(), IoError> {
    let remedy = "the folder cannot be created: choose another place";
    std::fs::create_dir_all(folder).map_err(|cause| IoError::Write { path: folder.into(), remedy, cause })
}

/// Refuses a file for a result, before any work is done. The file must have one of the `endings` (any if there are
/// none), must not be one of the job's inputs (`reads`: files and folders), and must not lie among the files of a data
/// set. Devices and pipes may have any name.
pub(crate) fn check(path: &Path, endings: &[&str], reads: &[&Path]) -> Result<(), JobError> {
    if atomic::is_stream(path) {
        return Ok(());
    }
    let name = path.to_string_lossy().to_lowercase();
    if !endings.is_empty() && !endings.iter().any(|e| name.ends_with(e)) {
        return Err(JobError::Output(format!("'{}' must end in {}", path.display(), endings.join(" or "))));
    }
    scene_files::refuse_scene_file(path)?;
    refuse_read(path, reads)?;
    refuse_among(path, if path.is_dir() { path } else { files::folder_of(path) })
}

/// Refuses an input of the job.
fn refuse_read(path: &Path, reads: &[&Path]) -> Result<(), JobError> {
    let Ok(real) = path.canonicalize() else { return Ok(()) };
    for read in reads {
        let within = read.canonicalize().is_ok_and(|read| real.starts_with(read));
        // Results may lie in a scene's folder; its own files are refused above.
        if within && !trained::is_scene(read) {
            let (path, read) = (path.display(), read.display());
            return Err(JobError::Output(format!("'{path}' is read by this command ('{read}'); choose another name")));
        }
    }
    Ok(())
}

/// Refuses a result in a `folder` whose data set would take it for one of its files.
fn refuse_among(path: &Path, folder: &Path) -> Result<(), JobError> {
    let Some(set) = io::data_set_around(folder) else { return Ok(()) };
    let (path, set) = (path.display(), set.display());
    Err(JobError::Output(format!(
        "'{path}' would lie among the files of the data set '{set}', which would take it for one of them; choose another folder"
    )))
}

/// Refuses a folder for pictures that holds the job's inputs, or photos, as [`check`] does files.
pub(crate) fn check_folder(folder: &Path, reads: &[&Path]) -> Result<(), JobError> {
    // Nothing is read from a folder that does not exist yet.
    if folder.exists() { check(folder, &[], reads) } else { refuse_among(folder, folder) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_and_arrays_read_back() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.png");
        png(&path, &[1, 2, 3, 4, 5, 6], [2, 1], ColorType::Rgb8).expect("write");
        assert_eq!(image::open(&path).expect("read").to_rgb8().into_raw(), [1, 2, 3, 4, 5, 6]);
        let bytes: Vec<u8> = [258_u16, 3].iter().flat_map(|v| v.to_ne_bytes()).collect();
        png(&path, &bytes, [1, 2], ColorType::L16).expect("write");
        assert_eq!(image::open(&path).expect("read").to_luma16().into_raw(), [258, 3]);
        let path = folder.path().join("a.npy");
        npy(&path, &[1.0_f32, 2.5, 3.0, 4.0, 5.0, 6.0], [3, 2]).expect("write");
        let bytes = std::fs::read(&path).expect("read");
        let array = npyz::NpyFile::new(&bytes[..]).expect("npy");
        assert_eq!(array.shape(), [2, 3]);
        assert_eq!(array.into_vec::<f32>().expect("values")[1], 2.5);
        // Over more than one block.
        let count = BLOCK_ROWS + 3;
        npy_blocks(&path, &[count, 2], |rows| rows.flat_map(|i| [i as i64, -1]).collect()).expect("write");
        let bytes = std::fs::read(&path).expect("read");
        let array = npyz::NpyFile::new(&bytes[..]).expect("npy");
        assert_eq!(array.shape(), [count as u64, 2]);
        let values = array.into_vec::<i64>().expect("values");
        assert_eq!(values[2 * (count - 1)..], [count as i64 - 1, -1]);
    }
}
