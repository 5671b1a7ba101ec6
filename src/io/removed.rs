//! Gaussians removed from a scene for good, in the semantic map's file: positions and shapes, without colors.

use std::path::Path;

use glam::DVec3;
use safetensors::tensor::{Dtype, SafeTensors};

use super::IoError;
use crate::scene::GaussianCloud;

/// Names of the tensors: world positions, and logarithms of scales, quaternions and opacity logits.
pub(super) const PLACES: &str = "removed_places";
pub(super) const SHAPES: &str = "removed_shapes";
/// Numbers per shape.
pub(super) const SHAPE: usize = 8;

/// Returns positions and shapes as they are stored.
pub(super) fn pack(cloud: &GaussianCloud) -> (Vec<[f64; 3]>, Vec<[f32; SHAPE]>) {
    let places = (0..cloud.len()).map(|i| cloud.world_position(i).to_array()).collect();
    let shape = |i: usize| {
        let ([a, b, c], [w, x, y, z]) = (cloud.log_scales[i], cloud.quaternions[i]);
        [a, b, c, w, x, y, z, cloud.opacity_logits[i]]
    };
    (places, (0..cloud.len()).map(shape).collect())
}

/// Reads the removed Gaussians from a map's file; `path` is for errors.
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
    // Removed Gaussians lie close together, so any of their positions is near all others.
    let origin = places.first().copied().unwrap_or_default();
    if !places.iter().all(|p| (*p - origin).as_vec3().is_finite()) {
        return Err(broken("its places are too far apart"));
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::semantic_map;
    use crate::scene::{Identities, SemanticMap};

    #[test]
    fn what_was_taken_out_is_stored_with_the_map() {
        let gone = |x: f64| GaussianCloud {
            origin: DVec3::new(500_000.0, x, 0.0),
            ..GaussianCloud::isotropic(vec![[0.25, 0.0, 0.0], [0.0, 0.5, 0.0]], -2.0, 1.5)
        };
        let path = Path::new("map");
        let mut map = SemanticMap::from_identities(Identities::default(), Vec::new(), Vec::new(), Vec::new());
        let bytes = semantic_map::encode(&map, None, path).expect("encoded");
        assert_eq!(unpack(&bytes, path).expect("readable"), None, "nothing was taken out");
        map.add_removed(gone(0.0));
        map.add_removed(gone(7.0));
        let bytes = semantic_map::encode(&map, None, path).expect("encoded");
        let read = unpack(&bytes, path).expect("readable").expect("both");
        let places = |cloud: &GaussianCloud| (0..cloud.len()).map(|i| cloud.world_position(i)).collect::<Vec<_>>();
        let all = map.removed.expect("both");
        assert_eq!((places(&read), read.len()), (places(&all), 4));
        assert_eq!((&read.log_scales, &read.quaternions, &read.opacity_logits), {
            (&all.log_scales, &all.quaternions, &all.opacity_logits)
        });
    }
}
