//! The rows of an element as columns of numbers.

use std::borrow::Cow;

use super::Scalar;

/// A column of a [`Table`].
#[derive(Clone, Debug)]
pub(crate) struct Column {
    pub(crate) name: String,
    pub(crate) scalar: Scalar,
    /// Offset in a row, in bytes.
    pub(crate) offset: usize,
}

impl Column {
    #[inline]
    pub(crate) fn f64(&self, row: &[u8]) -> f64 {
        self.scalar.read(&row[self.offset..])
    }

    #[inline]
    pub(crate) fn f32(&self, row: &[u8]) -> f32 {
        match (self.scalar, row[self.offset..].first_chunk()) {
            (Scalar::F32, Some(bytes)) => f32::from_le_bytes(*bytes),
            _ => self.f64(row) as f32,
        }
    }

    /// Reads the value in `row` of an integer column that fits 32 bits.
    #[inline]
    pub(crate) fn u32(&self, row: &[u8]) -> u32 {
        self.f64(row) as u32
    }
}

/// Rows of fixed size, little-endian.
pub(crate) struct Table<'a> {
    pub(crate) rows: usize,
    pub(crate) stride: usize,
    pub(crate) columns: Vec<Column>,
    /// `rows * stride` bytes.
    pub(crate) data: Cow<'a, [u8]>,
}

impl Table<'_> {
    #[inline]
    pub(crate) fn row(&self, i: usize) -> &[u8] {
        &self.data[i * self.stride..(i + 1) * self.stride]
    }

    pub(crate) fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|c| c.name == name)
    }

    /// Returns the columns of those names, or the first name that is missing.
    pub(crate) fn all<const N: usize>(&self, names: [&'static str; N]) -> Result<[&Column; N], &'static str> {
        if let Some(missing) = names.iter().find(|n| self.column(n).is_none()) {
            return Err(missing);
        }
        // Every name was found above, so the fallback is never reached.
        Ok(names.map(|n| self.column(n).unwrap_or(&self.columns[0])))
    }
}
