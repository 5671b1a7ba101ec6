//! NumPy arrays of any numbers, alone or in an `.npz` archive. Shapes are compared with the bytes that are there.

use std::io::{Cursor, Read};
use std::path::Path;

use half::f16;
use zip::ZipArchive;

use super::rows::FeatureRows;
use crate::io::npy::header_len;
use crate::io::{IoError, files, memory};

/// Most arrays of an archive.
const MAX_ENTRIES: usize = 256;
/// Kinds of numbers, with their bytes.
const KINDS: [&str; 12] = ["f2", "f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "b1"];

/// An array with its bytes.
#[derive(Debug)]
pub(in crate::io) struct NumpyArray {
    pub(in crate::io) shape: Vec<usize>,
    /// Kind and size of a number: `f4`.
    kind: String,
    bytes: Vec<u8>,
}

/// Reads an `.npy` file.
pub(super) fn read(path: &Path) -> Result<NumpyArray, IoError> {
    parse(files::read(path, u64::MAX)?).map_err(|reason| IoError::syntax(path, "npy", reason))
}

/// Parses the bytes of an `.npy` file.
pub(in crate::io) fn parse(mut bytes: Vec<u8>) -> Result<NumpyArray, String> {
    let header = header_len(&bytes).ok_or("not an .npy file, or its header is cut off")?;
    let text = String::from_utf8_lossy(&bytes[..header]).into_owned();
    let quoted = |key: &str| text.split_once(key).and_then(|(_, rest)| rest.split('\'').nth(1));
    let descr = quoted("'descr'").unwrap_or_default();
    let (order, kind) = descr.split_at_checked(1).unwrap_or(("", ""));
    let size = kind.get(1..).and_then(|s| s.parse::<usize>().ok());
    let known = KINDS.contains(&kind) && matches!(order, "<" | "|" | "=");
    let Some(size) = size.filter(|_| known) else {
        let reason =
            format!("its numbers are of the kind '{descr}'; save it as little-endian numbers, not as Python objects");
        return Err(reason);
    };
    if !text.contains("'fortran_order': False") {
        return Err("the array is stored column by column; save it with order='C'".into());
    }
    let entries =
        text.split_once("'shape'").and_then(|(_, rest)| rest.split_once('(')?.1.split_once(')').map(|(s, _)| s));
    let entries = entries.ok_or("the header has no shape")?.split(',').map(str::trim).filter(|e| !e.is_empty());
    let shape: Vec<usize> =
        entries.map(|e| e.parse().map_err(|_| format!("'{e}' in its shape is no number"))).collect::<Result<_, _>>()?;
    let claimed = shape.iter().try_fold(size, |n, length| n.checked_mul(*length));
    let present = bytes.len() - header;
    if claimed != Some(present) {
        return Err(format!("its shape {shape:?} of {size} bytes each does not fit the {present} bytes that follow"));
    }
    bytes.drain(..header);
    Ok(NumpyArray { shape, kind: kind.to_owned(), bytes })
}

impl NumpyArray {
    /// The numbers, of which whole ones are converted.
    pub(in crate::io) fn floats(&self) -> Vec<f32> {
        let b = &self.bytes;
        match self.kind.as_str() {
            "f2" => b.as_chunks().0.iter().map(|b| f16::from_le_bytes(*b).to_f32()).collect(),
            "f4" => b.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
            "f8" => b.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b) as f32).collect(),
            _ => self.integers().unwrap_or_default().into_iter().map(|v| v as f32).collect(),
        }
    }

    /// The numbers; `None` if they are fractions.
    pub(super) fn integers(&self) -> Option<Vec<i64>> {
        let b = &self.bytes;
        Some(match self.kind.as_str() {
            "i1" => b.iter().map(|b| i64::from(*b as i8)).collect(),
            "u1" | "b1" => b.iter().map(|b| i64::from(*b)).collect(),
            "i2" => b.as_chunks().0.iter().map(|b| i64::from(i16::from_le_bytes(*b))).collect(),
            "u2" => b.as_chunks().0.iter().map(|b| i64::from(u16::from_le_bytes(*b))).collect(),
            "i4" => b.as_chunks().0.iter().map(|b| i64::from(i32::from_le_bytes(*b))).collect(),
            "u4" => b.as_chunks().0.iter().map(|b| i64::from(u32::from_le_bytes(*b))).collect(),
            "i8" => b.as_chunks().0.iter().map(|b| i64::from_le_bytes(*b)).collect(),
            "u8" => b.as_chunks().0.iter().map(|b| u64::from_le_bytes(*b) as i64).collect(),
            _ => return None,
        })
    }

    /// The array as rows: its first axis, and all others together.
    pub(super) fn rows(&self, path: &Path, what: &str) -> Result<FeatureRows, IoError> {
        let dim: usize = self.shape.iter().skip(1).product();
        let rows = if self.shape.len() < 2 { None } else { FeatureRows::new(dim, self.floats()) };
        let bad = || IoError::syntax(path, what, format!("an array of shape {:?}, expected rows", self.shape));
        rows.ok_or_else(bad)?.finite(path, what)
    }
}

/// An `.npz` archive.
pub(super) struct NumpyArchive<'a> {
    zip: ZipArchive<Cursor<Vec<u8>>>,
    path: &'a Path,
}

