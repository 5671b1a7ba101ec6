//! Photos that are added to a scene, with their cameras in its frame: posed ones as they are or aligned, others located.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::align::{aligned, is_own};
use crate::io::joined::AddedPhoto;
use crate::io::{self, OpenError, Opened, files, photo};
use crate::jobs::error::chain;
use crate::jobs::locate::{self, DEFAULT_PX, LocateOptions};
use crate::jobs::open::{self, Contents};
use crate::jobs::{JobError, Scene};
use crate::math::format::things;
use crate::pipeline::observer::{Observer, Severity};
use crate::scene::{Dataset, Photo};

/// Smallest side of a photo, px.
const LEAST_SIDE_PX: u32 = 16;
/// Longer side to which photos are read to see that they can be, px.
const TRIED_SIDE_PX: u32 = 64;

/// A photo that is not added.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct RefusedPhoto {
    pub(crate) photo: PathBuf,
    pub(crate) reason: String,
}

/// Photos to add.
#[derive(Debug, Default)]
pub(super) struct GatheredPhotos {
    pub(super) added: Vec<AddedPhoto>,
    pub(super) refused: Vec<RefusedPhoto>,
    /// Folders of posed photos, which may hold masks of theirs.
    pub(super) roots: Vec<PathBuf>,
}

impl GatheredPhotos {
    fn take(&mut self, photo: &Photo, located: bool) {
        if let Err(reason) = readable(photo) {
            self.refused.push(RefusedPhoto { photo: photo.path.clone(), reason });
            return;
        }
        self.added.push(AddedPhoto {
            name: String::new(),
            path: photo.path.clone(),
            camera: photo.camera.clone(),
            distortion: photo.distortion,
            mask: photo.mask.clone(),
            held_out: photo.test_split,
            located,
        });
    }

    /// Gives every photo a name that no other has.
    fn name(&mut self, dataset: &Dataset) {
        let mut taken: BTreeSet<String> = dataset.photos.iter().map(|p| p.name.clone()).collect();
        for photo in &mut self.added {
            let file = photo.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            let names = std::iter::once(format!("added/{file}")).chain((2..).map(|n| format!("added/{n}/{file}")));
            photo.name = names.into_iter().find(|name| !taken.contains(name)).unwrap_or_default();
            taken.insert(photo.name.clone());
        }
    }
}

/// Finds the cameras of the photos at `paths`, files or folders.
///
/// # Errors
/// If a folder cannot be opened, its poses contradict those of the scene, or the observer asks to stop.
pub(super) fn gather(
    scene: &Scene,
    dataset: &Dataset,
    paths: &[PathBuf],
    focal_px: Option<f64>,
    observer: &mut dyn Observer,
) -> Result<GatheredPhotos, JobError> {
    let (mut all, mut unposed) = (GatheredPhotos::default(), Vec::new());
    for path in paths {
        match posed(path)? {
            Ok(posed) => {
                let (photos, change) = aligned(dataset, &posed)?;
                let common = posed.photos.len() - photos.len();
                if common > 0 {
                    let frame =
                        if change.is_some() { "brought into the scene's frame by them" } else { "in its frame" };
                    let text = format!(
                        "{}: {} of the scene's own; the others are {frame}",
                        path.display(),
                        things(common, "photo")
                    );
                    observer.note(Severity::Info, text);
                }
                for photo in photos {
                    let camera = change.map_or_else(|| photo.camera.clone(), |change| change.applied(&photo.camera));
                    all.take(&Photo { camera, ..photo }, false);
                }
                all.roots.push(posed.root);
            }
            Err(files) => unposed.extend(files),
        }
    }
    let (known, unposed): (Vec<PathBuf>, Vec<PathBuf>) = unposed.into_iter().partition(|path| is_own(dataset, path));
    let known_count = known.len();
    let reason = || "the scene has it already".to_owned();
    all.refused.extend(known.into_iter().map(|photo| RefusedPhoto { photo, reason: reason() }));
    if focal_px.is_some() && unposed.is_empty() && known_count == 0 {
        let text = "a focal length has no use here: all of these photos have poses; leave it out";
        return Err(JobError::Output(text.into()));
    }
    if !unposed.is_empty() {
        let options = LocateOptions { focal_px, finest_px: DEFAULT_PX, dataset: Some(dataset.source().into()) };
        let (_, found) = locate::run(scene, &unposed, &options, observer)?;
        for found in found {
            match found.place.filter(|_| found.located) {
                Some(place) => {
                    let photo = Photo::new(String::new(), files::real(&found.photo), place.camera);
                    all.take(&Photo { distortion: place.distortion, ..photo }, true);
                }
                None => {
                    let reason = found.problem.unwrap_or_default();
                    all.refused.push(RefusedPhoto { photo: found.photo, reason });
                }
            }
        }
    }
    all.name(dataset);
    Ok(all)
}

