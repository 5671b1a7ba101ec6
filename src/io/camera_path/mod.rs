//! Camera paths as files: the program's own JSON format and nerfstudio's.

use std::path::Path;

use serde::de::{DeserializeSeed, Error as _, IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::{IoError, files};
use crate::scene::{CameraPath, PathError};

pub(crate) mod kept;
pub(crate) mod nerfstudio;
mod own;

pub use own::{FORMAT, VERSION, write};

/// Largest file of a camera path in bytes; a path of [`CameraPath::MAX_KEYS`] keys fits.
pub(crate) const MAX_BYTES: u64 = 128 << 20;

/// Reads a camera path in the program's own format or in nerfstudio's.
pub(crate) fn open(path: &Path) -> Result<CameraPath, IoError> {
    parse(&files::read(path, MAX_BYTES)?, path)
}

/// As [`open()`], from bytes; `path` is for errors.
pub fn parse(bytes: &[u8], path: &Path) -> Result<CameraPath, IoError> {
    let marks: Marks = files::json(bytes, path)?;
    let camera_path = match marks {
        Marks { format: Some(format), .. } if format == FORMAT => own::parse(bytes, marks.version, path)?,
        Marks { format: None, keyframes: Some(_), .. } | Marks { format: None, camera_path: Some(_), .. } => {
            nerfstudio::parse(bytes, path)?
        }
        Marks { format, .. } => {
            let found = format.map_or_else(|| "no 'format'".into(), |f| format!("the format '{f}'"));
            let reason = format!(
                "{found}: neither a camera path of this program (\"format\": \"{FORMAT}\") nor one of nerfstudio \
                 (\"keyframes\" or \"camera_path\")"
            );
            return Err(IoError::Syntax { path: path.into(), place: "the head".into(), reason });
        }
    };
    camera_path.validate().map_err(|e| error(path, &e))?;
    Ok(camera_path)
}

/// Keys that tell the formats apart; all others are skipped without being stored.
#[derive(Deserialize)]
struct Marks {
    format: Option<String>,
    version: Option<u64>,
    keyframes: Option<IgnoredAny>,
    camera_path: Option<IgnoredAny>,
}

/// Makes an error about a file from a path that breaks a rule.
fn error(path: &Path, e: &PathError) -> IoError {
    let (place, reason) = match e {
        PathError::Key { field, reason, .. } => {
            let (text, reason) = (e.to_string(), format!("{field} {reason}"));
            let place = text.strip_suffix(&reason).map_or(text.as_str(), |key| key.trim_end_matches([',', ' ']));
            (place.to_owned(), reason)
        }
        other => ("the head".to_owned(), other.to_string()),
    };
    IoError::Syntax { path: path.into(), place, reason }
}

/// Reads a list of at most [`CameraPath::MAX_KEYS`] members; errors name the member by its number.
fn members<'de, D: Deserializer<'de>, T: Deserialize<'de>>(from: D, what: &'static str) -> Result<Vec<T>, D::Error> {
    Members { what, member: std::marker::PhantomData }.deserialize(from)
}

struct Members<T> {
    what: &'static str,
    member: std::marker::PhantomData<T>,
}

impl<'de, T: Deserialize<'de>> DeserializeSeed<'de> for Members<T> {
    type Value = Vec<T>;

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<Vec<T>, D::Error> {
        from.deserialize_seq(self)
    }
}

impl<'de, T: Deserialize<'de>> Visitor<'de> for Members<T> {
    type Value = Vec<T>;

    fn expecting(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(out, "a list of {}s", self.what)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Vec<T>, A::Error> {
        let mut members = Vec::new();
        loop {
            let next = list.next_element::<T>();
            match next.map_err(|e| A::Error::custom(format!("{} {}: {e}", self.what, members.len())))? {
                None => return Ok(members),
                Some(_) if members.len() == CameraPath::MAX_KEYS => {
                    let reason = format!("more than the {} {}s that a path may have", CameraPath::MAX_KEYS, self.what);
                    return Err(A::Error::custom(reason));
                }
                Some(member) => members.push(member),
            }
        }
    }
}

#[cfg(test)]
mod tests;