impl<'a> NumpyArchive<'a> {
    pub(super) fn open(path: &'a Path) -> Result<Self, IoError> {
        let bytes = files::read(path, u64::MAX)?;
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(|e| IoError::syntax(path, "npz", e.to_string()))?;
        if zip.len() > MAX_ENTRIES {
            let (claimed, possible) = (zip.len() as u64, MAX_ENTRIES as u64);
            return Err(IoError::Count { path: path.into(), what: "arrays".into(), claimed, possible });
        }
        Ok(Self { zip, path })
    }

    /// Reads an array by its name.
    pub(super) fn array(&mut self, name: &str) -> Result<NumpyArray, IoError> {
        let path = self.path;
        let bad = |reason: String| IoError::syntax(path, format!("array '{name}'"), reason);
        // A name that was given with its ending has it twice.
        let named = [format!("{name}.npy"), format!("{name}.npy.npy")];
        let index = named.iter().find_map(|n| self.zip.index_for_name(n)).ok_or_else(|| bad("is not there".into()))?;
        let entry = self.zip.by_index(index).map_err(|e| bad(e.to_string()))?;
        let limit = memory::budget();
        let mut bytes = Vec::new();
        // The size that the archive states may be wrong, so the reading itself is bounded.
        entry.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(|e| bad(e.to_string()))?;
        if bytes.len() as u64 > limit {
            let (bytes, remedy) = (bytes.len() as u64, "free some memory");
            return Err(IoError::OverBudget { path: path.into(), what: "an array", bytes, limit, remedy });
        }
        parse(bytes).map_err(bad)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::io::Write;

    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    use super::*;

    /// The bytes of an `.npy` file.
    pub(crate) fn npy(descr: &str, shape: &[usize], numbers: &[u8]) -> Vec<u8> {
        let mut shape: String = shape.iter().map(|n| format!("{n},")).collect();
        if shape.matches(',').count() > 1 {
            shape.pop();
        }
        let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}\n");
        [b"\x93NUMPY\x01\0", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), numbers].concat()
    }

    /// The bytes of an `.npz` file.
    pub(crate) fn npz(arrays: &[(&str, Vec<u8>)]) -> Vec<u8> {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in arrays {
            zip.start_file(format!("{name}.npy"), SimpleFileOptions::default()).expect("started");
            zip.write_all(bytes).expect("written");
        }
        zip.finish().expect("finished").into_inner()
    }

    #[test]
    fn numbers_of_every_kind_are_read() {
        let four = |v: [f32; 6]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let table = parse(npy("<f4", &[2, 3], &four([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))).expect("an array");
        let rows = table.rows(Path::new("x.npy"), "features").expect("rows");
        assert_eq!((rows.dim(), rows.row(1)), (3, vec![4.0, 5.0, 6.0]));
        assert_eq!(table.integers(), None);
        for (descr, bytes, says) in [
            ("<i8", (-3_i64).to_le_bytes().to_vec(), -3),
            ("<i4", (-3_i32).to_le_bytes().to_vec(), -3),
            ("<u2", 40_000_u16.to_le_bytes().to_vec(), 40_000),
            ("|u1", vec![200], 200),
            ("|i1", vec![255], -1),
            ("|b1", vec![1], 1),
        ] {
            let one = parse(npy(descr, &[1], &bytes)).expect("an array");
            assert_eq!((one.integers(), one.floats()), (Some(vec![says]), vec![says as f32]), "{descr}");
        }
        let half = parse(npy("<f2", &[1], &f16::from_f32(0.375).to_le_bytes())).expect("an array");
        assert_eq!(half.floats(), [0.375]);
    }

    #[test]
    fn claims_of_headers_are_compared_with_the_bytes() {
        for (bytes, says) in [
            (npy("<f4", &[2], &[0; 4]), "does not fit"),
            (npy("<f4", &[1 << 60, 1 << 60], &[0; 4]), "does not fit"),
            (npy("|O", &[1], &[0; 8]), "Python objects"),
            (npy(">f4", &[1], &[0; 4]), "little-endian"),
            (npy("<f1", &[1], &[0]), "'<f1'"),
            (npy("<f4", &[1], &[0; 4])[..20].to_vec(), "cut off"),
            (b"hello".to_vec(), "not an .npy"),
        ] {
            let e = parse(bytes).expect_err(says);
            assert!(e.contains(says), "{e}");
        }
        let turned = String::from_utf8_lossy(&npy("<f4", &[1], b"aaaa")[10..]).replace("False", "True");
        let turned = [b"\x93NUMPY\x01\0", &(turned.len() as u16 - 4).to_le_bytes()[..], turned.as_bytes()].concat();
        assert!(parse(turned).expect_err("columns").contains("order='C'"));
        let file = tempfile::NamedTempFile::new().expect("file");
        std::fs::write(file.path(), npz(&[("a", npy("<i4", &[1], &[7, 0, 0, 0]))])).expect("write");
        let mut archive = NumpyArchive::open(file.path()).expect("opens");
        assert_eq!(archive.array("a").expect("there").integers(), Some(vec![7]));
        assert!(archive.array("b").expect_err("missing").to_string().contains("array 'b'"));
    }
}
