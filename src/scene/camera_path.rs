//! A camera path: its key cameras and its duration.
//!
//! Pure data: `navigate::camera_spline` interpolates between keys.

use glam::{DMat3, DVec3};

use super::Camera;
use crate::math::rotation::rotation_error;

/// The keys of a flight in the order in which they are passed.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    /// The keys; at most [`CameraPath::MAX_KEYS`].
    pub(crate) keys: Vec<PathKey>,
    /// True if the path continues from the last key to the first.
    pub(crate) closed: bool,
    pub(crate) fps: f64,
    /// Seconds that the whole flight takes, waits included.
    pub(crate) seconds: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PathKey {
    /// Camera center in the world, in scene units.
    pub(crate) center: DVec3,
    /// Rotation of the pose before the roll: columns are the camera's right, down and forward axes in the world.
    pub(crate) world_from_camera: DMat3,
    /// Vertical field of view in radians.
    pub(crate) fov_y_rad: f64,
    /// Turn about the viewing direction on top of the pose, in radians; positive lowers the camera's right side.
    pub(crate) roll_rad: f64,
    /// Seconds that the camera waits here.
    pub(crate) dwell_secs: f64,
    /// Arrival time in seconds from the start, if fixed.
    pub(crate) time_secs: Option<f64>,
    pub(crate) name: Option<String>,
}

