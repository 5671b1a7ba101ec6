//! Triangle meshes with named nodes from glTF 2.0 (`.gltf` and `.glb`).
//!
//! Read: the node tree with its transforms, triangles of every index type and of lists, strips and
//! fans, sparse and quantized accessors, normals, all texture coordinate sets, vertex colors, base
//! color and emission (factor and texture, `KHR_texture_transform`), alpha modes, unlit materials; geometry packed by
//! Draco (`KHR_draco_mesh_compression`) and meshoptimizer (`EXT_meshopt_compression`).
//! Left out: animation, skinning, morph targets, cameras and lights.
//!
//! No file is trusted: every index is looked up, every byte range is checked against the bytes present, decoded data
//! counts against a budget, and files named by a scene must lie in its own folder.

mod accessor;
mod geometry;
mod material;
mod meshopt;
mod model;
mod packed;
pub(super) mod resource;
#[cfg(test)]
pub(crate) mod tests;

use std::cell::{Cell, OnceCell};
use std::path::Path;

use glam::{DMat4, DQuat, DVec3};
use gltf::json::{self, Root};

use super::{IoError, files};
use crate::scene::text;

use packed::{DRACO, MESHOPT, PackedFile};

pub(crate) use model::{AlphaMode, Material, Mesh, MeshNode, MeshPrimitive, MeshScene, TextureImage, TextureUse, Wrap};

/// Largest file that is read, in bytes.
const MAX_FILE_BYTES: u64 = 2 << 30;
/// Most values that all accessors together may decode to (4 bytes each).
const MAX_VALUES: u64 = 256 << 20;
/// Most values decoded per byte in the buffers.
const MAX_SHARING: u64 = 64;
/// Most nodes and most primitives.
const MAX_ITEMS: usize = 1 << 20;

/// Reads a scene from a `.gltf` or `.glb` file; external files only from the file's own folder.
pub fn read(path: &Path) -> Result<MeshScene, IoError> {
    let bytes = files::read(path, MAX_FILE_BYTES)?;
    let folder = path.parent().map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p });
    read_bytes(&bytes, path, folder)
}

/// Reads a self-contained scene from memory; `name` stands for its path in messages.
pub fn read_slice(bytes: &[u8], name: &str) -> Result<MeshScene, IoError> {
    read_bytes(bytes, Path::new(name), None)
}

fn read_bytes(bytes: &[u8], path: &Path, folder: Option<&Path>) -> Result<MeshScene, IoError> {
    let (text, blob) = resource::split_container(bytes, path)?;
    let root: Root = parse(text, path)?;
    if let Some(extension) = root.extensions_required.iter().find(|e| !supported(e)) {
        let what = format!("the required extension {extension}");
        // gltf-transform unpacks the formats that it supports, and writes them plain.
        let remedy = match extension.contains("compression") || extension.contains("meshopt") {
            true => "unpack it with 'gltf-transform copy IN OUT.glb', or pack it with 'gltfpack -c'",
            false => "export the scene without it",
        };
        return Err(IoError::Unsupported { path: path.into(), what, remedy });
    }
    let packed: PackedFile = parse(text, path)?;
    let mut file = File::open_packed(&root, path, folder, blob, [MAX_FILE_BYTES, MAX_VALUES], packed)?;
    let (nodes, roots) = file.nodes()?;
    let (materials, images) = file.materials()?;
    let meshes = geometry::meshes(&mut file, &nodes, &materials)?;
    Ok(MeshScene { nodes, roots, meshes, materials, images, warnings: file.warnings })
}

pub(super) fn parse<T: serde::de::DeserializeOwned>(text: &[u8], path: &Path) -> Result<T, IoError> {
    files::json(text, path)
}

/// Returns whether a scene that requires the extension can be drawn correctly. Extensions that only refine the look of
/// a surface may be ignored.
fn supported(extension: &str) -> bool {
    let exact = ["KHR_texture_transform", "KHR_mesh_quantization", "KHR_lights_punctual", "KHR_xmp_json_ld"];
    exact.contains(&extension) || [MESHOPT, DRACO].contains(&extension) || extension.starts_with("KHR_materials_")
}

/// A parsed file during conversion.
pub(super) struct File<'a> {
    path: &'a Path,
    folder: Option<&'a Path>,
    root: &'a Root,
    buffers: Vec<std::borrow::Cow<'a, [u8]>>,
    values_left: Cell<u64>,
    packed: PackedFile,
    /// Unpacked content of packed buffer views.
    unpacked: Vec<OnceCell<Vec<u8>>>,
    warnings: Vec<String>,
}

impl<'a> File<'a> {
    /// Loads the buffers of a file whose binary chunk is `blob`. `limits` are the bytes of all buffers, and the values
    /// that all accessors together may decode to.
    pub fn open(
        root: &'a Root,
        path: &'a Path,
        folder: Option<&'a Path>,
        blob: Option<&'a [u8]>,
        limits: [u64; 2],
    ) -> Result<Self, IoError> {
        Self::open_packed(root, path, folder, blob, limits, PackedFile::default())
    }

