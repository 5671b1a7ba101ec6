//! The viewer's camera: orbits a pivot, flies, pans, and zooms toward the point under the cursor.

use glam::{DMat3, DVec2, DVec3};

use crate::navigate::Pose;
use crate::scene::{Bounds, Camera, HomeView};

/// Smallest angle between viewing and up direction, radians.
const POLE_RAD: f64 = 0.03;

/// The viewer's camera, without a frame size.
#[derive(Clone, Debug, PartialEq)]
pub struct Eye {
    /// Position in the world.
    pub(crate) center: DVec3,
    /// Columns: right, down, forward in the world.
    pub(crate) world_from_eye: DMat3,
    /// Pivot of orbiting.
    pub(crate) pivot: DVec3,
    /// Up direction of the world, unit length.
    pub(crate) up: DVec3,
    /// Vertical field of view in radians.
    pub(crate) fov_y_rad: f64,
    /// Field of view with perspective, while the view is orthographic.
    pub(super) perspective_rad: Option<f64>,
}

impl Eye {
    /// A camera that sees all of `bounds` obliquely from above.
    pub fn framing(bounds: &Bounds, up: DVec3) -> Self {
        // The size of the image does not matter.
        Self::of_camera(&HomeView::overview(bounds, up, [1, 1]), bounds.center(), up)
    }

    /// The pose of a photo's camera, with `pivot` to orbit.
    pub(crate) fn of_camera(camera: &Camera, pivot: DVec3, up: DVec3) -> Self {
        Self {
            center: camera.center,
            world_from_eye: camera.world_from_camera,
            pivot,
            up,
            fov_y_rad: camera.fov_y_rad(),
            perspective_rad: None,
        }
    }

    /// A photo's camera, with a pivot ahead in the scene.
    pub(crate) fn of_photo(camera: &Camera, home: &HomeView, up: DVec3) -> Self {
        let ahead = (home.bounds.center() - camera.center).dot(camera.forward());
        let pivot = camera.center + camera.forward() * ahead.max(0.1 * home.bounds.radius());
        Self::of_camera(camera, pivot, up)
    }

    /// The camera for a frame of this size.
    pub fn camera(&self, width_px: u32, height_px: u32) -> Camera {
        Camera::of_pose(self.center, self.world_from_eye, self.fov_y_rad, width_px.max(1), height_px.max(1))
    }

    /// Unit vector of the viewing direction.
    pub(crate) fn forward(&self) -> DVec3 {
        self.world_from_eye.z_axis
    }

    /// True if a point is in front of the camera.
    pub(crate) fn has_ahead(&self, point: DVec3) -> bool {
        (point - self.center).dot(self.forward()) > 0.0
    }

    /// True if it is, nearly, at this place: what was drawn from there applies.
    pub(crate) fn is_at(&self, place: DVec3) -> bool {
        place.distance(self.center) <= 1e-3 * self.distance()
    }

    /// Distance to the pivot, never 0.
    pub(crate) fn distance(&self) -> f64 {
        self.center.distance(self.pivot).max(1e-9)
    }

    /// Orbits the pivot: `yaw_rad` about the up direction, `pitch_rad` about the camera's right axis, stopping short of
    /// the poles.
    pub(crate) fn orbit(&mut self, yaw_rad: f64, pitch_rad: f64) {
        let from_up = self.forward().dot(self.up).clamp(-1.0, 1.0).acos();
        // Positive pitch lifts the viewing direction toward up.
        let lowest = (from_up - (std::f64::consts::PI - POLE_RAD)).min(0.0);
        let highest = (from_up - POLE_RAD).max(0.0);
        let pitch = pitch_rad.clamp(lowest, highest);
        let Some(right) = self.world_from_eye.x_axis.try_normalize() else { return };
        let turn = DMat3::from_axis_angle(self.up, yaw_rad) * DMat3::from_axis_angle(right, pitch);
        self.center = self.pivot + turn * (self.center - self.pivot);
        self.set_rotation(turn * self.world_from_eye);
    }

    /// Moves camera and pivot in the image plane so that points at the pivot's depth follow the cursor.
    pub(crate) fn pan(&mut self, delta_px: DVec2, height_px: f64) {
        let per_px = self.units_per_px(self.pivot, height_px);
        let shift = self.world_from_eye * DVec3::new(-delta_px.x, -delta_px.y, 0.0) * per_px;
        self.center += shift;
        self.pivot += shift;
    }

    /// Size of a pixel at the depth of a point, in a frame of this height.
    pub(crate) fn units_per_px(&self, point: DVec3, height_px: f64) -> f64 {
        let depth = (point - self.center).dot(self.forward()).abs().max(0.05 * self.distance());
        2.0 * depth * (0.5 * self.fov_y_rad).tan() / height_px.max(1.0)
    }

    /// Moves toward `target` so that its distance is multiplied by `factor` (below 1: nearer). The target keeps its
    /// place in the frame.
    pub(crate) fn zoom(&mut self, target: DVec3, factor: f64) {
        self.center = target + (self.center - target) * factor.clamp(0.05, 20.0);
    }

