//! Index of the frames of an MP4 or QuickTime file: where each lies, how it is coded and turned.

use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use shiguredo_mp4::Decode;
use shiguredo_mp4::aux::SampleTableAccessor;
use shiguredo_mp4::boxes::{HdlrBox, SampleEntry, TrakBox};

use super::{FootageError, Turn};
use crate::io::{IoError, files};

/// Largest index, bytes: that of a video of many hours.
const MAX_INDEX_BYTES: u64 = 256 << 20;

/// Frame in a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct StoredFrame {
    pub(super) offset: u64,
    pub(super) bytes: u64,
    pub(super) is_key: bool,
}

/// Frames of a file, in the order in which they are decoded.
pub(super) struct VideoIndex {
    pub(super) samples: Vec<StoredFrame>,
    pub(super) size_px: (usize, usize),
    pub(super) turn: Turn,
    /// Parameter sets of H.264, each with a start code.
    pub(super) parameters: Vec<u8>,
    /// Bytes of the length before each unit.
    pub(super) length_bytes: usize,
    /// Name of the codec, if it is not H.264.
    pub(super) other_codec: Option<String>,
}

impl VideoIndex {
    pub(super) fn read(path: &Path) -> Result<Self, FootageError> {
        let no_video = |why: &str| FootageError::NoVideo { path: path.into(), why: why.into() };
        let moov = moov(path)?;
        let (mut found, mut others, mut broken) = (None, None, None);
        for (_, whole) in boxes(&moov).filter(|(kind, _)| kind == b"trak") {
            match TrakBox::decode(whole) {
                Err(e) => broken = Some(e.to_string()),
                Ok((track, _)) => match track.mdia_box.hdlr_box.handler_type {
                    HdlrBox::HANDLER_TYPE_VIDE if found.is_none() => found = Some(track),
                    HdlrBox::HANDLER_TYPE_SOUN => others = Some("sound"),
                    _ => {}
                },
            }
        }
        let Some(track) = found else {
            return Err(match (others, broken) {
                (_, Some(why)) => no_video(&format!("its index cannot be read ({why})")),
                (Some(found), None) => FootageError::NoPicture { path: path.into(), found },
                (None, None) => FootageError::NoPicture { path: path.into(), found: "data of other kinds" },
            });
        };
        let turn = turn(&track.tkhd_box.matrix);
        let table = SampleTableAccessor::new(&track.mdia_box.minf_box.stbl_box)
            .map_err(|e| no_video(&format!("its list of frames cannot be read ({e:?})")))?;
        let end = std::fs::metadata(path).map_err(|cause| IoError::Read { path: path.into(), cause })?.len();
        if u64::from(table.sample_count()) > end {
            return Err(no_video("its list of frames is longer than the file"));
        }
        let samples: Vec<StoredFrame> = table
            .samples()
            .map(|s| StoredFrame {
                offset: s.data_offset(),
                bytes: u64::from(s.data_size()),
                is_key: s.is_sync_sample(),
            })
            .collect();
        if samples.is_empty() {
            return Err(FootageError::NoFrames { path: path.into() });
        }
        let is_beyond = |s: &StoredFrame| s.offset.checked_add(s.bytes).is_none_or(|last| last > end);
        if let Some(frame) = samples.iter().position(is_beyond) {
            return Err(FootageError::CutOff { path: path.into(), frame: frame + 1, frames: samples.len() });
        }
        let mut index =
            Self { samples, size_px: (0, 0), turn, parameters: Vec::new(), length_bytes: 4, other_codec: None };
        let entries = &track.mdia_box.minf_box.stbl_box.stsd_box.entries;
        index.describe(entries.first().ok_or_else(|| no_video("it does not say how its frames are coded"))?);
        Ok(index)
    }

