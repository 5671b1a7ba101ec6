//! `.ksplat` of GaussianSplats3D, read only: sections of rows, as floats (level 0), or as half floats with positions
//! relative to buckets (level 1) and harmonics in bytes (level 2).
//!
//! The header of 4096 bytes: version, counts of sections and Gaussians, level, range of the harmonics' bytes. Then 1024
//! bytes a section, then the sections, each with the sizes of its buckets that are not full, the buckets' centers, and
//! the rows. The format has no signature, so files are recognized by their name.

use std::path::Path;

use half::f16;

use super::finite::finite_only;
use super::quantized::{constant, log_scale, logit, unorm};
use super::reader::Reader;
use super::{IoError, files};
use crate::math::sh::coefficients;
use crate::scene::GaussianCloud;

const HEADER: usize = 4096;
const SECTION_HEADER: usize = 1024;
/// Most sections; files have a few.
const MAX_SECTIONS: u32 = 4096;
/// Largest absolute value of harmonics in bytes, if the header states none.
const HARMONICS_RANGE: f32 = 1.5;
/// Value of a 16-bit position at the center of its bucket, if the section states none.
const POSITION_RANGE: u32 = 32_767;

pub(crate) fn read(path: &Path) -> Result<GaussianCloud, IoError> {
    parse(&files::read(path, u64::MAX)?, path)
}

/// Parses the Gaussians of a `.ksplat`; `path` is for errors.
///
/// # Errors
/// If it is of another version, a count exceeds what follows, or no Gaussian is finite.
pub fn parse(bytes: &[u8], path: &Path) -> Result<GaussianCloud, IoError> {
    let mut rest = Reader::new(bytes, path);
    let header = Fields(rest.take(HEADER, "the header")?);
    if header.0[0] != 0 || header.0[1] == 0 {
        let (major, minor) = (header.0[0], header.0[1]);
        return Err(IoError::syntax(path, "the header", format!("its version is {major}.{minor}, 0.1 is read")));
    }
    let level = header.u16(20);
    let layout = match level {
        0 => Layout { scale: 12, rotation: 24, color: 40, rest: 44, harmonic: 4 },
        1 | 2 => Layout { scale: 6, rotation: 12, color: 20, rest: 24, harmonic: if level == 1 { 2 } else { 1 } },
        _ => {
            return Err(IoError::syntax(
                path,
                "the header",
                format!("its compression level is {level}, 0 to 2 is read"),
            ));
        }
    };
    let sections = header.u32(4);
    if sections > MAX_SECTIONS {
        return Err(count(path, "sections", sections, MAX_SECTIONS as usize));
    }
    let or = |v: f32, default: f32| if v == 0.0 { default } else { v };
    let range = [or(header.f32(36), -HARMONICS_RANGE), or(header.f32(40), HARMONICS_RANGE)];
    let headers = Fields(rest.take(sections as usize * SECTION_HEADER, "the headers of the sections")?);
    let mut parts = Vec::new();
    for k in 0..sections as usize {
        let fields = Fields(&headers.0[k * SECTION_HEADER..(k + 1) * SECTION_HEADER]);
        let place = format!("section {k}");
        let section = Section::read(&fields, &layout, &mut rest, path, &place)?;
        parts.push(section.cloud(&layout, range));
    }
    let cloud = GaussianCloud::joined(parts);
    if cloud.is_empty() {
        return Err(IoError::syntax(path, "the header", "no section holds a Gaussian"));
    }
    finite_only(cloud, path)
}

fn count(path: &Path, what: &str, claimed: u32, possible: usize) -> IoError {
    IoError::Count { path: path.into(), what: what.into(), claimed: claimed.into(), possible: possible as u64 }
}

/// Reads numbers at fixed offsets of a header, which is long enough.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn u16(&self, at: usize) -> u16 {
        u16::from_le_bytes([self.0[at], self.0[at + 1]])
    }

    fn u32(&self, at: usize) -> u32 {
        u32::from_le_bytes([self.0[at], self.0[at + 1], self.0[at + 2], self.0[at + 3]])
    }

    fn f32(&self, at: usize) -> f32 {
        f32::from_bits(self.u32(at))
    }
}

/// Offsets of the fields of a row, in bytes; positions are at its start.
struct Layout {
    scale: usize,
    rotation: usize,
    color: usize,
    rest: usize,
    /// Bytes of a harmonic coefficient.
    harmonic: usize,
}

impl Layout {
    /// Returns the `k`th of the numbers that start at `at`, floats or half floats.
    fn number(&self, row: &Fields<'_>, at: usize, k: usize) -> f32 {
        match self.harmonic {
            4 => row.f32(at + 4 * k),
            _ => f16::from_bits(row.u16(at + 2 * k)).to_f32(),
        }
    }
}

