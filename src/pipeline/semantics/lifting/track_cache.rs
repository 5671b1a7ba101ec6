//! Tracks of one mask by SAM 2, kept on disk: tracking that was canceled resumes with its next photo, and the next
//! search with the same masks does not track again.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::frame_cache::{put, take};
use crate::io::labels::rle::Rle;
use crate::io::{atomic, files};
use crate::models::sam2::sequence::{Output, TrackHistory, TrackStep};
use crate::models::tensor::Tensor;
use crate::scene::Mask;

/// Largest file of kept masks, and largest record of a frame, bytes.
const MOST_BYTES: u64 = 64 << 20;
/// Bytes of a record before its content: its object, frame and direction, its length and its checksum.
const HEAD: usize = 40;

/// Reads the masks of a complete track, one of each photo; `None` if there are none of these sizes, or they are
/// damaged.
pub(super) fn read(file: &Path, sizes: &[(usize, usize)]) -> Option<Vec<Mask>> {
    let kept: Vec<Rle> = serde_json::from_slice(&files::read(file, MOST_BYTES).ok()?).ok()?;
    let fits = |(rle, size): (&Rle, &(usize, usize))| rle.size_px() == (size.0 as u32, size.1 as u32);
    let all_fit = kept.len() == sizes.len() && kept.iter().zip(sizes).all(fits);
    kept.iter().filter(|_| all_fit).map(|rle| rle.mask().ok()).collect::<Option<Vec<Mask>>>().filter(|_| all_fit)
}

/// Writes the masks of a complete track; its frames are not needed any more.
pub(super) fn write(file: &Path, masks: &[Mask]) -> io::Result<()> {
    let text = serde_json::to_vec(&masks.iter().map(Rle::of).collect::<Vec<_>>())?;
    atomic::write(file, |w| w.write_all(&text)).map_err(io::Error::other)?;
    fs::remove_file(part(file)).or_else(|e| if e.kind() == io::ErrorKind::NotFound { Ok(()) } else { Err(e) })
}

fn part(file: &Path) -> PathBuf {
    file.with_extension("part")
}

/// Frames of an unfinished track, one record after another in the order of tracking.
pub(super) struct TrackCache {
    /// File, at the start of the next record; `None` once it cannot be kept.
    file: Option<BufReader<File>>,
    /// End of the last record that was read or written, bytes.
    end: u64,
    /// True while there may be more records to read.
    resumes: bool,
}

impl TrackCache {
    /// Opens the track whose masks will be in `file`; without a file nothing is kept.
    pub(super) fn open(file: Option<&Path>) -> Self {
        let opened = file.and_then(|file| {
            file.parent().map(fs::create_dir_all).transpose().ok()?;
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(part(file)).ok()
        });
        Self { file: opened.map(BufReader::new), end: 0, resumes: true }
    }

    fn next(&mut self, step: TrackStep) -> Option<Output> {
        let file = self.file.as_mut()?;
        let mut head = [0; HEAD];
        file.read_exact(&mut head).ok()?;
        let number = |k: usize| head[8 * k..8 * k + 8].try_into().map(u64::from_le_bytes).unwrap_or(u64::MAX);
        let bytes = number(3);
        if [number(0), number(1), number(2)] != place(step) || bytes > MOST_BYTES {
            return None;
        }
        let mut held = Vec::new();
        file.take(bytes).read_to_end(&mut held).ok()?;
        let out = parse(&held).filter(|_| held.len() as u64 == bytes && checksum(&held) == head[32..])?;
        self.end += HEAD as u64 + bytes;
        Some(out)
    }

    fn append(&mut self, step: TrackStep, out: &Output) -> io::Result<()> {
        let Some(file) = self.file.as_mut() else { return Ok(()) };
        let mut held = Vec::new();
        let score = Tensor::new(&[1], vec![out.score]);
        for array in [&out.logits, &out.pointer, &score].into_iter().chain(&out.memory) {
            put(&mut held, array)?;
        }
        let mut record = Vec::with_capacity(HEAD + held.len());
        for number in place(step).into_iter().chain([held.len() as u64]) {
            record.extend(number.to_le_bytes());
        }
        record.extend(checksum(&held));
        record.extend(held);
        let file = file.get_mut();
        // A record that is cut off or of another track, and all after it, are dropped.
        file.set_len(self.end)?;
        file.seek(SeekFrom::Start(self.end))?;
        file.write_all(&record)?;
        self.end += record.len() as u64;
        Ok(())
    }
}

