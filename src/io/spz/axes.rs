//! Axes of SPZ files. The format documents right, up, back, and Niantic's apps, Spark, three.js and splat-transform 2
//! write and read that. Niantic's converter, splat-transform 3 and earlier versions of this program keep the axes of
//! the `.ply`. The header does not state the axes, so other marks of the writer decide.

use glam::DVec3;

use super::{EXTENSIONS, SHIFT, TURNED, fraction};
use crate::io::reader::Reader;
use crate::io::shift;
use crate::scene::Axes;

/// Extension record with the axes, and their numbering from 1 on (Adobe's).
const COORDINATE_SYSTEM: u32 = 0xADBE_0003;
const SYSTEMS: [&str; 16] =
    ["LDB", "RDB", "LUB", "RUB", "LDF", "RDF", "LUF", "RUF", "LFD", "RFD", "LFU", "RFU", "LBD", "RBD", "LBU", "RBU"];
/// The operating system in gzip headers that this program writes, "unknown"; others name theirs.
const UNKNOWN_SYSTEM: u8 = 255;

/// Prior knowledge of the axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpzAxes {
    /// None: the axes stated in the file, else those of the format, with a warning.
    Unknown,
    /// Axes of the format, unless a record says otherwise.
    Documented,
    /// These axes.
    Given(Axes),
}

/// Marks of a file's writer, besides its columns.
#[derive(Default)]
pub(super) struct AxisMarks {
    /// Records of extensions: type and bytes.
    pub(crate) records: Vec<(u32, Vec<u8>)>,
    /// Comment in the gzip header.
    pub(crate) comment: Option<Vec<u8>>,
    /// True if the gzip header has the form that this program writes.
    pub(crate) own_header: bool,
}

impl AxisMarks {
    pub(super) fn of_gzip(header: Option<&flate2::GzHeader>) -> Self {
        let own = |h: &flate2::GzHeader| {
            h.operating_system() == UNKNOWN_SYSTEM && h.mtime() == 0 && h.filename().is_none() && h.extra().is_none()
        };
        Self {
            comment: header.and_then(|h| h.comment()).map(<[u8]>::to_vec),
            own_header: header.is_some_and(own),
            ..Self::default()
        }
    }

    /// Reads the extension records; the first malformed one ends them.
    pub(super) fn with_records(mut self, flags: u8, bytes: &[u8]) -> Self {
        let mut rest = Reader::new(bytes, std::path::Path::new(""));
        while flags & EXTENSIONS != 0 && !rest.is_at_end() {
            let (Ok(kind), Ok(length)) = (rest.u32(""), rest.u32("")) else { break };
            let Ok(body) = rest.take(length as usize, "") else { break };
            self.records.push((kind, body.to_vec()));
        }
        self
    }

    /// Returns the axes by a record or by marks of this program; `farthest` is the largest coordinate, in steps of
    /// `bits` fractional bits.
    fn stated(&self, version: u32, bits: u8, farthest: i32) -> Option<Axes> {
        let record = self.records.iter().find(|(kind, _)| *kind == COORDINATE_SYSTEM);
        let number = record.and_then(|(_, body)| body.first_chunk::<4>()).map(|b| u32::from_le_bytes(*b) as usize);
        // 0 is "unspecified", which Adobe's reader treats as the format's own.
        let system = number.map(|n| if n == 0 { 4 } else { n }).and_then(|n| SYSTEMS.get(n - 1));
        if let Some(axes) = system.and_then(|letters| letters.parse().ok()) {
            return Some(axes);
        }
        if self.own_comment().is_some() {
            return Some(Axes::SPZ);
        }
        // Only early versions of this program, which kept the scene's axes, used all the bits that fit: others have 12
        // fractional bits.
        let all_bits = fraction(f64::from(farthest) / f64::from(bits).exp2()) == Some(bits);
        (version == 3 && self.own_header && self.comment.is_none() && all_bits).then_some(Axes::PLY)
    }

    /// Text after the axes in a comment of this program.
    fn own_comment(&self) -> Option<&str> {
        std::str::from_utf8(self.comment.as_deref()?).ok()?.strip_prefix(TURNED)
    }

    /// Shift that the positions are relative to, in the axes of the scene.
    pub(super) fn shift(&self) -> DVec3 {
        self.own_comment().and_then(|rest| shift::parsed(rest.strip_prefix(SHIFT)?)).unwrap_or_default()
    }

    /// Returns the axes to read with, and warnings about them and about skipped records.
    pub(super) fn decide(&self, known: SpzAxes, version: u32, bits: u8, farthest: i32) -> (Axes, Vec<String>) {
        let passed = |(kind, body): &(u32, Vec<u8>)| {
            let text = format!("the extension record {kind:#010x} of {} bytes is passed over", body.len());
            (*kind != COORDINATE_SYSTEM).then_some(text)
        };
        let mut told: Vec<String> = self.records.iter().filter_map(passed).collect();
        let axes = match (known, self.stated(version, bits, farthest)) {
            (SpzAxes::Given(axes), _) => axes,
            (_, Some(axes)) => axes,
            (SpzAxes::Documented, None) => Axes::SPZ,
            (SpzAxes::Unknown, None) => {
                told.push(format!(
                    "the file does not say its axes: they are read as {}, as SPZ documents them; if the scene is upside \
                     down, its writer kept those of the .ply, and --axes rdf reads it",
                    Axes::SPZ.words()
                ));
                Axes::SPZ
            }
        };
        (axes, told)
    }
}
