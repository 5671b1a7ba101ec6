//! Gaussians to view before training: the sparse points of the photos.

use glam::DVec3;

use crate::math::sh::SH_C0;
use crate::scene::{Bounds, Dataset, GaussianCloud};

/// Returns the sparse points as opaque round Gaussians of one size, about half the spacing that as many points would
/// have on a surface. `None` without points.
pub(crate) fn sparse_cloud(dataset: &Dataset) -> Option<GaussianCloud> {
    let bounds = Bounds::robust(dataset.points.iter().map(|p| p.position))?;
    let origin = bounds.center();
    let points: Vec<_> = dataset.points.iter().filter(|p| p.position.is_finite()).collect();
    let spacing = bounds.radius() / (points.len() as f64).sqrt();
    let sigma = (0.35 * spacing).max(1e-9).ln() as f32;
    let sh = |rgb: [u8; 3]| rgb.map(|c| ((f64::from(c) / 255.0 - 0.5) / SH_C0) as f32);
    Some(GaussianCloud {
        origin,
        sh: points.iter().map(|p| sh(p.rgb)).collect(),
        ..GaussianCloud::isotropic(
            points.iter().map(|p| DVec3::to_array(&(p.position - origin)).map(|v| v as f32)).collect(),
            sigma,
            3.0,
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SparsePoint;

    #[test]
    fn points_become_a_valid_cloud_of_their_colors() {
        let points = (0..100)
            .map(|i| SparsePoint { position: DVec3::new(1e6 + f64::from(i), 2.0, -3.0), rgb: [255, 0, 128] })
            .collect();
        let cloud = sparse_cloud(&Dataset { points, ..Dataset::default() }).expect("points");
        cloud.validate().expect("valid");
        assert_eq!(cloud.len(), 100);
        assert!((cloud.world_position(7).x - 1_000_007.0).abs() < 1e-3);
        let red = 0.5 + SH_C0 * f64::from(cloud.sh[0][0]);
        assert!((red - 1.0).abs() < 1e-6);
        assert!(sparse_cloud(&Dataset::default()).is_none());
    }
}
