//! `transform_matrix`: world_from_camera with OpenGL's camera axes, in the spellings of several programs, NaN included.

use std::borrow::Cow;
use std::fmt;

use glam::{DMat3, DVec3};
use serde::Deserialize;
use serde::de::{Deserializer, Error, Visitor};

/// Rows of numbers.
pub(super) type Matrix = Vec<Vec<Entry>>;

/// Deviation of the last row from 0 0 0 1 up to which no warning is needed.
const ROUNDING: f64 = 1e-9;
/// Largest deviation of the last row that counts as rounding.
const LARGEST: f64 = 1e-3;

/// A number of a matrix; NaN if the program wrote none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry(f64);

impl<'de> Deserialize<'de> for Entry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Number)
    }
}

struct Number;

impl Visitor<'_> for Number {
    type Value = Entry;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number")
    }

    fn visit_f64<E: Error>(self, v: f64) -> Result<Entry, E> {
        Ok(Entry(v))
    }

    fn visit_i64<E: Error>(self, v: i64) -> Result<Entry, E> {
        Ok(Entry(v as f64))
    }

    fn visit_u64<E: Error>(self, v: u64) -> Result<Entry, E> {
        Ok(Entry(v as f64))
    }

    /// NaN as JavaScript writes it, `null`.
    fn visit_unit<E: Error>(self) -> Result<Entry, E> {
        Ok(Entry(f64::NAN))
    }

    /// NaN and infinity as Python writes them, once they are [`quoted`].
    fn visit_str<E: Error>(self, v: &str) -> Result<Entry, E> {
        match v {
            "NaN" => Ok(Entry(f64::NAN)),
            "Infinity" => Ok(Entry(f64::INFINITY)),
            "-Infinity" => Ok(Entry(f64::NEG_INFINITY)),
            other => Err(E::invalid_value(serde::de::Unexpected::Str(other), &self)),
        }
    }
}

/// Quotes Python's NaN and Infinity, which are no JSON; a matrix may have them, nothing else.
pub(super) fn quoted(json: &[u8]) -> Cow<'_, [u8]> {
    const WORDS: [&[u8]; 3] = [b"NaN", b"-Infinity", b"Infinity"];
    let word_at = |at: usize| WORDS.iter().find(|word| json[at..].starts_with(word));
    if !(0..json.len()).any(|at| matches!(json[at], b'N' | b'I') && word_at(at).is_some()) {
        return Cow::Borrowed(json);
    }
    let mut out = Vec::with_capacity(json.len() + 64);
    let (mut at, mut in_text) = (0, false);
    while let Some(byte) = json.get(at) {
        let taken = match (byte, in_text) {
            (b'\\', true) => 2,
            (b'"', _) => {
                in_text = !in_text;
                1
            }
            (b'N' | b'I' | b'-', false) => match word_at(at) {
                Some(word) => {
                    out.extend([b"\"", *word, b"\""].concat());
                    at += word.len();
                    continue;
                }
                None => 1,
            },
            _ => 1,
        };
        out.extend(json.iter().skip(at).take(taken));
        at += taken;
    }
    Cow::Owned(out)
}

/// Returns axes (columns right, down, forward) and center of an OpenGL world_from_camera matrix, and true if its last
/// row had to be made 0 0 0 1.
///
/// # Errors
/// If it has another shape, or another last row.
pub(super) fn pose(m: &Matrix) -> Result<(DMat3, DVec3, bool), String> {
    let row = |r: &Vec<Entry>| -> Option<[f64; 4]> { r.iter().map(|e| e.0).collect::<Vec<_>>().try_into().ok() };
    let rows: Vec<[f64; 4]> = m.iter().filter_map(row).collect();
    if rows.len() != m.len() || !(3..=4).contains(&rows.len()) {
        return Err("transform_matrix is not 4 x 4".into());
    }
    let last = rows.get(3).copied().unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let off = last.iter().zip([0.0, 0.0, 0.0, 1.0]).fold(0.0_f64, |most, (v, exact)| most.max((v - exact).abs()));
    if !(off <= LARGEST) || last.iter().any(|v| v.is_nan()) {
        return Err("the last row of transform_matrix is not 0 0 0 1".into());
    }
    let column = |c: usize| DVec3::new(rows[0][c], rows[1][c], rows[2][c]) / last[3];
    Ok((DMat3::from_cols(column(0), -column(1), -column(2)), column(3), off > ROUNDING))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_are_none_are_quoted_outside_of_texts_only() {
        let json = br#"{"NaN \" NaN": [NaN, -Infinity,Infinity, -1], "a": "Infinity"}"#;
        let expected = br#"{"NaN \" NaN": ["NaN", "-Infinity","Infinity", -1], "a": "Infinity"}"#;
        assert_eq!(quoted(json).as_ref(), expected);
        assert!(matches!(quoted(b"[1, 2]"), Cow::Borrowed(_)));
        let values: Vec<Entry> = serde_json::from_slice(br#"[1, -2, 0.5, null, "NaN", "-Infinity"]"#).expect("entries");
        let values: Vec<f64> = values.iter().map(|e| e.0).collect();
        assert_eq!(values[..3], [1.0, -2.0, 0.5]);
        assert!(values[3].is_nan() && values[4].is_nan() && values[5] == f64::NEG_INFINITY);
        assert!(serde_json::from_slice::<Vec<Entry>>(br#"["1"]"#).is_err());
    }

    #[test]
    fn last_rows_are_forgiven_their_rounding_only() {
        let with = |last: [f64; 4]| {
            let rows = [[1.0, 0.0, 0.0, 2.0], [0.0, 1.0, 0.0, 4.0], [0.0, 0.0, 1.0, 6.0], last];
            pose(&rows.map(|row| row.map(Entry).to_vec()).to_vec())
        };
        let (axes, center, normalized) = with([0.0, 0.0, 0.0, 1.0]).expect("exact");
        assert_eq!((axes.z_axis, center, normalized), (-DVec3::Z, DVec3::new(2.0, 4.0, 6.0), false));
        assert!(with([0.0, 0.0, 0.0, 0.999_999_9]).is_ok_and(|(_, c, n)| n && (c.y - 4.0).abs() < 1e-6));
        assert!(with([1e-13, 0.0, -0.0, 1.0]).is_ok_and(|(_, _, n)| !n));
        for bad in [[0.0, 0.0, 0.0, 2.0], [0.0, 0.0, 0.0, 0.0], [0.1, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, f64::NAN]] {
            assert!(with(bad).is_err_and(|why| why.contains("last row")), "{bad:?}");
        }
    }
}
