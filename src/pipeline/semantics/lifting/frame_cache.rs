//! Frames encoded by SAM 2, computed once and kept on disk.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use sha2::{Digest, Sha256};

use crate::io::{atomic, files, photo};
use crate::models::ModelError;
use crate::models::sam2::sequence::FrameSource;
use crate::models::sam2::{EncodedFrame, Sam2};
use crate::models::tensor::Tensor;
use crate::scene::Photo;

/// Frames that are encoded once, then read from disk.
pub(super) struct FrameCache<'a> {
    pub(super) photos: &'a [Photo],
    pub(super) folder: Option<PathBuf>,
    /// The frame that was used last, because every object asks for it.
    pub(super) kept: Option<(usize, EncodedFrame)>,
    pub(super) secs: &'a mut f64,
}

impl FrameSource for FrameCache<'_> {
    fn len(&self) -> usize {
        self.photos.len()
    }

    fn get(&mut self, model: &mut Sam2, index: usize) -> Result<EncodedFrame, ModelError> {
        if let Some((_, frame)) = self.kept.as_ref().filter(|(at, _)| *at == index) {
            return Ok(frame.clone());
        }
        let start = std::time::Instant::now();
        let shown = &self.photos[index];
        let file = self.folder.as_ref().map(|folder| cache_file(folder, (&model.about.name, model.digest()), shown));
        let frame = match file.as_deref().and_then(read) {
            Some(frame) => frame,
            None => {
                let picture = photo::load(shown, model.about.image_size as u32);
                let picture =
                    picture.map_err(|e| ModelError::Metadata { path: shown.path.clone(), problem: e.to_string() })?;
                let frame = model.encode(&picture)?;
                // A failed write (a full disk) only costs time later.
                let _ = file.as_deref().map(|file| write(file, &frame));
                frame
            }
        };
        self.kept = Some((index, frame.clone()));
        *self.secs += start.elapsed().as_secs_f64();
        Ok(frame)
    }
}

/// Returns the file in `folder` for a photo as encoded by the `model` of this name and digest; another version of
/// either has another file.
fn cache_file(folder: &Path, model: (&str, &str), photo: &Photo) -> PathBuf {
    let [now, first] = [cache_name, first_name].map(|name| folder.join(name(model, photo, written(photo))));
    files::renamed(now, first)
}

/// Time of the last change of a photo's file, if known.
pub(super) fn written(photo: &Photo) -> Option<SystemTime> {
    std::fs::metadata(&photo.path).and_then(|m| m.modified()).ok()
}

pub(super) fn cache_name((model, digest): (&str, &str), photo: &Photo, written: Option<SystemTime>) -> String {
    let mut sum = Sha256::new();
    for part in [photo.path.as_os_str().as_encoded_bytes(), photo.name.as_bytes(), digest.as_bytes()] {
        sum.update((part.len() as u64).to_le_bytes());
        sum.update(part);
    }
    let since = written.and_then(|t| t.duration_since(SystemTime::UNIX_EPOCH).ok());
    sum.update(since.map_or(u128::MAX, |t| t.as_nanos()).to_le_bytes());
    format!("{model}-{}.frame", files::hex(&sum.finalize()[..12]))
}

/// File name of the first version, by a digest that the standard library does not promise to keep.
fn first_name((model, digest): (&str, &str), photo: &Photo, written: Option<SystemTime>) -> String {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    (photo.path.as_path(), photo.name.as_str(), digest).hash(&mut hasher);
    written.hash(&mut hasher);
    format!("{model}-{:016x}.frame", hasher.finish())
}

fn write(path: &Path, frame: &EncodedFrame) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    atomic::write(path, |w| {
        for array in [&frame.embeddings, &frame.fine, &frame.middle] {
            put(w, array)?;
        }
        Ok(())
    })
    .map_err(io::Error::other)
}

