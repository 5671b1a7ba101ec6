//! Small made-up scenes for tests.

use glam::{DMat3, DVec2, DVec3};

use crate::scene::{Camera, GaussianCloud};

/// A wall of flat, opaque Gaussians in the plane of this z, 4 x 4 units around the axis.
pub(crate) fn cloud_of_wall(z: f32) -> GaussianCloud {
    wall_with_hole(z, 0.0)
}

/// The same with a round hole of this radius in its middle.
pub(crate) fn wall_with_hole(z: f32, radius: f32) -> GaussianCloud {
    let mut cloud = GaussianCloud::default();
    for i in -40..=40 {
        for j in -40..=40 {
            let (x, y) = (i as f32 * 0.05, j as f32 * 0.05);
            if radius > 0.0 && (x * x + y * y).sqrt() < radius {
                continue;
            }
            cloud.positions.push([x, y, z]);
            cloud.log_scales.push([0.03_f32.ln(), 0.03_f32.ln(), 0.005_f32.ln()]);
            cloud.quaternions.push([1.0, 0.0, 0.0, 0.0]);
            cloud.opacity_logits.push(3.0);
            cloud.sh.push([0.0; 3]);
        }
    }
    cloud
}

pub(crate) fn joined(a: &GaussianCloud, b: &GaussianCloud) -> GaussianCloud {
    let mut all = a.clone();
    all.positions.extend_from_slice(&b.positions);
    all.log_scales.extend_from_slice(&b.log_scales);
    all.quaternions.extend_from_slice(&b.quaternions);
    all.opacity_logits.extend_from_slice(&b.opacity_logits);
    all.sh.extend_from_slice(&b.sh);
    all
}

/// A camera that looks along +z.
pub(crate) fn camera_at(center: DVec3) -> Camera {
    Camera {
        width_px: 64,
        height_px: 48,
        focal_px: DVec2::splat(50.0),
        principal_px: DVec2::new(32.0, 24.0),
        world_from_camera: DMat3::IDENTITY,
        center,
    }
}

/// Sixteen cameras in a circle.
pub(crate) fn ring_of_cameras() -> Vec<Camera> {
    let place = |i: i32| {
        let angle = f64::from(i) / 16.0 * std::f64::consts::TAU;
        camera_at(DVec3::new(1.3 * angle.cos(), 0.2, 1.3 * angle.sin()))
    };
    (0..16).map(place).collect()
}

/// The same, each turned as far as it is along the circle.
pub(crate) fn turning_ring() -> Vec<Camera> {
    let turned = |(i, c): (i32, Camera)| {
        let angle = f64::from(i) / 16.0 * std::f64::consts::TAU;
        Camera { world_from_camera: DMat3::from_rotation_y(angle), ..c }
    };
    (0..).zip(ring_of_cameras()).map(turned).collect()
}
