//! A calibrated pinhole camera.
//!
//! Camera axes: x right, y down, z forward (COLMAP's). Pixel `(i, j)` covers
//! `[i, i+1) x [j, j+1)`, so its center is at `(i + 0.5, j + 0.5)` px.

use std::ops::RangeInclusive;

use glam::{DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::rig;
use crate::math::rotation::rotation_error;

/// Distance of the near plane, as a share of the extent of the cameras.
const NEAR: f64 = 0.003;

/// A pinhole camera: size, intrinsics (px) and pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Width of the picture in px, at least 1.
    pub width_px: u32,
    /// Height of the picture in px, at least 1.
    pub height_px: u32,
    /// Focal lengths in px along x and y, both positive.
    pub focal_px: DVec2,
    /// Principal point in px from the top-left corner of the top-left pixel.
    pub principal_px: DVec2,
    /// Rotation of the pose: columns are the camera's right, down and forward axes in the world.
    pub world_from_camera: DMat3,
    /// Camera center in the world, in scene units.
    pub center: DVec3,
}

/// Error of an invalid camera.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum CameraError {
    #[error("picture size {0} x {1} px is not between 1 and {max} px a side", max = Camera::MAX_SIDE_PX)]
    Size(u32, u32),
    #[error("focal length ({0}, {1}) px is not positive and finite")]
    Focal(f64, f64),
    #[error(
        "focal length {focal_px:e} px along a side of {side_px} px is no lens's; between {} and {:e} sides are believed",
        Camera::FOCAL_SIDES.start(),
        Camera::FOCAL_SIDES.end()
    )]
    Lens { focal_px: f64, side_px: u32 },
    #[error("principal point ({0:e}, {1:e}) px is over {max:e} image sides away from the image", max = Camera::PRINCIPAL_SIDES)]
    Off(f64, f64),
    #[error("the camera center ({0:e}, {1:e}, {2:e}) is farther than {max:e} units from the origin", max = Camera::FARTHEST)]
    Far(f64, f64, f64),
    #[error("principal point ({0}, {1}) px is not finite")]
    Principal(f64, f64),
    #[error("the pose's 3x3 part is not a rotation (deviation {0:.2e}; scale, shear, reflection or NaN)")]
    Rotation(f64),
    #[error("the camera center ({0}, {1}, {2}) is not finite")]
    Center(f64, f64, f64),
}

impl Camera {
    /// Largest side of a picture that any part of the program accepts.
    pub(crate) const MAX_SIDE_PX: u32 = 16_384;

    /// Focal lengths accepted on reading, in sides of the picture along the same axis: fields of view from two seconds
    /// of arc to a quarter of a degree short of 180°.
    pub(crate) const FOCAL_SIDES: RangeInclusive<f64> = 1e-3..=1e5;
    /// Largest distance of the principal point on reading, in picture sides: pictures may be cut out of larger ones.
    pub(crate) const PRINCIPAL_SIDES: f64 = 1e4;
    /// Farthest from the origin that a camera or a point may be on reading, scene units.
    pub(crate) const FARTHEST: f64 = 1e12;

    /// Checks a camera read from a file: [`Self::validate`], and no number beyond those of real lenses and places.
    /// Drawing takes any valid camera; implausible ones are refused on reading, before a training run is spent on them.
    pub(crate) fn believe(&self) -> Result<(), CameraError> {
        self.validate()?;
        let sides = [
            (self.width_px, self.focal_px.x, self.principal_px.x),
            (self.height_px, self.focal_px.y, self.principal_px.y),
        ];
        for (side_px, focal_px, principal_px) in sides {
            let side = f64::from(side_px);
            if !Self::FOCAL_SIDES.contains(&(focal_px / side)) {
                return Err(CameraError::Lens { focal_px, side_px });
            }
            if !(principal_px.abs() <= Self::PRINCIPAL_SIDES * side) {
                return Err(CameraError::Off(self.principal_px.x, self.principal_px.y));
            }
        }
        let c = self.center;
        if !(c.abs().max_element() <= Self::FARTHEST) {
            return Err(CameraError::Far(c.x, c.y, c.z));
        }
        Ok(())
    }