impl TrackHistory for TrackCache {
    fn earlier(&mut self, step: TrackStep) -> Option<Output> {
        let out = if self.resumes { self.next(step) } else { None };
        self.resumes = out.is_some();
        out
    }

    fn keep(&mut self, step: TrackStep, out: &Output) {
        // A failed write (a full disk) only costs time later.
        if self.append(step, out).is_err() {
            self.file = None;
        }
    }
}

fn place(step: TrackStep) -> [u64; 3] {
    [u64::from(step.object), step.frame as u64, u64::from(step.backward)]
}

fn parse(mut held: &[u8]) -> Option<Output> {
    let (logits, pointer, score) = (take(&mut held)?, take(&mut held)?, take(&mut held)?);
    let memory = if held.is_empty() { None } else { Some(take(&mut held)?) };
    let score = *score.values.first()?;
    held.is_empty().then_some(Output { logits, pointer, score, memory })
}

fn checksum(bytes: &[u8]) -> [u8; 8] {
    let digest = Sha256::digest(bytes);
    std::array::from_fn(|i| digest[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn output(k: usize, with_memory: bool) -> Output {
        let array = |n: usize| Tensor::new(&[1, n], (0..n).map(|i| (i + 10 * k) as f32).collect());
        Output { logits: array(4), pointer: array(2), score: k as f32, memory: with_memory.then(|| array(3)) }
    }

    fn at(frame: usize, backward: bool) -> TrackStep {
        TrackStep { object: 0, frame, backward }
    }

    #[test]
    fn a_track_goes_on_where_it_was_cut_off() {
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join("deep").join("a.track");
        let mut kept = TrackCache::open(Some(&file));
        for k in 0..4 {
            assert_eq!(kept.earlier(at(k, false)), None);
            kept.keep(at(k, false), &output(k, k != 2));
        }
        drop(kept);
        let bytes = fs::read(part(&file)).expect("kept");
        for (cut, whole) in [(bytes.len(), 4), (bytes.len() - 1, 3), (bytes.len() / 2, 1), (HEAD, 0), (0, 0)] {
            fs::write(part(&file), &bytes[..cut]).expect("cut off");
            let mut kept = TrackCache::open(Some(&file));
            let again: Vec<Output> = (0..4).map_while(|k| kept.earlier(at(k, false))).collect();
            assert_eq!(again, (0..whole).map(|k| output(k, k != 2)).collect::<Vec<_>>(), "{cut}");
            (whole..4).for_each(|k| kept.keep(at(k, false), &output(k, k != 2)));
            drop(kept);
            assert_eq!(fs::read(part(&file)).expect("kept"), bytes, "what was cut off is followed again");
        }
        // The controls: a record that was changed, another direction, another frame.
        let mut broken = bytes.clone();
        broken[HEAD + 30] ^= 1;
        fs::write(part(&file), &broken).expect("broken");
        assert_eq!(TrackCache::open(Some(&file)).earlier(at(0, false)), None);
        fs::write(part(&file), &bytes).expect("whole");
        assert_eq!(TrackCache::open(Some(&file)).earlier(at(0, true)), None);
        assert_eq!(TrackCache::open(Some(&file)).earlier(at(1, false)), None);
        assert_eq!(TrackCache::open(None).earlier(at(0, false)), None);
    }

    #[test]
    fn masks_of_a_complete_track_are_read_again_and_its_frames_are_gone() {
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join("a.track");
        TrackCache::open(Some(&file)).keep(at(0, false), &output(1, true));
        let masks = [Mask::from_fn(5, 4, |i| i % 3 == 0), Mask::empty(6, 2)];
        write(&file, &masks).expect("written");
        assert_eq!(read(&file, &[(5, 4), (6, 2)]).as_deref(), Some(&masks[..]));
        assert!(!part(&file).exists());
        assert_eq!(read(&file, &[(5, 4), (2, 6)]), None, "of another size");
        assert_eq!(read(&file, &[(5, 4)]), None, "of fewer photos");
        fs::write(&file, b"[").expect("broken");
        assert_eq!(read(&file, &[(5, 4), (6, 2)]), None);
    }
}