struct Section<'a> {
    /// Bytes of a row.
    stride: usize,
    degree: u8,
    rows: &'a [u8],
    /// Value of a 16-bit position at its bucket's center, and the length of a step.
    middle: f32,
    step: f32,
    /// The center of each bucket, and the number of its last row plus 1.
    buckets: Vec<([f32; 3], usize)>,
}

impl<'a> Section<'a> {
    fn read(
        header: &Fields<'_>,
        layout: &Layout,
        rest: &mut Reader<'a>,
        path: &Path,
        place: &str,
    ) -> Result<Self, IoError> {
        let [used, rows, capacity, buckets] = [0, 4, 8, 12].map(|at| header.u32(at));
        let [full, partial] = [32, 36].map(|at| header.u32(at));
        let bad = |reason: String| IoError::syntax(path, place, reason);
        let degree = match header.u16(40) {
            d @ 0..=2 => d as u8,
            d => return Err(bad(format!("its harmonics are of degree {d}, up to 2 is read"))),
        };
        if used > rows {
            return Err(count(path, &format!("Gaussians in {place}"), used, rows as usize));
        }
        if full.checked_add(partial).is_none_or(|all| all > buckets) {
            return Err(count(path, &format!("buckets in {place}"), full.saturating_add(partial), buckets as usize));
        }
        let bytes = match header.u16(20) {
            bytes if bytes >= 12 || buckets == 0 => usize::from(bytes),
            bytes => return Err(bad(format!("a bucket has {bytes} bytes, a center has 12"))),
        };
        let sizes = Fields(rest.take(partial as usize * 4, place)?);
        // Nothing is allocated for buckets before their bytes are there.
        let centers = Fields(rest.take((buckets as usize).saturating_mul(bytes), place)?);
        let mut end = 0_usize;
        let mut ends = Vec::with_capacity((full + partial) as usize);
        for k in 0..(full + partial) as usize {
            let size = k.checked_sub(full as usize).map_or(capacity, |k| sizes.u32(4 * k));
            end = end.saturating_add(size as usize);
            ends.push(([0, 4, 8].map(|axis| centers.f32(k * bytes + axis)), end));
        }
        if layout.harmonic != 4 && end < used as usize {
            return Err(count(path, &format!("Gaussians in {place}, whose buckets hold fewer"), used, end));
        }
        let stride = layout.rest + layout.harmonic * 3 * (coefficients(degree) - 1);
        let all = rest.take((rows as usize).saturating_mul(stride), place)?;
        let range = Some(header.u32(24)).filter(|r| *r > 0).unwrap_or(POSITION_RANGE) as f32;
        let step = header.f32(16) / 2.0 / range;
        Ok(Self { stride, degree, rows: &all[..used as usize * stride], middle: range, step, buckets: ends })
    }

    fn cloud(&self, layout: &Layout, range: [f32; 2]) -> GaussianCloud {
        let mut cloud = GaussianCloud { sh_degree: self.degree, ..GaussianCloud::default() };
        let stride = cloud.sh_stride();
        let mut bucket = 0;
        for (i, row) in self.rows.chunks_exact(self.stride).enumerate() {
            let row = Fields(row);
            let numbers = |at: usize| [0, 1, 2].map(|k| layout.number(&row, at, k));
            let position = match layout.harmonic {
                4 => numbers(0),
                _ => {
                    while self.buckets.get(bucket).is_some_and(|(_, end)| i >= *end) {
                        bucket += 1;
                    }
                    let center = self.buckets.get(bucket).map_or([0.0; 3], |(center, _)| *center);
                    [0, 1, 2].map(|k| (f32::from(row.u16(2 * k)) - self.middle) * self.step + center[k])
                }
            };
            cloud.positions.push(position);
            cloud.log_scales.push(numbers(layout.scale).map(log_scale));
            cloud.quaternions.push([0, 1, 2, 3].map(|k| layout.number(&row, layout.rotation, k)));
            let [r, g, b, a] = [0, 1, 2, 3].map(|k| unorm(row.0[layout.color + k].into(), 8));
            cloud.opacity_logits.push(logit(a));
            cloud.sh.push([r, g, b].map(constant));
            let harmonic = |k: usize| match layout.harmonic {
                1 => range[0] + unorm(row.0[layout.rest + k].into(), 8) * (range[1] - range[0]),
                _ => layout.number(&row, layout.rest, k),
            };
            for k in 1..stride {
                // Harmonics of one band together: all red ones, then green, then blue.
                let (first, of_band) = if k < 4 { (0, 3) } else { (9, 5) };
                let at = first + k - if k < 4 { 1 } else { 4 };
                cloud.sh.push([0, 1, 2].map(|channel| harmonic(at + channel * of_band)));
            }
        }
        cloud
    }
}

#[cfg(test)]
mod tests;
