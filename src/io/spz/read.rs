//! Reading SPZ.

use std::io::Read;
use std::path::Path;

use flate2::read::GzDecoder;
use half::f16;
use rayon::prelude::*;
use ruzstd::decoding::FrameDecoder;

use super::{ANTIALIASED, COLOR_SCALE, COMPONENT_MOST, HARMONIC_MIDDLE, MAGIC, SCALE_FIRST, SCALE_STEP, columns};
use crate::io::quantized::{logit, unit_quaternion, unorm};
use crate::io::reader::Reader;
use crate::io::{IoError, files, memory};
use crate::math::sh::coefficients;
use crate::scene::{GaussianCloud, SplatRenderMode};

/// Bytes of the header up to version 3, and of what version 4 adds.
const HEADER: usize = 16;
const MORE_HEADER: usize = 16;
/// How gzip starts.
const GZIP: &[u8; 2] = &[0x1f, 0x8b];
/// What is unpacked from a byte at most: gzip's own limit, which real files never come near.
const MAX_RATIO: u64 = 1032;
/// More bits behind the point than a coordinate has bits.
const MAX_FRACTION: u8 = 24;

/// Whether the first bytes of a file are those of SPZ; others are packed by gzip too, but no splats.
pub(crate) fn is_spz(start: &[u8]) -> bool {
    start.starts_with(GZIP) || start.starts_with(MAGIC)
}

pub(crate) fn read(path: &Path) -> Result<GaussianCloud, IoError> {
    parse(&files::read(path, u64::MAX)?, path)
}

