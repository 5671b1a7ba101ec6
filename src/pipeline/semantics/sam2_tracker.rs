//! Masks of one photo followed to the others by SAM 2, photo by photo in their order: what the paper
//! does. Needs no Gaussians; frames are looked at once and kept on disk, so that a run that was
//! stopped resumes where it was.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use sha2::{Digest, Sha256};

use super::error::FindError;
use super::prompt_points::prompt_points;
use super::segmenter::FoundMask;
use super::votes::UNKNOWN;
use crate::io::{self, atomic, files};
use crate::models::ModelError;
use crate::models::catalog::{self, ModelRole};
use crate::models::network::Tensor;
use crate::models::sam2::track::{FrameSource, ObjectId, Prompt, Track, mask_of};
use crate::models::sam2::{EncodedFrame, Sam2};
use crate::pipeline::observer::{Observer, Ticker};
use crate::scene::{IdentityId, MaskPrompt, Photo};

/// Objects that are followed together; memory grows with it.
const BATCH: usize = 16;
pub(crate) const LABEL_SIDE_PX: u32 = 512;

pub(crate) struct Sam2Tracker {
    model: Sam2,
    cache: Option<PathBuf>,
    /// Seconds that looking at frames has taken, reading kept ones included.
    pub(crate) encode_secs: f64,
}

impl Sam2Tracker {
    /// With the SAM 2 of this name: a model of the catalog, or the path of a description. Frames
    /// are kept in `cache`.
    pub(crate) fn open(name: &str, cache: Option<PathBuf>) -> Result<Self, ModelError> {
        Ok(Self { model: Sam2::open(&catalog::find(name, ModelRole::Segmenter)?)?, cache, encode_secs: 0.0 })
    }

    /// The label of every pixel of every photo, scaled to at most [`LABEL_SIDE_PX`], row-major: the
    /// number in `ids` of the innermost mask that was followed there; `UNKNOWN` elsewhere, because
    /// what was not marked may be anything.
    pub(crate) fn follow(
        &mut self,
        photos: &[Photo],
        seed: usize,
        (found, ids): (&[FoundMask], &[IdentityId]),
        prompt: MaskPrompt,
        observer: &mut dyn Observer,
    ) -> Result<Vec<Vec<IdentityId>>, FindError> {
        let size = |photo: &Photo| {
            let camera = photo.camera.limited_to(LABEL_SIDE_PX);
            (camera.width_px as usize, camera.height_px as usize)
        };
        let sizes: Vec<(usize, usize)> = photos.iter().map(size).collect();
        let mut labels: Vec<Vec<IdentityId>> = sizes.iter().map(|(w, h)| vec![UNKNOWN; w * h]).collect();
        let mut frames = Cached { photos, folder: self.cache.clone(), kept: None, secs: &mut self.encode_secs };
        let batches = found.len().div_ceil(BATCH);
        let mut ticker = Ticker::new("Tracking masks", batches * photos.len());
        let mut done = 0;
        for (k, batch) in found.chunks(BATCH).enumerate() {
            let mut end = Ok(());
            let mut track = Track::new(&mut self.model, &mut frames, sizes[seed]);
            for (i, mask) in batch.iter().enumerate() {
                let (w, h) = sizes[seed];
                let mask = mask.mask.resized(w, h);
                let prompt = match prompt {
                    MaskPrompt::Points => Prompt::Points { points: prompt_points(&mask), around: None },
                    MaskPrompt::Mask => Prompt::Mask(mask),
                };
                track.prompt(seed, (k * BATCH + i) as ObjectId, &prompt)?;
            }
            for backward in [false, true] {
                track.run(backward, |frame, seen| {
                    // The seed is passed in both directions.
                    if !(backward && frame == seed) {
                        done += 1;
                    }
                    for (object, out) in seen {
                        let mask = mask_of(out, sizes[frame]);
                        mask.pixels().for_each(|i| labels[frame][i] = ids[*object as usize]);
                    }
                    end = ticker.tick(done, observer);
                    end.is_ok()
                })?;
                end?;
            }
        }
        Ok(labels)
    }
}

/// Frames that are looked at once, then read from disk.
struct Cached<'a> {
    photos: &'a [Photo],
    folder: Option<PathBuf>,
    /// The frame that was used last: it is asked for by every object.
    kept: Option<(usize, EncodedFrame)>,
    secs: &'a mut f64,
}

