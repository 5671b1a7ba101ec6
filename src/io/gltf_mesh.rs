//! Triangle meshes with named nodes from glTF 2.0 (`.gltf` and `.glb`).
//!
//! Read: the node tree with its transforms, triangles of every index type and of lists, strips and
//! fans, sparse and quantised accessors, normals, all texture coordinate sets, vertex colours, base
//! colour and emission (factor and texture, `KHR_texture_transform`), alpha modes, unlit materials.
//! Left out: animation, skinning, morph targets, cameras and lights.
//!
//! Nothing in a file is believed: every index is looked up, every byte range is checked against the
//! bytes that are really there, decoded data counts against a budget, and files named by a scene
//! must lie in the scene's own folder.

mod accessor;
mod geometry;
mod material;
mod model;
mod resource;
#[cfg(test)]
pub(crate) mod tests;

use std::path::{Path, PathBuf};

use glam::{DMat4, DQuat, DVec3};
use gltf::json::{self, Root};

use crate::scene::text;

pub use model::{AlphaMode, Material, Mesh, MeshNode, MeshScene, Primitive, TextureImage, TextureUse, Wrap};

/// Largest file that is read, in bytes.
const MAX_FILE_BYTES: u64 = 2 << 30;
/// Most values that all accessors together may decode to (4 bytes each).
const MAX_VALUES: u64 = 256 << 20;
/// How many values may be decoded for each byte in the buffers.
const MAX_SHARING: u64 = 64;
/// Most nodes and most primitives.
const MAX_ITEMS: usize = 1 << 20;

/// Why a glTF scene could not be read.
#[derive(Debug, thiserror::Error)]
pub enum GltfError {
    /// A file could not be read, or is larger than the reader takes.
    #[error(transparent)]
    Read(#[from] super::IoError),
    /// A file that the scene names could not be found.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The container is neither binary glTF 2.0 nor JSON.
    #[error("{path}: not a glTF 2.0 file: {problem}", path = path.display())]
    Container {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// The JSON part does not parse as glTF.
    #[error("{path}: the JSON part is not glTF 2.0: {source}", path = path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Where and why.
        source: json::Error,
    },
    /// The file cannot be shown without an extension that is not supported.
    #[error("{path}: needs the extension {extension}, which is not supported; export it without", path = path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// The extension's name.
        extension: String,
    },
    /// Something inside the file is wrong.
    #[error("{path}: {place}: {problem}", path = path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Where in its JSON, for example `accessors[3]`.
        place: String,
        /// What is wrong.
        problem: String,
    },
    /// A buffer or image outside the scene's folder.
    #[error("{path}: {place}: refuses to read `{uri}`, which is not inside the scene's folder", path = path.display())]
    OutsideFolder {
        /// The scene's file.
        path: PathBuf,
        /// Where in its JSON.
        place: String,
        /// What it asked for.
        uri: String,
    },
    /// More data than the reader takes.
    #[error("{path}: {what} exceeds the limit of {limit}", path = path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What is too large.
        what: String,
        /// The limit with its unit.
        limit: String,
    },
}

/// Reads a scene from a `.gltf` or `.glb` file; external files only from the file's own folder.
pub fn read(path: &Path) -> Result<MeshScene, GltfError> {
    let bytes = resource::read_file(path)?;
    let folder = path.parent().map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p });
    read_bytes(&bytes, path, folder)
}

/// Reads a self-contained scene from memory; `name` stands for its path in messages.
pub fn read_slice(bytes: &[u8], name: &str) -> Result<MeshScene, GltfError> {
    read_bytes(bytes, Path::new(name), None)
}

fn read_bytes(bytes: &[u8], path: &Path, folder: Option<&Path>) -> Result<MeshScene, GltfError> {
    let (text, blob) = resource::split_container(bytes, path)?;
    let root = json::deserialize::from_slice::<Root>(text)
        .map_err(|source| GltfError::Json { path: path.to_owned(), source })?;
    if let Some(extension) = root.extensions_required.iter().find(|e| !supported(e)) {
        return Err(GltfError::Extension { path: path.to_owned(), extension: extension.clone() });
    }
    let buffers = resource::load_buffers(&root, path, folder, blob)?;
    // Primitives may share vertices, but a small file that decodes to gigabytes means harm.
    let held = buffers.iter().map(|b| b.len() as u64).sum::<u64>();
    let values_left = held.saturating_mul(MAX_SHARING).clamp(1 << 20, MAX_VALUES);
    let mut file = File { path, folder, root: &root, buffers, values_left, warnings: Vec::new() };
    let (nodes, roots) = file.nodes()?;
    let (materials, images) = file.materials()?;
    let meshes = file.meshes(&nodes, &materials)?;
    Ok(MeshScene { nodes, roots, meshes, materials, images, warnings: file.warnings })
}

/// Whether a scene that requires the extension can be drawn right: those that only refine the look
/// of a surface may be ignored.
fn supported(extension: &str) -> bool {
    let exact = ["KHR_texture_transform", "KHR_mesh_quantization", "KHR_lights_punctual", "KHR_xmp_json_ld"];
    exact.contains(&extension) || extension.starts_with("KHR_materials_")
}

/// A parsed file while its content is taken over.
struct File<'a> {
    path: &'a Path,
    folder: Option<&'a Path>,
    root: &'a Root,
    buffers: Vec<std::borrow::Cow<'a, [u8]>>,
    values_left: u64,
    warnings: Vec<String>,
}

impl File<'_> {
    fn content(&self, place: impl Into<String>, problem: impl Into<String>) -> GltfError {
        GltfError::Content { path: self.path.to_owned(), place: place.into(), problem: problem.into() }
    }

    /// `list[index]`, or an error that names both.
    fn item<'l, T>(&self, list: &'l [T], index: usize, name: &str, place: &str) -> Result<&'l T, GltfError> {
        list.get(index)
            .ok_or_else(|| self.content(place, format!("refers to {name}[{index}], but there are {}", list.len())))
    }

    /// Takes `count` values off the budget.
    fn spend(&mut self, count: u64) -> Result<(), GltfError> {
        self.values_left = self.values_left.checked_sub(count).ok_or_else(|| GltfError::TooLarge {
            path: self.path.to_owned(),
            what: "the geometry".into(),
            limit: "what its buffers can hold, vertices shared within reason".into(),
        })?;
        Ok(())
    }

    /// The node tree of the default scene (else of the first, else of every node that is no child),
    /// parents before children.
    fn nodes(&mut self) -> Result<(Vec<MeshNode>, Vec<usize>), GltfError> {
        let root = self.root;
        if root.nodes.len() > MAX_ITEMS {
            let limit = format!("{MAX_ITEMS}");
            return Err(GltfError::TooLarge { path: self.path.to_owned(), what: "the number of nodes".into(), limit });
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

/// The node's own transform; not finite where the file's numbers are not.
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
