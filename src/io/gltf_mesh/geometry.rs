//! Primitives: vertices and triangles.

use glam::{Vec2, Vec3, Vec4};
use gltf::json::mesh::{Mode, Primitive as JsonPrimitive, Semantic};
use gltf::json::validation::Checked;

use super::accessor::AccessorValues;
use super::packed::Unpacked;
use super::{File, MAX_ITEMS, Material, Mesh, MeshNode, MeshPrimitive};
use crate::io::IoError;
use crate::scene::text;

/// Highest texture coordinate set that is read.
const MAX_UV_SETS: u32 = 8;

/// Converts the meshes that `nodes` use; the others stay empty.
pub(super) fn meshes(file: &mut File<'_>, nodes: &[MeshNode], materials: &[Material]) -> Result<Vec<Mesh>, IoError> {
    let root = file.root;
    let mut used = vec![false; root.meshes.len()];
    for m in nodes.iter().filter_map(|n| n.mesh) {
        used[m] = true;
    }
    if root.meshes.iter().map(|m| m.primitives.len()).sum::<usize>() > MAX_ITEMS {
        return Err(file.content("meshes", format!("there are more than {MAX_ITEMS} primitives")));
    }
    let mut meshes = Vec::with_capacity(root.meshes.len());
    for (m, mesh) in root.meshes.iter().enumerate() {
        let mut out = Mesh { name: mesh.name.as_deref().map(text::name), primitives: Vec::new() };
        for (p, json) in mesh.primitives.iter().enumerate().filter(|_| used[m]) {
            let place = format!("meshes[{m}].primitives[{p}]");
            let draco = file.draco(m, p)?;
            out.primitives.extend(primitive(file, json, draco.as_ref(), &place, materials)?);
        }
        meshes.push(out);
    }
    Ok(meshes)
}

fn primitive(
    file: &mut File<'_>,
    primitive: &JsonPrimitive,
    draco: Option<&Unpacked>,
    place: &str,
    materials: &[Material],
) -> Result<Option<MeshPrimitive>, IoError> {
    let mode = match primitive.mode {
        Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
        Checked::Valid(_) => {
            file.warnings.push(format!("{place}: points and lines are not drawn"));
            return Ok(None);
        }
        Checked::Invalid => return Err(file.content(place, "its mode is unknown")),
    };
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|i| i.value());
    let Some(positions) = attribute(Semantic::Positions) else {
        file.warnings.push(format!("{place}: has no positions, left out"));
        return Ok(None);
    };
    let values = attribute_values(file, draco, "POSITION", positions, place)?;
    if values.width != 3 {
        return Err(file.content(place, "its POSITION is not VEC3"));
    }
    let positions: Vec<Vec3> = values.arrays(0.0).map(Vec3::from_array).collect();
    let count = positions.len();
    let normals = match attribute(Semantic::Normals) {
        Some(i) => attribute_values(file, draco, "NORMAL", i, place)?.arrays(0.0).map(Vec3::from_array).collect(),
        None => Vec::new(),
    };
    let colors = match attribute(Semantic::Colors(0)) {
        Some(i) => attribute_values(file, draco, "COLOR_0", i, place)?.arrays(1.0).map(Vec4::from_array).collect(),
        None => Vec::new(),
    };
    let mut uv_sets: Vec<Vec<Vec2>> = Vec::new();
    for set in 0..MAX_UV_SETS {
        if let Some(i) = attribute(Semantic::TexCoords(set)) {
            uv_sets.resize(set as usize + 1, Vec::new());
            let values = attribute_values(file, draco, &format!("TEXCOORD_{set}"), i, place)?;
            uv_sets[set as usize] = values.arrays(0.0).map(Vec2::from_array).collect();
        }
    }
    let lengths = [normals.len(), colors.len()].into_iter().chain(uv_sets.iter().map(Vec::len));
    if let Some(length) = lengths.into_iter().find(|&l| l != 0 && l != count) {
        return Err(file.content(place, format!("one attribute has {length} elements, POSITION has {count}")));
    }
    let order: Vec<u32> = match primitive.indices {
        _ if draco.is_some() => draco.map(Unpacked::indices).unwrap_or_default(),
        Some(i) => file.indices(i.value(), place)?,
        None => (0..u32::try_from(count).unwrap_or(u32::MAX)).collect(),
    };
    if let Some(i) = order.iter().find(|&&i| i as usize >= count) {
        return Err(file.content(place, format!("an index {i} is not below its {count} vertices")));
    }
    let material = match primitive.material {
        // The last material is the default one, which no file can name.
        Some(i) => {
            file.item(&materials[..materials.len() - 1], i.value(), "materials", place)?;
            i.value()
        }
        None => materials.len() - 1,
    };
    // Draco has no strips and fans: it unpacks to triangles.
    let triangles = triangles(&order, if draco.is_some() { Mode::Triangles } else { mode });
    Ok(Some(MeshPrimitive { positions, normals, uv_sets, colors, triangles, material }))
}

/// Reads an attribute of a primitive, unpacked if Draco has packed it.
fn attribute_values(
    file: &File<'_>,
    draco: Option<&Unpacked>,
    name: &str,
    accessor: usize,
    place: &str,
) -> Result<AccessorValues, IoError> {
    let unpacked = draco.map(|draco| file.unpacked_values(draco, name, accessor, place)).transpose()?.flatten();
    unpacked.map_or_else(|| file.values(accessor, place), Ok)
}

/// Makes triangles of a list, strip or fan; incomplete ones at the end are dropped.
pub(crate) fn triangles(order: &[u32], mode: Mode) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => order
            .windows(3)
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        Mode::TriangleFan => {
            let Some((&first, rest)) = order.split_first() else { return Vec::new() };
            rest.windows(2).map(|w| [first, w[0], w[1]]).collect()
        }
        _ => order.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}
