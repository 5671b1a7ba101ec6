//! SPZ within glTF: `KHR_gaussian_splatting_compression_spz`, its second draft and its earlier names.

use serde_json::Value;

use super::EXTENSION;
use super::container::{Gltf, SplatPrimitive};
use crate::io::IoError;
use crate::io::spz::{self, SpzAxes};
use crate::scene::{Axes, GaussianCloud};

/// Extensions within `KHR_gaussian_splatting`.
const WITHIN: [&str; 2] = ["KHR_gaussian_splatting_compression_spz_2", "KHR_gaussian_splatting_compression_spz"];
/// Extensions of a primitive, in earlier drafts.
const BESIDE: [&str; 2] = ["KHR_spz_gaussian_splats_compression", "KHR_spz_compression"];

/// Returns the extension's content of the primitive: `bufferView`.
pub(super) fn view(primitive: &SplatPrimitive) -> Option<&Value> {
    let inner = primitive.extensions.get(EXTENSION).and_then(|e| e.get("extensions"));
    let within = WITHIN.iter().find_map(|name| inner?.get(name));
    within.or_else(|| BESIDE.iter().find_map(|name| primitive.extensions.get(*name)))
}

/// Reads the Gaussians in the buffer view, in the axes of glTF.
pub(super) fn cloud(gltf: &Gltf<'_>, extension: &Value) -> Result<GaussianCloud, IoError> {
    let index = extension.get("bufferView").and_then(Value::as_u64).and_then(|index| usize::try_from(index).ok());
    let index = index.ok_or_else(|| gltf.bad("a splat primitive", "its SPZ has no bufferView".into()))?;
    let cloud = spz::parse_in(gltf.view_bytes(index)?, gltf.path(), SpzAxes::Documented)?;
    Ok(cloud.turned(&Axes::GLTF.scene_from_file().transpose(), false))
}
