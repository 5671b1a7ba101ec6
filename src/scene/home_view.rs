//! Initial view of a scene, the same for the window, the command line and every other output.

use glam::{DMat3, DVec3};

use super::{Bounds, Camera, GaussianCloud};
use crate::math::stats::median;

/// Vertical field of view of a scene that is framed as a whole, in radians.
const FOV_Y_RAD: f64 = 0.85;
/// Tangent of the elevation angle of such a view.
const ABOVE: f64 = 0.45;
/// Factor on the distance for room around the scene.
const MARGIN: f64 = 1.15;

/// Initial view of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct HomeView {
    /// The part of the world that the scene fills.
    pub bounds: Bounds,
    /// World up direction, unit length.
    pub up: DVec3,
    /// A camera to start from, where the scene has one.
    pub(crate) camera: Option<Camera>,
}

/// Gaussians that a view is framed by at most.
const FRAMED: usize = 200_000;

impl Default for HomeView {
    fn default() -> Self {
        Self { bounds: Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE }, up: DVec3::Z, camera: None }
    }
}

impl HomeView {
    /// Initial view of a scene with these cameras and Gaussians. With cameras: around the point that they look at, seen
    /// from the first one. A bare splat is framed as a whole, with `-y` up as in the files that 3DGS writes, or as its
    /// file states.
    pub(crate) fn new(cameras: &[Camera], cloud: Option<&GaussianCloud>) -> Self {
        // A sample of millions gives the same bounds sooner.
        let whole = || {
            let some = |c: &GaussianCloud| c.len().div_ceil(FRAMED).max(1);
            cloud.and_then(|c| Bounds::robust((0..c.len()).step_by(some(c)).map(|i| c.world_position(i))))
        };
        let Some(first) = cameras.first() else {
            let up = cloud.and_then(|c| c.up).unwrap_or(DVec3::NEG_Y);
            return Self { up, bounds: whole().unwrap_or(Self::default().bounds), camera: None };
        };
        let focus = Camera::focus_of(cameras.iter())
            .or_else(|| Some(whole()?.center()))
            .unwrap_or_else(|| first.center + first.forward());
        let distances: Vec<f64> = cameras.iter().map(|c| c.center.distance(focus)).collect();
        // Photos of an object are taken from about twice its radius.
        let half = DVec3::splat((0.5 * median(&distances)).max(1e-6) / 3.0_f64.sqrt());
        Self {
            bounds: Bounds { min: focus - half, max: focus + half },
            up: Camera::up_of(cameras.iter()).unwrap_or(DVec3::Z),
            camera: Some(first.clone()),
        }
    }

    /// The camera of this view; pictures from where there is no photo have `size_px`.
    pub fn camera(&self, size_px: [u32; 2]) -> Camera {
        self.camera.clone().unwrap_or_else(|| Self::overview(&self.bounds, self.up, size_px))
    }

    /// `count` cameras that show all of its bounds from all sides, the first as [`Self::overview`] does.
    pub(crate) fn around(&self, size_px: [u32; 2], count: usize) -> Vec<Camera> {
        let (first, middle) = (Self::overview(&self.bounds, self.up, size_px), self.bounds.center());
        let turned = |k: usize| {
            let turn = DMat3::from_axis_angle(self.up, std::f64::consts::TAU * k as f64 / count as f64);
            let center = middle + turn * (first.center - middle);
            Camera { center, world_from_camera: turn * first.world_from_camera, ..first.clone() }
        };
        (0..count).map(turned).collect()
    }

    /// A camera that shows all of `bounds` from obliquely above, from where a splat's front usually is: x
    /// right, z away.
    pub(crate) fn overview(bounds: &Bounds, up: DVec3, [width_px, height_px]: [u32; 2]) -> Camera {
        // Where z or y is upwards, as files say that are not 3DGS's, x is on the right as well.
        let front = match up.z.abs().max(up.y) == 1.0 {
            true => DVec3::X.cross(up),
            false => DVec3::NEG_Z.reject_from(up),
        };
        let front = front.try_normalize().unwrap_or_else(|| up.any_orthonormal_vector());
        let away = (front + up * ABOVE).normalize_or(front);
        let eye = bounds.center() + away * Self::distance(bounds, FOV_Y_RAD);
        Camera::look_at(eye, bounds.center(), up, FOV_Y_RAD, width_px, height_px)
            .unwrap_or_else(|| Camera::of_pose(eye, DMat3::IDENTITY, FOV_Y_RAD, width_px, height_px))
    }

