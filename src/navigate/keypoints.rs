//! Keypoints, the places that a camera may take: those of the photos' cameras, and six more around each, half of the
//! cameras' spacing away (the paper's dilation).

use glam::{DMat3, DVec3};
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::is_place;
use super::occupancy::OccupancyGrid;
use crate::scene::Camera;

/// A place that a camera may take.
#[derive(Clone, Debug, PartialEq)]
pub struct Keypoint {
    /// Center in the world.
    pub center: DVec3,
    /// Rotation of the camera that it comes from: columns are right, down and forward.
    pub(crate) world_from_camera: DMat3,
    /// Index of that camera.
    pub(crate) camera: usize,
    /// True if it is the camera's own center.
    pub(crate) original: bool,
    /// Distance to occupied space, scene units.
    pub(crate) clearance: f64,
}

/// The mean distance from a camera to the nearest one elsewhere, scene units; 0 for fewer than two
/// places.
///
/// Photos need not be in the order of a walk, so the nearest camera counts, not the next.
pub fn spacing(cameras: &[Camera]) -> f64 {
    let places = distinct(cameras);
    let tree = RTree::bulk_load(places.iter().map(|p| p.to_array()).collect());
    let nearest = |p: &DVec3| {
        let mut near = tree.nearest_neighbor_iter(p.to_array()).skip(1);
        near.next().map(|q| DVec3::from_array(*q).distance(*p))
    };
    let all: Vec<f64> = places.iter().filter_map(nearest).collect();
    if all.is_empty() { 0.0 } else { all.iter().sum::<f64>() / all.len() as f64 }
}

/// The cameras' places, each once.
fn distinct(cameras: &[Camera]) -> Vec<DVec3> {
    let mut places: Vec<DVec3> = cameras.iter().map(|c| c.center).filter(|c| is_place(*c)).collect();
    places.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    places.dedup();
    places
}

/// The places of `cameras`, dilated by six neighbors along each camera's own axes, less those with
/// less than `clearance` to occupied space; and how many those are.
pub(crate) fn keypoints(cameras: &[Camera], occupancy: &OccupancyGrid, clearance: f64) -> (Vec<Keypoint>, usize) {
    let half = 0.5 * spacing(cameras);
    let mut all = Vec::with_capacity(7 * cameras.len());
    for (camera, c) in cameras.iter().enumerate().filter(|(_, c)| is_place(c.center)) {
        let axes = [c.world_from_camera.x_axis, c.world_from_camera.y_axis, c.world_from_camera.z_axis];
        let around = axes.into_iter().flat_map(|axis| [axis * half, axis * -half]);
        let offsets = std::iter::once(DVec3::ZERO).chain(around.filter(|_| half > 0.0));
        all.extend(offsets.map(|offset| {
            let center = c.center + offset;
            Keypoint {
                center,
                world_from_camera: c.world_from_camera,
                camera,
                original: offset == DVec3::ZERO,
                clearance: occupancy.clearance(center),
            }
        }));
    }
    let before = all.len();
    all.retain(|k| k.clearance >= clearance);
    let left_out = before - all.len();
    (all, left_out)
}

/// The keypoints' places, to find those that are near.
pub(crate) type Places = RTree<GeomWithData<[f64; 3], usize>>;

/// An index of the keypoints by place.
pub(crate) fn places(keypoints: &[Keypoint]) -> Places {
    let all = keypoints.iter().enumerate().map(|(i, k)| GeomWithData::new(k.center.to_array(), i));
    RTree::bulk_load(all.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigate::testing::{camera_at, cloud_of_wall};

    #[test]
    fn six_neighbors_half_the_spacing_away() {
        let cameras: Vec<Camera> = (0..4).map(|i| camera_at(DVec3::new(0.4 * f64::from(i), 0.0, 1.5))).collect();
        assert!((spacing(&cameras) - 0.4).abs() < 1e-12);
        let eyes: Vec<DVec3> = cameras.iter().map(|c| c.center).collect();
        let occupancy = OccupancyGrid::of(&cloud_of_wall(0.0), &eyes, 0.1);
        let (all, left_out) = keypoints(&cameras, &occupancy, 0.05);
        assert_eq!((all.len(), left_out), (28, 0));
        assert_eq!(all.iter().filter(|k| k.original).count(), 4);
        for k in all.iter().filter(|k| !k.original) {
            assert!((k.center.distance(cameras[k.camera].center) - 0.2).abs() < 1e-12);
        }
    }

    #[test]
    fn keypoints_inside_matter_are_rejected() {
        // The neighbors of the second camera toward the wall would stand in it.
        let cameras = [camera_at(DVec3::new(0.0, 0.0, 0.9)), camera_at(DVec3::new(0.0, 0.0, 0.3))];
        let eyes: Vec<DVec3> = cameras.iter().map(|c| c.center).collect();
        let occupancy = OccupancyGrid::of(&cloud_of_wall(0.0), &eyes, 0.05);
        let (all, left_out) = keypoints(&cameras, &occupancy, 0.1);
        assert_eq!((all.len(), left_out), (13, 1));
        assert!(all.iter().all(|k| k.center.z > 0.1), "the one in the wall is gone");
    }

    #[test]
    fn coincident_and_single_cameras_are_no_trouble() {
        let one = camera_at(DVec3::new(0.0, 0.0, 1.0));
        assert_eq!(spacing(&[one.clone(), one.clone()]), 0.0);
        assert_eq!(spacing(&[]), 0.0);
        let occupancy = OccupancyGrid::of(&cloud_of_wall(0.0), &[one.center], 0.1);
        assert_eq!(keypoints(&[one.clone(), one], &occupancy, 0.1).0.len(), 2);
    }
}