    /// Checks every field; see [`CameraError`].
    pub fn validate(&self) -> Result<(), CameraError> {
        let (w, h) = (self.width_px, self.height_px);
        if w == 0 || h == 0 || w > Self::MAX_SIDE_PX || h > Self::MAX_SIDE_PX {
            return Err(CameraError::Size(w, h));
        }
        let f = self.focal_px;
        if !(f.is_finite() && f.x > 0.0 && f.y > 0.0) {
            return Err(CameraError::Focal(f.x, f.y));
        }
        let c = self.principal_px;
        if !c.is_finite() {
            return Err(CameraError::Principal(c.x, c.y));
        }
        let error = rotation_error(&self.world_from_camera);
        if error.is_nan() || error > 1e-3 {
            return Err(CameraError::Rotation(error));
        }
        if !self.center.is_finite() {
            return Err(CameraError::Center(self.center.x, self.center.y, self.center.z));
        }
        Ok(())
    }

    /// A camera at `eye` that looks at `target`, with `up` upwards in the picture, a vertical
    /// field of view of `fov_y_rad` and the principal point in the middle. `None` where the
    /// viewing direction is zero or along `up`.
    pub fn look_at(
        eye: DVec3,
        target: DVec3,
        up: DVec3,
        fov_y_rad: f64,
        width_px: u32,
        height_px: u32,
    ) -> Option<Self> {
        let forward = (target - eye).try_normalize()?;
        let right = forward.cross(up).try_normalize()?;
        let down = forward.cross(right);
        Some(Self::of_pose(eye, DMat3::from_cols(right, down, forward), fov_y_rad, width_px, height_px))
    }

    /// The camera with this pose and vertical field of view: square pixels, principal point in the middle.
    pub(crate) fn of_pose(
        center: DVec3,
        world_from_camera: DMat3,
        fov_y_rad: f64,
        width_px: u32,
        height_px: u32,
    ) -> Self {
        let size = DVec2::new(f64::from(width_px), f64::from(height_px));
        let focal = 0.5 * size.y / (0.5 * fov_y_rad).tan();
        let (focal_px, principal_px) = (DVec2::splat(focal), size * 0.5);
        Self { width_px, height_px, focal_px, principal_px, world_from_camera, center }
    }

    /// Its vertical field of view, radians.
    pub fn fov_y_rad(&self) -> f64 {
        2.0 * (0.5 * f64::from(self.height_px) / self.focal_px.y).atan()
    }