/// Error of an invalid camera path.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum PathError {
    #[error("{0} keys are more than the {max} that a path may have", max = CameraPath::MAX_KEYS)]
    TooManyKeys(usize),
    #[error("{field} {reason}")]
    Path { field: &'static str, reason: String },
    #[error("key {}, {field} {reason}", key_name(*.key, .name.as_deref()))]
    Key { key: usize, name: Option<String>, field: &'static str, reason: String },
}

/// `3` or `3 ('window')`.
fn key_name(key: usize, name: Option<&str>) -> String {
    name.map_or_else(|| key.to_string(), |n| format!("{key} ('{n}')"))
}

impl CameraPath {
    pub(crate) const MAX_KEYS: usize = 100_000;
    /// Most frames per second.
    pub(crate) const MAX_FPS: f64 = 1000.0;
    /// Longest flight in seconds (a day).
    pub(crate) const MAX_SECONDS: f64 = 86_400.0;

    /// Checks every field; the error names the key and the field. A path without keys is valid.
    pub fn validate(&self) -> Result<(), PathError> {
        if self.keys.len() > Self::MAX_KEYS {
            return Err(PathError::TooManyKeys(self.keys.len()));
        }
        let path =
            |field, value: f64, what: &str| PathError::Path { field, reason: format!("= {value} is not {what}") };
        if !(self.fps > 0.0 && self.fps <= Self::MAX_FPS) {
            return Err(path("fps", self.fps, &format!("above 0 and at most {}", Self::MAX_FPS)));
        }
        if !(self.seconds >= 0.0 && self.seconds <= Self::MAX_SECONDS) {
            return Err(path("seconds", self.seconds, &format!("between 0 and {}", Self::MAX_SECONDS)));
        }
        let mut before = 0.0;
        for (index, key) in self.keys.iter().enumerate() {
            key.check(before).map_err(|(field, reason)| PathError::Key {
                key: index,
                name: key.name.clone(),
                field,
                reason,
            })?;
            before = key.time_secs.unwrap_or(before);
        }
        Ok(())
    }
}

impl PathKey {
    /// A key at a camera: its pose and vertical field of view, no roll, no wait.
    #[cfg(test)]
    pub(crate) fn of_camera(camera: &Camera) -> Self {
        Self::of_pose(camera.center, camera.world_from_camera, camera.fov_y_rad())
    }

    /// A key at a pose with this vertical field of view: no roll, no wait, no fixed time.
    pub(crate) fn of_pose(center: DVec3, world_from_camera: DMat3, fov_y_rad: f64) -> Self {
        Self { center, world_from_camera, fov_y_rad, roll_rad: 0.0, dwell_secs: 0.0, time_secs: None, name: None }
    }

    /// The rotation of the pose with the roll in it: columns right, down, forward in the world.
    pub(crate) fn rotation(&self) -> DMat3 {
        self.world_from_camera * DMat3::from_rotation_z(self.roll_rad)
    }

    /// The camera that takes a picture of this size here: square pixels, principal point in the middle.
    #[cfg(test)]
    pub(crate) fn camera(&self, width_px: u32, height_px: u32) -> Camera {
        Camera::of_pose(self.center, self.rotation(), self.fov_y_rad, width_px, height_px)
    }

    /// The first field that is wrong, and why; `before` is the latest time of the keys before.
    fn check(&self, before: f64) -> Result<(), (&'static str, String)> {
        let c = self.center;
        if !c.is_finite() {
            return Err(("center", format!("= ({}, {}, {}) is not finite", c.x, c.y, c.z)));
        }
        if !(c.abs().max_element() <= Camera::FARTHEST) {
            let reason =
                format!("= ({:e}, {:e}, {:e}) is farther than {:e} units out", c.x, c.y, c.z, Camera::FARTHEST);
            return Err(("center", reason));
        }
        let error = rotation_error(&self.world_from_camera);
        if !(error <= 1e-3) {
            let reason = format!("is not a rotation (deviation {error:.2e}; scale, shear, reflection or NaN)");
            return Err(("world_from_camera", reason));
        }
        if !(self.fov_y_rad > 0.0 && self.fov_y_rad < std::f64::consts::PI) {
            return Err(("fov_y_rad", format!("= {} is not between 0 and pi", self.fov_y_rad)));
        }
        if !self.roll_rad.is_finite() {
            return Err(("roll_rad", format!("= {} is not finite", self.roll_rad)));
        }
        if !(self.dwell_secs >= 0.0 && self.dwell_secs <= CameraPath::MAX_SECONDS) {
            let reason = format!("= {} is not between 0 and {}", self.dwell_secs, CameraPath::MAX_SECONDS);
            return Err(("dwell_secs", reason));
        }
        match self.time_secs {
            Some(t) if !(0.0..=CameraPath::MAX_SECONDS).contains(&t) => {
                Err(("time_secs", format!("= {t} is not between 0 and {}", CameraPath::MAX_SECONDS)))
            }
            Some(t) if t < before => Err(("time_secs", format!("= {t} is before {before}, a time of an earlier key"))),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path() -> CameraPath {
        let camera = Camera::look_at(DVec3::new(0.0, -3.0, 1.0), DVec3::ZERO, DVec3::Z, 0.8, 640, 480).expect("valid");
        let key = PathKey::of_camera(&camera);
        let later = PathKey { time_secs: Some(2.0), name: Some("window".into()), ..key.clone() };
        CameraPath { keys: vec![key, later], closed: false, fps: 30.0, seconds: 4.0 }
    }

    #[test]
    fn a_key_is_the_camera_it_came_from() {
        let camera = Camera::look_at(DVec3::new(1.0, -3.0, 1.0), DVec3::ZERO, DVec3::Z, 0.8, 640, 480).expect("valid");
        let again = PathKey::of_camera(&camera).camera(640, 480);
        assert!((again.focal_px - camera.focal_px).length() < 1e-9);
        assert_eq!(again.world_from_camera, camera.world_from_camera);
        again.validate().expect("valid");
    }

    #[test]
    fn a_positive_roll_lowers_the_right_side() {
        let mut key = path().keys.remove(0);
        let upright = key.rotation().x_axis;
        key.roll_rad = 0.2;
        assert!(upright.z.abs() < 1e-12);
        assert!(key.rotation().x_axis.z < -0.1);
        assert!(rotation_error(&key.rotation()) < 1e-12);
    }

    #[test]
    fn bad_values_are_named_with_key_and_field() {
        path().validate().expect("valid");
        type Spoil = fn(&mut CameraPath);
        let cases: [(Spoil, &str); 12] = [
            (|p| p.keys[1].center.y = f64::NAN, "key 1 ('window'), center"),
            (|p| p.keys[0].world_from_camera *= 2.0, "key 0, world_from_camera"),
            (|p| p.keys[0].world_from_camera *= -1.0, "key 0, world_from_camera"),
            (|p| p.keys[0].world_from_camera.x_axis.x = f64::NAN, "key 0, world_from_camera"),
            (|p| p.keys[0].fov_y_rad = 0.0, "key 0, fov_y_rad"),
            (|p| p.keys[1].fov_y_rad = std::f64::consts::PI, "key 1 ('window'), fov_y_rad"),
            (|p| p.keys[0].roll_rad = f64::INFINITY, "key 0, roll_rad"),
            (|p| p.keys[0].dwell_secs = -1.0, "key 0, dwell_secs"),
            (|p| p.keys[0].time_secs = Some(3.0), "key 1 ('window'), time_secs"),
            (|p| p.fps = 0.0, "fps"),
            (|p| p.seconds = f64::NAN, "seconds"),
            (|p| p.keys = vec![p.keys[0].clone(); CameraPath::MAX_KEYS + 1], "100001 keys"),
        ];
        for (spoil, named) in cases {
            let mut p = path();
            spoil(&mut p);
            let text = p.validate().expect_err(named).to_string();
            assert!(text.starts_with(named), "{named}: {text}");
        }
    }
}
