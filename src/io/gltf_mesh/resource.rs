//! Bytes of a glTF file: the container, its buffers and the data behind URIs.

use std::borrow::Cow;
use std::path::Path;

use gltf::json::Root;

use crate::io::{IoError, files};

/// Bytes of a `.glb` header, and of a chunk's.
const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

/// Splits the JSON text and the binary chunk of a `.glb`; a `.gltf` is returned whole.
pub(crate) fn split_container<'a>(bytes: &'a [u8], path: &Path) -> Result<(&'a [u8], Option<&'a [u8]>), IoError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let cut = |place: &str, need: usize, at: usize| IoError::Truncated {
        path: path.into(),
        place: place.into(),
        need: need as u64,
        have: bytes.len().saturating_sub(at) as u64,
    };
    let version = word(bytes, 4).ok_or_else(|| cut("the header", HEADER, 0))?;
    if version != 2 {
        let what = format!("version {version} of binary glTF");
        return Err(IoError::Unsupported { path: path.into(), what, remedy: "export it as version 2" });
    }
    let (mut json, mut binary) = (None, None);
    let mut at = HEADER;
    while let (Some(length), Some(kind)) = (word(bytes, at), word(bytes, at + 4)) {
        let (start, length) = (at + CHUNK_HEADER, length as usize);
        let chunk = bytes.get(start..start.saturating_add(length)).ok_or_else(|| cut("a chunk", length, start))?;
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        at = start + length;
    }
    json.map(|j| (j, binary)).ok_or_else(|| cut("the JSON chunk", CHUNK_HEADER, at))
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at.checked_add(4)?)?.try_into().ok().map(u32::from_le_bytes)
}

/// Loads every buffer, each at least as long as it says, together at most `limit` bytes. Buffers without data that
/// `is_empty` names are empty.
pub(crate) fn load_buffers<'a>(
    root: &Root,
    path: &Path,
    folder: Option<&Path>,
    mut blob: Option<&'a [u8]>,
    limit: u64,
    is_empty: &dyn Fn(usize) -> bool,
) -> Result<Vec<Cow<'a, [u8]>>, IoError> {
    let mut total = 0_u64;
    let mut buffers = Vec::new();
    for (i, buffer) in root.buffers.iter().enumerate() {
        if is_empty(i) && buffer.uri.is_none() {
            buffers.push(Cow::Borrowed(&[][..]));
            continue;
        }
        let place = format!("buffers[{i}]");
        let content = |reason: String| IoError::Syntax { path: path.into(), place: place.clone(), reason };
        let bytes: Cow<'a, [u8]> = match &buffer.uri {
            Some(uri) => Cow::Owned(load_uri(uri, &place, path, folder, limit)?),
            None => Cow::Borrowed(blob.take().ok_or_else(|| content("has neither a URI nor a binary chunk".into()))?),
        };
        if (bytes.len() as u64) < buffer.byte_length.0 {
            return Err(content(format!("claims {} bytes, but there are {}", buffer.byte_length.0, bytes.len())));
        }
        total += bytes.len() as u64;
        if total > limit {
            let (what, remedy) = ("all buffers together", "split the scene");
            return Err(IoError::OverBudget { path: path.into(), what, bytes: total, limit, remedy });
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// Loads the bytes behind a URI: `data:` or a file inside `folder`, links resolved.
pub(crate) fn load_uri(
    uri: &str,
    place: &str,
    path: &Path,
    folder: Option<&Path>,
    limit: u64,
) -> Result<Vec<u8>, IoError> {
    if uri.starts_with("data:") {
        // Without a base path this decodes `data:` URIs only.
        return gltf::buffer::Data::from_source(gltf::buffer::Source::Uri(uri), None).map(|d| d.0).map_err(|e| {
            let reason = format!("its data URI does not decode: {e}");
            IoError::Syntax { path: path.into(), place: place.into(), reason }
        });
    }
    let outside =
        || IoError::Outside { path: path.into(), entry: uri.into(), folder: folder.unwrap_or(Path::new("")).into() };
    let name = percent_decoded(uri).filter(|_| !uri.contains(':')).ok_or_else(outside)?;
    let folder = folder.ok_or_else(outside)?;
    let entry = files::relative(folder, &name, path)?;
    let file = files::inside(folder, &entry, path)?.unwrap_or_else(|| folder.join(entry));
    files::read(&file, limit)
}

/// Decodes `%41` and the like; `None` if an escape is broken or the result is not UTF-8.
fn percent_decoded(uri: &str) -> Option<String> {
    let mut bytes = uri.bytes();
    let mut out = Vec::with_capacity(uri.len());
    while let Some(b) = bytes.next() {
        if b == b'%' {
            let digits = [bytes.next()?, bytes.next()?];
            out.push(u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?);
        } else {
            out.push(b);
        }
    }
    String::from_utf8(out).ok()
}
