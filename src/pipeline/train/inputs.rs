//! Inputs of a training run at its start, so that changes are detected when it is resumed.

use std::collections::BTreeMap;
use std::path::Path;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::io::{IoError, files, files::hex};
use crate::math::format::{number, things};
use crate::scene::{Camera, Dataset, Distortion, Photo};

/// Relative difference of positions and rotations up to which it is rounding of a text file.
const ROUNDING: f64 = 1e-9;
/// Most names that are listed for each kind of change.
const NAMED: usize = 3;

/// Comparison of files: by contents or by size alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Compare {
    Contents,
    Sizes,
}

/// Inputs of a training run: cameras, files and sparse points.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrainInputs {
    photos: Vec<PhotoInput>,
    points: usize,
    /// SHA-256 of the sparse points' positions and colors.
    points_sha256: String,
    background: Option<[f32; 3]>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct PhotoInput {
    name: String,
    camera: Camera,
    distortion: Option<Distortion>,
    background: Option<[f32; 3]>,
    test_split: bool,
    #[serde(default)]
    cut_out: bool,
    files: Vec<FileInput>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct FileInput {
    bytes: u64,
    sha256: Option<String>,
}

impl TrainInputs {
    /// Records the inputs in `dataset`. Reads every file if contents are compared.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub(crate) fn of(dataset: &Dataset, compare: Compare) -> Result<Self, IoError> {
        let photos: Result<Vec<PhotoInput>, IoError> =
            dataset.photos.par_iter().map(|photo| PhotoInput::of(photo, compare)).collect();
        let mut sum = Sha256::new();
        for point in &dataset.points {
            point.position.to_array().iter().for_each(|x| sum.update(x.to_le_bytes()));
            sum.update(point.rgb);
        }
        let (points, points_sha256) = (dataset.points.len(), hex(&sum.finalize()));
        Ok(Self { photos: photos?, points, points_sha256, background: dataset.background })
    }

    /// Checksum of all inputs.
    pub(crate) fn digest(&self) -> String {
        hex(&Sha256::digest(serde_json::to_vec(self).unwrap_or_default()))
    }

    /// Describes the changes, one phrase for each kind; empty if nothing changed.
    pub(crate) fn changes(&self, now: &Self) -> Vec<String> {
        let by_name =
            |all: &'_ Self| all.photos.iter().map(|p| (p.name.clone(), p.clone())).collect::<BTreeMap<_, _>>();
        let (before, after) = (by_name(self), by_name(now));
        let missing = |from: &BTreeMap<String, PhotoInput>, names: &BTreeMap<String, PhotoInput>| -> Vec<String> {
            names.keys().filter(|name| !from.contains_key(*name)).cloned().collect()
        };
        let (gone, new) = (missing(&after, &before), missing(&before, &after));
        let both: Vec<[&PhotoInput; 2]> = before.iter().filter_map(|(k, b)| Some([b, after.get(k)?])).collect();
        let which = |is: &dyn Fn(&PhotoInput, &PhotoInput) -> bool| -> Vec<String> {
            both.iter().filter(|[b, a]| is(b, a)).map(|[b, _]| b.name.clone()).collect()
        };
        let mut told = Vec::new();
        let mut tell = |names: Vec<String>, one: &str, many: &str| {
            if !names.is_empty() {
                let what = if names.len() == 1 { one } else { many };
                told.push(format!("{} {what} ({})", things(names.len(), "photo"), listed(&names)));
            }
        };
        tell(gone, "is gone", "are gone");
        tell(new, "is new", "are new");
        let moved: Vec<(f64, f64)> = both.iter().map(|[b, a]| moved(&b.camera, &a.camera)).collect();
        let most = moved.iter().fold((0.0, 0.0), |m: (f64, f64), v| (m.0.max(v.0), m.1.max(v.1)));
        let how = format!("moved by up to {} units and turned by up to {}\u{b0}", amount(most.0), amount(most.1));
        let is_moved = both.iter().zip(&moved).filter(|(_, m)| **m != (0.0, 0.0));
        tell(is_moved.map(|([b, _], _)| b.name.clone()).collect(), &how, &how);
        let lens = which(&|b, a| !same_lens(&b.camera, &a.camera) || b.distortion != a.distortion);
        tell(lens, "has another lens or size", "have other lenses or sizes");
        let pixels = which(&|b, a| b.files != a.files || b.background != a.background || b.cut_out != a.cut_out);
        tell(pixels, "has other pixels", "have other pixels");
        let marks = which(&|b, a| b.test_split != a.test_split);
        tell(marks, "is marked otherwise as test", "are marked otherwise as test");
        if (self.points, &self.points_sha256) != (now.points, &now.points_sha256) {
            told.push(format!("the sparse points are others ({} then, {} now)", self.points, now.points));
        }
        if self.background != now.background {
            told.push("the background has another color".into());
        }
        told
    }
}

impl PhotoInput {
    fn of(photo: &Photo, compare: Compare) -> Result<Self, IoError> {
        let file = |path: &Path| -> Result<FileInput, IoError> {
            let read = |cause| IoError::Read { path: path.into(), cause };
            let bytes = files::open(path)?.metadata().map_err(read)?.len();
            let sha256 = (compare == Compare::Contents).then(|| files::sha256(path)).transpose()?;
            Ok(FileInput { bytes, sha256 })
        };
        Ok(Self {
            name: photo.name.clone(),
            camera: photo.camera.clone(),
            distortion: photo.distortion,
            background: photo.background,
            test_split: photo.test_split,
            cut_out: photo.cut_out,
            files: std::iter::once(&photo.path).chain(&photo.mask).map(|path| file(path)).collect::<Result<_, _>>()?,
        })
    }
}

