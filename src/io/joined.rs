//! Photos of a data set with others that were added to it: `joined.json`.
//!
//! A scene that close-ups were added to names its photos so. Like `scene.json`, this program writes the file itself and
//! the paths in it may lead anywhere; only pictures and a data set are read from there. Added photos have their cameras in
//! it, in the frame of the data set.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::scene_info::relative_to;
use super::{IoError, atomic, files, pixel_masks, posed};
use crate::scene::{Camera, Dataset, Distortion, Photo, text};

/// Name of the list.
pub(crate) const JOINED_FILE: &str = "joined.json";
const VERSION: u64 = 1;

/// Contents of the list.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct JoinedPhotos {
    pub(crate) version: u64,
    #[serde(default, deserialize_with = "text::read_name")]
    pub(crate) name: String,
    /// Path of the data set, from the list's folder where it can be.
    pub(crate) photos: PathBuf,
    /// Names of its photos that are held out.
    pub(crate) held_out: BTreeSet<String>,
    pub(crate) added: Vec<AddedPhoto>,
    /// Cameras of photos of the data set at poses that training refined, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) refined: BTreeMap<String, Camera>,
    /// Request that made the list, to resume it.
    #[serde(default)]
    pub(crate) request: serde_json::Value,
}

/// A photo that was added.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AddedPhoto {
    /// Name, different from those of all others.
    pub(crate) name: String,
    /// Path of the file, from the list's folder where it can be.
    pub(crate) path: PathBuf,
    /// Pinhole camera of the undistorted photo at full size.
    pub(crate) camera: Camera,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) distortion: Option<Distortion>,
    /// Picture of the pixels that count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) mask: Option<PathBuf>,
    #[serde(default)]
    pub(crate) held_out: bool,
    /// True if its pose was found in the scene.
    #[serde(default)]
    pub(crate) located: bool,
}

impl AddedPhoto {
    /// Returns the photo in the list's folder.
    pub(crate) fn photo(&self, folder: &Path) -> Photo {
        Photo {
            distortion: self.distortion,
            mask: self.mask.as_ref().map(|mask| folder.join(mask)),
            test_split: self.held_out,
            ..Photo::new(self.name.clone(), folder.join(&self.path), self.camera.clone())
        }
    }
}

/// Reads the list in a folder.
pub(crate) fn list(folder: &Path) -> Result<JoinedPhotos, IoError> {
    let path = folder.join(JOINED_FILE);
    let list: JoinedPhotos = files::json(&files::read(&path, files::MAX_TEXT_BYTES)?, &path)?;
    if list.version != VERSION {
        return Err(IoError::Version { path, found: list.version, supported: VERSION });
    }
    let added = list.added.iter().map(|added| (&added.name, &added.camera));
    for (name, camera) in added.chain(&list.refined) {
        files::photo_name(name, &path)?;
        camera.believe().map_err(|cause| IoError::Camera { path: path.clone(), photo: name.clone(), cause })?;
    }
    Ok(list)
}

/// Writes the list into a folder, with paths from there.
pub(crate) fn write(folder: &Path, list: &JoinedPhotos) -> Result<(), IoError> {
    let mut list = JoinedPhotos { version: VERSION, photos: relative_to(&list.photos, folder), ..list.clone() };
    for added in &mut list.added {
        added.path = relative_to(&added.path, folder);
        added.mask = added.mask.take().map(|mask| relative_to(&mask, folder));
    }
    atomic::write(&folder.join(JOINED_FILE), |w| {
        serde_json::to_writer_pretty(&mut *w, &list)?;
        w.write_all(b"\n")
    })
}

/// Returns whether a folder holds such a list.
pub(super) fn is_joined(folder: &Path) -> bool {
    folder.join(JOINED_FILE).is_file()
}

