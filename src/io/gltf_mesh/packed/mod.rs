//! Packed geometry: the fields of `EXT_meshopt_compression` and `KHR_draco_mesh_compression`, and its unpacking.

use std::collections::BTreeMap;

use draco_core::{DecodeLimits, DecoderBuffer, Mesh as DracoMesh, MeshDecoder};
use gltf::json::accessor::ComponentType;
use gltf::json::validation::Checked;
use serde::Deserialize;

use super::accessor::AccessorValues;
use super::meshopt::{self, MeshoptFilter, Mode};
use super::{File, MAX_VALUES};
use crate::io::IoError;

pub(super) const MESHOPT: &str = "EXT_meshopt_compression";
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";

/// Fields of a file that describe packed geometry.
#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct PackedFile {
    buffers: Vec<With<Fallback>>,
    buffer_views: Vec<With<PackedView>>,
    meshes: Vec<PackedMesh>,
}

/// Extensions of an object, one of which parses as `T`.
#[derive(Deserialize)]
struct With<T> {
    #[serde(default = "BTreeMap::new")]
    extensions: BTreeMap<String, serde_json::Value>,
    #[serde(skip)]
    of: std::marker::PhantomData<T>,
}

#[derive(Deserialize)]
struct Fallback {
    #[serde(default)]
    fallback: bool,
}

#[derive(Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
struct PackedView {
    buffer: usize,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: u64,
    count: u64,
    mode: String,
    #[serde(default)]
    filter: Option<String>,
}

#[derive(Deserialize)]
struct PackedMesh {
    #[serde(default)]
    primitives: Vec<With<PackedPrimitive>>,
}

#[derive(Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
struct PackedPrimitive {
    buffer_view: usize,
    attributes: BTreeMap<String, u32>,
}

impl<T: serde::de::DeserializeOwned> With<T> {
    fn get(&self, extension: &str) -> Option<Result<T, serde_json::Error>> {
        self.extensions.get(extension).map(T::deserialize)
    }
}

impl PackedFile {
    /// Returns whether a buffer is only a placeholder for the content of its packed views.
    pub(super) fn is_fallback(&self, buffer: usize) -> bool {
        let told = self.buffers.get(buffer).and_then(|b| b.get(MESHOPT));
        told.is_some_and(|b| b.is_ok_and(|b| b.fallback))
    }
}

/// Unpacked Draco mesh, and the ids of its attributes.
pub(super) struct Unpacked {
    mesh: DracoMesh,
    attributes: BTreeMap<String, u32>,
}

impl File<'_> {
    /// Returns the unpacked bytes of a view packed by meshoptimizer; `None` if it is not packed.
    pub(super) fn packed_view(&self, index: usize) -> Result<Option<&[u8]>, IoError> {
        let Some(told) = self.packed.buffer_views.get(index).and_then(|view| view.get(MESHOPT)) else {
            return Ok(None);
        };
        let place = || format!("bufferViews[{index}], {MESHOPT}");
        let bad =
            |reason: String| self.content(place(), format!("{reason}; unpack the file with 'gltf-transform copy'"));
        let view = told.map_err(|e| bad(e.to_string()))?;
        let Some(cell) = self.unpacked.get(index) else { return Ok(None) };
        if cell.get().is_none() {
            let mode = match view.mode.as_str() {
                "ATTRIBUTES" => Mode::Attributes,
                "TRIANGLES" => Mode::Triangles,
                "INDICES" => Mode::Indices,
                other => return Err(bad(format!("the mode {other} is not known"))),
            };
            let filter = match view.filter.as_deref() {
                None | Some("NONE") => MeshoptFilter::None,
                Some("OCTAHEDRAL") => MeshoptFilter::Octahedral,
                Some("EXPONENTIAL") => MeshoptFilter::Exponential,
                Some(other) => return Err(bad(format!("the filter {other} is not known"))),
            };
            self.spend(view.count.saturating_mul(view.byte_stride).div_ceil(4))?;
            let data = self.buffer_bytes(view.buffer, view.byte_offset, view.byte_length, &place())?;
            let (count, stride) = (view.count as usize, view.byte_stride as usize);
            let bytes = meshopt::unpack(data, count, stride, mode, filter).map_err(bad)?;
            let _ = cell.set(bytes);
        }
        Ok(cell.get().map(Vec::as_slice))
    }

    /// Unpacks the mesh of a primitive packed by Draco; `None` if it is not packed.
    pub(super) fn draco(&self, mesh: usize, primitive: usize) -> Result<Option<Unpacked>, IoError> {
        let told = self.packed.meshes.get(mesh).and_then(|m| m.primitives.get(primitive)).and_then(|p| p.get(DRACO));
        let Some(told) = told else { return Ok(None) };
        let place = format!("meshes[{mesh}].primitives[{primitive}], {DRACO}");
        let bad =
            |reason: String| self.content(&place, format!("{reason}; unpack the file with 'gltf-transform copy'"));
        let PackedPrimitive { buffer_view, attributes } = told.map_err(|e| bad(e.to_string()))?;
        let bytes = self.view_bytes(buffer_view, &place)?;
        let left = self.values_left.get().min(MAX_VALUES);
        let limits = DecodeLimits::default().with_max_points(left / 3).with_max_faces(left / 3);
        let mut buffer = DecoderBuffer::new(bytes).with_limits(limits.with_max_decoded_bytes(left.saturating_mul(4)));
        let mut mesh = DracoMesh::new();
        MeshDecoder::new().decode(&mut buffer, &mut mesh).map_err(|e| bad(e.to_string()))?;
        self.spend(3 * mesh.num_faces() as u64)?;
        Ok(Some(Unpacked { mesh, attributes }))
    }

    /// Reads an attribute of an unpacked mesh, scaled as its accessor says; `None` if the mesh does not have it.
    pub(super) fn unpacked_values(
        &self,
        unpacked: &Unpacked,
        name: &str,
        accessor: usize,
        place: &str,
    ) -> Result<Option<AccessorValues>, IoError> {
        let Some(attribute) = unpacked.attributes.get(name).and_then(|id| unpacked.mesh.attribute_by_unique_id(*id))
        else {
            return Ok(None);
        };
        let told = self.item(&self.root.accessors, accessor, "accessors", place)?;
        let (width, count) = (usize::from(attribute.num_components()), unpacked.mesh.num_points());
        self.spend((count as u64).saturating_mul(width as u64))?;
        let largest = match &told.component_type {
            Checked::Valid(c) if told.normalized => match c.0 {
                ComponentType::I8 => 127.0,
                ComponentType::U8 => 255.0,
                ComponentType::I16 => 32_767.0,
                ComponentType::U16 => 65_535.0,
                _ => 1.0,
            },
            _ => 1.0_f32,
        };
        let mut data = attribute.read_f32s(count, width);
        data.iter_mut().for_each(|v| *v = (*v / largest).max(if largest > 1.0 { -1.0 } else { f32::MIN }));
        if let Some(i) = data.iter().position(|v| !v.is_finite()) {
            let (path, index) = (self.path.into(), i / width.max(1));
            return Err(IoError::NotFinite { path, element: "element", index, property: format!("{name} of {place}") });
        }
        Ok(Some(AccessorValues { width, data, signed_integer: false }))
    }
}

impl Unpacked {
    /// Vertex indices of its triangles, one after another.
    pub(super) fn indices(&self) -> Vec<u32> {
        self.mesh.faces().iter().flatten().map(|point| point.0).collect()
    }
}

#[cfg(test)]
mod tests;
