//! NumPy arrays of numbers of any kind: whole numbers, fractions of 16 to 64 bits, truth values.

use std::path::Path;

use half::f16;
use npyz::NpyFile;

use super::npy::{claimed, header_len, syntax};
use super::{IoError, files};

/// Kind of the numbers of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NumberKind {
    Float,
    Signed,
    Unsigned,
}

/// Array of numbers whose header has been compared with the file.
pub(crate) struct NpyNumbers {
    /// Length along each axis.
    pub(crate) shape: Vec<usize>,
    kind: NumberKind,
    /// Bytes per number.
    width: usize,
    is_big_endian: bool,
    bytes: Vec<u8>,
    /// Offset of the first number.
    start: usize,
}

/// Reads the file at `path`, of at most 256 MiB.
pub(crate) fn read(path: &Path) -> Result<NpyNumbers, IoError> {
    parse(files::read(path, files::MAX_PICTURE_BYTES)?, path)
}

/// Checks the array in `bytes`, which come from `path`.
pub(crate) fn parse(bytes: Vec<u8>, path: &Path) -> Result<NpyNumbers, IoError> {
    let bad = |reason: String| syntax(path, reason);
    let start = header_len(&bytes).ok_or_else(|| bad("not an .npy file, or its header is cut off".into()))?;
    let text = String::from_utf8_lossy(&bytes[..start]).into_owned();
    let descr = text.split_once("'descr'").and_then(|(_, rest)| rest.split('\'').nth(1)).unwrap_or_default();
    let (kind, width) =
        kind_of(descr).ok_or_else(|| bad(format!("its entries are of the kind '{descr}', expected numbers")))?;
    let possible = ((bytes.len() - start) / width) as u64;
    let claimed = claimed(&text);
    if claimed > possible {
        return Err(IoError::Count { path: path.into(), what: "numbers".into(), claimed, possible });
    }
    let npy = NpyFile::new(&bytes[..]).map_err(|e| bad(e.to_string()))?;
    if npy.order() != npyz::Order::C {
        return Err(bad("the array is stored column by column; save it with order='C'".into()));
    }
    let shape = npy.shape().iter().map(|n| *n as usize).collect();
    let is_big_endian = descr.starts_with('>');
    Ok(NpyNumbers { shape, kind, width, is_big_endian, bytes, start })
}

fn kind_of(descr: &str) -> Option<(NumberKind, usize)> {
    let kind = descr.strip_prefix(['<', '>', '=', '|']).unwrap_or(descr);
    Some(match kind {
        "f2" | "f4" | "f8" => (NumberKind::Float, kind[1..].parse().ok()?),
        "i1" | "i2" | "i4" | "i8" => (NumberKind::Signed, kind[1..].parse().ok()?),
        "u1" | "u2" | "u4" | "u8" => (NumberKind::Unsigned, kind[1..].parse().ok()?),
        "b1" => (NumberKind::Unsigned, 1),
        _ => return None,
    })
}

impl NpyNumbers {
    /// Number at `index`, row by row.
    #[inline]
    pub(crate) fn at(&self, index: usize) -> f64 {
        let from = self.start + index * self.width;
        let mut raw = [0; 8];
        raw[..self.width].copy_from_slice(&self.bytes[from..from + self.width]);
        if self.is_big_endian {
            raw[..self.width].reverse();
        }
        let [a, b, c, d, ..] = raw;
        match (self.kind, self.width) {
            (NumberKind::Float, 2) => f16::from_le_bytes([a, b]).to_f64(),
            (NumberKind::Float, 4) => f64::from(f32::from_le_bytes([a, b, c, d])),
            (NumberKind::Float, _) => f64::from_le_bytes(raw),
            (NumberKind::Signed, 1) => f64::from(a.cast_signed()),
            (NumberKind::Signed, 2) => f64::from(i16::from_le_bytes([a, b])),
            (NumberKind::Signed, 4) => f64::from(i32::from_le_bytes([a, b, c, d])),
            (NumberKind::Signed, _) => i64::from_le_bytes(raw) as f64,
            (NumberKind::Unsigned, _) => u64::from_le_bytes(raw) as f64,
        }
    }

    /// Count of the numbers.
    pub(crate) fn len(&self) -> usize {
        self.shape.iter().product()
    }
}

/// Bytes of an array as NumPy writes it.
#[cfg(test)]
pub(crate) fn written(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
    [b"\x93NUMPY\x01\x00\x76\x00", format!("{header:<117}\n").as_bytes(), data].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(descr: &str, data: &[u8], count: usize) -> Vec<f64> {
        let array = parse(written(descr, &format!("({count},)"), data), Path::new("a.npy")).expect(descr);
        assert_eq!((array.len(), array.shape.as_slice()), (count, &[count][..]));
        (0..count).map(|i| array.at(i)).collect()
    }

    #[test]
    fn every_kind_of_number_is_read() {
        assert_eq!(values("<f2", &[0x00, 0x3c, 0x00, 0xc1], 2), [1.0, -2.5]);
        assert_eq!(values(">f2", &[0x3c, 0x00], 1), [1.0]);
        assert_eq!(values("<f4", &[1.5_f32, -1.0].map(f32::to_le_bytes).concat(), 2), [1.5, -1.0]);
        assert_eq!(values(">f8", &0.1_f64.to_be_bytes(), 1), [0.1]);
        assert_eq!(values("|i1", &[0xff, 7], 2), [-1.0, 7.0]);
        assert_eq!(values("<i2", &(-300_i16).to_le_bytes(), 1), [-300.0]);
        assert_eq!(values("<i4", &(-70_000_i32).to_le_bytes(), 1), [-70_000.0]);
        assert_eq!(values(">i8", &(-1_i64).to_be_bytes(), 1), [-1.0]);
        assert_eq!(values("<u2", &[0xff, 0xff], 1), [65_535.0]);
        assert_eq!(values("|b1", &[1, 0], 2), [1.0, 0.0]);
    }

    #[test]
    fn what_is_no_array_of_numbers_is_refused() {
        let refused = |bytes: Vec<u8>| parse(bytes, Path::new("a.npy")).err().expect("refused").to_string();
        assert!(refused(written("|O", "(1,)", &[0; 8])).contains("'|O'"));
        assert!(refused(written("<c8", "(1,)", &[0; 8])).contains("'<c8'"));
        assert!(refused(written("<f4", "(3,)", &[0; 8])).contains("3 numbers announced, 2 present"));
        assert!(refused(written("<f4", "(4294967296, 4294967296)", &[0; 8])).contains("announced"));
        let columns = String::from_utf8_lossy(&written("|i1", "(2,)", b"ab")[10..]).replace("False", "True ");
        let columns = [&b"\x93NUMPY\x01\x00\x76\x00"[..], columns.as_bytes()].concat();
        assert!(refused(columns).contains("column by column"));
        assert!(refused(b"\x93NUMPY\x01\x00\x76".to_vec()).contains("cut off"));
    }
}
