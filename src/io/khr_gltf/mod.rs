//! Splats in glTF 2.0 (`.gltf`, `.glb`): the extension `KHR_gaussian_splatting`.
//!
//! Scales are linear since the extension's draft of April 2026; earlier files hold logarithms.
//! A negative value or a signed integer type gives the latter away. Colors of the linear color
//! space are carried over to the display's: the constant harmonic exactly, the higher ones to
//! first order around it.

mod container;
mod primitive;
mod write;

use std::path::Path;

pub(crate) use container::is_gltf;
pub(super) use write::{encode_binary, encode_text};

use super::gltf_mesh::resource::split_container;
use super::{IoError, files};
use crate::scene::GaussianCloud;
use container::Gltf;

/// Name of the extension, and prefix of its attributes.
const EXTENSION: &str = "KHR_gaussian_splatting";
/// Prefix of attributes that the format leaves to applications.
const EXTRA: &str = "_";

/// Reads every splat of a glTF file's scene.
pub(crate) fn read(path: &Path) -> Result<GaussianCloud, IoError> {
    parse(&files::read(path, u64::MAX)?, path)
}

/// The Gaussians in the bytes of a glTF file. External buffers are read from the folder of `path`.
pub fn parse(bytes: &[u8], path: &Path) -> Result<GaussianCloud, IoError> {
    let (text, blob) = split_container(bytes, path)?;
    let json = container::json(text, path)?;
    let gltf = Gltf::open(&json, blob, path)?;
    let mut parts = Vec::new();
    for node in gltf.nodes()? {
        for primitive in gltf.primitives(&node) {
            if let Some(extension) = primitive.extensions.get(EXTENSION) {
                parts.push(primitive::cloud(&gltf, primitive, extension, node.world_from_node)?);
            }
        }
    }
    if parts.is_empty() {
        return Err(IoError::Unsupported {
            path: path.into(),
            what: "meshes without Gaussians".into(),
            remedy: "turn the meshes into posed photos first: fmlgs synth",
        });
    }
    let cloud = GaussianCloud::joined(parts);
    cloud.validate().map_err(|cause| IoError::Cloud { path: path.into(), cause })?;
    Ok(cloud)
}

#[cfg(test)]
mod tests;
