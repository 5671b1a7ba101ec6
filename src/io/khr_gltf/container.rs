//! Parts of a glTF file with splats that [`crate::io::gltf_mesh`] does not read: the extension's attributes, whose
//! names general glTF readers do not know.

use std::collections::BTreeMap;
use std::path::Path;

use gltf::json::Root;
use serde::Deserialize;

use crate::io::IoError;
use crate::io::gltf_mesh::{File, MeshNode, parse};

/// Part of the JSON with attributes by their names.
#[derive(Deserialize)]
pub(super) struct Meshes {
    #[serde(default)]
    meshes: Vec<Mesh>,
}

#[derive(Deserialize)]
struct Mesh {
    primitives: Vec<SplatPrimitive>,
}

#[derive(Deserialize)]
pub(super) struct SplatPrimitive {
    pub(crate) attributes: BTreeMap<String, usize>,
    #[serde(default)]
    pub(crate) extensions: BTreeMap<String, serde_json::Value>,
}

pub(super) struct AttributeValues<const N: usize> {
    pub(crate) rows: Vec<[f32; N]>,
    pub(crate) signed_integer: bool,
}

pub(super) struct Gltf<'a> {
    meshes: &'a Meshes,
    file: File<'a>,
    path: &'a Path,
}

/// Returns whether the first bytes of a file are those of a `.glb`, or its name is that of a `.gltf`.
pub(crate) fn is_gltf(start: &[u8], name: &str) -> bool {
    start.starts_with(b"glTF") || name.ends_with(".gltf")
}

/// Parses the JSON part in both forms.
pub(super) fn json(text: &[u8], path: &Path) -> Result<(Root, Meshes), IoError> {
    Ok((parse(text, path)?, parse(text, path)?))
}

impl<'a> Gltf<'a> {
    pub(crate) fn open(
        (root, meshes): &'a (Root, Meshes),
        blob: Option<&'a [u8]>,
        path: &'a Path,
    ) -> Result<Self, IoError> {
        let folder = path.parent().map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p });
        Ok(Self { meshes, file: File::open(root, path, folder, blob, [u64::MAX; 2])?, path })
    }

    pub(crate) fn bad(&self, place: &str, reason: String) -> IoError {
        self.file.content(place, reason)
    }

    pub(crate) fn unsupported(&self, what: String, remedy: &'static str) -> IoError {
        IoError::Unsupported { path: self.path.into(), what, remedy }
    }

    /// Path of the file, for errors.
    pub(crate) fn path(&self) -> &Path {
        self.path
    }

    /// Returns the bytes of buffer view `index`.
    pub(crate) fn view_bytes(&self, index: usize) -> Result<&[u8], IoError> {
        self.file.view_bytes(index, "a splat primitive")
    }

    pub(crate) fn nodes(&self) -> Result<Vec<MeshNode>, IoError> {
        Ok(self.file.nodes()?.0)
    }

    pub(crate) fn primitives(&self, node: &MeshNode) -> &[SplatPrimitive] {
        node.mesh.and_then(|mesh| self.meshes.meshes.get(mesh)).map_or(&[], |mesh| &mesh.primitives)
    }

    /// Reads the values of accessor `index`; integers are normalized if the accessor says so.
    pub(crate) fn values<const N: usize>(&self, index: usize) -> Result<AttributeValues<N>, IoError> {
        let values = self.file.any_values(index, "a splat primitive")?;
        if values.width != N {
            let reason = format!("it has {} components, expected {N}", values.width);
            return Err(self.bad(&format!("accessors[{index}]"), reason));
        }
        let (rows, _) = values.data.as_chunks::<N>();
        Ok(AttributeValues { rows: rows.to_vec(), signed_integer: values.signed_integer })
    }

    /// Reads the values of accessor `index` if each is one number.
    pub(crate) fn scalars(&self, index: usize) -> Result<Option<Vec<f32>>, IoError> {
        let values = self.file.values(index, "a splat primitive")?;
        Ok((values.width == 1).then_some(values.data))
    }
}
