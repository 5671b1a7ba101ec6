//! Orthographic view, and views along the axes of the scene.

use glam::DVec3;

use strum::VariantArray;

use super::eye::Eye;
use crate::math::format;
use crate::scene::HomeView;
use crate::ui::actions::Face;

/// Field of view of the orthographic view: a camera so far off that its rays are parallel but for a thousandth, at which
/// positions are still exact to a fiftieth of a pixel.
const PARALLEL_RAD: f64 = 0.003;
/// Largest sine of the angle between an axis and the floor for the axis to count as level.
const LEVEL: f64 = 0.02;
/// Least share of the distance to the pivot that is left after a flight ahead, and least distance.
const NEAREST: f64 = 0.02;
const LEAST: f64 = 1e-6;

impl Eye {
    /// True if the view is orthographic.
    pub(crate) fn is_orthographic(&self) -> bool {
        self.perspective_rad.is_some()
    }

    /// Switches between perspective and orthographic view; at the pivot's depth everything keeps its size.
    pub(crate) fn set_orthographic(&mut self, on: bool) {
        match (on, self.perspective_rad) {
            (true, None) => {
                self.perspective_rad = Some(self.fov_y_rad);
                self.refit(PARALLEL_RAD);
            }
            (false, Some(fov)) => {
                self.perspective_rad = None;
                self.refit(fov);
            }
            _ => {}
        }
    }

    /// The eye with perspective.
    pub(crate) fn in_perspective(&self) -> Self {
        let mut eye = self.clone();
        eye.set_orthographic(false);
        eye
    }

    /// Changes the field of view, and the distance to the pivot with it.
    fn refit(&mut self, fov_y_rad: f64) {
        let depth = self.pivot_depth();
        let ratio = (0.5 * self.fov_y_rad).tan() / (0.5 * fov_y_rad).tan();
        self.center += self.forward() * (depth - depth * ratio);
        self.fov_y_rad = fov_y_rad;
    }

    /// Flies ahead in the orthographic view: what is in its middle becomes larger, as with perspective.
    pub(super) fn fly_orthographic(&mut self, ahead: f64) {
        let Some(fov) = self.perspective_rad else { return };
        let ratio = (0.5 * fov).tan() / (0.5 * self.fov_y_rad).tan();
        let depth = self.pivot_depth();
        let left = (depth - ahead * ratio).max(NEAREST * depth).max(LEAST);
        self.center += self.forward() * (depth - left);
    }

    /// Words for an orthographic view, with the side that it is from; `None` with perspective.
    pub(super) fn straight_name(&self, home: Option<&HomeView>) -> Option<String> {
        if !self.is_orthographic() {
            return None;
        }
        let ahead = front_of(home);
        let is_from = |face: &&Face| {
            let mut straight = self.clone();
            straight.look_from(**face, ahead);
            straight.forward().dot(self.forward()) > 1.0 - 1e-6
        };
        let side = Face::VARIANTS.iter().find(is_from).map(|face| format!(" \u{b7} {}", format::capital(face.into())));
        Some(format!("Orthographic{}", side.unwrap_or_default()))
    }

    /// Looks at the pivot from a side of the scene, whose front is seen along `ahead`.
    pub(crate) fn look_from(&mut self, face: Face, ahead: DVec3) {
        let Some(up) = self.up.try_normalize() else { return };
        let front = level_axis(up, ahead);
        let right = front.cross(up);
        let (forward, top) = match face {
            Face::Front => (front, up),
            Face::Back => (-front, up),
            Face::Left => (right, up),
            Face::Right => (-right, up),
            Face::Top => (-up, front),
            Face::Bottom => (up, front),
        };
        let depth = self.pivot_depth();
        self.world_from_eye = glam::DMat3::from_cols(forward.cross(top), -top, forward);
        self.center = self.pivot - forward * depth;
    }
}

/// The direction in which the scene's first camera looks.
pub(super) fn front_of(home: Option<&HomeView>) -> DVec3 {
    home.and_then(|home| home.camera.as_ref()).map_or(DVec3::Y, |camera| camera.forward())
}