/// Returns the posed photos at a path, or the pictures there that nobody posed.
fn posed(path: &Path) -> Result<Result<Dataset, Vec<PathBuf>>, JobError> {
    let is_list = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    if path.is_file() && !is_list {
        return Ok(Err(vec![path.into()]));
    }
    let refusal = match io::open(path) {
        Ok(Opened::Dataset(dataset)) => return Ok(Ok(dataset)),
        Ok(_) => return Err(JobError::NoPhotos(path.into())),
        Err(refusal) => refusal,
    };
    let pictures: Vec<PathBuf> = match &refusal {
        OpenError::NoPoses(photos) => photos.photos.iter().map(|name| photos.images.join(name)).collect(),
        // A single picture is no folder of photos elsewhere; here it is one to add.
        OpenError::Unrecognized { .. } => {
            let names = files::names_in(path).unwrap_or_default();
            names.iter().filter(|name| photo::is_photo(name)).map(|name| path.join(name)).collect()
        }
        _ => Vec::new(),
    };
    if pictures.is_empty() { Err(refusal.into()) } else { Ok(Err(pictures)) }
}

/// Returns whether a folder holds photos, posed or not, and neither a scene nor a result.
pub(crate) fn holds_photos(folder: &Path) -> bool {
    match open::contents(folder, None) {
        Ok(Contents::Photos(_)) => true,
        Err(JobError::Open(_)) => posed(folder).is_ok_and(|found| found.is_err()),
        Ok(Contents::Scene(_)) | Err(_) => false,
    }
}

/// Checks that a photo can be read and is no speck.
fn readable(photo: &Photo) -> Result<(), String> {
    let (width, height) = (photo.camera.width_px, photo.camera.height_px);
    if width.min(height) < LEAST_SIDE_PX {
        return Err(format!("it is {width} x {height} px; at least {LEAST_SIDE_PX} px are needed"));
    }
    photo::load(photo, TRIED_SIDE_PX).map(drop).map_err(|e| chain(&e))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::io::transforms::opengl_pose;
    use crate::pipeline::observer::Silent;
    use crate::scene::Camera;

    #[test]
    fn posed_photos_get_names_of_their_own_and_bad_ones_are_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let camera = Camera::look_at(DVec3::new(0.0, -3.0, 1.0), DVec3::ZERO, DVec3::Z, 0.8, 32, 24).expect("valid");
        std::fs::create_dir_all(at("new/a")).expect("made");
        std::fs::create_dir_all(at("new/b")).expect("made");
        for name in ["new/a/1.png", "new/b/1.png"] {
            image::RgbImage::from_pixel(32, 24, image::Rgb([90; 3])).save(at(name)).expect("written");
        }
        image::RgbImage::new(4, 3).save(at("new/speck.png")).expect("written");
        let frame = |name: &str| {
            serde_json::json!({ "file_path": name, "transform_matrix": opengl_pose(&camera),
                "w": 32, "h": 24, "fl_x": camera.focal_px.x })
        };
        let mut speck = frame("speck.png");
        (speck["w"], speck["h"]) = (4.into(), 3.into());
        let list = serde_json::json!({ "frames": [frame("a/1.png"), frame("b/1.png"), speck] });
        std::fs::write(at("new/transforms.json"), list.to_string()).expect("written");
        let own = Photo::new("added/1.png", at("own.png"), camera.clone());
        let dataset = Dataset { photos: vec![own], ..Dataset::default() };
        let found = gather(&Scene::default(), &dataset, &[at("new")], None, &mut Silent).expect("gathered");
        let names: Vec<&str> = found.added.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["added/2/1.png", "added/3/1.png"]);
        assert!(found.added.iter().all(|p| !p.located && p.camera.center.distance(camera.center) < 1e-9));
        assert_eq!(found.refused.len(), 1);
        assert!(found.refused[0].photo.ends_with("speck.png"), "{:?}", found.refused);
        assert!(holds_photos(&at("new")) && holds_photos(&at("new/a")), "posed, and a picture that is not");
        std::fs::create_dir(at("empty")).expect("made");
        let cloud = crate::scene::GaussianCloud::isotropic(vec![[0.0; 3]; 3], -3.0, 1.0);
        std::fs::create_dir(at("splats")).expect("made");
        crate::io::splat_ply::write(&at("splats/a.ply"), &cloud).expect("written");
        assert!(["gone", "empty", "splats"].iter().all(|name| !holds_photos(&at(name))), "the control");
        let gone = gather(&Scene::default(), &dataset, &[at("gone")], None, &mut Silent).expect_err("gone").to_string();
        assert!(gone.contains("does not exist"), "{gone}");
    }
}
