//! Sharpness that a scene can show: the samples that its training photos took of what a picture shows. A scene that was
//! trained from afar is blurred from near, and a close-up is compared with it at the size at which both are sharp.

use glam::{DVec2, DVec3};

use crate::math::stats::median;
use crate::scene::Camera;

/// Distance of the places that are looked at, px.
const STEP_PX: usize = 8;

/// Samples along the longer side of a picture that the nearest of `views` had of what is there; `depth` is that of the
/// picture's pixels, 0 where nothing is. `None` if no view saw any of it.
pub(super) fn samples_across(camera: &Camera, depth: &[f32], views: &[&Camera]) -> Option<f64> {
    let width = camera.width_px as usize;
    let ratio = |i: usize| {
        let z = f64::from(depth[i]);
        let at = DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        let point = camera.center + camera.ray(at) * z;
        let most = views.iter().filter_map(|view| px_per_unit(view, point)).fold(0.0, f64::max);
        (most > 0.0).then(|| most / (camera.focal_px.x / z))
    };
    let places = (0..depth.len()).filter(|i| (i % width) % STEP_PX == 0 && (i / width) % STEP_PX == 0);
    let ratios: Vec<f64> = places.filter(|&i| depth[i] > 0.0).filter_map(ratio).collect();
    (!ratios.is_empty()).then(|| median(&ratios) * f64::from(camera.width_px.max(camera.height_px)))
}

/// Pixels that a camera has for a length of one at a point in its picture.
fn px_per_unit(camera: &Camera, point: DVec3) -> Option<f64> {
    let at = camera.project(point)?;
    let size = DVec2::new(f64::from(camera.width_px), f64::from(camera.height_px));
    (at.cmpge(DVec2::ZERO).all() && at.cmplt(size).all()).then(|| camera.focal_px.x / camera.camera_from_world(point).z)
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;

    fn at(distance: f64, width_px: u32) -> Camera {
        Camera::look_at(DVec3::new(0.0, -distance, 0.0), DVec3::ZERO, DVec3::Z, 0.8, width_px, width_px * 3 / 4)
            .expect("valid")
    }

    #[test]
    fn the_nearest_view_counts_and_those_that_look_elsewhere_do_not() {
        let (close, far, farther) = (at(1.0, 400), at(4.0, 240), at(8.0, 240));
        let depth = vec![1.0; 400 * 300];
        let samples = samples_across(&close, &depth, &[&farther, &far]).expect("seen");
        assert!((samples - 60.0).abs() < 1e-6, "a quarter of 240 px: {samples}");
        let mut away = at(0.5, 4000);
        away.world_from_camera *= DMat3::from_rotation_y(std::f64::consts::PI);
        assert_eq!(samples_across(&close, &depth, &[&far, &away]), Some(samples));
        assert_eq!(samples_across(&close, &depth, &[&away]), None);
        assert_eq!(samples_across(&close, &vec![0.0; 400 * 300], &[&far]), None);
    }
}