    /// World up direction of these cameras: the negated mean of their down axes. `None` if they cancel.
    pub(crate) fn up_of<'a>(cameras: impl Iterator<Item = &'a Self>) -> Option<DVec3> {
        let (sum, count) = cameras.fold((DVec3::ZERO, 0), |(sum, n), c| (sum - c.world_from_camera.y_axis, n + 1));
        if sum.length() > 0.1 * f64::from(count) { sum.try_normalize() } else { None }
    }

    /// Point nearest to the viewing axes of these cameras; `None` if the axes are parallel. Cameras far from all others
    /// are left out.
    pub(crate) fn focus_of<'a>(cameras: impl Iterator<Item = &'a Self>) -> Option<DVec3> {
        let (mut a, mut b, mut n) = (DMat3::ZERO, DVec3::ZERO, 0.0);
        for c in rig::together(cameras) {
            let d = c.forward();
            let m = DMat3::IDENTITY - DMat3::from_cols(d * d.x, d * d.y, d * d.z);
            a += m;
            b += m * c.center;
            n += 1.0_f64;
        }
        (n > 1.0 && a.determinant() > 1e-4 * n.powi(3)).then(|| a.inverse() * b)
    }

    /// Mean center, and 1.1 times the largest distance from it, of cameras that are not far from all others; 1 where
    /// they are at one place.
    pub(crate) fn extent_of<'a>(cameras: impl Iterator<Item = &'a Self>) -> (DVec3, f64) {
        let centers: Vec<DVec3> = rig::together(cameras).map(|c| c.center).collect();
        let mean = centers.iter().sum::<DVec3>() / centers.len().max(1) as f64;
        let far = centers.iter().map(|c| c.distance(mean)).fold(0.0, f64::max);
        (mean, if far > 0.0 { far * 1.1 } else { 1.0 })
    }

    /// Distance of the near plane in scenes with cameras of this extent, scene units.
    pub(crate) fn near_plane(extent: f64) -> f64 {
        NEAR * extent
    }

    /// The same camera with a picture of another size: intrinsics scaled per axis.
    pub fn resized(&self, width_px: u32, height_px: u32) -> Self {
        let scale = DVec2::new(
            f64::from(width_px) / f64::from(self.width_px),
            f64::from(height_px) / f64::from(self.height_px),
        );
        Self {
            width_px,
            height_px,
            focal_px: self.focal_px * scale,
            principal_px: self.principal_px * scale,
            ..self.clone()
        }
    }

    /// The camera with a picture of this size. The vertical field of view stays; where the shape differs, the
    /// picture shows more or less at the sides, never anything stretched.
    pub(crate) fn with_size(&self, width_px: u32, height_px: u32) -> Self {
        let scale = f64::from(height_px) / f64::from(self.height_px);
        let shift = f64::from(width_px) * 0.5 - f64::from(self.width_px) * 0.5 * scale;
        Self {
            width_px,
            height_px,
            focal_px: self.focal_px * scale,
            principal_px: self.principal_px * scale + DVec2::new(shift, 0.0),
            ..self.clone()
        }
    }

    /// The same camera with a picture `factor` times smaller.
    pub(crate) fn reduced(&self, factor: u32) -> Self {
        let side = |s: u32| (s / factor.max(1)).max(1);
        self.resized(side(self.width_px), side(self.height_px))
    }

    /// The same camera at most `max_side_px` along its longer side, never enlarged.
    pub fn limited_to(&self, max_side_px: u32) -> Self {
        let longer = self.width_px.max(self.height_px);
        if longer <= max_side_px {
            return self.clone();
        }
        let scale = f64::from(max_side_px) / f64::from(longer);
        let side = |s: u32| ((f64::from(s) * scale).round() as u32).max(1);
        self.resized(side(self.width_px), side(self.height_px))
    }

    /// Takes the place and rotation of another camera.
    pub(crate) fn set_pose(&mut self, other: &Self) {
        (self.world_from_camera, self.center) = (other.world_from_camera, other.center);
    }

    /// Unit vector of the viewing direction in the world.
    pub(crate) fn forward(&self) -> DVec3 {
        self.world_from_camera.z_axis
    }

    /// The world point in camera axes (x right, y down, z forward).
    pub fn camera_from_world(&self, p: DVec3) -> DVec3 {
        self.world_from_camera.transpose() * (p - self.center)
    }

    /// Pixel coordinates of a world point in front of the camera, or `None` behind it.
    pub fn project(&self, p: DVec3) -> Option<DVec2> {
        let q = self.camera_from_world(p);
        (q.z > 0.0).then(|| DVec2::new(q.x, q.y) / q.z * self.focal_px + self.principal_px)
    }

    /// Direction in the world (not normalized, camera-space depth 1) of the ray through the
    /// pixel position.
    pub fn ray(&self, pixel: DVec2) -> DVec3 {
        let q = (pixel - self.principal_px) / self.focal_px;
        self.world_from_camera * DVec3::new(q.x, q.y, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::look_at(DVec3::new(0.0, -3.0, 1.0), DVec3::ZERO, DVec3::Z, 0.8, 640, 480).expect("valid")
    }

    #[test]
    fn looks_at_its_target_with_up_upwards() {
        let c = camera();
        c.validate().expect("valid");
        let middle = c.project(DVec3::ZERO).expect("in front");
        assert!((middle - DVec2::new(320.0, 240.0)).length() < 1e-9);
        let above = c.project(DVec3::new(0.0, 0.0, 0.5)).expect("in front");
        assert!(above.y < 240.0);
        let right = c.project(DVec3::new(0.5, 0.0, 0.0)).expect("in front");
        assert!(right.x > 320.0);
    }

    #[test]
    fn ray_inverts_projection() {
        let c = camera();
        let p = c.center + c.ray(DVec2::new(12.25, 400.5)) * 2.5;
        let back = c.project(p).expect("in front");
        assert!((back - DVec2::new(12.25, 400.5)).length() < 1e-9);
    }

    #[test]
    fn cameras_that_can_be_drawn_but_not_be_are_not_believed() {
        let change = |change: fn(&mut Camera)| {
            let mut c = camera();
            change(&mut c);
            c.validate().expect("drawn");
            c.believe()
        };
        assert_eq!(change(|_| {}), Ok(()));
        assert_eq!(change(|c| c.focal_px *= 1e3), Ok(()), "a telescope");
        assert!(matches!(change(|c| c.focal_px.y = 1e-30), Err(CameraError::Lens { side_px: 480, .. })));
        assert!(matches!(change(|c| c.focal_px.x = 1e30), Err(CameraError::Lens { side_px: 640, .. })));
        assert!(matches!(change(|c| c.principal_px.x = -1e9), Err(CameraError::Off(..))));
        assert!(matches!(change(|c| c.center.z = -1e308), Err(CameraError::Far(..))));
    }

    #[test]
    fn pictures_of_other_sizes_show_the_same() {
        let c = Camera { principal_px: DVec2::new(300.0, 250.0), ..camera() };
        let p = c.center + c.ray(DVec2::new(100.0, 400.0)) * 2.0;
        let at = |c: &Camera| c.project(p).expect("in front");
        // Half as wide, a quarter as high.
        let other = c.resized(320, 120);
        assert_eq!((other.width_px, other.height_px), (320, 120));
        assert!((at(&other) - DVec2::new(50.0, 100.0)).length() < 1e-9, "{}", at(&other));
        let third = c.reduced(3);
        assert_eq!((third.width_px, third.height_px), (213, 160));
        assert!((at(&third) - DVec2::new(100.0 * 213.0 / 640.0, 400.0 / 3.0)).length() < 1e-9, "{}", at(&third));
        assert_eq!(c.reduced(0), c);
        assert_eq!((c.limited_to(640), c.limited_to(9_000)), (c.clone(), c.clone()));
        let small = c.limited_to(321);
        assert_eq!((small.width_px, small.height_px), (321, 241));
        assert!((at(&small).x - 100.0 * 321.0 / 640.0).abs() < 1e-9);
        assert_eq!(c.limited_to(1).height_px, 1);
        assert!((camera().fov_y_rad() - 0.8).abs() < 1e-12);
        assert_eq!(camera().principal_px, DVec2::new(320.0, 240.0));
    }

    #[test]
    fn what_is_beside_or_behind_is_not_projected() {
        let c = camera();
        assert_eq!((c.project(c.center), c.project(c.center - c.forward())), (None, None));
        assert!(c.project(c.center + c.world_from_camera.x_axis).is_none(), "depth 0");
        assert!(Camera::look_at(DVec3::ZERO, DVec3::ZERO, DVec3::Z, 0.8, 9, 9).is_none());
        assert!(Camera::look_at(DVec3::ZERO, DVec3::Z, DVec3::Z, 0.8, 9, 9).is_none());
        let up = Camera::up_of([&c].into_iter()).expect("one");
        assert!((up + c.world_from_camera.y_axis).length() < 1e-12);
        let mut turned = c.clone();
        turned.world_from_camera =
            glam::DMat3::from_cols(-c.world_from_camera.x_axis, -c.world_from_camera.y_axis, c.forward());
        assert!(Camera::up_of([&c, &turned].into_iter()).is_none(), "they cancel");
        assert!(Camera::up_of([&c, &c, &turned].into_iter()).is_some(), "two of three");
    }

    #[test]
    fn every_field_of_a_camera_is_checked_at_its_limit() {
        let with = |change: &dyn Fn(&mut Camera)| {
            let mut c = camera();
            change(&mut c);
            c.validate()
        };
        assert!(with(&|c| (c.width_px, c.height_px) = (Camera::MAX_SIDE_PX, 1)).is_ok());
        for size in [(0, 9), (9, 0), (Camera::MAX_SIDE_PX + 1, 9), (9, Camera::MAX_SIDE_PX + 1)] {
            assert_eq!(with(&|c| (c.width_px, c.height_px) = size), Err(CameraError::Size(size.0, size.1)));
        }
        for focal in [DVec2::new(0.0, 1.0), DVec2::new(1.0, -1.0), DVec2::new(f64::INFINITY, 1.0)] {
            assert!(matches!(with(&|c| c.focal_px = focal), Err(CameraError::Focal(..))), "{focal}");
        }
        assert!(matches!(with(&|c| c.principal_px.x = f64::NAN), Err(CameraError::Principal(..))));
        assert!(matches!(with(&|c| c.center.x = f64::NAN), Err(CameraError::Center(..))));
        assert!(with(&|c| c.world_from_camera.x_axis *= 1.0004).is_ok(), "8e-4 off");
        assert!(matches!(with(&|c| c.world_from_camera.x_axis *= 1.0006), Err(CameraError::Rotation(_))));
    }

    #[test]
    fn another_size_keeps_the_middle_and_the_vertical_view() {
        let camera = Camera::look_at(DVec3::new(1.0, -3.0, 1.0), DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid");
        let wide = camera.with_size(200, 96);
        wide.validate().expect("valid");
        let middle = wide.project(DVec3::ZERO).expect("in front");
        assert!((middle - DVec2::new(100.0, 48.0)).length() < 1e-9, "{middle}");
        let top = camera.center + camera.ray(DVec2::new(32.0, 0.0)) * 2.0;
        assert!(wide.project(top).expect("in front").y.abs() < 1e-9);
    }
}
