//! NumPy arrays of floating-point numbers, with every claim of the header compared with the file.

use std::path::Path;

use npyz::NpyFile;

use super::{IoError, files};

/// Largest header of an `.npy` file in bytes; that of an array of numbers takes 128.
const MAX_HEADER_BYTES: usize = 1024;

/// An array with a validated header and numbers still to be read.
pub struct NpyArray<'a> {
    path: &'a Path,
    npy: NpyFile<&'a [u8]>,
    /// Bytes per number, 4 or 8.
    item: usize,
    /// Most numbers that the file's size allows, whatever the header claims.
    pub(crate) possible: u64,
}

/// Opens the array in `bytes`, which come from `path`.
pub fn open<'a>(bytes: &'a [u8], path: &'a Path) -> Result<NpyArray<'a>, IoError> {
    let bad = |reason: String| syntax(path, reason);
    let header = header_len(bytes).ok_or_else(|| bad("not an .npy file, or its header is cut off".into()))?;
    // The library that parses the header multiplies sizes and the shape's entries unchecked.
    let text = String::from_utf8_lossy(&bytes[..header]);
    let kind = text.split_once("'descr'").and_then(|(_, rest)| rest.split('\'').nth(1)).unwrap_or_default();
    if !["<f4", ">f4", "<f8", ">f8", "=f4", "=f8"].contains(&kind) {
        return Err(bad(format!("its numbers are of the kind '{kind}', expected 32- or 64-bit floating point")));
    }
    let (claimed, possible) = (values_claimed(&text), (bytes.len() - header) as u64);
    if claimed > possible {
        return Err(IoError::Count { path: path.into(), what: "numbers".into(), claimed, possible });
    }
    let npy = NpyFile::new(bytes).map_err(|e| bad(e.to_string()))?;
    if npy.order() != npyz::Order::C {
        return Err(bad("the array is stored column by column; save it with order='C'".into()));
    }
    let item = npy.dtype().num_bytes().filter(|b| *b > 0).ok_or_else(|| bad("the array holds no numbers".into()))?;
    Ok(NpyArray { path, npy, item, possible: possible / item as u64 })
}

impl NpyArray<'_> {
    pub(crate) fn shape(&self) -> &[u64] {
        self.npy.shape()
    }

    /// Reads the numbers, row by row; they may be infinite or NaN.
    pub(crate) fn values(self) -> Result<Vec<f64>, IoError> {
        let failed = |e: std::io::Error| syntax(self.path, e.to_string());
        match self.item {
            4 => Ok(self.npy.into_vec::<f32>().map_err(failed)?.into_iter().map(f64::from).collect()),
            _ => self.npy.into_vec::<f64>().map_err(failed),
        }
    }
}

/// Reads a map of one number per pixel, such as the depths of `fmlgs synth`: width, height, rows from the top.
pub(crate) fn read_map(path: &Path) -> Result<(usize, usize, Vec<f32>), IoError> {
    map(&files::read(path, files::MAX_PICTURE_BYTES)?, path)
}

/// As [`read_map`], from the file's bytes.
pub fn map(bytes: &[u8], path: &Path) -> Result<(usize, usize, Vec<f32>), IoError> {
    let array = open(bytes, path)?;
    let &[height, width] = array.shape() else {
        let shape = format!("the array's shape is {:?}, expected [height, width]", array.shape());
        return Err(syntax(path, shape));
    };
    let (claimed, possible) = (width.saturating_mul(height), array.possible);
    if claimed == 0 || claimed > possible {
        return Err(IoError::Count { path: path.into(), what: "pixels".into(), claimed, possible });
    }
    let values = array.values()?;
    if let Some(index) = values.iter().position(|v| !(*v >= 0.0 && *v <= f64::from(f32::MAX))) {
        return Err(syntax(path, format!("pixel {index} is {}, expected a finite number, 0 or more", values[index])));
    }
    Ok((width as usize, height as usize, values.into_iter().map(|v| v as f32).collect()))
}

fn syntax(path: &Path, reason: String) -> IoError {
    IoError::Syntax { path: path.into(), place: "npy".into(), reason }
}

/// Returns the number of bytes before the data of an `.npy` file.
pub(super) fn header_len(bytes: &[u8]) -> Option<usize> {
    let [0x93, b'N', b'U', b'M', b'P', b'Y', major, _, rest @ ..] = bytes else { return None };
    let (start, length) = match major {
        1 => (10, usize::from(u16::from_le_bytes(*rest.first_chunk()?))),
        _ => (12, u32::from_le_bytes(*rest.first_chunk()?) as usize),
    };
    let end = start + length;
    (length <= MAX_HEADER_BYTES && end <= bytes.len()).then_some(end)
}

/// Returns the product of the shape in an `.npy` header; `u64::MAX` if it has none or overflows.
fn values_claimed(text: &str) -> u64 {
    let tuple = |text: &str| Some(text.split_once("shape")?.1.split_once('(')?.1.split_once(')')?.0.to_owned());
    // Of a shape that is given twice the library would take the last.
    let is_once = text.matches("shape").count() == 1;
    let shape = tuple(text).filter(|_| is_once).unwrap_or_else(|| "?".into());
    let entries = shape.split(',').map(str::trim).filter(|e| !e.is_empty());
    let entries: Vec<u64> = entries.map(|e| e.parse().unwrap_or(u64::MAX)).collect();
    // The library multiplies in order: a zero at the end does not help where it has overflowed before.
    let largest = entries.iter().map(|e| (*e).max(1)).fold(1, u64::saturating_mul);
    if largest == u64::MAX { largest } else { entries.into_iter().product() }
}

#[cfg(test)]
mod tests {
    use npyz::WriterBuilder;

    use super::*;

    fn file(values: &[f32], shape: &[u64]) -> tempfile::NamedTempFile {
        let mut file = tempfile::NamedTempFile::new().expect("file");
        let mut w = npyz::WriteOptions::new().default_dtype().shape(shape).writer(&mut file).begin_nd().expect("begin");
        w.extend(values.iter().copied()).expect("write");
        w.finish().expect("finish");
        file
    }

    #[test]
    fn a_map_reads_back() {
        let f = file(&[0.0, 1.5, 2.0, 3.0, 4.0, 5.0], &[2, 3]);
        assert_eq!(read_map(f.path()).expect("read"), (3, 2, vec![0.0, 1.5, 2.0, 3.0, 4.0, 5.0]));
    }

    #[test]
    fn what_is_no_map_is_refused() {
        for (values, shape) in [(&[1.0; 6][..], &[6][..]), (&[1.0; 6], &[1, 2, 3]), (&[], &[0, 3])] {
            assert!(read_map(file(values, shape).path()).is_err(), "{shape:?}");
        }
        for bad in [f32::NAN, f32::INFINITY, -1.0] {
            let error = read_map(file(&[1.0, bad], &[1, 2]).path()).expect_err("refused").to_string();
            assert!(error.contains("pixel 1"), "{error}");
        }
        let whole = std::fs::read(file(&[1.0; 6], &[2, 3]).path()).expect("read");
        let cut = tempfile::NamedTempFile::new().expect("file");
        std::fs::write(cut.path(), &whole[..whole.len() - 4]).expect("write");
        assert!(read_map(cut.path()).is_err());
    }
}
