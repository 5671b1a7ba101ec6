//! Photos listed in JSON: nerfstudio's and instant-ngp's `transforms.json`, Blender's
//! `transforms_{train,val,test}.json`.
//!
//! `transform_matrix` is world_from_camera with OpenGL camera axes (x right, y up, z back).

mod blender;
mod matrix;

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};
use serde::Deserialize;

pub use blender::read_blender;
use matrix::{Matrix, pose};

use super::photo_list::{Focal, Lens, ListedPhoto, Lookup, PhotoFinder, photos, unlisted};
use super::splits::Splits;
use super::{IoError, files, points_ply};
use crate::scene::{Camera, Dataset, Distortion};

/// The usual name of a list.
pub(crate) const USUAL: &str = "transforms.json";

#[derive(Deserialize)]
struct File {
    #[serde(flatten)]
    lens: Intrinsics,
    frames: Vec<Frame>,
    ply_file_path: Option<String>,
    #[serde(default)]
    train_filenames: Vec<String>,
    #[serde(default)]
    val_filenames: Vec<String>,
    #[serde(default)]
    test_filenames: Vec<String>,
    /// What this program's own data sets say beyond nerfstudio's keys.
    #[serde(default)]
    fmlgs: Own,
}

#[derive(Default, Deserialize)]
struct Own {
    /// sRGB color behind everything, 0 to 1.
    background: Option<[f32; 3]>,
    metres_per_unit: Option<f64>,
}

#[derive(Deserialize)]
struct Frame {
    file_path: String,
    transform_matrix: Matrix,
    #[serde(flatten)]
    lens: Intrinsics,
}

/// Lens values, in the file's head for all photos or in a frame for one.
#[derive(Clone, Default, Deserialize)]
struct Intrinsics {
    camera_model: Option<String>,
    is_fisheye: Option<bool>,
    w: Option<f64>,
    h: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
}

/// Reads the dataset that a `transforms.json` describes.
pub fn read(file: &Path) -> Result<Dataset, IoError> {
    let root = files::folder_of(file);
    let parsed = File::read(file)?;
    let finder = PhotoFinder::new(root)?;
    let mut listed: Vec<ListedPhoto> =
        parsed.frames.iter().map(|frame| frame.listed(&parsed.lens, file)).collect::<Result<_, _>>()?;
    let mut warnings = Vec::new();
    let list = |name: &str, names: &[String]| (name.to_owned(), names.to_owned());
    let splits = Splits {
        train: vec![list("train_filenames", &parsed.train_filenames)],
        held_out: vec![list("val_filenames", &parsed.val_filenames), list("test_filenames", &parsed.test_filenames)],
    };
    splits.apply(&mut listed, &finder, &mut warnings);
    let photos = photos(listed, root, file, &mut warnings)?;
    warnings.extend(unlisted(&photos, parsed.frames.iter().map(|frame| &*frame.file_path), root));
    let points = match &parsed.ply_file_path {
        None => points_ply::beside(root).map(|path| points_ply::read(&path)).transpose()?.unwrap_or_default(),
        Some(entry) => match finder.find("", entry) {
            Lookup::Found(found) => {
                if let Some(called) = found.called {
                    warnings.push(format!("the sparse points {entry} were found as {called}"));
                }
                points_ply::read(&found.path)?
            }
            Lookup::Outside => {
                return Err(IoError::Outside { path: file.into(), entry: entry.clone(), folder: root.into() });
            }
            Lookup::Missing | Lookup::Several(_) => {
                warnings.push(format!("the sparse points {entry} are missing; training starts from random points"));
                Vec::new()
            }
        },
    };
    Ok(Dataset {
        name: files::folder_name(root),
        root: root.into(),
        source: file.file_name().is_some_and(|name| name != USUAL).then(|| file.into()),
        format: "transforms.json".into(),
        photos,
        points,
        background: parsed.fmlgs.background.filter(|b| b.iter().all(|c| (0.0..=1.0).contains(c))),
        metres_per_unit: parsed.fmlgs.metres_per_unit.filter(|m| m.is_finite() && *m > 0.0),
        warnings,
    })
}

impl File {
    fn read(path: &Path) -> Result<Self, IoError> {
        let bytes = files::read(path, files::MAX_TEXT_BYTES)?;
        files::json(&matrix::quoted(&bytes), path)
    }
}