/// The Gaussians in the bytes of an SPZ file; `path` is for errors.
///
/// # Errors
/// If it is of another version, is cut off, or claims more than it can hold.
pub fn parse(bytes: &[u8], path: &Path) -> Result<GaussianCloud, IoError> {
    if bytes.starts_with(MAGIC) {
        let mut file = Reader::new(bytes, path);
        let header = Header::parse(file.take(HEADER, "the header")?, path)?;
        let per_gaussian = header.checked(bytes.len(), path)?;
        let more = file.take(MORE_HEADER, "the header")?;
        let toc = u32::from_le_bytes([more[0], more[1], more[2], more[3]]) as usize;
        return header.cloud(streams(&header, per_gaussian, toc, bytes, path)?, path);
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
    let header = Header::parse(&next(HEADER, "the header")?, path)?;
    let per_gaussian = header.checked(bytes.len(), path)?;
    let mut all = Vec::new();
    for (bytes, name) in per_gaussian.into_iter().zip(NAMES) {
        all.push(next(bytes * header.count, name)?);
    }
    header.cloud(all, path)
}

/// What the columns are called in errors.
const NAMES: [&str; 6] = ["positions", "opacities", "colors", "scales", "rotations", "harmonics"];

/// The columns of a file of version 4; `toc` is where the sizes of its streams are.
fn streams(
    header: &Header,
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
        // A frame may ask for a window of any size before its content is seen.
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

/// What all versions say at first.
struct Header {
    version: u32,
    count: usize,
    degree: u8,
    fraction: u8,
    flags: u8,
    /// In version 4.
    streams: u8,
}

impl Header {
    fn parse(bytes: &[u8], path: &Path) -> Result<Self, IoError> {
        let mut fields = Reader::new(bytes, path);
        let bad = |reason: String| IoError::syntax(path, "the header", reason);
        if fields.take(MAGIC.len(), "the header")? != MAGIC {
            return Err(bad("what is packed there is no SPZ".into()));
        }
        let [version, count] = [fields.u32("the header")?, fields.u32("the header")?];
        let [degree, fraction, flags, streams] = fields.array("the header")?;
        if !(1..=4).contains(&version) {
            return Err(IoError::Version { path: path.into(), found: version.into(), supported: 4 });
        }
        if degree > 3 {
            let what = format!("harmonics of degree {degree}");
            return Err(IoError::Unsupported { path: path.into(), what, remedy: "up to degree 3 can be drawn" });
        }
        if fraction > MAX_FRACTION {
            return Err(bad(format!("{fraction} bits behind the point, of {MAX_FRACTION} in all")));
        }
        Ok(Self { version, count: count as usize, degree, fraction, flags, streams })
    }

    /// Bytes a Gaussian in each column, once it is known that a file of so many bytes may hold them.
    fn checked(&self, file_bytes: usize, path: &Path) -> Result<[usize; 6], IoError> {
        let columns = columns(self.version, self.degree);
        let each = columns.iter().sum::<usize>() as u64;
        let possible = (file_bytes as u64).saturating_mul(MAX_RATIO) / each;
        if self.count as u64 > possible {
            let what = "Gaussians".into();
            return Err(IoError::Count { path: path.into(), what, claimed: self.count as u64, possible });
        }
        let (bytes, limit) = (self.count as u64 * each, memory::budget());
        if bytes > limit {
            let remedy = "free some memory or use a smaller file";
            return Err(IoError::OverBudget { path: path.into(), what: "unpacking the file", bytes, limit, remedy });
        }
        Ok(columns)
    }

    fn cloud(&self, columns: Vec<Vec<u8>>, path: &Path) -> Result<GaussianCloud, IoError> {
        let [positions, opacities, colors, scales, rotations, harmonics] = columns.as_slice() else {
            return Ok(GaussianCloud::default());
        };
        let step = (-f32::from(self.fraction)).exp2();
        let position = |bytes: &[u8]| match self.version {
            1 => [0, 2, 4].map(|k| f16::from_le_bytes([bytes[k], bytes[k + 1]]).to_f32()),
            // The sign is in the third byte of four.
            _ => [0, 3, 6].map(|k| (i32::from_le_bytes([0, bytes[k], bytes[k + 1], bytes[k + 2]]) >> 8) as f32 * step),
        };
        let color = |byte: u8| (unorm(byte.into(), 8) - 0.5) / COLOR_SCALE;
        let stride = coefficients(self.degree);
        let mut sh = vec![[0.0; 3]; self.count * stride];
        sh.par_chunks_exact_mut(stride).enumerate().for_each(|(i, out)| {
            out[0] = [0, 1, 2].map(|k| color(colors[3 * i + k]));
            let rest = harmonics[3 * (stride - 1) * i..].as_chunks::<3>().0;
            out[1..].iter_mut().zip(rest).for_each(|(rgb, bytes)| {
                *rgb = bytes.map(|byte| (f32::from(byte) - HARMONIC_MIDDLE) / HARMONIC_MIDDLE);
            });
        });
        let antialiased = self.flags & ANTIALIASED != 0;
        let cloud = GaussianCloud {
            positions: positions.par_chunks_exact(super::columns(self.version, 0)[0]).map(position).collect(),
            log_scales: scales
                .as_chunks::<3>()
                .0
                .par_iter()
                .map(|s| s.map(|byte| f32::from(byte) * SCALE_STEP + SCALE_FIRST))
                .collect(),
            quaternions: match rotations.as_chunks::<4>() {
                (packed, _) if self.version >= 3 => {
                    packed.par_iter().map(|bytes| smallest_three(u32::from_le_bytes(*bytes))).collect()
                }
                _ => rotations.as_chunks::<3>().0.par_iter().map(|bytes| first_three(*bytes)).collect(),
            },
            opacity_logits: opacities.par_iter().map(|byte| logit(unorm((*byte).into(), 8))).collect(),
            sh_degree: self.degree,
            sh,
            render_mode: if antialiased { SplatRenderMode::Mip } else { SplatRenderMode::Plain },
            ..GaussianCloud::default()
        };
        // Half floats may be infinite.
        cloud.validate().map_err(|cause| IoError::Cloud { path: path.into(), cause })?;
        Ok(cloud)
    }
}

/// Versions 1 and 2: x, y and z, w positive.
fn first_three(bytes: [u8; 3]) -> [f32; 4] {
    let [x, y, z] = bytes.map(|byte| f32::from(byte) / 127.5 - 1.0);
    [(1.0 - (x * x + y * y + z * z)).max(0.0).sqrt(), x, y, z]
}

/// Versions 3 and 4: which of x, y, z, w is largest in 2 bits, a sign and 9 bits for each of the others.
fn smallest_three(packed: u32) -> [f32; 4] {
    let part = |shift: u32| {
        let size = (packed >> shift & 511) as f32 / COMPONENT_MOST * 0.5;
        0.5 + if packed >> shift & 512 == 0 { size } else { -size }
    };
    let [x, y, z, w] = unit_quaternion((packed >> 30) as usize, [part(20), part(10), part(0)]);
    [w, x, y, z]
}
