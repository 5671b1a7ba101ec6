//! glTF's container: JSON, buffers and accessors, as far as splats need them. The extension's
//! attribute names are unknown to general glTF readers, so the JSON is read here.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

use glam::{DMat4, DQuat, DVec3};
use serde::Deserialize;

use crate::io::{IoError, files};

/// Bytes of a `.glb` header, and of a chunk's.
const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

#[derive(Deserialize)]
struct Json {
    #[serde(default)]
    scene: usize,
    #[serde(default)]
    scenes: Vec<Scene>,
    #[serde(default)]
    nodes: Vec<Node>,
    #[serde(default)]
    meshes: Vec<Mesh>,
    #[serde(default)]
    accessors: Vec<Accessor>,
    #[serde(default, rename = "bufferViews")]
    views: Vec<View>,
    #[serde(default)]
    buffers: Vec<Buffer>,
}

#[derive(Deserialize)]
struct Scene {
    #[serde(default)]
    nodes: Vec<usize>,
}

#[derive(Deserialize)]
pub(super) struct Node {
    #[serde(default)]
    pub children: Vec<usize>,
    pub mesh: Option<usize>,
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct Mesh {
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub attributes: BTreeMap<String, usize>,
    #[serde(default)]
    pub extensions: BTreeMap<String, serde_json::Value>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: usize,
    component_type: u32,
    #[serde(default)]
    normalized: bool,
    count: u64,
    #[serde(rename = "type")]
    shape: String,
    sparse: Option<serde::de::IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct View {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: Option<usize>,
}

#[derive(Deserialize)]
struct Buffer {
    uri: Option<String>,
}

/// The values of an accessor.
pub(super) struct Values<const N: usize> {
    pub rows: Vec<[f32; N]>,
    /// Whether the type is a signed integer.
    pub signed_integer: bool,
}

/// A glTF file.
pub(super) struct Gltf<'a> {
    json: Json,
    buffers: Vec<Cow<'a, [u8]>>,
    path: &'a Path,
}

/// Whether the first bytes of a file are those of a `.glb`, or its name is that of a `.gltf`.
pub fn is_gltf(start: &[u8], name: &str) -> bool {
    start.starts_with(b"glTF") || name.ends_with(".gltf")
}

impl<'a> Gltf<'a> {
    pub fn parse(bytes: &'a [u8], path: &'a Path) -> Result<Self, IoError> {
        let (text, binary) = if bytes.starts_with(b"glTF") { chunks(bytes, path)? } else { (bytes, None) };
        let json: Json = serde_json::from_slice(text).map_err(|e| files::json_error(path, &e))?;
        let buffers = json.buffers.iter().map(|b| b.load(binary, path)).collect::<Result<_, _>>()?;
        Ok(Self { json, buffers, path })
    }

    pub fn bad(&self, place: String, reason: String) -> IoError {
        IoError::Syntax { path: self.path.into(), place, reason }
    }

    pub fn unsupported(&self, what: String, remedy: &'static str) -> IoError {
        IoError::Unsupported { path: self.path.into(), what, remedy }
    }

    /// The nodes at the top of the scene; all that are no one's children where there is no scene.
    pub fn roots(&self) -> Vec<usize> {
        match self.json.scenes.get(self.json.scene) {
            Some(scene) => scene.nodes.clone(),
            None => {
                let mut top = vec![true; self.json.nodes.len()];
                for child in self.json.nodes.iter().flat_map(|n| &n.children) {
                    if let Some(t) = top.get_mut(*child) {
                        *t = false;
                    }
                }
                (0..top.len()).filter(|&i| top[i]).collect()
            }
        }
    }

    pub fn node(&self, index: usize) -> Result<&Node, IoError> {
        self.json.nodes.get(index).ok_or_else(|| self.bad(format!("node {index}"), "there is none".into()))
    }

    pub fn primitives(&self, mesh: usize) -> Result<&[Primitive], IoError> {
        let mesh =
            self.json.meshes.get(mesh).ok_or_else(|| self.bad(format!("mesh {mesh}"), "there is none".into()))?;
        Ok(&mesh.primitives)
    }

    /// The values of accessor `index`, integers as the accessor says: normalised or as they are.
    pub fn values<const N: usize>(&self, index: usize) -> Result<Values<N>, IoError> {
        let place = || format!("accessor {index}");
        let bad = |reason: &str| self.bad(place(), reason.into());
        let a = self.json.accessors.get(index).ok_or_else(|| bad("there is none"))?;
        let components = match a.shape.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 0,
        };
        if components != N {
            return Err(self.bad(place(), format!("its type is {}, expected {N} components", a.shape)));
        }
        if a.sparse.is_some() {
            return Err(self.unsupported("a sparse accessor".into(), "write the file without sparse accessors"));
        }
        let view = a.buffer_view.and_then(|v| self.json.views.get(v)).ok_or_else(|| bad("it has no buffer view"))?;
        let buffer = self.buffers.get(view.buffer).ok_or_else(|| bad("its buffer does not exist"))?;
        let end = view.byte_offset.checked_add(view.byte_length);
        let data = end.and_then(|end| buffer.get(view.byte_offset..end));
        let data = data.and_then(|d| d.get(a.byte_offset..)).ok_or_else(|| bad("it lies outside of its buffer"))?;
        let (size, read) =
            component(a.component_type, a.normalized).ok_or_else(|| bad("its component type is unknown"))?;
        let stride = view.byte_stride.filter(|s| *s > 0).unwrap_or(size * N);
        let possible = if data.len() < size * N { 0 } else { (data.len() - size * N) / stride + 1 };
        if a.count > possible as u64 {
            return Err(IoError::Count {
                path: self.path.into(),
                what: format!("values in accessor {index}"),
                claimed: a.count,
                possible: possible as u64,
            });
        }
        // A stride under the size of a value would yield more values than there are bytes.
        if stride < size * N {
            return Err(bad("its stride is less than the size of its values"));
        }
        let rows: Vec<[f32; N]> =
            (0..a.count as usize).map(|i| std::array::from_fn(|k| read(&data[i * stride + k * size..]))).collect();
        if let Some(row) = rows.iter().position(|r| r.iter().any(|v| !v.is_finite())) {
            let property = place();
            return Err(IoError::NotFinite { path: self.path.into(), element: "value", index: row, property });
        }
        Ok(Values { rows, signed_integer: matches!(a.component_type, 5120 | 5122) })
    }
}

