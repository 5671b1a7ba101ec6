//! Files that 3D Gaussian Splatting's training leaves beside a splat: `cameras.json` with the photos' cameras,
//! `cfg_args` with the photos' folder and the background.
//!
//! [`GsOutput`] holds the same for trainings of other programs.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec2, DVec3};
use serde::Deserialize;

use super::photo_list::{some_of, straightened};
use super::photo_source::PhotoSource;
use super::trained::SceneCamera;
use super::{IoError, files, labels};
use crate::scene::Camera;

const CAMERAS: &str = "cameras.json";
const SETTINGS: &str = "cfg_args";
const CLOUDS: &str = "point_cloud";
const CLOUD: &str = "point_cloud.ply";

/// Training output found beside a splat.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct GsOutput {
    /// Folder of the training output.
    pub(crate) folder: PathBuf,
    pub(crate) cameras: Vec<SceneCamera>,
    /// Name of the scene, if the settings have one.
    pub(crate) name: Option<String>,
    /// Photos at training time.
    pub(crate) source: Option<PhotoSource>,
    pub(crate) white_background: bool,
    /// True if the Gaussians have Mip-Splatting's 3-D filter, which is in the `.ply` only.
    pub(crate) filters: bool,
    pub(crate) warnings: Vec<String>,
}

impl GsOutput {
    /// Makes the output of a training in this folder, of which nothing is known yet.
    pub(crate) fn of(folder: &Path) -> Self {
        Self { folder: folder.into(), ..Self::default() }
    }
}

/// An entry of `cameras.json`.
#[derive(Deserialize)]
struct Entry {
    #[serde(default)]
    img_name: String,
    width: u32,
    height: u32,
    /// Camera center in the world.
    position: [f64; 3],
    /// Rows of world_from_camera, with the axes of this program.
    rotation: [[f64; 3]; 3],
    fx: f64,
    fy: f64,
}

/// Finds the splat of the latest iteration in a folder that 3D Gaussian Splatting wrote.
pub(crate) fn latest(folder: &Path) -> Option<PathBuf> {
    let is_iteration = folder.file_name().is_some_and(|name| name.to_string_lossy().starts_with("iteration_"));
    if is_iteration && folder.join(CLOUD).is_file() {
        return Some(folder.join(CLOUD));
    }
    let clouds = folder.join(CLOUDS);
    let names = files::names_in(&clouds).ok()?;
    let iteration = |name: &String| name.strip_prefix("iteration_")?.parse::<u64>().ok();
    let there = |name: &String| clouds.join(name).join(CLOUD).is_file();
    let latest = names.iter().filter(|name| there(name)).filter_map(|name| Some((iteration(name)?, name))).max()?;
    Some(clouds.join(latest.1).join(CLOUD))
}

/// Returns whether a file is called like the settings or the cameras of such a training.
pub(crate) fn is_settings(name: &str) -> bool {
    name == SETTINGS || name == CAMERAS
}

/// Reads the training output beside `splat`, or above it if that is in `point_cloud/iteration_<n>`.
pub(crate) fn beside(splat: &Path) -> Option<GsOutput> {
    let folder = files::folder_of(splat);
    let is_called = |path: &Path, start: &str| path.file_name().is_some_and(|n| n.to_string_lossy().starts_with(start));
    let whole = std::path::absolute(folder).unwrap_or_else(|_| folder.into());
    let above = whole.parent().filter(|p| is_called(&whole, "iteration_") && is_called(p, CLOUDS));
    let all = std::iter::once(folder).chain(above.and_then(Path::parent));
    let folder = all.into_iter().find(|f| f.join(CAMERAS).is_file() || f.join(SETTINGS).is_file())?;
    let mut found = GsOutput::of(folder);
    // Every splat of such a training is called like every other.
    found.name = (Some(folder) == above.and_then(Path::parent)).then(|| files::folder_name(folder));
    let mut is_split = false;
    let settings = folder.join(SETTINGS);
    if let Some(text) = settings.is_file().then(|| files::read_text(&settings)) {
        match text {
            Ok(text) => {
                let source = value(&text, "source_path").filter(|s| !s.is_empty());
                found.source = source.map(|s| PhotoSource::find(Path::new(&s.replace('\0', "")), folder));
                found.filters = value(&text, "kernel_size").is_some();
                found.white_background = value(&text, "white_background") == Some("True");
                is_split = value(&text, "eval") == Some("True");
            }
            Err(e) => found.warnings.push(format!("{SETTINGS} was passed over: {e}")),
        }
    }
    let file = folder.join(CAMERAS);
    if file.is_file() {
        match cameras(&file, is_split, &mut found.warnings) {
            Ok(cameras) => found.cameras = cameras,
            Err(e) => found.warnings.push(format!("the cameras beside the splat were passed over: {e}")),
        }
    }
    Some(found)
}