impl FrameSource for Cached<'_> {
    fn len(&self) -> usize {
        self.photos.len()
    }

    fn get(&mut self, model: &mut Sam2, index: usize) -> Result<EncodedFrame, ModelError> {
        if let Some((_, frame)) = self.kept.as_ref().filter(|(at, _)| *at == index) {
            return Ok(frame.clone());
        }
        let start = std::time::Instant::now();
        let photo = &self.photos[index];
        let file = self.folder.as_ref().map(|folder| kept_file(folder, (&model.about.name, model.digest()), photo));
        let frame = match file.as_deref().and_then(read) {
            Some(frame) => frame,
            None => {
                let picture = io::photo::load(photo, model.about.image_size as u32);
                let picture =
                    picture.map_err(|e| ModelError::Metadata { path: photo.path.clone(), problem: e.to_string() })?;
                let frame = model.encode(&picture)?;
                // A full disk costs time later, nothing else.
                let _ = file.as_deref().map(|file| write(file, &frame));
                frame
            }
        };
        self.kept = Some((index, frame.clone()));
        *self.secs += start.elapsed().as_secs_f64();
        Ok(frame)
    }
}

/// The file in `folder` for what the `model` of this name and digest makes of a photo; another version of either
/// has another.
fn kept_file(folder: &Path, model: (&str, &str), photo: &Photo) -> PathBuf {
    let written = std::fs::metadata(&photo.path).and_then(|m| m.modified()).ok();
    let [now, first] = [kept_name, first_name].map(|name| folder.join(name(model, photo, written)));
    files::renamed(now, first)
}

pub(super) fn kept_name((model, digest): (&str, &str), photo: &Photo, written: Option<SystemTime>) -> String {
    let mut sum = Sha256::new();
    for part in [photo.path.as_os_str().as_encoded_bytes(), photo.name.as_bytes(), digest.as_bytes()] {
        sum.update((part.len() as u64).to_le_bytes());
        sum.update(part);
    }
    let since = written.and_then(|t| t.duration_since(SystemTime::UNIX_EPOCH).ok());
    sum.update(since.map_or(u128::MAX, |t| t.as_nanos()).to_le_bytes());
    let sum: String = sum.finalize().iter().take(12).map(|byte| format!("{byte:02x}")).collect();
    format!("{model}-{sum}.frame")
}

/// What the first version called the file, by a digest that the standard library does not promise to keep.
fn first_name((model, digest): (&str, &str), photo: &Photo, written: Option<SystemTime>) -> String {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    (photo.path.as_path(), photo.name.as_str(), digest).hash(&mut hasher);
    written.hash(&mut hasher);
    format!("{model}-{:016x}.frame", hasher.finish())
}

fn write(path: &Path, frame: &EncodedFrame) -> std::io::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    atomic::write(path, |w| {
        for array in [&frame.embeddings, &frame.fine, &frame.middle] {
            let shape: Vec<u64> = array.shape.iter().map(|n| *n as u64).collect();
            w.write_all(&(shape.len() as u64).to_le_bytes())?;
            w.write_all(bytemuck::cast_slice(&shape))?;
            w.write_all(bytemuck::cast_slice(&array.values))?;
        }
        Ok(())
    })
    .map_err(std::io::Error::other)
}

/// A frame that was kept; `None` if there is none, or it is damaged.
fn read(path: &Path) -> Option<EncodedFrame> {
    parse(&files::read(path, files::MAX_PICTURE_BYTES).ok()?)
}

/// The frame in the bytes of a kept file; `None` if they are damaged.
pub fn parse(bytes: &[u8]) -> Option<EncodedFrame> {
    let mut rest = bytes;
    let mut array = || -> Option<Tensor> {
        let mut number = || {
            let (head, tail) = rest.split_first_chunk::<8>()?;
            rest = tail;
            usize::try_from(u64::from_le_bytes(*head)).ok()
        };
        let axes = number().filter(|n| *n <= 8)?;
        let shape: Vec<usize> = (0..axes).map(|_| number()).collect::<Option<_>>()?;
        let n = shape.iter().try_fold(4_usize, |n, axis| n.checked_mul(*axis))?;
        let (values, tail) = rest.split_at_checked(n)?;
        rest = tail;
        let values = values.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        Some(Tensor { shape, values })
    };
    let frame = EncodedFrame { embeddings: array()?, fine: array()?, middle: array()? };
    rest.is_empty().then_some(frame)
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
        // It is not there, so nobody knows when it was written.
        let photo = Photo::new("a.jpg", "/one/fox/a.jpg", camera.expect("valid"));
        let model = ("sam2.1-tiny", "00ff");
        let old = folder.path().join("sam2.1-tiny-7228bc543858c811.frame");
        assert_eq!(folder.path().join(first_name(model, &photo, None)), old, "as the first version called it");
        std::fs::write(&old, "kept").expect("write");
        let now = kept_file(folder.path(), model, &photo);
        assert_eq!(std::fs::read(&now).expect("there"), b"kept");
        assert!(!old.exists() && now == kept_file(folder.path(), model, &photo), "it has one name and keeps it");
        let other = kept_file(folder.path(), ("sam2.1-tiny", "00fe"), &photo);
        assert!(other != now && !other.exists(), "the control: another version of the model");
    }
}
