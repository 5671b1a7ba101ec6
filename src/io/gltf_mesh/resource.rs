//! Bytes behind a scene: the container, its buffers and its encoded images.

use std::borrow::Cow;
use std::path::{Component, Path, PathBuf};

use gltf::json::Root;

use super::{GltfError, MAX_FILE_BYTES};
use crate::io::files;

/// Reads a regular file of bounded size.
pub fn read_file(path: &Path) -> Result<Vec<u8>, GltfError> {
    Ok(files::read(path, MAX_FILE_BYTES)?)
}

/// The JSON text and the binary chunk of a `.glb`, or the whole of a `.gltf`.
pub fn split_container<'a>(bytes: &'a [u8], path: &Path) -> Result<(&'a [u8], Option<&'a [u8]>), GltfError> {
    let problem = |problem: String| GltfError::Container { path: path.to_owned(), problem };
    if !bytes.starts_with(b"glTF") {
        let json = bytes.iter().find(|b| !b.is_ascii_whitespace() && **b > 0x7f || **b == b'{') == Some(&b'{');
        return if json {
            Ok((bytes, None))
        } else {
            Err(problem("starts neither with `glTF` nor with a JSON object".into()))
        };
    }
    let version = word(bytes, 4).ok_or_else(|| problem("ends inside its header".into()))?;
    if version != 2 {
        return Err(problem(format!("version {version} of binary glTF; only 2 is supported")));
    }
    let (mut json, mut binary) = (None, None);
    let mut at = 12;
    while let (Some(length), Some(kind)) = (word(bytes, at), word(bytes, at + 4)) {
        let start = at + 8;
        let chunk = start.checked_add(length as usize).and_then(|end| bytes.get(start..end)).ok_or_else(|| {
            problem(format!("a chunk at byte {at} claims {length} bytes, beyond the end of the file"))
        })?;
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        at = start + length as usize;
    }
    json.map(|j| (j, binary)).ok_or_else(|| problem("has no JSON chunk".into()))
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at.checked_add(4)?)?.try_into().ok().map(u32::from_le_bytes)
}

/// Every buffer, each at least as long as it says.
pub fn load_buffers<'a>(
    root: &Root,
    path: &Path,
    folder: Option<&Path>,
    mut blob: Option<&'a [u8]>,
) -> Result<Vec<Cow<'a, [u8]>>, GltfError> {
    let mut total = 0_u64;
    let mut buffers = Vec::new();
    for (i, buffer) in root.buffers.iter().enumerate() {
        let place = format!("buffers[{i}]");
        let content = |problem: String| GltfError::Content { path: path.to_owned(), place: place.clone(), problem };
        let bytes: Cow<'a, [u8]> = match &buffer.uri {
            Some(uri) => Cow::Owned(load_uri(uri, &place, path, folder)?),
            None => Cow::Borrowed(blob.take().ok_or_else(|| content("has neither a URI nor a binary chunk".into()))?),
        };
        if (bytes.len() as u64) < buffer.byte_length.0 {
            return Err(content(format!("claims {} bytes, but there are {}", buffer.byte_length.0, bytes.len())));
        }
        total += bytes.len() as u64;
        if total > MAX_FILE_BYTES {
            let limit = format!("{} GiB", MAX_FILE_BYTES >> 30);
            return Err(GltfError::TooLarge { path: path.to_owned(), what: "the buffers together".into(), limit });
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// The bytes behind a URI: `data:` or a file inside `folder`.
pub fn load_uri(uri: &str, place: &str, path: &Path, folder: Option<&Path>) -> Result<Vec<u8>, GltfError> {
    if uri.starts_with("data:") {
        // Without a base path this decodes `data:` URIs only.
        return gltf::buffer::Data::from_source(gltf::buffer::Source::Uri(uri), None).map(|d| d.0).map_err(|e| {
            let problem = format!("its data URI does not decode: {e}");
            GltfError::Content { path: path.to_owned(), place: place.into(), problem }
        });
    }
    read_file(&inside(uri, place, path, folder)?)
}

/// The file that a relative URI names, proven to lie inside `folder`, links resolved.
fn inside(uri: &str, place: &str, path: &Path, folder: Option<&Path>) -> Result<PathBuf, GltfError> {
    let outside = || GltfError::OutsideFolder { path: path.to_owned(), place: place.into(), uri: uri.into() };
    let folder = folder.ok_or_else(outside)?;
    let relative = PathBuf::from(percent_decoded(uri).ok_or_else(outside)?.replace('\\', "/"));
    let plain = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    if !plain || uri.contains(':') {
        return Err(outside());
    }
    let joined = folder.join(relative);
    let io = |source| GltfError::Io { path: joined.clone(), source };
    let real = joined.canonicalize().map_err(io)?;
    if real.starts_with(folder.canonicalize().map_err(io)?) { Ok(real) } else { Err(outside()) }
}

/// `%41` and the like replaced; `None` where that is not UTF-8 or an escape is broken.
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
