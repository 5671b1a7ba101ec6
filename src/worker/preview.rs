//! Something to look at before training: the sparse points as small Gaussians.

use glam::DVec3;

use super::protocol::HomeView;
use crate::math::sh::SH_C0;
use crate::math::stats::median;
use crate::scene::{Bounds, Dataset, GaussianCloud};

/// The sparse points as opaque round Gaussians of one size, about half the spacing that as many
/// points would have on a surface. `None` without points.
pub fn sparse_cloud(dataset: &Dataset) -> Option<GaussianCloud> {
    let bounds = Bounds::robust(dataset.points.iter().map(|p| p.position))?;
    let origin = bounds.center();
    let points: Vec<_> = dataset.points.iter().filter(|p| p.position.is_finite()).collect();
    let spacing = bounds.radius() / (points.len() as f64).sqrt();
    let sigma = (0.35 * spacing).max(1e-9).ln() as f32;
    let n = points.len();
    let sh = |rgb: [u8; 3]| rgb.map(|c| ((f64::from(c) / 255.0 - 0.5) / SH_C0) as f32);
    Some(GaussianCloud {
        origin,
        positions: points.iter().map(|p| DVec3::to_array(&(p.position - origin)).map(|v| v as f32)).collect(),
        log_scales: vec![[sigma; 3]; n],
        quaternions: vec![[1.0, 0.0, 0.0, 0.0]; n],
        opacity_logits: vec![3.0; n],
        sh_degree: 0,
        sh: points.iter().map(|p| sh(p.rgb)).collect(),
        extras: Vec::new(),
    })
}

/// How to look at a scene at first. Photos say where it is: around the point that they look at. A
/// bare splat is framed as a whole, with `-y` upwards as in the files that 3DGS writes.
pub fn home_view(dataset: Option<&Dataset>, cloud: Option<&GaussianCloud>) -> HomeView {
    if let Some(d) = dataset.filter(|d| !d.photos.is_empty()) {
        let focus = d.focus();
        let distances: Vec<f64> = d.photos.iter().map(|p| p.camera.center.distance(focus)).collect();
        // Photos of an object are taken from about twice its radius.
        let half = DVec3::splat((0.5 * median(&distances)).max(1e-6) / 3.0_f64.sqrt());
        let camera = d.photos.first().map(|p| p.camera.clone());
        return HomeView {
            bounds: Bounds { min: focus - half, max: focus + half },
            up: d.up().normalize_or(DVec3::Z),
            camera,
        };
    }
    let whole = cloud.and_then(|c| Bounds::robust((0..c.len()).map(|i| c.world_position(i))));
    HomeView { up: DVec3::NEG_Y, bounds: whole.unwrap_or(HomeView::default().bounds), camera: None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SparsePoint;

    #[test]
    fn points_become_a_valid_cloud_of_their_colours() {
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

    #[test]
    fn the_first_view_of_a_bare_splat_frames_it() {
        let cloud = GaussianCloud {
            origin: DVec3::new(10.0, 0.0, 0.0),
            positions: (0..100).map(|i| [i as f32 / 100.0; 3]).collect(),
            ..GaussianCloud::default()
        };
        let view = home_view(None, Some(&cloud));
        assert!((view.bounds.center() - DVec3::new(10.5, 0.5, 0.5)).length() < 0.05);
        assert_eq!(view.up, DVec3::NEG_Y);
        assert_eq!(home_view(None, None).bounds, HomeView::default().bounds);
    }
}