/// Reads the photos of the list in a folder: those of the data set, then those that were added.
pub(super) fn read(folder: &Path) -> Result<Dataset, IoError> {
    let list = list(folder)?;
    let base = files::real(&folder.join(&list.photos));
    let path = folder.join(JOINED_FILE);
    let missing = || IoError::syntax(&path, "'photos'", format!("{} holds no posed photos any more", base.display()));
    let mut dataset = posed::read(&base).ok_or_else(missing)??;
    pixel_masks::find(&mut dataset);
    for photo in &mut dataset.photos {
        photo.test_split = list.held_out.contains(&photo.name);
        if let Some(refined) = list.refined.get(&photo.name) {
            photo.camera.set_pose(refined);
        }
    }
    let taken: BTreeSet<String> = dataset.photos.iter().map(|p| p.name.clone()).collect();
    let mut gone = 0;
    for added in list.added.iter().filter(|added| !taken.contains(&added.name)) {
        let photo = added.photo(folder);
        if photo.path.is_file() {
            dataset.photos.push(photo);
        } else {
            gone += 1;
        }
    }
    if gone > 0 {
        dataset.warnings.push(format!("{gone} of {} photos that were added are missing", list.added.len()));
    }
    (dataset.root, dataset.source) = (folder.into(), None);
    dataset.format = format!("{}, with added photos", dataset.format);
    if !list.name.is_empty() {
        dataset.name = list.name;
    }
    Ok(dataset)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::io::transforms::opengl_pose;

    #[test]
    fn a_list_is_read_as_the_photos_of_both() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let camera = |x: f64| {
            let eye = DVec3::new(x, -3.0, 0.4);
            Camera::look_at(eye, DVec3::ZERO, DVec3::Z, 0.8, 16, 12).expect("valid")
        };
        for name in ["far", "near", "scene"] {
            std::fs::create_dir(at(name)).expect("made");
        }
        let picture = |name: &str| image::RgbImage::from_pixel(16, 12, image::Rgb([9, 99, 9])).save(at(name));
        ["far/a.png", "far/b.png", "near/a.png"].iter().for_each(|name| picture(name).expect("written"));
        let frame =
            |name: &str, x: f64| serde_json::json!({ "file_path": name, "transform_matrix": opengl_pose(&camera(x)) });
        let f = camera(0.0).focal_px.x;
        let photos =
            serde_json::json!({ "w": 16, "h": 12, "fl_x": f, "frames": [frame("a.png", 0.0), frame("b.png", 1.0)] });
        std::fs::write(at("far/transforms.json"), photos.to_string()).expect("written");
        let added = AddedPhoto {
            name: "added/a.png".into(),
            path: at("near/a.png"),
            camera: camera(0.2),
            distortion: None,
            mask: None,
            held_out: false,
            located: true,
        };
        let gone = AddedPhoto { name: "added/b.png".into(), path: at("near/b.png"), ..added.clone() };
        let joined = JoinedPhotos {
            name: "both".into(),
            photos: at("far"),
            held_out: ["b.png".to_owned()].into(),
            added: vec![added.clone(), gone],
            refined: [("b.png".to_owned(), camera(1.1))].into(),
            ..JoinedPhotos::default()
        };
        write(&at("scene"), &joined).expect("written");
        let Ok(crate::io::Opened::Dataset(read)) = crate::io::open(&at("scene")) else { panic!("a data set") };
        let names: Vec<(&str, bool)> = read.photos.iter().map(|p| (p.name.as_str(), p.test_split)).collect();
        assert_eq!(names, [("a.png", false), ("b.png", true), ("added/a.png", false)]);
        assert_eq!((read.name.as_str(), read.photos[2].camera.center), ("both", added.camera.center));
        let places = [0, 1].map(|i| read.photos[i].camera.center);
        assert!(places[0].distance(camera(0.0).center) < 1e-9 && places[1].distance(camera(1.1).center) < 1e-9);
        assert!(read.warnings.iter().any(|w| w.starts_with("1 of 2 photos that were added")), "{:?}", read.warnings);
        assert_eq!(files::real(&read.photos[2].path), files::real(&at("near/a.png")));
        let text = std::fs::read_to_string(at("scene").join(JOINED_FILE)).expect("read");
        std::fs::write(at("scene").join(JOINED_FILE), text.replace("\"version\": 1", "\"version\": 2"))
            .expect("written");
        assert!(matches!(list(&at("scene")), Err(IoError::Version { .. })));
        std::fs::write(at("scene").join(JOINED_FILE), text.replace("../far", "../away")).expect("written");
        let error = crate::io::open(&at("scene")).expect_err("its photos are gone").to_string();
        assert!(error.contains("away"), "{error}");
    }
}
