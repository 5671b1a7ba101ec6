//! Splats in glTF 2.0 (`.gltf`, `.glb`): the extension `KHR_gaussian_splatting`.
//!
//! Scales are linear since the extension's draft of April 2026; earlier files hold logarithms.
//! A negative value or a signed integer type gives the latter away. Colors of the linear color
//! space are carried over to the display's: the constant harmonic exactly, the higher ones to
//! first order around it.

mod container;
mod primitive;

use std::path::Path;

pub(crate) use container::is_gltf;

use super::gltf_mesh::resource::split_container;
use super::{IoError, files};
use crate::math::sh::coefficients;
use crate::scene::GaussianCloud;
use container::Gltf;

/// Name of the extension, and prefix of its attributes.
const EXTENSION: &str = "KHR_gaussian_splatting";
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
    let cloud = joined(parts);
    cloud.validate().map_err(|cause| IoError::Cloud { path: path.into(), cause })?;
    Ok(cloud)
}

/// One cloud of all parts, with the highest degree among them.
fn joined(parts: Vec<GaussianCloud>) -> GaussianCloud {
    let sh_degree = parts.iter().map(|p| p.sh_degree).max().unwrap_or(0);
    let stride = coefficients(sh_degree);
    let mut all = GaussianCloud { sh_degree, ..GaussianCloud::default() };
    for part in parts {
        for sh in part.sh.chunks_exact(part.sh_stride()) {
            all.sh.extend_from_slice(sh);
            all.sh.resize(all.sh.len() + stride - sh.len(), [0.0; 3]);
        }
        all.positions.extend(part.positions);
        all.log_scales.extend(part.log_scales);
        all.quaternions.extend(part.quaternions);
        all.opacity_logits.extend(part.opacity_logits);
    }
    all
}

#[cfg(test)]
mod tests;