/// The direction of the scene's front: the level world axis that is nearest to `ahead`, or `ahead` itself, level, if the
/// scene is tilted against all axes.
fn level_axis(up: DVec3, ahead: DVec3) -> DVec3 {
    let level = |v: DVec3| (v - up * v.dot(up)).try_normalize();
    let ahead = level(ahead).unwrap_or_else(|| up.any_orthonormal_vector());
    let axes = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).filter(|axis| axis.dot(up).abs() < LEVEL);
    let nearest = axes.max_by(|a, b| a.dot(ahead).total_cmp(&b.dot(ahead)));
    nearest.and_then(level).unwrap_or(ahead)
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::scene::Bounds;

    fn eye() -> Eye {
        Eye::framing(&Bounds { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) }, DVec3::Z)
    }

    fn at(eye: &Eye, point: DVec3) -> DVec2 {
        eye.camera(640, 480).project(point).expect("in front")
    }

    #[test]
    fn an_orthographic_view_has_no_vanishing_point_and_keeps_the_size_at_the_pivot() {
        let (mut flat, deep) = (eye(), eye());
        flat.set_orthographic(true);
        let (right, away) = (deep.world_from_eye.x_axis, deep.forward());
        for point in [deep.pivot, deep.pivot + right * 0.4] {
            assert!(at(&flat, point).distance(at(&deep, point)) < 1e-6);
        }
        let moved =
            |eye: &Eye| at(eye, deep.pivot + right * 0.4 + away * 0.8).distance(at(eye, deep.pivot + right * 0.4));
        assert!(moved(&flat) < 0.1 && moved(&deep) > 5.0, "{} {}", moved(&flat), moved(&deep));
        let back = flat.in_perspective();
        assert!(
            back.center.distance(deep.center) < 1e-9 && back.fov_y_rad == deep.fov_y_rad && !back.is_orthographic()
        );
        // Switched twice, it is switched once.
        let before = flat.clone();
        flat.set_orthographic(true);
        assert_eq!(flat, before);
    }

    #[test]
    fn a_straight_view_is_named_by_its_side() {
        let mut flat = eye();
        assert_eq!(flat.straight_name(None), None, "with perspective");
        for (face, name) in [(Face::Top, "Orthographic \u{b7} Top"), (Face::Left, "Orthographic \u{b7} Left")] {
            flat.look_from(face, DVec3::Y);
            flat.set_orthographic(true);
            assert_eq!(flat.straight_name(None).as_deref(), Some(name));
        }
        flat.orbit(0.3, -0.1);
        assert_eq!(flat.straight_name(None).as_deref(), Some("Orthographic"), "control: from no side");
    }

    #[test]
    fn flying_ahead_magnifies_as_in_perspective_and_never_goes_through_the_pivot() {
        let mut flat = eye();
        flat.set_orthographic(true);
        let side = flat.pivot + flat.world_from_eye.x_axis * 0.2;
        let size = |eye: &Eye| at(eye, side).distance(at(eye, eye.pivot));
        let (before, distance) = (size(&flat), eye().distance());
        flat.fly(DVec3::new(0.0, 0.0, 0.5 * distance));
        assert!((size(&flat) / before - 2.0).abs() < 1e-3, "half as far, twice as large");
        for _ in 0..100 {
            flat.fly(DVec3::new(0.0, 0.0, distance));
        }
        assert!(flat.has_ahead(flat.pivot));
        flat.camera(640, 480).validate().expect("valid");
    }

    #[test]
    fn each_side_is_seen_straight_and_upright() {
        let ahead = DVec3::new(0.2, 1.0, -0.4);
        for (face, forward, down) in [
            (Face::Front, DVec3::Y, DVec3::NEG_Z),
            (Face::Back, DVec3::NEG_Y, DVec3::NEG_Z),
            (Face::Left, DVec3::X, DVec3::NEG_Z),
            (Face::Right, DVec3::NEG_X, DVec3::NEG_Z),
            (Face::Top, DVec3::NEG_Z, DVec3::NEG_Y),
            (Face::Bottom, DVec3::Z, DVec3::NEG_Y),
        ] {
            let mut eye = eye();
            let (pivot, distance) = (eye.pivot, eye.distance());
            eye.look_from(face, ahead);
            assert!(
                eye.forward().distance(forward) < 1e-12 && eye.world_from_eye.y_axis.distance(down) < 1e-12,
                "{face:?}"
            );
            assert!((eye.world_from_eye.determinant() - 1.0).abs() < 1e-12);
            assert!((eye.center.distance(pivot) - distance).abs() < 1e-9 && eye.pivot == pivot);
            // It can still be turned.
            eye.orbit(0.3, -0.1);
            eye.camera(64, 48).validate().expect("valid");
        }
        // A scene that is tilted against all axes has a front of its own.
        let up = DVec3::new(1.0, 1.0, 1.0).normalize_or(DVec3::Z);
        assert!(level_axis(up, DVec3::X).dot(up).abs() < 1e-12);
    }
}
