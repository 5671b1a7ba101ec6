//! Objects and parts of a node tree.
//!
//! With [`Levels::Nodes`], "bearing" meaning that a node or one below it has a mesh:
//!
//! 1. Start from the roots that bear meshes. As long as there is a single one without a mesh of its
//!    own, it is a wrapper and is replaced by its bearing children, where it has only one, or where
//!    at least two of them are groups without a mesh of their own (a lone group of plain meshes is
//!    an object: a motorcycle with wheels). The nodes that remain are the **objects**.
//! 2. Below an object, every named node with a mesh of its own is a **part**. An unnamed node with a
//!    mesh belongs to the nearest named node above it; if that is the object, to no part.
//! 3. The object's own mesh belongs to the object and to no part. An object whose meshes would all
//!    be one part has no parts: it is that part.
//!
//! With [`Levels::File`] there is one object, named like the file, and rule 2 holds below it.
//!
//! Names need not be unique (two controllers both have a "button a"); ids and paths are. Objects
//! are numbered from 1, parts follow; 0 means nothing.

use std::collections::HashMap;

use serde::Serialize;

use super::SynthError;
use super::options::Levels;
use crate::io::gltf_mesh::MeshScene;
use crate::scene::Level;

/// Object or part in the id maps.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrueIdentity {
    /// Value in the id maps, from 1.
    pub(crate) id: u16,
    pub(crate) name: String,
    pub(crate) level: Level,
    /// For a part, its object's id.
    pub(crate) parent: Option<u16>,
    /// Names from the root to the node, joined by `/`.
    pub(crate) path: String,
    /// Color for the display of id maps, sRGB.
    pub(crate) color: [u8; 3],
    /// Number of pixels in all photos whose center shows it (for an object: with its parts).
    pub(crate) pixels: u64,
    /// Number of photos that show it.
    pub(crate) views: u32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct NodeIds {
    /// Object, 0 for none.
    pub(crate) object: u16,
    /// Part, 0 for none.
    pub(crate) part: u16,
}

/// All identities of a scene, and the ids of each node.
pub struct TrueIdentities {
    /// In order of their ids, from 1.
    pub(crate) list: Vec<TrueIdentity>,
    pub(crate) of_node: Vec<NodeIds>,
}

/// Node with a mesh, its object's index, and the node that names its part.
struct Surface {
    node: usize,
    object: usize,
    part: Option<usize>,
}

/// Finds objects and parts; `file` names the object of [`Levels::File`].
pub(crate) fn identities(scene: &MeshScene, levels: Levels, file: &str) -> Result<TrueIdentities, SynthError> {
    let bearing = bearing(scene);
    let has_mesh = |n: usize| has_mesh(scene, n);
    let objects: Vec<Vec<usize>> = match levels {
        Levels::Nodes => object_nodes(scene, &bearing).into_iter().map(|n| vec![n]).collect(),
        Levels::File => vec![scene.roots.iter().copied().filter(|&n| bearing[n]).collect()],
    };
    let named = |n: usize| scene.nodes[n].name.is_some();
    let mut list = Vec::new();
    let mut surfaces: Vec<Surface> = Vec::new();
    for (object, tops) in objects.iter().filter(|tops| !tops.is_empty()).enumerate() {
        let (name, path) = match levels {
            Levels::Nodes => (label(scene, tops[0]), path(scene, tops[0])),
            Levels::File => (file.to_owned(), file.to_owned()),
        };
        list.push(identity(object, name, Level::Object, None, path)?);
        let top_part = |t: usize| (levels == Levels::File && named(t)).then_some(t);
        // Pushed in reverse, so that nodes are visited in the order of the file.
        let mut stack: Vec<(usize, Option<usize>)> = tops.iter().rev().map(|&t| (t, top_part(t))).collect();
        let first = surfaces.len();
        while let Some((node, part)) = stack.pop() {
            if has_mesh(node) {
                surfaces.push(Surface { node, object, part });
            }
            let children = scene.nodes[node].children.iter().rev();
            stack.extend(children.map(|&c| (c, if named(c) { Some(c) } else { part })));
        }
        let own = &mut surfaces[first..];
        // Rule 3: a single part is the object itself.
        if own.iter().all(|s| s.part == own[0].part) {
            own.iter_mut().for_each(|s| s.part = None);
        }
    }
    let mut of_node = vec![NodeIds::default(); scene.nodes.len()];
    let mut part_ids: HashMap<usize, u16> = HashMap::new();
    for s in &surfaces {
        let object = list[s.object].id;
        let part = match s.part {
            None => 0,
            Some(p) => match part_ids.get(&p) {
                Some(&id) => id,
                None => {
                    let next = identity(list.len(), label(scene, p), Level::Part, Some(object), path(scene, p))?;
                    part_ids.insert(p, next.id);
                    list.push(next);
                    part_ids[&p]
                }
            },
        };
        of_node[s.node] = NodeIds { object, part };
    }
    Ok(TrueIdentities { list, of_node })
}