/// Distance in scene units and angle in degrees between two poses, both 0 up to rounding.
fn moved(before: &Camera, now: &Camera) -> (f64, f64) {
    let distance = before.center.distance(now.center);
    let chord = (before.world_from_camera - now.world_from_camera).to_cols_array();
    let chord = chord.iter().map(|v| v * v).sum::<f64>().sqrt();
    let angle = 2.0 * (chord / 8.0_f64.sqrt()).min(1.0).asin();
    let scale = 1.0 + before.center.length();
    let beyond = |value: f64, most: f64| if value > most { value } else { 0.0 };
    (beyond(distance, ROUNDING * scale), beyond(angle, ROUNDING).to_degrees())
}

fn same_lens(before: &Camera, now: &Camera) -> bool {
    let near = |a: glam::DVec2, b: glam::DVec2| a.distance(b) <= ROUNDING * (1.0 + a.length());
    (before.width_px, before.height_px) == (now.width_px, now.height_px)
        && near(before.focal_px, now.focal_px)
        && near(before.principal_px, now.principal_px)
}

/// Number without trailing zeros.
fn amount(v: f64) -> String {
    let text = number(v);
    if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        text
    }
}

/// Joins the first few names.
fn listed(names: &[String]) -> String {
    let more = if names.len() > NAMED { ", ..." } else { "" };
    format!("{}{more}", names[..names.len().min(NAMED)].join(", "))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::SparsePoint;

    /// Dataset with three photos on disk and two points.
    fn dataset(folder: &Path) -> Dataset {
        let photo = |k: usize| {
            let path = folder.join(format!("{k}.png"));
            std::fs::write(&path, [k as u8; 9]).expect("written");
            let eye = DVec3::new(1.0 + k as f64, -3.0, 1.0);
            Photo::new(
                format!("{k}.png"),
                path,
                Camera::look_at(eye, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid"),
            )
        };
        let points = vec![SparsePoint { position: DVec3::ONE, rgb: [1, 2, 3] }; 2];
        Dataset { photos: (0..3).map(photo).collect(), points, ..Dataset::default() }
    }

    #[test]
    fn each_change_is_named_and_nothing_else() {
        let folder = tempfile::tempdir().expect("folder");
        let data = dataset(folder.path());
        let of = |d: &Dataset| TrainInputs::of(d, Compare::Contents).expect("read");
        let before = of(&data);
        let kept: TrainInputs = serde_json::from_slice(&serde_json::to_vec(&before).expect("json")).expect("read");
        assert!(kept.changes(&of(&data)).is_empty(), "the control: nothing has changed");
        let changed = |change: &dyn Fn(&mut Dataset)| {
            let mut now = data.clone();
            change(&mut now);
            before.changes(&of(&now))
        };
        assert!(changed(&|d| d.photos[0].camera.center.x += 1e-12).is_empty(), "rounding is no change");
        let found = changed(&|d| d.photos.iter_mut().for_each(|p| p.camera.center.x += 0.2));
        assert_eq!(found, ["3 photos moved by up to 0.2 units and turned by up to 0\u{b0} (0.png, 1.png, 2.png)"]);
        let turn = glam::DMat3::from_rotation_z(0.1_f64.to_radians());
        let found = changed(&|d| d.photos[1].camera.world_from_camera = turn * d.photos[1].camera.world_from_camera);
        assert_eq!(found, ["1 photo moved by up to 0 units and turned by up to 0.1\u{b0} (1.png)"]);
        assert_eq!(changed(&|d| d.photos[2].camera.focal_px *= 1.01), ["1 photo has another lens or size (2.png)"]);
        let lens = |d: &mut Dataset| d.photos[2].distortion = Some(Distortion { k1: 0.1, ..Distortion::default() });
        assert_eq!(changed(&lens), ["1 photo has another lens or size (2.png)"]);
        assert_eq!(changed(&|d| d.photos[0].test_split = true), ["1 photo is marked otherwise as test (0.png)"]);
        assert_eq!(
            changed(&|d| d.photos[0].name = "z.png".into()),
            ["1 photo is gone (0.png)", "1 photo is new (z.png)"]
        );
        let point = |d: &mut Dataset| d.points[0].position.x += 1.0;
        assert_eq!(changed(&point), ["the sparse points are others (2 then, 2 now)"]);
        assert_eq!(changed(&|d| d.background = Some([1.0; 3])), ["the background has another color"]);
    }

    #[test]
    fn pixels_are_told_apart_by_contents_and_by_sizes() {
        let folder = tempfile::tempdir().expect("folder");
        let data = dataset(folder.path());
        let of = |compare| TrainInputs::of(&data, compare).expect("read");
        let before = [of(Compare::Contents), of(Compare::Sizes)];
        std::fs::write(&data.photos[1].path, [7; 9]).expect("the same size");
        assert_eq!(before[0].changes(&of(Compare::Contents)), ["1 photo has other pixels (1.png)"]);
        assert_eq!(before[1].digest(), of(Compare::Sizes).digest(), "the size is the same");
        std::fs::write(&data.photos[1].path, [7; 10]).expect("another size");
        assert_ne!(before[1].digest(), of(Compare::Sizes).digest());
        std::fs::remove_file(&data.photos[1].path).expect("gone");
        assert!(TrainInputs::of(&data, Compare::Sizes).is_err());
    }
}
