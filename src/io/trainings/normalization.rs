//! gsplat's normalization of the world, found again from the photos: it is stored nowhere.
//!
//! gsplat turns the mean up direction of the cameras to one axis, moves the median of what they look at to zero, scales
//! by the median distance of the cameras, and then turns the principal axes of the sparse points to those of the world.
//! The signs of principal axes are arbitrary, so that the one is taken which the Gaussians lie at.

use std::collections::HashSet;

use glam::{DMat3, DQuat, DVec3, IVec3};

use super::similarity::Similarity;
use crate::math::eigen;
use crate::scene::{Bounds, Dataset, GaussianCloud};

/// Cells of the comparison along the diagonal of the sparse points.
const CELLS: f64 = 96.0;
/// Most sparse points that are compared.
const MOST_POINTS: usize = 20_000;
/// Share of sparse points at which there must be Gaussians.
const LEAST: f64 = 0.3;

/// Returns the map from the photos' world to that of the Gaussians; `None` if it does not fit them.
pub(super) fn found(dataset: &Dataset, cloud: &GaussianCloud) -> Option<Similarity> {
    let points: Vec<DVec3> = dataset.points.iter().map(|p| p.position).collect();
    let axes = of(dataset, &points)?;
    let turns = [DVec3::ONE, DVec3::new(1.0, -1.0, -1.0), DVec3::new(-1.0, 1.0, -1.0), DVec3::new(-1.0, -1.0, 1.0)];
    let size = Bounds::robust(points.iter().map(|p| axes.of(*p)))?.size().length() / CELLS;
    if !(size > 0.0 && size.is_finite()) {
        return None;
    }
    let cell = |p: DVec3| (p / size).floor().as_ivec3();
    let filled: HashSet<IVec3> = (0..cloud.len()).map(|i| cell(cloud.world_position(i))).collect();
    let every = points.len().div_ceil(MOST_POINTS).max(1);
    let compared: Vec<DVec3> = points.iter().step_by(every).copied().collect();
    let share = |trained: &Similarity| {
        let hits = compared.iter().filter(|p| filled.contains(&cell(trained.of(**p)))).count();
        hits as f64 / compared.len() as f64
    };
    let turned = turns.map(|signs| {
        let turn = DMat3::from_diagonal(signs);
        Similarity { rotation: turn * axes.rotation, shift: turn * axes.shift, ..axes }
    });
    let best = turned.into_iter().map(|t| (share(&t), t)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 >= LEAST).then_some(best.1)
}

/// Computes the normalization up to the signs of the axes.
fn of(dataset: &Dataset, points: &[DVec3]) -> Option<Similarity> {
    let cameras = || dataset.photos.iter().map(|p| &p.camera);
    let up: DVec3 = cameras().map(|c| -c.world_from_camera.y_axis).sum();
    let turn = to_minus_y(up.try_normalize()?);
    let centers: Vec<DVec3> = cameras().map(|c| turn * c.center).collect();
    let nearest = cameras().zip(&centers).map(|(c, center)| {
        let forward = turn * c.forward();
        *center + forward.dot(-*center) * forward
    });
    let middle = median(nearest.collect())?;
    let distances = centers.iter().map(|c| DVec3::splat(c.distance(middle))).collect();
    let scale = 1.0 / median(distances)?.x;
    if !scale.is_finite() {
        return None;
    }
    let first = Similarity { scale, rotation: turn, shift: -middle };
    let placed: Vec<DVec3> = points.iter().map(|p| first.of(*p)).collect();
    let center = median(placed.clone())?;
    let mean = placed.iter().sum::<DVec3>() / placed.len() as f64;
    let mut covariance = DMat3::ZERO;
    for p in &placed {
        let d = *p - mean;
        covariance += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    }
    let (_, axes) = eigen::axes(&(covariance * (1.0 / placed.len() as f64)));
    let turn = axes.transpose();
    Some(Similarity { scale, rotation: turn * first.rotation, shift: turn * (first.shift - center / scale) })
}

/// Rotation of a direction to -y on the shortest way.
fn to_minus_y(up: DVec3) -> DMat3 {
    DMat3::from_quat(DQuat::from_rotation_arc(up, DVec3::NEG_Y))
}

/// Median of each coordinate.
fn median(points: Vec<DVec3>) -> Option<DVec3> {
    if points.is_empty() {
        return None;
    }
    let of = |axis: usize| {
        let mut values: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        values.sort_unstable_by(f64::total_cmp);
        let n = values.len();
        0.5 * (values[(n - 1) / 2] + values[n / 2])
    };
    Some(DVec3::new(of(0), of(1), of(2)))
}
