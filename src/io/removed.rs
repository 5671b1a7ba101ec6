//! Gaussians that were taken out of a scene for good, in the semantic map's file: their places and shapes, without colors.

use std::path::Path;

use glam::DVec3;
use safetensors::tensor::{Dtype, SafeTensors};

use super::IoError;
use crate::scene::GaussianCloud;

/// Names of the tensors: world positions, and logarithms of scales, quaternions and opacity logits.
pub(super) const PLACES: &str = "removed_places";
pub(super) const SHAPES: &str = "removed_shapes";
/// Numbers of a shape.
pub(super) const SHAPE: usize = 8;

/// What is stored of them.
pub(super) fn pack(cloud: &GaussianCloud) -> (Vec<[f64; 3]>, Vec<[f32; SHAPE]>) {
    let places = (0..cloud.len()).map(|i| cloud.world_position(i).to_array()).collect();
    let shape = |i: usize| {
        let ([a, b, c], [w, x, y, z]) = (cloud.log_scales[i], cloud.quaternions[i]);
        [a, b, c, w, x, y, z, cloud.opacity_logits[i]]
    };
    (places, (0..cloud.len()).map(shape).collect())
}

/// Those that such bytes hold; `path` is for errors.
pub(super) fn unpack(bytes: &[u8], path: &Path) -> Result<Option<GaussianCloud>, IoError> {
    let broken = |reason: &str| IoError::syntax(path, format!("tensors '{PLACES}', '{SHAPES}'"), reason);
    let file = SafeTensors::deserialize(bytes).map_err(|e| broken(&e.to_string()))?;
    let (Ok(places), Ok(shapes)) = (file.tensor(PLACES), file.tensor(SHAPES)) else { return Ok(None) };
    let n = places.shape().first().copied().unwrap_or(0);
    let fits = (places.dtype(), places.shape()) == (Dtype::F64, &[n, 3])
        && (shapes.dtype(), shapes.shape()) == (Dtype::F32, &[n, SHAPE]);
    if !fits {
        return Err(broken("another type or shape than [n, 3] f64 and [n, 8] f32"));
    }
    let number = |b: &[u8]| f64::from_le_bytes(std::array::from_fn(|k| b[k]));
    let places: Vec<f64> = places.data().chunks_exact(8).map(number).collect();
    let number = |b: &[u8]| f32::from_le_bytes(std::array::from_fn(|k| b[k]));
    let shapes: Vec<f32> = shapes.data().chunks_exact(4).map(number).collect();
    if !places.iter().all(|v| v.is_finite()) || !shapes.iter().all(|v| v.is_finite()) {
        return Err(broken("a number is not finite"));
    }
    let places: Vec<DVec3> = places.chunks_exact(3).map(DVec3::from_slice).collect();
    let shapes: Vec<&[f32]> = shapes.chunks_exact(SHAPE).collect();
    // What was taken out hangs together, so one of its places is near all others.
    let origin = places.first().copied().unwrap_or_default();
    Ok(Some(GaussianCloud {
        origin,
        positions: places.iter().map(|p| (*p - origin).as_vec3().to_array()).collect(),
        log_scales: shapes.iter().map(|s| [s[0], s[1], s[2]]).collect(),
        quaternions: shapes.iter().map(|s| [s[3], s[4], s[5], s[6]]).collect(),
        opacity_logits: shapes.iter().map(|s| s[7]).collect(),
        sh: vec![[0.0; 3]; places.len()],
        ..GaussianCloud::default()
    }))
}
