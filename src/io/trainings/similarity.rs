//! Similarity transforms: the axes and the unit in which another program trained.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::scene::GaussianCloud;

/// Map `trained = scale * (rotation * world + shift)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Similarity {
    pub(super) scale: f64,
    pub(super) rotation: DMat3,
    pub(super) shift: DVec3,
}

impl Similarity {
    pub(super) const NONE: Self = Self { scale: 1.0, rotation: DMat3::IDENTITY, shift: DVec3::ZERO };

    pub(super) fn of(&self, world: DVec3) -> DVec3 {
        self.scale * (self.rotation * world + self.shift)
    }

    /// The Gaussians in the world, from those trained.
    pub(super) fn undone(&self, cloud: GaussianCloud) -> GaussianCloud {
        if *self == Self::NONE {
            return cloud;
        }
        let back = self.rotation.transpose();
        let unit = |p: [f32; 3]| p.map(|v| (f64::from(v) / self.scale) as f32);
        let log = self.scale.ln();
        let mut cloud = cloud;
        cloud.positions.par_iter_mut().for_each(|p| *p = unit(*p));
        cloud.log_scales.par_iter_mut().for_each(|s| *s = s.map(|v| (f64::from(v) - log) as f32));
        cloud.origin = cloud.origin / self.scale - self.shift;
        cloud.turned(&back, false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation::unit_quaternion;
    use crate::scene::Camera;

    #[test]
    fn gaussians_fit_the_photos_again_with_center_size_and_direction() {
        let rotation = DMat3::from_rotation_z(0.4) * DMat3::from_rotation_x(-1.1);
        let trained = Similarity { scale: 0.37, rotation, shift: DVec3::new(2.0, -30.0, 4.0) };
        let world = DVec3::new(5.0, 1.0, -2.0);
        // A camera of the world, and the same one as the training had it.
        let camera = Camera::look_at(DVec3::new(9.0, 2.0, 1.0), DVec3::new(4.0, 1.2, -1.5), DVec3::Z, 0.8, 64, 48);
        let camera = camera.expect("valid");
        let theirs = Camera {
            world_from_camera: rotation * camera.world_from_camera,
            center: trained.of(camera.center),
            ..camera.clone()
        };
        let mut cloud = GaussianCloud::isotropic(vec![trained.of(world).as_vec3().to_array()], -3.0, 0.5);
        cloud.log_scales[0] = [-3.0, -4.0, -2.0];
        let back = trained.undone(cloud.clone());
        let seen = camera.project(back.world_position(0)).expect("in front");
        assert!((seen - theirs.project(trained.of(world)).expect("in front")).length() < 1e-4, "{seen}");
        assert!((back.world_position(0) - world).length() < 1e-5);
        let bigger = back.log_scales[0][2] - cloud.log_scales[0][2];
        assert!((f64::from(bigger) + 0.37_f64.ln()).abs() < 1e-6);
        // Their longest axis, in the world.
        let axis = |c: &GaussianCloud| {
            let [w, x, y, z] = unit_quaternion(c.quaternions[0].map(f64::from)).expect("unit");
            glam::DQuat::from_xyzw(x, y, z, w) * DVec3::Z
        };
        assert!((rotation * axis(&back) - axis(&cloud)).length() < 1e-6);
        assert!((axis(&back) - axis(&cloud)).length() > 0.1, "the control");
        let turned = Similarity { rotation: rotation.transpose(), ..trained }.undone(cloud.clone());
        assert!((turned.world_position(0) - world).length() > 0.1, "a transposed rotation is another one");
        assert_eq!(Similarity::NONE.undone(cloud.clone()), cloud);
    }
}
