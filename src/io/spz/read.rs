//! Reading SPZ.

use std::io::Read;
use std::path::Path;

use flate2::read::GzDecoder;
use ruzstd::decoding::FrameDecoder;

use super::axes::{AxisMarks, SpzAxes};
use super::header::SpzHeader;
use super::{EXTENSIONS, MAGIC, decode};
use crate::io::reader::Reader;
use crate::io::{IoError, files};
use crate::scene::{Axes, GaussianCloud};

/// Bytes of the header up to version 3, and of the addition in version 4.
const HEADER: usize = 16;
const MORE_HEADER: usize = 16;
/// First bytes of a gzip stream.
const GZIP: &[u8; 2] = &[0x1f, 0x8b];
/// Bytes of extension records that are read, at the end of a gzip stream.
const MAX_RECORDS: u64 = 1 << 16;

/// Returns whether the first bytes of a file may be SPZ; a gzip stream may also hold something else.
pub(crate) fn is_spz(start: &[u8]) -> bool {
    start.starts_with(GZIP) || start.starts_with(MAGIC)
}

/// Reads a file, with these axes if given.
pub(crate) fn read(path: &Path, axes: Option<Axes>) -> Result<GaussianCloud, IoError> {
    parse_in(&files::read(path, u64::MAX)?, path, axes.map_or(SpzAxes::Unknown, SpzAxes::Given))
}

/// Parses the Gaussians of an SPZ file, in the scene's axes; `path` is for errors.
///
/// # Errors
/// If it is of another version, is cut off, or claims more than it can hold.
pub fn parse(bytes: &[u8], path: &Path) -> Result<GaussianCloud, IoError> {
    parse_in(bytes, path, SpzAxes::Unknown)
}

/// As [`parse`], with prior knowledge of the axes.
pub(crate) fn parse_in(bytes: &[u8], path: &Path, known: SpzAxes) -> Result<GaussianCloud, IoError> {
    if bytes.starts_with(MAGIC) {
        let mut file = Reader::new(bytes, path);
        let header = SpzHeader::parse(file.take(HEADER, "the header")?, path)?;
        let per_gaussian = header.checked(bytes.len(), path)?;
        let more = file.take(MORE_HEADER, "the header")?;
        let toc = u32::from_le_bytes([more[0], more[1], more[2], more[3]]) as usize;
        let records = bytes.get(HEADER + MORE_HEADER..toc).unwrap_or_default();
        let marks = AxisMarks::default().with_records(header.flags, records);
        let all = streams(&header, per_gaussian, toc, bytes, path)?;
        return decode::cloud(&header, &all, &marks, known, path);
    }
    let mut unpacked = GzDecoder::new(bytes);
    let mut next = |n: usize, place: &str| {
        let mut all = Vec::new();
        let broken = |e: std::io::Error| IoError::syntax(path, place, format!("it cannot be unpacked: {e}"));
        (&mut unpacked).take(n as u64).read_to_end(&mut all).map_err(broken)?;
        match all.len() {
            have if have < n => {
                Err(IoError::Truncated { path: path.into(), place: place.into(), need: n as u64, have: have as u64 })
            }
            _ => Ok(all),
        }
    };
    let header = SpzHeader::parse(&next(HEADER, "the header")?, path)?;
    let per_gaussian = header.checked(bytes.len(), path)?;
    let mut all = Vec::new();
    for (bytes, name) in per_gaussian.into_iter().zip(NAMES) {
        all.push(next(bytes * header.count, name)?);
    }
    let mut records = Vec::new();
    if header.flags & EXTENSIONS != 0 {
        let broken = |e| IoError::syntax(path, "the extensions", format!("they cannot be unpacked: {e}"));
        (&mut unpacked).take(MAX_RECORDS).read_to_end(&mut records).map_err(broken)?;
    }
    let marks = AxisMarks::of_gzip(unpacked.header()).with_records(header.flags, &records);
    decode::cloud(&header, &all, &marks, known, path)
}

/// Names of the columns in errors.
const NAMES: [&str; 6] = ["positions", "opacities", "colors", "scales", "rotations", "harmonics"];

/// Unpacks the columns of a file of version 4; `toc` is the offset of the sizes of its streams.
fn streams(
    header: &SpzHeader,
    per_gaussian: [usize; 6],
    toc: usize,
    bytes: &[u8],
    path: &Path,
) -> Result<Vec<Vec<u8>>, IoError> {
    let bad = |place: &str, reason: String| IoError::syntax(path, place, reason);
    let of_file = bytes.get(toc.max(HEADER + MORE_HEADER)..).unwrap_or_default();
    let mut table = Reader::new(of_file, path);
    let given = per_gaussian.iter().filter(|bytes| **bytes > 0).count();
    if usize::from(header.streams) != given {
        return Err(bad("the header", format!("{} streams, expected {given}", header.streams)));
    }
    let sizes: Result<Vec<[u64; 2]>, _> = (0..given)
        .map(|_| Ok([table.u64("the sizes of the streams")?, table.u64("the sizes of the streams")?]))
        .collect();
    let mut all = Vec::new();
    for ((bytes, name), [packed, unpacked]) in per_gaussian.into_iter().zip(NAMES).zip(sizes?) {
        let size = bytes * header.count;
        if unpacked != size as u64 {
            return Err(bad(name, format!("{unpacked} bytes, expected {size}")));
        }
        let stream = table.take(usize::try_from(packed).unwrap_or(usize::MAX), name)?;
        let mut decoder = FrameDecoder::new();
        // A frame may ask for a window of any size before its content is decoded.
        decoder.set_max_window_size((size as u64).max(1 << 20));
        let mut out = vec![0; size];
        match decoder.decode_all(stream, &mut out) {
            Ok(n) if n == size => all.push(out),
            Ok(n) => return Err(bad(name, format!("{n} bytes, expected {size}"))),
            Err(e) => return Err(bad(name, format!("they cannot be unpacked: {e}"))),
        }
    }
    all.resize(per_gaussian.len(), Vec::new());
    Ok(all)
}