    /// Distance from their middle at which `bounds` fill the picture of a camera with this vertical field of view.
    pub(crate) fn distance(bounds: &Bounds, fov_y_rad: f64) -> f64 {
        MARGIN * bounds.radius().max(1e-6) / (0.5 * fov_y_rad).sin()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn a_bare_splat_is_framed_from_its_front() {
        let cloud = GaussianCloud {
            origin: DVec3::new(10.0, 0.0, 0.0),
            positions: (0..100).map(|i| [i as f32 / 100.0; 3]).collect(),
            ..GaussianCloud::default()
        };
        let view = HomeView::new(&[], Some(&cloud));
        let middle = view.bounds.center();
        assert!((middle - DVec3::new(10.5, 0.5, 0.5)).length() < 0.05 && view.up == DVec3::NEG_Y);
        let camera = view.camera([640, 480]);
        let seen = |p: DVec3| camera.project(p).expect("in front");
        assert!((seen(middle) - DVec2::new(320.0, 240.0)).length() < 1e-9);
        assert!(seen(middle + DVec3::X * 0.1).x > 320.0, "x is on the right");
        assert!(seen(middle + DVec3::Y * 0.1).y > 240.0, "y is down");
        assert!(camera.center.z < middle.z && camera.center.y < middle.y, "from its front, from above");
        for p in [0.0, 0.99].map(|t| DVec3::new(10.0 + t, t, t)) {
            assert!(seen(p).cmpge(DVec2::ZERO).all() && seen(p).cmple(DVec2::new(640.0, 480.0)).all(), "{p}");
        }
        assert_eq!(HomeView::new(&[], None).bounds, HomeView::default().bounds);
    }

    #[test]
    fn cameras_go_around_what_is_framed() {
        let bounds = Bounds { min: DVec3::splat(5.0), max: DVec3::splat(7.0) };
        let view = HomeView { bounds, up: DVec3::NEG_Y, camera: None };
        let all = view.around([64, 48], 4);
        assert_eq!((all.len(), &all[0]), (4, &HomeView::overview(&bounds, view.up, [64, 48])));
        for (k, camera) in all.iter().enumerate() {
            let middle = camera.project(DVec3::splat(6.0)).expect("in front");
            assert!((middle - DVec2::new(32.0, 24.0)).length() < 1e-6 && camera.validate().is_ok());
            assert!((camera.center.y - all[0].center.y).abs() < 1e-9 && (k == 0 || camera.center != all[0].center));
        }
    }

    #[test]
    fn photos_say_where_a_scene_is_and_how_it_is_seen() {
        let at = |eye: DVec3| Camera::look_at(eye, DVec3::ONE, DVec3::Z, 0.8, 64, 48).expect("valid");
        let cameras = [DVec3::new(4.0, 1.0, 1.0), DVec3::new(1.0, 4.0, 1.0), DVec3::new(-2.0, 1.0, 1.0)].map(at);
        let view = HomeView::new(&cameras, None);
        assert!((view.bounds.center() - DVec3::ONE).length() < 1e-9 && (view.bounds.radius() - 1.5).abs() < 1e-9);
        assert!(view.up.dot(DVec3::Z) > 0.999);
        assert_eq!(view.camera([9, 9]), cameras[0]);
        // One camera knows a direction and no distance: the Gaussians do.
        let cloud = GaussianCloud { positions: vec![[1.0; 3]; 9], ..GaussianCloud::default() };
        let one = HomeView::new(&cameras[..1], Some(&cloud));
        assert!((one.bounds.center() - DVec3::ONE).length() < 1e-6);
    }
}