/// Reads a kept frame; `None` if there is none, or it is damaged.
fn read(path: &Path) -> Option<EncodedFrame> {
    parse(&files::read(path, files::MAX_PICTURE_BYTES).ok()?)
}

/// Reads a frame from the bytes of a kept file; `None` if they are damaged.
pub fn parse(mut bytes: &[u8]) -> Option<EncodedFrame> {
    let frame = EncodedFrame { embeddings: take(&mut bytes)?, fine: take(&mut bytes)?, middle: take(&mut bytes)? };
    bytes.is_empty().then_some(frame)
}

/// Writes an array: the number of its axes, their lengths, its numbers.
pub(super) fn put(w: &mut dyn Write, array: &Tensor) -> io::Result<()> {
    let shape: Vec<u64> = array.shape.iter().map(|n| *n as u64).collect();
    w.write_all(&(shape.len() as u64).to_le_bytes())?;
    w.write_all(bytemuck::cast_slice(&shape))?;
    w.write_all(bytemuck::cast_slice(&array.values))
}

/// Takes an array off the front of these bytes; `None` if they are damaged.
pub(super) fn take(rest: &mut &[u8]) -> Option<Tensor> {
    let mut number = || {
        let (head, tail) = rest.split_first_chunk::<8>()?;
        *rest = tail;
        usize::try_from(u64::from_le_bytes(*head)).ok()
    };
    let axes = number().filter(|n| *n <= 8)?;
    let shape: Vec<usize> = (0..axes).map(|_| number()).collect::<Option<_>>()?;
    let n = shape.iter().try_fold(4_usize, |n, axis| n.checked_mul(*axis))?;
    let (values, tail) = rest.split_at_checked(n)?;
    *rest = tail;
    let values = values.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    Some(Tensor { shape, values })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_survive_the_disk_and_damaged_ones_are_made_anew() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("deep").join("a.frame");
        let array = |n: usize| Tensor::new(&[1, n], (0..n).map(|i| i as f32 - 0.5).collect());
        let frame = EncodedFrame { embeddings: array(3), fine: array(5), middle: array(0) };
        write(&path, &frame).expect("written");
        assert_eq!(read(&path), Some(frame));
        let bytes = std::fs::read(&path).expect("read");
        for cut in [0, 7, 20, bytes.len() - 1] {
            std::fs::write(&path, &bytes[..cut]).expect("written");
            assert_eq!(read(&path), None, "{cut}");
        }
        let mut longer = bytes.clone();
        longer.push(0);
        std::fs::write(&path, &longer).expect("written");
        assert_eq!(read(&path), None);
        let mut huge = bytes;
        huge[8..16].copy_from_slice(&u64::MAX.to_le_bytes());
        std::fs::write(&path, &huge).expect("written");
        assert_eq!(read(&path), None);
    }

    #[test]
    fn frames_of_the_first_version_are_used_on() {
        let folder = tempfile::tempdir().expect("folder");
        let camera = crate::scene::Camera::look_at(glam::DVec3::ONE, glam::DVec3::ZERO, glam::DVec3::Z, 0.8, 64, 48);
        // The file does not exist, so its time is unknown.
        let photo = Photo::new("a.jpg", "/one/fox/a.jpg", camera.expect("valid"));
        let model = ("sam2.1-tiny", "00ff");
        let old = folder.path().join("sam2.1-tiny-7228bc543858c811.frame");
        assert_eq!(folder.path().join(first_name(model, &photo, None)), old, "as the first version called it");
        std::fs::write(&old, "kept").expect("write");
        let now = cache_file(folder.path(), model, &photo);
        assert_eq!(std::fs::read(&now).expect("there"), b"kept");
        assert!(!old.exists() && now == cache_file(folder.path(), model, &photo), "it has one name and keeps it");
        let other = cache_file(folder.path(), ("sam2.1-tiny", "00fe"), &photo);
        assert!(other != now && !other.exists(), "the control: another version of the model");
    }
}