    /// Takes codec and size from the description of the frames.
    fn describe(&mut self, entry: &SampleEntry) {
        let (visual, codec) = match entry {
            SampleEntry::Avc1(avc) => {
                self.length_bytes = usize::from(avc.avcc_box.length_size_minus_one.get()) + 1;
                for set in avc.avcc_box.sps_list.iter().chain(&avc.avcc_box.pps_list) {
                    self.parameters.extend([0, 0, 0, 1]);
                    self.parameters.extend(set);
                }
                (&avc.visual, None)
            }
            SampleEntry::Hvc1(other) => (&other.visual, Some("HEVC (H.265)")),
            SampleEntry::Hev1(other) => (&other.visual, Some("HEVC (H.265)")),
            SampleEntry::Vp08(other) => (&other.visual, Some("VP8")),
            SampleEntry::Vp09(other) => (&other.visual, Some("VP9")),
            SampleEntry::Av01(other) => (&other.visual, Some("AV1")),
            // Its size is not known; ffmpeg says if it is no use.
            _ => {
                self.size_px = (usize::MAX, usize::MAX);
                self.other_codec = Some("another codec than H.264".into());
                return;
            }
        };
        self.size_px = (usize::from(visual.width), usize::from(visual.height));
        self.other_codec = codec.map(str::to_owned);
    }
}

/// Reads the content of the file's index.
fn moov(path: &Path) -> Result<Vec<u8>, FootageError> {
    let no_video = |why: &str| FootageError::NoVideo { path: path.into(), why: why.into() };
    let failed = |cause| IoError::Read { path: path.into(), cause };
    let mut file = files::open(path)?;
    let end = file.metadata().map_err(failed)?.len();
    let (mut at, mut is_first, mut has_data) = (0_u64, true, false);
    while at < end {
        let mut start = [0; 16];
        file.seek(SeekFrom::Start(at)).map_err(failed)?;
        let read = file.by_ref().take(16).read(&mut start).map_err(failed)?;
        let Some((kind, head, size)) = head(&start[..read], end - at) else { break };
        if is_first && ![*b"ftyp", *b"moov", *b"mdat", *b"wide", *b"free", *b"skip"].contains(&kind) {
            return Err(no_video("it does not begin like an MP4 or QuickTime file"));
        }
        if kind == *b"moov" {
            if size > MAX_INDEX_BYTES || size > end - at {
                return Err(no_video("its index is cut off or too large; copy the file again"));
            }
            let mut content = vec![0; (size - head) as usize];
            file.seek(SeekFrom::Start(at + head)).map_err(failed)?;
            file.read_exact(&mut content).map_err(failed)?;
            return Ok(content);
        }
        has_data |= kind == *b"mdat";
        is_first = false;
        at = at.saturating_add(size);
    }
    Err(no_video(match (end, has_data) {
        (0, _) => "it is empty",
        (_, true) => "it has no index of its frames: the recording or the copy was cut off",
        (_, false) => "it has no index of frames",
    }))
}

/// Kind of a box, bytes of its head, and all its bytes; `left` are to the end of the file.
fn head(start: &[u8], left: u64) -> Option<([u8; 4], u64, u64)> {
    let number = u32::from_be_bytes(*start.first_chunk()?);
    let kind: [u8; 4] = start.get(4..8)?.try_into().ok()?;
    let (head, size) = match number {
        0 => (8, left),
        1 => (16, u64::from_be_bytes(start.get(8..16)?.try_into().ok()?)),
        size => (8, u64::from(size)),
    };
    (size >= head).then_some((kind, head, size))
}

/// Boxes one after the other, each whole.
fn boxes(content: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    let mut rest = content;
    std::iter::from_fn(move || {
        let (kind, _, size) = head(rest, rest.len() as u64)?;
        let (whole, after) = rest.split_at_checked(usize::try_from(size).ok()?)?;
        rest = after;
        Some((kind, whole))
    })
}

/// Turn of a matrix of 16.16 numbers, row by row; anything but quarter turns is none.
fn turn(matrix: &[i32; 9]) -> Turn {
    const ONE: i32 = 1 << 16;
    match [matrix[0], matrix[1], matrix[3], matrix[4]] {
        [0, ONE, b, 0] if b == -ONE => Turn::Quarter,
        [a, 0, 0, d] if a == -ONE && d == -ONE => Turn::Half,
        [0, b, ONE, 0] if b == -ONE => Turn::ThreeQuarters,
        _ => Turn::None,
    }
}
