//! COLMAP's camera models.

use std::path::Path;

use glam::DVec2;

use crate::io::IoError;
use crate::io::photo_list::{Focal, Lens};
use crate::scene::{Camera, Distortion};

/// Name and number of parameters of each model, by its number in binary files.
const MODELS: [(&str, usize); 12] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
    ("RAD_TAN_THIN_PRISM_FISHEYE", 16),
];

/// Name and number of parameters of model number `id`.
pub(super) fn by_number(id: u32) -> Option<(&'static str, usize)> {
    MODELS.get(id as usize).copied()
}

/// The lens of a camera of the model named `model`.
pub(super) fn lens(model: &str, size: (u64, u64), params: &[f64], id: u32, path: &Path) -> Result<Lens, IoError> {
    let bad = |reason: String| IoError::Syntax { path: path.into(), place: format!("camera {id}"), reason };
    let (fx, fy, cx, cy, d) = match (model, params) {
        ("SIMPLE_PINHOLE", &[f, cx, cy]) => (f, f, cx, cy, [0.0; 4]),
        ("PINHOLE", &[fx, fy, cx, cy]) => (fx, fy, cx, cy, [0.0; 4]),
        ("SIMPLE_RADIAL", &[f, cx, cy, k1]) => (f, f, cx, cy, [k1, 0.0, 0.0, 0.0]),
        ("RADIAL", &[f, cx, cy, k1, k2]) => (f, f, cx, cy, [k1, k2, 0.0, 0.0]),
        ("OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2]) => (fx, fy, cx, cy, [k1, k2, p1, p2]),
        ("SIMPLE_PINHOLE" | "PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" | "OPENCV", _) => {
            return Err(bad(format!("{} parameters do not make a {model} camera", params.len())));
        }
        _ => {
            return Err(IoError::Unsupported {
                path: path.into(),
                what: format!("the camera model {}", model.chars().take(40).collect::<String>()),
                remedy: "undistort the photos with COLMAP's image_undistorter first",
            });
        }
    };
    let side = |v: u64| u32::try_from(v).ok().filter(|v| (1..=Camera::MAX_SIDE_PX).contains(v));
    let (Some(w), Some(h)) = (side(size.0), side(size.1)) else {
        return Err(bad(format!(
            "size {} x {} px is not between 1 and {} px a side",
            size.0,
            size.1,
            Camera::MAX_SIDE_PX
        )));
    };
    let [k1, k2, p1, p2] = d;
    Ok(Lens {
        size_px: Some((w, h)),
        focal: Focal::Px(DVec2::new(fx, fy)),
        principal_px: Some(DVec2::new(cx, cy)),
        distortion: Distortion { k1, k2, p1, p2 },
    })
}