    /// Flies: `motion` is in camera axes (right, up, forward), in scene units. The pivot moves along.
    pub(crate) fn fly(&mut self, mut motion: DVec3) {
        if self.is_orthographic() {
            self.fly_orthographic(std::mem::take(&mut motion.z));
        }
        let shift = self.world_from_eye * DVec3::new(motion.x, -motion.y, motion.z);
        self.center += shift;
        self.pivot += shift;
    }

    /// Moves along the viewing direction until `bounds` fills the view, and sets the pivot to its center.
    pub(crate) fn frame(&mut self, bounds: &Bounds) {
        self.pivot = bounds.center();
        self.center = self.pivot - self.forward() * HomeView::distance(bounds, self.fov_y_rad);
    }

    /// Turns to `bounds`, and steps back as far as needed, unless a view of this aspect ratio (width / height) shows all
    /// of it. Returns true if it has moved.
    pub(super) fn turn_to(&mut self, bounds: &Bounds, aspect: f64) -> bool {
        let camera = self.camera((1000.0 * aspect).round() as u32, 1000);
        if is_in_view(&camera, bounds, 0.0) {
            return false;
        }
        let middle = bounds.center();
        // Parallel rays keep their direction.
        if !self.is_orthographic() {
            self.look_along(middle - self.center);
        }
        let narrow = 2.0 * ((0.5 * self.fov_y_rad).tan() * aspect.min(1.0)).atan();
        let ahead = (middle - self.center).dot(self.forward()).max(HomeView::distance(bounds, narrow));
        (self.pivot, self.center) = (middle, middle - self.forward() * ahead);
        true
    }

    /// The first view of a scene: from its first camera if it has one, else framed as a whole; upright if the user
    /// chose the up direction.
    pub(crate) fn home(home: &HomeView, up: Option<DVec3>) -> Self {
        let mut eye = match &home.camera {
            Some(c) => {
                let mut eye = Self::of_camera(c, home.bounds.center(), home.up);
                eye.fov_y_rad = eye.fov_y_rad.clamp(0.5, 1.2);
                eye
            }
            None => Self::framing(&home.bounds, up.unwrap_or(home.up)),
        };
        if let Some(up) = up {
            eye.set_up(up);
        }
        eye
    }

    /// Moves to a pose. The pivot stays ahead at its distance, or is half the `radius` of the scene ahead.
    pub(crate) fn stand(&mut self, pose: &Pose, radius: f64, up: DVec3) {
        let ahead = (self.pivot - pose.center).dot(pose.forward());
        let distance = if ahead > 0.0 { ahead } else { 0.5 * radius };
        *self = Self {
            center: pose.center,
            world_from_eye: pose.world_from_camera,
            pivot: pose.center + pose.forward() * distance,
            up,
            fov_y_rad: pose.fov_y_rad,
            perspective_rad: None,
        };
    }

    /// The point at a relative position of a view of this aspect ratio (height / width), at the depth of the pivot.
    pub(crate) fn point_at_pivot_depth(&self, at: DVec2, aspect: f64) -> DVec3 {
        let camera = self.camera(1000, (1000.0 * aspect).max(1.0) as u32);
        let ray = camera.ray(at * DVec2::new(f64::from(camera.width_px), f64::from(camera.height_px)));
        self.center + ray * self.pivot_depth()
    }

    /// Depth of the pivot, never 0.
    pub(super) fn pivot_depth(&self) -> f64 {
        (self.pivot - self.center).dot(self.forward()).abs().max(0.05 * self.distance())
    }

    /// Sets another up direction and turns upright.
    pub(crate) fn set_up(&mut self, up: DVec3) {
        self.up = up;
        self.look_along(self.forward());
    }

    /// Looks along `direction`, upright; keeps the old rotation if that is undefined.
    fn look_along(&mut self, direction: DVec3) {
        let Some(forward) = direction.try_normalize() else { return };
        let right = forward.cross(self.up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        self.world_from_eye = DMat3::from_cols(right, forward.cross(right), forward);
    }

    /// Sets a rotation, orthonormalized against rounding errors.
    fn set_rotation(&mut self, m: DMat3) {
        let Some(forward) = m.z_axis.try_normalize() else { return };
        let Some(right) = (m.x_axis - forward * m.x_axis.dot(forward)).try_normalize() else { return };
        self.world_from_eye = DMat3::from_cols(right, forward.cross(right), forward);
    }
}

/// True if a camera sees all corners, none of them at a border of its picture; `border` is a share of its size.
pub(super) fn is_in_view(camera: &Camera, bounds: &Bounds, border: f64) -> bool {
    let size = DVec2::new(f64::from(camera.width_px), f64::from(camera.height_px));
    let is_in = |p: DVec2| p.cmpge(border * size).all() && p.cmple((1.0 - border) * size).all();
    bounds.corners().into_iter().all(|p| camera.project(p).is_some_and(is_in))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation::rotation_error;

    fn eye() -> Eye {
        Eye::framing(&Bounds { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) }, DVec3::Z)
    }

