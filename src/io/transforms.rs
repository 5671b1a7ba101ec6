//! Photos listed in JSON: nerfstudio's and instant-ngp's `transforms.json`, Blender's
//! `transforms_{train,val,test}.json`.
//!
//! `transform_matrix` is world_from_camera with OpenGL camera axes (x right, y up, z back).

use std::collections::HashSet;
use std::path::Path;

use glam::{DMat3, DVec2, DVec3};
use serde::Deserialize;

use super::photo_list::{Focal, Lens, ListedPhoto, photos};
use super::{IoError, files, points_ply};
use crate::scene::{Camera, Dataset, Distortion};

/// Blender's synthetic scenes have no backdrop; the literature shows them on white.
const WHITE: [f32; 3] = [1.0; 3];

#[derive(Deserialize)]
struct File {
    #[serde(flatten)]
    lens: Intrinsics,
    frames: Vec<Frame>,
    ply_file_path: Option<String>,
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
    transform_matrix: Vec<Vec<f64>>,
    /// A picture of the pixels that count.
    mask_path: Option<String>,
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
    let root = file.parent().unwrap_or(Path::new("."));
    let parsed: File = files::read_json(file)?;
    let test: HashSet<String> =
        parsed.test_filenames.iter().map(|n| files::relative(root, n, file)).collect::<Result<_, _>>()?;
    let mut listed = Vec::with_capacity(parsed.frames.len());
    for frame in &parsed.frames {
        let mut l = frame.listed(&parsed.lens, root, file)?;
        l.test_split = test.contains(&l.name);
        listed.push(l);
    }
    let mut warnings = Vec::new();
    let photos = photos(listed, root, file, &mut warnings)?;
    let points = match &parsed.ply_file_path {
        None => Vec::new(),
        Some(entry) => match files::inside(root, &files::relative(root, entry, file)?, file)? {
            Some(path) => points_ply::read(&path)?,
            None => {
                warnings.push(format!("the sparse points {entry} are missing; training starts where the photos agree"));
                Vec::new()
            }
        },
    };
    Ok(Dataset {
        name: files::folder_name(root),
        root: root.into(),
        format: "transforms.json".into(),
        photos,
        points,
        background: parsed.fmlgs.background.filter(|b| b.iter().all(|c| (0.0..=1.0).contains(c))),
        metres_per_unit: parsed.fmlgs.metres_per_unit.filter(|m| m.is_finite() && *m > 0.0),
        warnings,
        alpha: None,
    })
}

/// nerfstudio's camera: 4x4 rows of world_from_camera with x right, y up, z back.
pub(crate) fn opengl_pose(camera: &Camera) -> [[f64; 4]; 4] {
    let m = camera.world_from_camera;
    let (x, y, z, c) = (m.x_axis, -m.y_axis, -m.z_axis, camera.center);
    [[x.x, y.x, z.x, c.x], [x.y, y.y, z.y, c.y], [x.z, y.z, z.z, c.z], [0.0, 0.0, 0.0, 1.0]]
}

/// Reads a Blender dataset: photos of `transforms_train.json` to train on, those of
/// `transforms_test.json` (or else of `transforms_val.json`) marked as test.
pub fn read_blender(root: &Path) -> Result<Dataset, IoError> {
    let train = root.join("transforms_train.json");
    let held_out =
        ["transforms_test.json", "transforms_val.json"].map(|n| root.join(n)).into_iter().find(|p| p.is_file());
    let mut warnings = Vec::new();
    let mut all = Vec::new();
    for (file, test_split) in std::iter::once((train, false)).chain(held_out.map(|p| (p, true))) {
        let parsed: File = files::read_json(&file)?;
        let mut listed = Vec::with_capacity(parsed.frames.len());
        for frame in &parsed.frames {
            let mut l = frame.listed(&parsed.lens, root, &file)?;
            l.test_split = test_split;
            l.background = Some(WHITE);
            listed.push(l);
        }
        all.extend(photos(listed, root, &file, &mut warnings)?);
    }
    all.sort_by(|a, b| a.name.cmp(&b.name));
    if let Some(pair) = all.windows(2).find(|w| w[0].name == w[1].name) {
        return Err(IoError::Duplicate { path: root.into(), photo: pair[0].name.clone() });
    }
    Ok(Dataset {
        name: files::folder_name(root),
        root: root.into(),
        format: "Blender synthetic".into(),
        photos: all,
        background: Some(WHITE),
        warnings,
        ..Dataset::default()
    })
}

impl Frame {
    fn listed(&self, shared: &Intrinsics, root: &Path, source: &Path) -> Result<ListedPhoto, IoError> {
        let name = files::relative(root, &self.file_path, source)?;
        let bad = |reason: String| IoError::Syntax { path: source.into(), place: format!("frame '{name}'"), reason };
        let (world_from_camera, center) = pose(&self.transform_matrix).map_err(|r| bad(r.into()))?;
        let lens = self.lens.or(shared).lens(source, &bad)?;
        Ok(ListedPhoto {
            entry: name.clone(),
            name,
            lens,
            world_from_camera,
            center,
            test_split: false,
            background: None,
            mask: self.mask_path.clone(),
        })
    }
}

/// Rotation (columns right, down, forward) and center of an OpenGL world_from_camera matrix.
fn pose(m: &[Vec<f64>]) -> Result<(DMat3, DVec3), &'static str> {
    let rows: Vec<[f64; 4]> = m.iter().filter_map(|r| r.as_slice().try_into().ok()).collect();
    if rows.len() != m.len() || !(3..=4).contains(&rows.len()) {
        return Err("transform_matrix is not 4 x 4");
    }
    if rows.get(3).is_some_and(|last| *last != [0.0, 0.0, 0.0, 1.0]) {
        return Err("the last row of transform_matrix is not 0 0 0 1");
    }
    let column = |c: usize| DVec3::new(rows[0][c], rows[1][c], rows[2][c]);
    Ok((DMat3::from_cols(column(0), -column(1), -column(2)), column(3)))
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
