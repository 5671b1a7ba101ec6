//! Rows of numbers as text, converted to the binary form.

use super::{Column, Element, Encoding, Kind, Ply};
use crate::io::IoError;

/// Converts the rows of element `at` to little-endian bytes.
pub(super) fn rows(ply: &Ply<'_>, at: usize, columns: &[Column], stride: usize) -> Result<Vec<u8>, IoError> {
    debug_assert_eq!(ply.encoding, Encoding::Ascii);
    let mut words = Words { rest: ply.body };
    for element in &ply.elements[..at] {
        if element.properties.is_empty() {
            continue;
        }
        for row in 0..element.count {
            for p in &element.properties {
                match p.kind {
                    Kind::Scalar(_) => drop(words.next().ok_or_else(|| ply.short(element, row))?),
                    Kind::List { .. } => pass_list(ply, &mut words, element, row, &p.name)?,
                }
            }
        }
    }
    let element = &ply.elements[at];
    // A number takes at least one digit and one blank, except for the last.
    ply.fits(element, (words.rest.len() + 1) / (2 * columns.len()))?;
    let mut out = Vec::with_capacity(element.count as usize * stride);
    for row in 0..element.count {
        let mut columns = columns.iter();
        for p in &element.properties {
            if let Kind::List { .. } = p.kind {
                pass_list(ply, &mut words, element, row, &p.name)?;
                continue;
            }
            let Some(c) = columns.next() else { break };
            let value = number(ply, &mut words, element, row, &c.name)?;
            if c.scalar.push(&mut out, value).is_none() {
                return Err(ply.syntax(&element.name, format!("row {row}: {} = {value} does not fit its type", c.name)));
            }
        }
    }
    Ok(out)
}

/// Skips a list with its length in front.
fn pass_list(ply: &Ply<'_>, words: &mut Words<'_>, element: &Element, row: u64, property: &str) -> Result<(), IoError> {
    let items = number(ply, words, element, row, property)?.max(0.0) as u64;
    for _ in 0..items {
        words.next().ok_or_else(|| ply.short(element, row))?;
    }
    Ok(())
}

fn number(ply: &Ply<'_>, words: &mut Words<'_>, element: &Element, row: u64, property: &str) -> Result<f64, IoError> {
    let word = words.next().ok_or_else(|| ply.short(element, row))?;
    std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()).ok_or_else(|| {
        let shown: String = String::from_utf8_lossy(word).chars().take(30).collect();
        ply.syntax(&element.name, format!("row {row}: {property} = '{shown}' is not a number"))
    })
}

/// Words between white space.
struct Words<'a> {
    rest: &'a [u8],
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let text = self.rest.trim_ascii_start();
        let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
        let (word, rest) = text.split_at(end);
        self.rest = rest;
        (!word.is_empty()).then_some(word)
    }
}
