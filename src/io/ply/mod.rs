//! Stanford PLY: headers, and the fixed-size rows of an element as a table of columns, in any encoding. `splat_ply` and
//! `points_ply` interpret the columns.

mod ascii;
mod color;
mod header;
mod table;

use std::borrow::Cow;
use std::path::Path;

pub(crate) use color::Colors;
pub(crate) use header::{Element, Encoding, Kind, Scalar};
pub(crate) use table::{Column, Table};

use super::IoError;

/// A PLY file whose header has been read.
pub(crate) struct Ply<'a> {
    pub(crate) path: &'a Path,
    pub(crate) encoding: Encoding,
    /// The comment lines, without the word `comment`.
    pub(crate) comments: Vec<&'a str>,
    pub(crate) elements: Vec<Element>,
    body: &'a [u8],
}

impl<'a> Ply<'a> {
    /// Reads the header of a file's bytes. Nothing is allocated for the rows it claims.
    pub(crate) fn parse(bytes: &'a [u8], path: &'a Path) -> Result<Self, IoError> {
        // Editors may put a byte order mark before a text file.
        header::parse(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes), path)
    }

    pub(crate) fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|e| e.name == name)
    }

    /// Columns and bytes per row of the element of that name, if it comes first and its rows have a fixed size.
    pub(crate) fn first_rows(&self, name: &str) -> Option<(Vec<Column>, usize)> {
        let element = self.elements.first().filter(|e| e.name == name && !e.has_lists())?;
        self.columns(element).ok()
    }

    pub(crate) fn body_len(&self) -> usize {
        self.body.len()
    }

    /// Reads the rows of the element of that name without its lists; `None` if the file has no such element.
    pub(crate) fn table(&self, name: &str) -> Result<Option<Table<'a>>, IoError> {
        let Some(at) = self.elements.iter().position(|e| e.name == name) else { return Ok(None) };
        let element = &self.elements[at];
        let (columns, stride) = self.columns(element)?;
        let data = match self.encoding {
            Encoding::Ascii => Cow::Owned(ascii::rows(self, at, &columns, stride)?),
            Encoding::LittleEndian | Encoding::BigEndian => self.binary_rows(at, &columns, stride)?,
        };
        Ok(Some(Table { rows: element.count as usize, stride, columns, data }))
    }

    /// Columns of an element except its lists, and their bytes per row in binary.
    fn columns(&self, element: &Element) -> Result<(Vec<Column>, usize), IoError> {
        let mut offset = 0;
        let mut columns = Vec::with_capacity(element.properties.len());
        for p in &element.properties {
            let Kind::Scalar(scalar) = p.kind else { continue };
            columns.push(Column { name: p.name.clone(), scalar, offset });
            offset += scalar.bytes();
        }
        if columns.is_empty() {
            return Err(self.syntax(&element.name, "no properties that are numbers".into()));
        }
        Ok((columns, offset))
    }

    fn binary_rows(&self, at: usize, columns: &[Column], stride: usize) -> Result<Cow<'a, [u8]>, IoError> {
        let mut rest = self.body;
        for element in &self.elements[..at] {
            rest = &rest[self.binary_len(element, rest)?..];
        }
        let element = &self.elements[at];
        self.fits(element, rest.len() / stride)?;
        if element.has_lists() {
            return self.rows_beside_lists(element, rest, stride).map(Cow::Owned);
        }
        let data = &rest[..element.count as usize * stride];
        if self.encoding == Encoding::LittleEndian {
            return Ok(Cow::Borrowed(data));
        }
        let mut swapped = data.to_vec();
        for row in swapped.chunks_exact_mut(stride) {
            for c in columns {
                row[c.offset..c.offset + c.scalar.bytes()].reverse();
            }
        }
        Ok(Cow::Owned(swapped))
    }

    /// Copies the numbers of rows with lists between them, little-endian.
    fn rows_beside_lists(&self, element: &Element, rest: &[u8], stride: usize) -> Result<Vec<u8>, IoError> {
        let mut out = Vec::with_capacity(element.count as usize * stride);
        let mut left = rest;
        for row in 0..element.count {
            for p in &element.properties {
                let (bytes, kept) = match p.kind {
                    Kind::Scalar(s) => (s.bytes(), true),
                    Kind::List { count, item } => {
                        let head = left.get(..count.bytes()).ok_or_else(|| self.short(element, row))?;
                        let items = self.list_len(head, count) as usize;
                        (items.saturating_mul(item.bytes()).saturating_add(count.bytes()), false)
                    }
                };
                let (value, after) = left.split_at_checked(bytes).ok_or_else(|| self.short(element, row))?;
                left = after;
                match (kept, self.encoding) {
                    (true, Encoding::BigEndian) => out.extend(value.iter().rev()),
                    (true, _) => out.extend_from_slice(value),
                    (false, _) => {}
                }
            }
        }
        Ok(out)
    }

    /// Bytes of an element at the front of `rest`.
    fn binary_len(&self, element: &Element, rest: &[u8]) -> Result<usize, IoError> {
        let fixed = |k: &Kind| match k {
            Kind::Scalar(s) => Some(s.bytes()),
            Kind::List { .. } => None,
        };
        if let Some(stride) = element.properties.iter().map(|p| fixed(&p.kind)).sum::<Option<usize>>() {
            if stride == 0 {
                return Ok(0);
            }
            self.fits(element, rest.len() / stride)?;
            return Ok(element.count as usize * stride);
        }
        let mut used = 0_usize;
        for row in 0..element.count {
            for p in &element.properties {
                let bytes = match p.kind {
                    Kind::Scalar(s) => s.bytes(),
                    Kind::List { count, item } => {
                        let head = rest.get(used..used + count.bytes());
                        let items = head.map(|h| self.list_len(h, count)).ok_or_else(|| self.short(element, row))?;
                        (items as usize).saturating_mul(item.bytes()).saturating_add(count.bytes())
                    }
                };
                used = used.saturating_add(bytes);
                if used > rest.len() {
                    return Err(self.short(element, row));
                }
            }
        }
        Ok(used)
    }

    fn list_len(&self, head: &[u8], scalar: Scalar) -> u64 {
        let mut le = [0; 8];
        le[..head.len()].copy_from_slice(head);
        if self.encoding == Encoding::BigEndian {
            le[..head.len()].reverse();
        }
        // A negative length reads as one that no file can hold.
        scalar.read(&le) as i64 as u64
    }

    fn fits(&self, element: &Element, possible: usize) -> Result<(), IoError> {
        if element.count > possible as u64 {
            return Err(IoError::Count {
                path: self.path.into(),
                what: format!("rows of '{}'", element.name),
                claimed: element.count,
                possible: possible as u64,
            });
        }
        Ok(())
    }

    fn short(&self, element: &Element, row: u64) -> IoError {
        IoError::Truncated {
            path: self.path.into(),
            place: format!("row {row} of '{}'", element.name),
            need: 1,
            have: 0,
        }
    }

    /// Makes an error about the element `element`.
    pub(crate) fn syntax(&self, element: &str, reason: String) -> IoError {
        IoError::Syntax { path: self.path.into(), place: format!("element '{element}'"), reason }
    }
}
