//! Photos at the poses that training refined: what is lifted from photos to the scene has to use these.

use crate::io::trained::SceneInfo;
use crate::scene::Photo;

/// Gives photos the poses of the scene's cameras, where its training refined them.
pub(crate) fn at_refined_poses(photos: &mut [Photo], info: &SceneInfo) {
    for fit in info.photo_fits.iter().filter(|fit| fit.moved.is_some()) {
        let own = info.cameras.iter().find(|c| c.name == fit.name);
        let photo = photos.iter_mut().find(|p| p.name == fit.name);
        if let (Some(own), Some(photo)) = (own, photo) {
            photo.camera.set_pose(&own.camera);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::io::trained::SceneCamera;
    use crate::scene::{Camera, PhotoFit};

    #[test]
    fn only_refined_poses_are_taken() {
        let camera = |x: f64| Camera::look_at(DVec3::new(x, -3.0, 1.0), DVec3::ZERO, DVec3::Z, 0.8, 64, 48);
        let camera = |x: f64| camera(x).expect("valid");
        let fit = |name: &str, moved| PhotoFit { name: name.into(), moved, exposure: None };
        let info = SceneInfo {
            cameras: ["a", "b"].map(|n| SceneCamera { name: n.into(), camera: camera(0.1), held_out: false }).into(),
            photo_fits: vec![fit("a", Some([1.0, 0.1])), fit("b", None), fit("gone", Some([1.0, 0.1]))],
            ..SceneInfo::default()
        };
        let mut photos = ["a", "b", "c"].map(|n| Photo::new(n, n, camera(0.0)));
        at_refined_poses(&mut photos, &info);
        assert_eq!(photos.map(|p| p.camera), [camera(0.1), camera(0.0), camera(0.0)]);
    }
}