/// nerfstudio's camera: 4x4 rows of world_from_camera with x right, y up, z back.
pub(crate) fn opengl_pose(camera: &Camera) -> [[f64; 4]; 4] {
    let m = camera.world_from_camera;
    let (x, y, z, c) = (m.x_axis, -m.y_axis, -m.z_axis, camera.center);
    [[x.x, y.x, z.x, c.x], [x.y, y.y, z.y, c.y], [x.z, y.z, z.z, c.z], [0.0, 0.0, 0.0, 1.0]]
}

impl Frame {
    fn listed(&self, shared: &Intrinsics, source: &Path) -> Result<ListedPhoto, IoError> {
        let name = &self.file_path;
        let bad = |reason: String| IoError::Syntax { path: source.into(), place: format!("frame '{name}'"), reason };
        let lens = self.lens.or(shared).lens(source, &bad)?;
        let (pose, broken) = match pose(&self.transform_matrix) {
            Ok(pose) => (pose, None),
            Err(why) => ((DMat3::IDENTITY, DVec3::ZERO, false), Some(why)),
        };
        let (world_from_camera, center, normalized) = pose;
        Ok(ListedPhoto {
            entry: name.clone(),
            folder: String::new(),
            lens,
            world_from_camera,
            center,
            normalized,
            broken,
            test_split: false,
            background: None,
        })
    }
}

impl Intrinsics {
    /// These values, with those that are missing taken from `shared`. A frame that gives an angle
    /// or a focal length of its own overrides both of the shared ones.
    fn or(&self, shared: &Self) -> Self {
        let own_focal = self.fl_x.is_some() || self.camera_angle_x.is_some();
        let focal = if own_focal { self } else { shared };
        Self {
            camera_model: self.camera_model.clone().or_else(|| shared.camera_model.clone()),
            is_fisheye: self.is_fisheye.or(shared.is_fisheye),
            w: self.w.or(shared.w),
            h: self.h.or(shared.h),
            fl_x: focal.fl_x,
            fl_y: focal.fl_y,
            camera_angle_x: focal.camera_angle_x,
            camera_angle_y: focal.camera_angle_y,
            cx: self.cx.or(shared.cx),
            cy: self.cy.or(shared.cy),
            k1: self.k1.or(shared.k1),
            k2: self.k2.or(shared.k2),
            k3: self.k3.or(shared.k3),
            k4: self.k4.or(shared.k4),
            p1: self.p1.or(shared.p1),
            p2: self.p2.or(shared.p2),
        }
    }

    /// The lens; `bad` makes an error of a value that cannot be.
    fn lens(&self, source: &Path, bad: &dyn Fn(String) -> IoError) -> Result<Lens, IoError> {
        let remedy = "undistort the photos to a pinhole camera first";
        let unsupported = |what: String| IoError::Unsupported { path: source.into(), what, remedy };
        let known = ["SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "PERSPECTIVE"];
        if let Some(model) = self.camera_model.as_deref().filter(|m| !known.contains(m)) {
            return Err(unsupported(format!("the camera model {model}")));
        }
        if self.is_fisheye == Some(true) {
            return Err(unsupported("a fisheye camera model".into()));
        }
        if [self.k3, self.k4].iter().any(|k| k.is_some_and(|k| k != 0.0)) {
            return Err(unsupported("the distortion coefficients k3 or k4".into()));
        }
        let focal = match (self.fl_x, self.camera_angle_x) {
            (Some(x), _) => Focal::Px(DVec2::new(x, self.fl_y.unwrap_or(x))),
            (None, Some(x)) => Focal::Angle(x, self.camera_angle_y),
            (None, None) => return Err(bad("neither fl_x nor camera_angle_x is given".into())),
        };
        let size_px = match (self.w, self.h) {
            (Some(w), Some(h)) => Some((side("w", w).map_err(bad)?, side("h", h).map_err(bad)?)),
            _ => None,
        };
        let principal_px = match (self.cx, self.cy) {
            (Some(x), Some(y)) => Some(DVec2::new(x, y)),
            _ => None,
        };
        let [k1, k2, p1, p2] = [self.k1, self.k2, self.p1, self.p2].map(Option::unwrap_or_default);
        let distortion = Distortion { k1, k2, p1, p2 };
        Ok(Lens { size_px, focal, principal_px, distortion })
    }
}

/// A picture side in px, which files give as a floating-point number.
fn side(name: &str, value: f64) -> Result<u32, String> {
    let max = f64::from(Camera::MAX_SIDE_PX);
    if value >= 1.0 && value <= max && value.fract() == 0.0 {
        Ok(value as u32)
    } else {
        Err(format!("{name} = {value} is not a whole number of px between 1 and {max}"))
    }
}

#[cfg(test)]
mod tests;