    #[test]
    fn framing_shows_all_corners_with_up_upwards() {
        let camera = eye().camera(640, 480);
        camera.validate().expect("valid");
        for i in 0..8 {
            let corner = DVec3::new(
                f64::from(i & 1) * 2.0 - 1.0,
                f64::from((i >> 1) & 1) * 2.0 - 1.0,
                f64::from((i >> 2) & 1) * 2.0 - 1.0,
            );
            let p = camera.project(corner).expect("in front");
            assert!((0.0..640.0).contains(&p.x) && (0.0..480.0).contains(&p.y), "{corner} {p}");
        }
        let (low, high) = (camera.project(DVec3::ZERO), camera.project(DVec3::Z * 0.5));
        assert!(high.expect("in front").y < low.expect("in front").y);
        assert!(camera.center.z > 0.0, "from above");
    }

    #[test]
    fn orbiting_keeps_the_distance_and_never_tips_over() {
        let mut e = eye();
        let before = e.distance();
        for i in 0..2000 {
            e.orbit(0.05, if i % 400 < 200 { 0.05 } else { -0.05 });
            assert!(e.world_from_eye.y_axis.dot(e.up) < 0.0, "upside down at {i}");
        }
        assert!((e.distance() - before).abs() < 1e-6);
        assert!(rotation_error(&e.world_from_eye) < 1e-12);
        let middle = e.camera(100, 100).project(e.pivot).expect("in front");
        assert!((middle - DVec2::splat(50.0)).length() < 1e-6, "the pivot left the middle: {middle}");
    }

    #[test]
    fn zooming_keeps_the_target_under_the_cursor() {
        let mut e = eye();
        let target = DVec3::new(0.3, -0.2, 0.5);
        let before = e.camera(640, 480).project(target).expect("in front");
        let distance = e.center.distance(target);
        e.zoom(target, 0.5);
        let after = e.camera(640, 480).project(target).expect("in front");
        assert!((before - after).length() < 1e-9);
        assert!((e.center.distance(target) - 0.5 * distance).abs() < 1e-9);
    }

    #[test]
    fn panning_moves_the_pivot_with_the_cursor() {
        let mut e = eye();
        let point = e.pivot;
        let before = e.camera(640, 480).project(point).expect("in front");
        e.pan(DVec2::new(30.0, -12.0), 480.0);
        let after = e.camera(640, 480).project(point).expect("in front");
        assert!((after - before - DVec2::new(30.0, -12.0)).length() < 1e-6);
    }

    #[test]
    fn flying_forward_goes_where_the_eye_looks() {
        let mut e = eye();
        let (from, forward) = (e.center, e.forward());
        e.fly(DVec3::new(0.0, 0.0, 2.0));
        assert!((e.center - from - forward * 2.0).length() < 1e-12);
        let from = e.center;
        e.fly(DVec3::new(0.0, 1.0, 0.0));
        assert!((e.center - from).dot(e.up) > 0.0, "up is up");
    }

    #[test]
    fn a_thing_that_a_narrow_view_cuts_is_turned_to() {
        let thing = Bounds { min: DVec3::new(0.7, -0.1, -0.1), max: DVec3::new(0.9, 0.1, 0.1) };
        let sees = |e: &Eye, aspect: f64| {
            let camera = e.camera((600.0 * aspect) as u32, 600);
            let is_in = |p: DVec2| (0.0..600.0 * aspect).contains(&p.x) && (0.0..600.0).contains(&p.y);
            thing.corners().into_iter().all(|p| camera.project(p).is_some_and(is_in))
        };
        for (orthographic, nearer) in [(false, 0.5), (true, 0.5), (false, 0.0)] {
            let mut e = eye();
            e.set_orthographic(orthographic);
            e.zoom(e.pivot, 1.0 - nearer);
            let (before, forward) = (e.clone(), e.forward());
            if !orthographic {
                assert!(!e.turn_to(&thing, 3.0) && e == before, "control: a wide view shows it as it is");
            }
            assert!(!sees(&e, 0.4) && e.turn_to(&thing, 0.4) && sees(&e, 0.4));
            assert_eq!(e.center != before.center && e.forward() == forward, orthographic, "it turns where it stands");
            assert!(!e.turn_to(&thing, 0.4), "once is enough");
            assert!(e.world_from_eye.y_axis.dot(e.up) < 0.0, "upright");
        }
    }

    #[test]
    fn the_eye_of_a_photo_sees_what_its_camera_sees() {
        let camera = Camera::look_at(DVec3::new(3.0, 1.0, 2.0), DVec3::ZERO, DVec3::Z, 0.7, 400, 300).expect("valid");
        let again = Eye::of_camera(&camera, DVec3::ZERO, DVec3::Z).camera(400, 300);
        let p = DVec3::new(0.1, 0.2, -0.3);
        assert!((camera.project(p).expect("front") - again.project(p).expect("front")).length() < 1e-9);
    }
}
