//! Freedom of poses that photos cannot see: a move, turn and change of size of all cameras and the scene together.

use glam::{DMat3, DVec3};

use super::pose_offset::{MOVE_DEVIATION, PoseOffset, TURN_DEVIATION};
use crate::scene::Camera;

/// Similarities of a set of cameras, for small changes.
#[derive(Debug)]
pub(super) struct PoseGauge {
    /// Rotations of the cameras, and places relative to their mean, scene units.
    cameras: Vec<(DMat3, DVec3)>,
    /// Inverse of the curvature by a common turn.
    turn: DMat3,
    /// Sum of squared distances from the mean.
    spread: f64,
    /// Weights of moves and turns: inverse squares of their deviations.
    weights: [f64; 2],
}

impl PoseGauge {
    /// Similarities of cameras in a scene of this radius; `None` for cameras at one place.
    pub(super) fn new(cameras: &[Camera], extent: f64) -> Option<Self> {
        let n = cameras.len() as f64;
        let mean = cameras.iter().map(|c| c.center).sum::<DVec3>() / n.max(1.0);
        let cameras: Vec<(DMat3, DVec3)> = cameras.iter().map(|c| (c.world_from_camera, c.center - mean)).collect();
        let spread: f64 = cameras.iter().map(|(_, p)| p.length_squared()).sum();
        let weights = [MOVE_DEVIATION * extent, TURN_DEVIATION].map(|d| 1.0 / (d * d));
        let across = |p: &DVec3| {
            let column = |axis: DVec3| p.length_squared() * axis - *p * p.dot(axis);
            DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z)) * weights[0]
        };
        let normal = cameras
            .iter()
            .map(|(_, p)| across(p))
            .fold(DMat3::from_diagonal(DVec3::splat(n * weights[1])), |sum, m| sum + m);
        let turn = normal.inverse();
        (spread > 0.0 && turn.is_finite()).then_some(Self { cameras, turn, spread, weights })
    }

    /// Takes the similarity that fits the changes best out of them.
    pub(super) fn remove(&self, offsets: &mut [PoseOffset]) {
        let n = self.cameras.len() as f64;
        let world = |(rotation, p): &(DMat3, DVec3), o: &PoseOffset| (*p, *rotation * o.along, *rotation * o.turn);
        let (mut shift, mut growth, mut torque) = (DVec3::ZERO, 0.0, DVec3::ZERO);
        for (camera, offset) in self.cameras.iter().zip(&*offsets) {
            let (p, along, turn) = world(camera, offset);
            shift += along / n;
            growth += p.dot(along) / self.spread;
            torque += self.weights[0] * p.cross(along) + self.weights[1] * turn;
        }
        let turn = self.turn * torque;
        for ((rotation, p), offset) in self.cameras.iter().zip(offsets) {
            let to_camera = rotation.transpose();
            offset.along -= to_camera * (shift + turn.cross(*p) + growth * *p);
            offset.turn -= to_camera * turn;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cameras() -> Vec<Camera> {
        let eye = |k: usize| DVec3::new((k as f64).cos(), (k as f64).sin(), 0.2 * k as f64) * 2.0 + DVec3::X;
        (0..6).map(|k| Camera::look_at(eye(k), DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid")).collect()
    }

    #[test]
    fn a_similarity_is_taken_out_and_the_rest_stays() {
        let cameras = cameras();
        let gauge = PoseGauge::new(&cameras, 2.0).expect("apart");
        let mean = cameras.iter().map(|c| c.center).sum::<DVec3>() / 6.0;
        let (shift, turn, growth) = (DVec3::new(0.01, -0.02, 0.03), DVec3::new(0.002, 0.001, -0.003), 0.01);
        let of = |c: &Camera| {
            let (p, back) = (c.center - mean, c.world_from_camera.transpose());
            PoseOffset { along: back * (shift + turn.cross(p) + growth * p), turn: back * turn }
        };
        let mut common: Vec<PoseOffset> = cameras.iter().map(of).collect();
        gauge.remove(&mut common);
        assert!(common.iter().all(|o| o.along.length() < 1e-12 && o.turn.length() < 1e-12), "{common:?}");
        // The control: what one camera alone does stays for the most part, and removing again changes nothing.
        let mut alone = vec![PoseOffset::default(); 6];
        alone[2].along = DVec3::new(0.02, 0.01, 0.0);
        gauge.remove(&mut alone);
        assert!(alone[2].along.length() > 0.01);
        let once = alone.clone();
        gauge.remove(&mut alone);
        assert!(once.iter().zip(&alone).all(|(a, b)| a.along.distance(b.along) < 1e-12));
    }

    #[test]
    fn cameras_at_one_place_have_none() {
        assert!(PoseGauge::new(&[0; 3].map(|_| cameras()[0].clone()), 1.0).is_none());
    }
}