fn has_mesh(scene: &MeshScene, node: usize) -> bool {
    scene.nodes[node].mesh.is_some_and(|m| scene.meshes[m].primitives.iter().any(|p| !p.triangles.is_empty()))
}

/// Marks each node that has a mesh, itself or below it.
fn bearing(scene: &MeshScene) -> Vec<bool> {
    let mut bearing: Vec<bool> = (0..scene.nodes.len()).map(|n| has_mesh(scene, n)).collect();
    // Parents come before children, so backwards every child is known before its parent.
    for n in (0..scene.nodes.len()).rev() {
        if let Some(parent) = scene.nodes[n].parent.filter(|_| bearing[n]) {
            bearing[parent] = true;
        }
    }
    bearing
}

/// Finds the object nodes by rule 1.
fn object_nodes(scene: &MeshScene, bearing: &[bool]) -> Vec<usize> {
    let below = |n: &usize| bearing[*n];
    let mut nodes: Vec<usize> = scene.roots.iter().copied().filter(below).collect();
    while let [only] = nodes[..] {
        let children: Vec<usize> = scene.nodes[only].children.iter().copied().filter(below).collect();
        let groups = children.iter().filter(|&&c| !has_mesh(scene, c)).count();
        if has_mesh(scene, only) || !(children.len() == 1 || groups >= 2) {
            break;
        }
        nodes = children;
    }
    nodes
}

fn identity(
    index: usize,
    name: String,
    level: Level,
    parent: Option<u16>,
    path: String,
) -> Result<TrueIdentity, SynthError> {
    let id = u16::try_from(index + 1).map_err(|_| SynthError::TooManyIdentities)?;
    Ok(TrueIdentity { id, name, level, parent, path, color: color(index), pixels: 0, views: 0 })
}

/// Name of the node, else of its mesh, else its number.
fn label(scene: &MeshScene, node: usize) -> String {
    let n = &scene.nodes[node];
    let mesh = n.mesh.and_then(|m| scene.meshes[m].name.clone());
    n.name.clone().or(mesh).unwrap_or_else(|| format!("node {node}"))
}

/// Names from the root to the node.
fn path(scene: &MeshScene, node: usize) -> String {
    let mut names = vec![label(scene, node)];
    let mut at = node;
    while let Some(parent) = scene.nodes[at].parent {
        names.push(label(scene, parent));
        at = parent;
    }
    names.reverse();
    names.join("/")
}

/// Display color: hues a golden angle apart in three brightnesses, so that consecutive ids differ most.
fn color(index: usize) -> [u8; 3] {
    let hue = (index as f64 * 0.618_033_988_75).fract() * 6.0;
    let value = [0.95, 0.7, 0.85][index % 3];
    let channel = |shift: f64| {
        let k = (hue + shift) % 6.0;
        let strength = (k.min(4.0 - k)).clamp(0.0, 1.0);
        ((value * (1.0 - 0.75 * strength)) * 255.0) as u8
    };
    [channel(5.0), channel(3.0), channel(1.0)]
}

/// Counts the pixels of each id in the maps of one photo.
pub(crate) fn counts(object: &[u16], part: &[u16]) -> Vec<(u16, u64)> {
    let mut counts: HashMap<u16, u64> = HashMap::new();
    for &id in object.iter().chain(part).filter(|id| **id != 0) {
        *counts.entry(id).or_default() += 1;
    }
    let mut counts: Vec<_> = counts.into_iter().collect();
    counts.sort_unstable();
    counts
}
