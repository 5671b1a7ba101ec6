//! COLMAP's camera models.

use std::path::Path;

use glam::DVec2;

use crate::io::IoError;
use crate::io::lenses::PANORAMA;
use crate::io::photo_list::{Focal, Lens};
use crate::scene::{Camera, Distortion, Projection};

/// A camera model by its number in binary files.
#[derive(Debug)]
pub(super) struct LensModel {
    name: &'static str,
    pub(super) params: usize,
    /// Parameters before the principal point; 0 = there is none.
    focals: usize,
}

const fn model(name: &'static str, params: usize, focals: usize) -> LensModel {
    LensModel { name, params, focals }
}

/// The models of COLMAP 4, in the order of their numbers.
const MODELS: [LensModel; 18] = [
    model("SIMPLE_PINHOLE", 3, 1),
    model("PINHOLE", 4, 2),
    model("SIMPLE_RADIAL", 4, 1),
    model("RADIAL", 5, 1),
    model("OPENCV", 8, 2),
    model("OPENCV_FISHEYE", 8, 2),
    model("FULL_OPENCV", 12, 2),
    model("FOV", 5, 2),
    model("SIMPLE_RADIAL_FISHEYE", 4, 1),
    model("RADIAL_FISHEYE", 5, 1),
    model("THIN_PRISM_FISHEYE", 12, 2),
    model("RAD_TAN_THIN_PRISM_FISHEYE", 16, 2),
    model("SIMPLE_DIVISION", 4, 1),
    model("DIVISION", 5, 2),
    model("SIMPLE_FISHEYE", 3, 1),
    model("FISHEYE", 4, 2),
    model("EUCM", 6, 2),
    model(PANORAMA, 2, 0),
];

/// A camera, or the name of its model if that cannot be undistorted.
pub(super) type FoundLens = Result<Lens, String>;

/// Returns model number `number` of the camera `place`.
pub(super) fn by_number(number: u32, place: &str, path: &Path) -> Result<&'static LensModel, IoError> {
    MODELS.get(number as usize).ok_or_else(|| IoError::Unsupported {
        path: path.into(),
        what: format!("the camera model number {number} ({place}), newer than COLMAP 4's {}", MODELS.len()),
        remedy: "undistort the photos with COLMAP's image_undistorter first",
    })
}

/// Returns the model of a name; an unknown one is reported once a photo needs it.
pub(super) fn by_name(name: &str) -> Result<&'static LensModel, String> {
    MODELS.iter().find(|m| m.name == name).ok_or_else(|| name.chars().take(40).collect())
}

/// Makes the camera `id` of a model.
pub(super) fn lens(
    model: &LensModel,
    size: (u64, u64),
    params: &[f64],
    id: u32,
    path: &Path,
) -> Result<FoundLens, IoError> {
    let bad = |reason: String| IoError::Syntax { path: path.into(), place: format!("camera {id}"), reason };
    if params.len() != model.params {
        return Err(bad(format!("{} parameters do not make a {} camera", params.len(), model.name)));
    }
    let Some((focal, principal, distortion)) = parts(model, params) else { return Ok(Err(model.name.into())) };
    let side = |v: u64| u32::try_from(v).ok().filter(|v| (1..=Camera::MAX_SIDE_PX).contains(v));
    let (Some(w), Some(h)) = (side(size.0), side(size.1)) else {
        return Err(bad(format!(
            "size {} x {} px is not between 1 and {} px a side",
            size.0,
            size.1,
            Camera::MAX_SIDE_PX
        )));
    };
    Ok(Ok(Lens { size_px: Some((w, h)), focal: Focal::Px(focal), principal_px: Some(principal), distortion }))
}

/// Splits parameters into focal lengths, principal point and distortion; `None` for a model without a pinhole.
fn parts(model: &LensModel, params: &[f64]) -> Option<(DVec2, DVec2, Distortion)> {
    let (focal, principal, rest) = match (model.focals, params) {
        (1, [f, cx, cy, rest @ ..]) => (DVec2::splat(*f), DVec2::new(*cx, *cy), rest),
        (2, [fx, fy, cx, cy, rest @ ..]) => (DVec2::new(*fx, *fy), DVec2::new(*cx, *cy), rest),
        _ => return None,
    };
    let plain = |[k1, k2, p1, p2]: [f64; 4]| Distortion { k1, k2, p1, p2, ..Distortion::default() };
    let of = |projection| Distortion { projection, ..Distortion::default() };
    let fisheye = |k: [f64; 4], p1, p2| Distortion {
        more: [k[2], k[3], 0.0, 0.0],
        projection: Projection::Fisheye,
        ..plain([k[0], k[1], p1, p2])
    };
    let distortion = match (model.name, rest) {
        ("SIMPLE_PINHOLE" | "PINHOLE", []) => Distortion::default(),
        ("SIMPLE_RADIAL", &[k1]) => plain([k1, 0.0, 0.0, 0.0]),
        ("RADIAL", &[k1, k2]) => plain([k1, k2, 0.0, 0.0]),
        ("OPENCV", &[k1, k2, p1, p2]) => plain([k1, k2, p1, p2]),
        ("FULL_OPENCV", &[k1, k2, p1, p2, k3, k4, k5, k6]) => {
            Distortion { more: [k3, 0.0, 0.0, 0.0], divisor: [k4, k5, k6], ..plain([k1, k2, p1, p2]) }
        }
        ("SIMPLE_FISHEYE" | "FISHEYE", []) => of(Projection::Fisheye),
        ("SIMPLE_RADIAL_FISHEYE", &[k1]) => fisheye([k1, 0.0, 0.0, 0.0], 0.0, 0.0),
        ("RADIAL_FISHEYE", &[k1, k2]) => fisheye([k1, k2, 0.0, 0.0], 0.0, 0.0),
        ("OPENCV_FISHEYE", &[k1, k2, k3, k4]) => fisheye([k1, k2, k3, k4], 0.0, 0.0),
        ("THIN_PRISM_FISHEYE", &[k1, k2, p1, p2, k3, k4, s1, s2]) => {
            Distortion { prism: [s1, 0.0, s2, 0.0], ..fisheye([k1, k2, k3, k4], p1, p2) }
        }
        // Its tangential parameters come in the other order.
        ("RAD_TAN_THIN_PRISM_FISHEYE", &[k1, k2, k3, k4, k5, k6, p2, p1, s1, s2, s3, s4]) => Distortion {
            more: [k3, k4, k5, k6],
            prism: [s1, s2, s3, s4],
            radial_first: true,
            ..fisheye([k1, k2, k3, k4], p1, p2)
        },
        ("FOV", &[omega]) => of(Projection::Fov(omega)),
        ("SIMPLE_DIVISION" | "DIVISION", &[k]) => of(Projection::Division(k)),
        ("EUCM", &[alpha, beta]) => of(Projection::Unified(alpha, beta)),
        _ => return None,
    };
    Some((focal, principal, distortion))
}

#[cfg(test)]
mod tests;
