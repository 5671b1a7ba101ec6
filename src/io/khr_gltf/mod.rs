//! Splats in glTF 2.0 (`.gltf`, `.glb`): the extension `KHR_gaussian_splatting`, plain or with SPZ inside.
//!
//! The axes of glTF are left, up, front. Early files of this program (generator `fmlgs`) have the axes of the scene.
//!
//! Scales are linear since the extension's draft of April 2026; earlier files hold logarithms, recognized by a negative
//! value or a signed integer type. Colors in the linear color space are converted to that of the display: the constant
//! harmonic exactly, the higher ones to first order around it.

mod container;
mod packed;
mod primitive;
mod write;

use std::path::Path;

pub(crate) use container::is_gltf;
pub(super) use write::{encode_binary, encode_text};

use super::finite::finite_only;
use super::gltf_mesh::resource::split_container;
use super::{IoError, files};
use crate::scene::{Axes, GaussianCloud};
use container::Gltf;

/// Name of the extension, and prefix of its attributes.
const EXTENSION: &str = "KHR_gaussian_splatting";
/// Prefix of attributes that the format leaves to applications.
const EXTRA: &str = "_";
/// The generator of files in the scene's axes.
const UNTURNED: &str = "fmlgs";

/// Reads every splat of a glTF file's scene, with these axes if given.
pub(crate) fn read(path: &Path, axes: Option<Axes>) -> Result<GaussianCloud, IoError> {
    parse_in(&files::read(path, u64::MAX)?, path, axes)
}

/// Parses the Gaussians of a glTF file, in the scene's axes. External buffers are read from the folder of `path`.
pub fn parse(bytes: &[u8], path: &Path) -> Result<GaussianCloud, IoError> {
    parse_in(bytes, path, None)
}

fn parse_in(bytes: &[u8], path: &Path, axes: Option<Axes>) -> Result<GaussianCloud, IoError> {
    let (text, blob) = split_container(bytes, path)?;
    let json = container::json(text, path)?;
    let gltf = Gltf::open(&json, blob, path)?;
    let mut parts = Vec::new();
    for node in gltf.nodes()? {
        for primitive in gltf.primitives(&node) {
            let part = match (packed::view(primitive), primitive.extensions.get(EXTENSION)) {
                (Some(view), _) => packed::cloud(&gltf, view)?,
                (None, Some(extension)) => primitive::cloud(&gltf, primitive, extension)?,
                (None, None) => continue,
            };
            parts.push(primitive::placed(&gltf, part, node.world_from_node)?);
        }
    }
    if parts.is_empty() {
        return Err(IoError::Unsupported {
            path: path.into(),
            what: "meshes without Gaussians".into(),
            remedy: "turn the meshes into posed photos first: fmlgs synth",
        });
    }
    let warnings = parts.iter_mut().flat_map(|part| std::mem::take(&mut part.warnings)).collect();
    let cloud = GaussianCloud { warnings, ..GaussianCloud::joined(parts) };
    let unturned = json.0.asset.generator.as_deref() == Some(UNTURNED);
    let axes = axes.unwrap_or(if unturned { Axes::PLY } else { Axes::GLTF });
    let cloud = finite_only(cloud, path)?;
    Ok(cloud.turned(&axes.scene_from_file(), false))
}

#[cfg(test)]
mod tests;
