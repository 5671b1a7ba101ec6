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
use super::{IoError, files, lenses, points_ply};
use crate::scene::{Camera, Dataset, Distortion, Projection, text};

/// Usual name of a list.
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
    /// Keys of this program's own data sets beyond nerfstudio's.
    #[serde(default)]
    fmlgs: Own,
}

#[derive(Default, Deserialize)]
struct Own {
    /// sRGB color behind everything, 0 to 1.
    background: Option<[f32; 3]>,
    #[serde(rename = "metres_per_unit")]
    meters_per_unit: Option<f64>,
}

#[derive(Deserialize)]
struct Frame {
    file_path: String,
    transform_matrix: Matrix,
    /// Mask of the pixels that count.
    mask_path: Option<String>,
    #[serde(flatten)]
    lens: Intrinsics,
}

/// Lens values, in the file's head for all photos or in a frame for one.
#[derive(Clone, Default, Deserialize)]
struct Intrinsics {
    camera_model: Option<String>,
    is_fisheye: Option<bool>,
    /// instant-ngp's panoramas.
    equirectangular: Option<bool>,
    latlong: Option<bool>,
    /// instant-ngp's F-theta lenses.
    ftheta_p0: Option<f64>,
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
    k5: Option<f64>,
    k6: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
}

/// Reads the dataset of a `transforms.json`.
pub fn read(file: &Path) -> Result<Dataset, IoError> {
    let root = files::folder_of(file);
    let parsed = File::read(file)?;
    let finder = PhotoFinder::new(root)?;
    let listed: Vec<_> =
        parsed.frames.iter().map(|frame| frame.listed(&parsed.lens, file)).collect::<Result<_, _>>()?;
    let mut warnings = Vec::new();
    let mut listed = lenses::readable(listed, file, &mut warnings)?;
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
                warnings.push(format!("the sparse points {entry} are missing; training starts where the photos agree"));
                Vec::new()
            }
        },
    };
    Ok(Dataset {
        name: files::data_set_name(root),
        root: root.into(),
        source: file.file_name().is_some_and(|name| name != USUAL).then(|| file.into()),
        format: "transforms.json".into(),
        photos,
        points,
        background: parsed.fmlgs.background.filter(|b| b.iter().all(|c| (0.0..=1.0).contains(c))),
        meters_per_unit: parsed.fmlgs.meters_per_unit.filter(|m| m.is_finite() && *m > 0.0),
        warnings,
        alpha: None,
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
    /// Makes the photo, or returns the name of its camera model if that is not supported.
    fn listed(&self, shared: &Intrinsics, source: &Path) -> Result<Result<ListedPhoto, String>, IoError> {
        let name = &self.file_path;
        let bad = |reason: String| IoError::Syntax { path: source.into(), place: format!("frame '{name}'"), reason };
        let lens = match self.lens.or(shared).lens(&bad)? {
            Ok(lens) => lens,
            Err(model) => return Ok(Err(model)),
        };
        let (pose, broken) = match pose(&self.transform_matrix) {
            Ok(pose) => (pose, None),
            Err(why) => ((DMat3::IDENTITY, DVec3::ZERO, false), Some(why)),
        };
        let (world_from_camera, center, normalized) = pose;
        Ok(Ok(ListedPhoto {
            entry: name.clone(),
            folder: String::new(),
            lens,
            world_from_camera,
            center,
            normalized,
            broken,
            test_split: false,
            background: None,
            mask: self.mask_path.clone(),
        }))
    }
}

impl Intrinsics {
    /// Fills missing values from `shared`. An angle or focal length of a frame overrides both of the shared ones.
    fn or(&self, shared: &Self) -> Self {
        let own_focal = self.fl_x.is_some() || self.camera_angle_x.is_some();
        let focal = if own_focal { self } else { shared };
        Self {
            camera_model: self.camera_model.clone().or_else(|| shared.camera_model.clone()),
            is_fisheye: self.is_fisheye.or(shared.is_fisheye),
            equirectangular: self.equirectangular.or(shared.equirectangular),
            latlong: self.latlong.or(shared.latlong),
            ftheta_p0: self.ftheta_p0.or(shared.ftheta_p0),
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
            k5: self.k5.or(shared.k5),
            k6: self.k6.or(shared.k6),
            p1: self.p1.or(shared.p1),
            p2: self.p2.or(shared.p2),
        }
    }

    /// Returns the distortion of the lens, or the name of its model if that is not supported.
    fn distortion(&self) -> Result<Distortion, String> {
        let model = self.camera_model.as_deref().unwrap_or_default().to_ascii_uppercase();
        let [k1, k2, k3, k4, k5, k6, p1, p2] =
            [self.k1, self.k2, self.k3, self.k4, self.k5, self.k6, self.p1, self.p2].map(Option::unwrap_or_default);
        let of = |more, divisor, projection| {
            Ok(Distortion { k1, k2, p1, p2, more, divisor, projection, ..Distortion::default() })
        };
        let fisheye = self.is_fisheye == Some(true);
        match model.as_str() {
            _ if self.equirectangular == Some(true) => Err(lenses::PANORAMA.into()),
            _ if self.latlong == Some(true) => Err("LATLONG".into()),
            _ if self.ftheta_p0.is_some() => Err("FTHETA".into()),
            "OPENCV_FISHEYE" | "FISHEYE" | "SIMPLE_FISHEYE" | "RADIAL_FISHEYE" | "SIMPLE_RADIAL_FISHEYE" => {
                of([k3, k4, k5, k6], [0.0; 3], Projection::Fisheye)
            }
            "" | "SIMPLE_PINHOLE" | "PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" | "OPENCV" | "PERSPECTIVE"
            | "FULL_OPENCV" => {
                match model == "FULL_OPENCV" || k5 != 0.0 || k6 != 0.0 {
                    _ if fisheye => of([k3, k4, k5, k6], [0.0; 3], Projection::Fisheye),
                    // OpenCV's k4 to k6 divide; nerfstudio's and Metashape's k4 is one more power.
                    true => of([k3, 0.0, 0.0, 0.0], [k4, k5, k6], Projection::Perspective),
                    false => of([k3, k4, 0.0, 0.0], [0.0; 3], Projection::Perspective),
                }
            }
            _ => Err(text::shortened(&model, 40).into_owned()),
        }
    }

    /// Returns the lens, or the name of its model if that is not supported; `bad` makes an error of an invalid value.
    fn lens(&self, bad: &dyn Fn(String) -> IoError) -> Result<Result<Lens, String>, IoError> {
        let distortion = match self.distortion() {
            Ok(distortion) => distortion,
            Err(model) => return Ok(Err(model)),
        };
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
        Ok(Ok(Lens { size_px, focal, principal_px, distortion }))
    }
}

/// Checks a picture side in px, which files give as a floating-point number.
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
