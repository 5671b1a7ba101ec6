//! The Gaussians a run starts from.

use glam::{DVec2, DVec3};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use rstar::RTree;

use super::TrainView;
use crate::math::sh::{SH_C0, coefficients};
use crate::scene::{Bounds, Dataset, GaussianCloud, SparsePoint};

/// Opacity of a new Gaussian.
const OPACITY: f64 = 0.1;

/// A cloud at the dataset's sparse points or, where it has fewer than a hundred, at `random`
/// points in front of the cameras, coloured by the photos they were shot from.
pub fn initial_cloud(
    dataset: &Dataset,
    views: &[TrainView],
    degree: u8,
    random: usize,
    rng: &mut Pcg64Mcg,
) -> GaussianCloud {
    let finite: Vec<SparsePoint> = dataset.points.iter().copied().filter(|p| p.position.is_finite()).collect();
    let points = if finite.len() >= 100 { finite } else { random_points(dataset, views, random, rng) };
    from_points(&points, degree)
}

/// One Gaussian per point, as wide as the mean distance to its three nearest neighbours.
pub fn from_points(points: &[SparsePoint], degree: u8) -> GaussianCloud {
    let origin = Bounds::robust(points.iter().map(|p| p.position)).map_or(DVec3::ZERO, |b| b.center());
    let local: Vec<[f64; 3]> = points.iter().map(|p| (p.position - origin).to_array()).collect();
    let tree = RTree::bulk_load(local.clone());
    let spacing: Vec<f64> = local
        .par_iter()
        .map(|p| {
            // The first neighbour is the point itself.
            let near: Vec<f64> =
                tree.nearest_neighbor_iter_with_distance_2(*p).skip(1).take(3).map(|(_, d)| d).collect();
            (near.iter().sum::<f64>() / near.len().max(1) as f64).sqrt()
        })
        .collect();
    // Coincident points get a small size instead of none; lonely ones no more than their share.
    let typical = crate::math::stats::median(&spacing.iter().copied().filter(|s| *s > 0.0).collect::<Vec<_>>());
    let typical = if typical.is_finite() { typical } else { 1.0 };
    let stride = coefficients(degree);
    let mut cloud = GaussianCloud { origin, sh_degree: degree, ..GaussianCloud::default() };
    for ((p, at), s) in points.iter().zip(&local).zip(&spacing) {
        cloud.positions.push(at.map(|v| v as f32));
        cloud.log_scales.push([s.clamp(typical * 1e-3, typical * 30.0).ln() as f32; 3]);
        cloud.quaternions.push([1.0, 0.0, 0.0, 0.0]);
        cloud.opacity_logits.push((OPACITY / (1.0 - OPACITY)).ln() as f32);
        cloud.sh.push(p.rgb.map(|c| ((f64::from(c) / 255.0 - 0.5) / SH_C0) as f32));
        cloud.sh.extend(std::iter::repeat_n([0.0; 3], stride - 1));
    }
    cloud
}

/// Points along random viewing rays of random photos, log-uniform in depth between a quarter and
/// four times the distance to what the photos look at: every one of them is seen by some photo,
/// and the cloud is bounded.
fn random_points(dataset: &Dataset, views: &[TrainView], n: usize, rng: &mut Pcg64Mcg) -> Vec<SparsePoint> {
    let focus = dataset.focus();
    (0..n)
        .filter_map(|_| {
            let view = views.get(rng.random_range(0..views.len().max(1)))?;
            let (x, y) = (rng.random_range(0..view.pixels.width_px), rng.random_range(0..view.pixels.height_px));
            let rgb = *view.pixels.rgb.get((y * view.pixels.width_px + x) as usize)?;
            let distance = view.camera.center.distance(focus).max(1e-9);
            let depth = distance * 4.0_f64.powf(rng.random_range(-1.0..1.0));
            let ray = view.camera.ray(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
            Some(SparsePoint { position: view.camera.center + ray * depth, rgb })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_follow_the_spacing() {
        let points: Vec<SparsePoint> = (0..1000)
            .map(|i| SparsePoint {
                position: DVec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)) * 0.5,
                rgb: [255, 0, 128],
            })
            .collect();
        let cloud = from_points(&points, 2);
        cloud.validate().expect("valid");
        for s in &cloud.log_scales {
            assert!((s[0].exp() - 0.5).abs() < 1e-4);
        }
        let red = 0.5 + SH_C0 * f64::from(cloud.sh[0][0]);
        assert!((red - 1.0).abs() < 1e-6);
    }

    #[test]
    fn coincident_and_lonely_points_are_defined() {
        let p = SparsePoint { position: DVec3::ONE, rgb: [9; 3] };
        from_points(&[p; 50], 0).validate().expect("valid");
        from_points(&[p], 0).validate().expect("valid");
        assert!(from_points(&[], 0).is_empty());
    }
}
