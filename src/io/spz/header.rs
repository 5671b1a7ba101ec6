//! The header of SPZ, and the checks of its numbers.

use std::path::Path;

use super::{MAGIC, columns};
use crate::io::reader::Reader;
use crate::io::{IoError, memory};

/// Most bytes unpacked from one byte: gzip's own limit, which real files never approach.
const MAX_RATIO: u64 = 1032;
/// Most fractional bits of a coordinate: all of its bits.
const MAX_FRACTION: u8 = 24;
/// Highest degree of harmonics in a file.
const MAX_DEGREE: u8 = 4;

/// Fields of the header common to all versions.
pub(super) struct SpzHeader {
    pub(crate) version: u32,
    pub(crate) count: usize,
    pub(crate) degree: u8,
    pub(crate) fraction: u8,
    pub(crate) flags: u8,
    /// Number of streams, in version 4.
    pub(super) streams: u8,
}

impl SpzHeader {
    /// Parses the bytes of a header.
    pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Self, IoError> {
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
        if degree > MAX_DEGREE {
            let what = format!("harmonics of degree {degree}");
            return Err(IoError::Unsupported { path: path.into(), what, remedy: "up to degree 3 can be drawn" });
        }
        if fraction > MAX_FRACTION {
            return Err(bad(format!("{fraction} bits behind the point, of {MAX_FRACTION} in all")));
        }
        Ok(Self { version, count: count as usize, degree, fraction, flags, streams })
    }

    /// Returns bytes per Gaussian in each column, after checking that a file of so many bytes may hold them.
    pub(super) fn checked(&self, file_bytes: usize, path: &Path) -> Result<[usize; 6], IoError> {
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
}
