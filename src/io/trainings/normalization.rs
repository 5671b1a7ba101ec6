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

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::scene::{Camera, Photo, SparsePoint};

    /// Rows of the matrix that the formulas of gsplat give for [`made_up`], computed with NumPy.
    const REFERENCE: [[f64; 4]; 3] = [
        [-2.26198407e-01, -7.23824680e-04, 5.75150388e-04, 1.59478391e-03],
        [7.23798032e-04, -2.26199138e-01, -1.14001680e-05, 8.15222642e-03],
        [5.75183923e-04, -9.55970068e-06, 2.26199565e-01, -6.13095453e-02],
    ];

    fn made_up() -> Dataset {
        let camera = |i: usize| {
            let k = i as f64;
            let (sin, cos) = (k * 0.7).sin_cos();
            let eye = DVec3::new(4.0 * cos + 0.5, 3.5 * sin - 0.2, 1.0 + 0.3 * k);
            let at = DVec3::new(0.3 * k.sin(), 0.2, 0.01 * k);
            Camera::look_at(eye, at, DVec3::new(0.1, 0.05, 1.0), 0.8, 64, 48).expect("valid")
        };
        let photo = |i| Photo::new(format!("{i}.png"), PathBuf::new(), camera(i));
        let position = |i: usize| {
            let k = i as f64;
            let height = ((i * 37) % 101) as f64 / 101.0;
            DVec3::new(
                2.5 * (k * 1.7).sin() + 0.4 * (k * 0.31).cos(),
                1.4 * (k * 0.9 + 1.0).sin() + 0.2 * (k * 0.11).sin(),
                0.9 * height * height,
            )
        };
        let points = (0..600).map(|i| SparsePoint { position: position(i), rgb: [128; 3] }).collect();
        Dataset { photos: (0..9).map(photo).collect(), points, ..Dataset::default() }
    }

    fn trained(p: DVec3) -> DVec3 {
        DVec3::from_array(REFERENCE.map(|r| r[0] * p.x + r[1] * p.y + r[2] * p.z + r[3]))
    }

    fn cloud(dataset: &Dataset, at: impl Fn(DVec3) -> DVec3) -> GaussianCloud {
        let positions = dataset.points.iter().map(|p| at(p.position).as_vec3().to_array()).collect();
        GaussianCloud::isotropic(positions, -4.0, 0.0)
    }

    #[test]
    fn the_normalization_is_that_of_gsplat_with_any_signs_of_its_axes() {
        let dataset = made_up();
        for signs in [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]].map(DVec3::from_array) {
            let found = found(&dataset, &cloud(&dataset, |p| signs * trained(p))).expect("fits");
            for p in dataset.points.iter().step_by(50).map(|p| p.position) {
                assert!((found.of(p) - signs * trained(p)).length() < 1e-7, "{signs}: {p}");
            }
        }
    }

    #[test]
    fn gaussians_of_other_photos_do_not_fit() {
        let dataset = made_up();
        assert_eq!(found(&dataset, &cloud(&dataset, |p| p)), None, "not normalized");
        assert_eq!(found(&dataset, &cloud(&dataset, |p| trained(p) + DVec3::splat(0.7))), None, "elsewhere");
        assert_eq!(found(&dataset, &GaussianCloud::default()), None, "nothing");
        let without = Dataset { points: Vec::new(), ..dataset.clone() };
        assert_eq!(found(&without, &cloud(&dataset, trained)), None, "without sparse points");
        assert_eq!(found(&Dataset::default(), &cloud(&dataset, trained)), None, "without photos");
    }
}