/// Reads a component off the front of bytes.
type ReadComponent = fn(&[u8]) -> f32;

/// Bytes and reader of a component type.
fn component(kind: u32, normalized: bool) -> Option<(usize, ReadComponent)> {
    fn get<const N: usize>(b: &[u8]) -> [u8; N] {
        b.first_chunk().copied().unwrap_or([0; N])
    }
    Some(match (kind, normalized) {
        (5120, true) => (1, |b| (f32::from(i8::from_le_bytes(get(b))) / 127.0).max(-1.0)),
        (5120, false) => (1, |b| f32::from(i8::from_le_bytes(get(b)))),
        (5121, true) => (1, |b| f32::from(u8::from_le_bytes(get(b))) / 255.0),
        (5121, false) => (1, |b| f32::from(u8::from_le_bytes(get(b)))),
        (5122, true) => (2, |b| (f32::from(i16::from_le_bytes(get(b))) / 32_767.0).max(-1.0)),
        (5122, false) => (2, |b| f32::from(i16::from_le_bytes(get(b)))),
        (5123, true) => (2, |b| f32::from(u16::from_le_bytes(get(b))) / 65_535.0),
        (5123, false) => (2, |b| f32::from(u16::from_le_bytes(get(b)))),
        (5126, _) => (4, |b| f32::from_le_bytes(get(b))),
        _ => return None,
    })
}

/// The JSON chunk of a `.glb` and the binary one, if there is one.
fn chunks<'a>(bytes: &'a [u8], path: &Path) -> Result<(&'a [u8], Option<&'a [u8]>), IoError> {
    let chunk = |at: usize, place: &str| {
        let cut = |need: usize| IoError::Truncated {
            path: path.into(),
            place: place.into(),
            need: need as u64,
            have: bytes.len().saturating_sub(at) as u64,
        };
        let head = bytes.get(at..).and_then(|b| b.first_chunk::<CHUNK_HEADER>()).ok_or_else(|| cut(CHUNK_HEADER))?;
        let [l0, l1, l2, l3, kind @ ..] = *head;
        let (start, length) = (at + CHUNK_HEADER, u32::from_le_bytes([l0, l1, l2, l3]) as usize);
        let data = bytes.get(start..start.saturating_add(length)).ok_or_else(|| cut(length))?;
        Ok((kind, data))
    };
    let (kind, json) = chunk(HEADER, "the JSON chunk")?;
    if kind != *b"JSON" {
        return Err(IoError::Syntax {
            path: path.into(),
            place: "the first chunk".into(),
            reason: "it is not JSON".into(),
        });
    }
    let next = HEADER + CHUNK_HEADER + json.len();
    if next >= bytes.len() {
        return Ok((json, None));
    }
    let (kind, binary) = chunk(next, "the binary chunk")?;
    Ok((json, (kind == *b"BIN\0").then_some(binary)))
}

impl Buffer {
    fn load<'a>(&self, binary: Option<&'a [u8]>, path: &Path) -> Result<Cow<'a, [u8]>, IoError> {
        let bad = |reason: &str| IoError::Syntax { path: path.into(), place: "buffers".into(), reason: reason.into() };
        let Some(uri) = &self.uri else {
            return binary.map(Cow::Borrowed).ok_or_else(|| bad("a buffer has neither an address nor a binary chunk"));
        };
        if let Some(data) = uri.strip_prefix("data:") {
            let text = data.split_once(";base64,").ok_or_else(|| bad("embedded data is not base64"))?.1;
            return base64::decode(text).map(Cow::Owned).map_err(|e| bad(&format!("embedded data: {e}")));
        }
        let root = path.parent().unwrap_or(Path::new("."));
        match files::inside(root, &files::relative(root, uri, path)?, path)? {
            Some(file) => files::read(&file, u64::MAX).map(Cow::Owned),
            None => Err(bad(&format!("the file '{uri}' does not exist"))),
        }
    }
}

impl Node {
    /// parent_from_node.
    pub fn local(&self) -> DMat4 {
        if let Some(m) = &self.matrix {
            return DMat4::from_cols_array(m);
        }
        DMat4::from_scale_rotation_translation(
            self.scale.map_or(DVec3::ONE, DVec3::from_array),
            self.rotation.map_or(DQuat::IDENTITY, DQuat::from_array),
            self.translation.map_or(DVec3::ZERO, DVec3::from_array),
        )
    }
}