    /// As [`open`](Self::open), for a file with packed geometry.
    fn open_packed(
        root: &'a Root,
        path: &'a Path,
        folder: Option<&'a Path>,
        blob: Option<&'a [u8]>,
        [most_bytes, most_values]: [u64; 2],
        packed: PackedFile,
    ) -> Result<Self, IoError> {
        let is_empty = |buffer| packed.is_fallback(buffer);
        let buffers = resource::load_buffers(root, path, folder, blob, most_bytes, &is_empty)?;
        // Primitives may share vertices, but a small file that decodes to gigabytes is hostile.
        let held = buffers.iter().map(|b| b.len() as u64).sum::<u64>();
        let values_left = Cell::new(held.saturating_mul(MAX_SHARING).clamp(1 << 20, most_values));
        let unpacked = (0..root.buffer_views.len()).map(|_| OnceCell::new()).collect();
        Ok(Self { path, folder, root, buffers, values_left, packed, unpacked, warnings: Vec::new() })
    }

    /// Makes an error about `place`, which does not follow the format.
    pub(crate) fn content(&self, place: impl Into<String>, problem: impl Into<String>) -> IoError {
        IoError::Syntax { path: self.path.into(), place: place.into(), reason: problem.into() }
    }

    /// Returns `list[index]`, or an error that names both.
    fn item<'l, T>(&self, list: &'l [T], index: usize, name: &str, place: &str) -> Result<&'l T, IoError> {
        list.get(index)
            .ok_or_else(|| self.content(place, format!("refers to {name}[{index}], but there are {}", list.len())))
    }

    /// Takes `count` values off the budget.
    fn spend(&self, count: u64) -> Result<(), IoError> {
        let (limit, left) = (self.values_left.get(), self.values_left.get().checked_sub(count));
        self.values_left.set(left.ok_or_else(|| IoError::OverBudget {
            path: self.path.into(),
            what: "the geometry",
            bytes: count.saturating_mul(4),
            limit: limit.saturating_mul(4),
            remedy: "that is more than what its buffers can hold, vertices shared within reason",
        })?);
        Ok(())
    }

    /// The node tree of the default scene (else of the first, else of every node that is no child),
    /// parents before children.
    pub(crate) fn nodes(&self) -> Result<(Vec<MeshNode>, Vec<usize>), IoError> {
        let root = self.root;
        if root.nodes.len() > MAX_ITEMS {
            return Err(self.content("nodes", format!("there are more than {MAX_ITEMS}")));
        }
        let tops: Vec<usize> = match (root.scene, root.scenes.first()) {
            (Some(i), _) => {
                let scene = self.item(&root.scenes, i.value(), "scenes", "scene")?;
                scene.nodes.iter().map(json::Index::value).collect()
            }
            (None, Some(scene)) => scene.nodes.iter().map(json::Index::value).collect(),
            (None, None) => {
                let mut child = vec![false; root.nodes.len()];
                for c in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
                    if let Some(flag) = child.get_mut(c.value()) {
                        *flag = true;
                    }
                }
                (0..root.nodes.len()).filter(|&i| !child[i]).collect()
            }
        };
        let mut seen = vec![false; root.nodes.len()];
        let mut nodes: Vec<MeshNode> = Vec::new();
        let mut roots = Vec::new();
        // (index in the file, parent's index in `nodes`); a stack, because trees may be deep.
        let mut stack: Vec<(usize, Option<usize>)> = tops.iter().rev().map(|&i| (i, None)).collect();
        while let Some((index, parent)) = stack.pop() {
            let place = format!("nodes[{index}]");
            let node = self.item(&root.nodes, index, "nodes", "the node tree")?;
            if std::mem::replace(&mut seen[index], true) {
                return Err(self.content(place, "is reached twice: the nodes form a cycle or share a child"));
            }
            let local = local_transform(node);
            let world = parent.map_or(DMat4::IDENTITY, |p| nodes[p].world_from_node) * local;
            if !world.is_finite() {
                return Err(self.content(place, "its transform is not finite"));
            }
            let own = nodes.len();
            match parent {
                Some(p) => nodes[p].children.push(own),
                None => roots.push(own),
            }
            let mesh = node.mesh.map(|m| m.value());
            if let Some(m) = mesh {
                self.item(&root.meshes, m, "meshes", &place)?;
            }
            let name = node.name.as_deref().map(str::trim).filter(|n| !n.is_empty()).map(text::name);
            nodes.push(MeshNode { name, parent, children: Vec::new(), mesh, world_from_node: world });
            stack.extend(node.children.iter().flatten().rev().map(|c| (c.value(), Some(own))));
        }
        Ok((nodes, roots))
    }
}

/// The node's own transform; not finite if the file's numbers are not.
fn local_transform(node: &json::Node) -> DMat4 {
    if let Some(m) = node.matrix {
        return DMat4::from_cols_array(&m.map(f64::from));
    }
    let vector = |v: Option<[f32; 3]>, default: f64| v.map_or(DVec3::splat(default), |v| DVec3::from(v.map(f64::from)));
    let q = node.rotation.unwrap_or_default().0.map(f64::from);
    // A quaternion of no length stands for no rotation, as in most viewers.
    let length = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    let rotation = if length > 0.0 { DQuat::from_array(q.map(|c| c / length)) } else { DQuat::IDENTITY };
    if !rotation.is_finite() {
        return DMat4::NAN;
    }
    let scale = vector(node.scale, 1.0);
    let axes = glam::DMat3::from_quat(rotation);
    DMat4::from_cols(
        (axes.x_axis * scale.x).extend(0.0),
        (axes.y_axis * scale.y).extend(0.0),
        (axes.z_axis * scale.z).extend(0.0),
        vector(node.translation, 0.0).extend(1.0),
    )
}