/// Returns whether a camera's name is that of a photo: 3D Gaussian Splatting drops folders and endings.
pub(crate) fn is_of(camera: &str, photo: &str) -> bool {
    let file = photo.rsplit('/').next().unwrap_or(photo);
    camera == photo || camera == file || camera == labels::stem(photo)
}

/// The value of `key` in the text of a Python `Namespace(...)`, without quotes.
fn value<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let mut rest = text;
    loop {
        let (before, after) = rest.split_once(&format!("{key}="))?;
        if before.is_empty() || before.ends_with(['(', ' ', ',']) {
            let quote = after.chars().next().filter(|c| matches!(c, '\'' | '"'));
            return match quote {
                Some(quote) => after[1..].split(quote).next(),
                None => after.split([',', ')']).next().map(str::trim),
            };
        }
        rest = after;
    }
}

/// Reads the valid cameras of the file; the others are reported in `warnings`.
fn cameras(file: &Path, is_split: bool, warnings: &mut Vec<String>) -> Result<Vec<SceneCamera>, IoError> {
    let entries: Vec<Entry> = files::read_json(file)?;
    // Held-out photos come first, then the training photos; each list is sorted by name.
    let falls: Vec<usize> = (1..entries.len()).filter(|i| entries[*i].img_name < entries[i - 1].img_name).collect();
    let held_out = match falls.as_slice() {
        [one] if is_split => *one,
        _ => 0,
    };
    let (mut good, mut bad) = (Vec::new(), Vec::new());
    for (i, entry) in entries.iter().enumerate() {
        match camera(entry) {
            Some(camera) => {
                good.push(SceneCamera { name: entry.img_name.clone(), camera, held_out: i < held_out });
            }
            None => bad.push(entry.img_name.clone()),
        }
    }
    if !bad.is_empty() {
        let shown = some_of(&bad, ", ");
        warnings.push(format!("{} cameras in {CAMERAS} cannot be and were left out: {shown}", bad.len()));
    }
    good.iter().try_for_each(|c| files::photo_name(&c.name, file))?;
    Ok(good)
}

fn camera(e: &Entry) -> Option<Camera> {
    let rows = e.rotation.map(DVec3::from_array);
    let (world_from_camera, _) = straightened(DMat3::from_cols(rows[0], rows[1], rows[2]).transpose()).ok()?;
    let camera = Camera {
        width_px: e.width,
        height_px: e.height,
        focal_px: DVec2::new(e.fx, e.fy),
        principal_px: DVec2::new(f64::from(e.width), f64::from(e.height)) * 0.5,
        world_from_camera,
        center: DVec3::from_array(e.position),
    };
    camera.believe().is_ok().then_some(camera)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_read_from_what_python_prints() {
        let text = "Namespace(data_device='cuda', eval=True, images='images', resolution=-1, \
                    source_path=\"/data/it's\", xsource_path='no', white_background=False)";
        assert_eq!(value(text, "source_path"), Some("/data/it's"));
        assert_eq!((value(text, "eval"), value(text, "white_background")), (Some("True"), Some("False")));
        assert_eq!((value(text, "resolution"), value(text, "path")), (Some("-1"), None));
    }

    #[test]
    fn cameras_are_read_and_those_that_cannot_be_are_named() {
        let folder = tempfile::tempdir().expect("folder");
        let entry = |name: &str, scale: f64| {
            serde_json::json!({"id": 0, "img_name": name, "width": 64, "height": 48, "position": [1.0, 2.0, 3.0],
                "rotation": [[scale, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]], "fx": 50.0, "fy": 51.0})
        };
        let all = [entry("a", 1.0), entry("c", 1.0), entry("b", 1.0), entry("d", 0.0)];
        std::fs::write(folder.path().join(CAMERAS), serde_json::json!(all).to_string()).expect("write");
        std::fs::write(folder.path().join(SETTINGS), "Namespace(eval=True, source_path='/no/where')").expect("write");
        let cloud = folder.path().join("point_cloud/iteration_30");
        std::fs::create_dir_all(&cloud).expect("create");
        std::fs::write(cloud.join(CLOUD), "x").expect("write");
        let splat = latest(folder.path()).expect("a splat");
        let found = beside(&splat).expect("beside");
        let names: Vec<(&str, bool)> = found.cameras.iter().map(|c| (&*c.name, c.held_out)).collect();
        assert_eq!(names, [("a", true), ("c", true), ("b", false)]);
        // It looks along +y with +z up: columns right, down, forward.
        let camera = &found.cameras[0].camera;
        assert_eq!((camera.forward(), camera.center), (DVec3::Y, DVec3::new(1.0, 2.0, 3.0)));
        let source = found.source.expect("stated");
        assert_eq!((source.stated, source.found), ("/no/where".into(), None));
        assert!(found.warnings[0].contains("1 cameras") && found.warnings[0].contains('d'), "{:?}", found.warnings);
        assert_eq!(beside(&folder.path().join("other/a.ply")), None, "not of that splat");
    }
}
