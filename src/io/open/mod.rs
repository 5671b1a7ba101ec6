//! One `open` for every input: recognizes the content and calls its reader.

mod among;
mod beside;
mod packed;

use std::fs;
use std::path::Path;

use super::gs_output::GsOutput;
use super::trained::{self, TrainedScene};
use super::trainings::Training;
use super::video::footage;
use super::{
    IoError, OpenError, alpha, colmap, files, gs_output, joined, khr_gltf, ksplat, llff, pixel_masks, results, sog,
    splat, splat_ply, spz, trainings, transforms, unposed,
};
use crate::scene::{Axes, Dataset, GaussianCloud};

/// Content found at a path.
// One value exists per opening; a box would only be in the reader's way.
#[allow(clippy::large_enum_variant)]
#[derive(Debug)]
pub enum Opened {
    /// Posed photos.
    Dataset(Dataset),
    /// A finished splat.
    Cloud(GaussianCloud),
    /// A folder that this program trained.
    Trained(TrainedScene),
}

pub(crate) use among::data_set_around;

type Result<T> = std::result::Result<T, OpenError>;

/// Layouts of folders that are recognized, in this order, and the reader of each.
const FOLDERS: [Layout; 10] = [
    Layout {
        name: "a trained scene (scene.json)",
        is_of_photos: false,
        is: trained::is_scene,
        open: |p| Ok(Opened::Trained(trained::load(p)?)),
    },
    Layout {
        name: "photos with others that were added to them (joined.json)",
        is_of_photos: true,
        is: joined::is_joined,
        open: |p| Ok(Opened::Dataset(joined::read(p)?)),
    },
    Layout {
        name: "nerfstudio or instant-ngp photos (transforms.json)",
        is_of_photos: true,
        is: |p| files::called(p, transforms::USUAL).is_some(),
        open: |p| {
            let list = files::called(p, transforms::USUAL).unwrap_or_else(|| p.join(transforms::USUAL));
            Ok(Opened::Dataset(transforms::read(&list)?))
        },
    },
    Layout {
        name: "Blender photos (transforms_train.json)",
        is_of_photos: true,
        is: |p| p.join("transforms_train.json").is_file(),
        open: |p| Ok(Opened::Dataset(transforms::read_blender(p)?)),
    },
    Layout {
        name: "a COLMAP reconstruction ({cameras,images}.{bin,txt} in sparse/0, colmap/sparse/0, distorted/sparse/0, \
               another folder or the folder itself)",
        is_of_photos: true,
        is: colmap::is_colmap,
        open: |p| Ok(Opened::Dataset(colmap::read(p)?)),
    },
    Layout {
        name: "LLFF photos (poses_bounds.npy)",
        is_of_photos: true,
        is: |p| p.join(llff::POSES_FILE).is_file(),
        open: |p| Ok(Opened::Dataset(llff::read(p)?)),
    },
    Layout {
        name: "a folder of 3D Gaussian Splatting (point_cloud/iteration_<n>/point_cloud.ply)",
        is_of_photos: false,
        is: |p| gs_output::latest(p).is_some(),
        open: |p| Ok(Opened::Cloud(splat_ply::read(&gs_output::latest(p).unwrap_or_else(|| p.into()))?)),
    },
    Layout {
        name: TRAINING,
        is_of_photos: false,
        is: trainings::is_training,
        open: |p| Ok(Opened::Cloud(trainings::open(p)?.cloud)),
    },
    Layout {
        name: "a SOG splat (meta.json)",
        is_of_photos: false,
        is: |p| p.join(sog::META_FILE).is_file(),
        open: |p| Ok(Opened::Cloud(sog::read_folder(&p.join(sog::META_FILE))?)),
    },
    Layout {
        name: "a result of another method (of SAGA, LUDVIG, LangSplat and others)",
        is_of_photos: false,
        is: |p| results::sniff(p).is_some(),
        open: |p| {
            let gaussians = results::sniff(p).map_or_else(|| p.into(), |found| found.gaussians);
            let is_splat = gaussians.extension().is_some_and(|e| e == "ply");
            Ok(Opened::Cloud(if is_splat { splat_ply::read(&gaussians)? } else { trainings::open(&gaussians)?.cloud }))
        },
    },
];

/// Layouts of trainings whose Gaussians are in checkpoints.
const TRAINING: &str = "a training of 3D Gaussian Splatting (chkpnt<n>.pth), gsplat (ckpts/ckpt_<step>_rank<n>.pt) or \
                        splatfacto (config.yml, nerfstudio_models/step-<n>.ckpt)";

/// Returns whether a folder holds posed photos, and no trained scene.
fn is_data_set(folder: &Path) -> bool {
    !trained::is_scene(folder) && FOLDERS.iter().any(|layout| layout.is_of_photos && (layout.is)(folder))
}

/// Layout of a scene in a folder.
struct Layout {
    name: &'static str,
    /// True if it is one of posed photos.
    is_of_photos: bool,
    is: fn(&Path) -> bool,
    open: fn(&Path) -> std::result::Result<Opened, IoError>,
}

/// Files that are recognized, for the error.
const FILES: &str = "splats (.ply, .compressed.ply, .splat, .ksplat, .spz, .sog, SOG's meta.json, .gltf or .glb with KHR_gaussian_splatting), checkpoints of Gaussians (.pth, .pt, .ckpt), transforms.json, scene.json, poses_bounds.npy";

/// Bytes at the start of a file that tell formats apart.
const MAGIC_BYTES: u64 = 4;

/// Opens a dataset's folder or its `transforms.json`, a splat file, or a trained scene.
pub fn open(path: &Path) -> Result<Opened> {
    open_in(path, None)
}

/// As [`open()`], with other axes of a splat than its file or format states.
///
/// # Errors
/// As [`open()`], and if axes are given for anything but a splat.
pub fn open_in(path: &Path, axes: Option<Axes>) -> Result<Opened> {
    match (open_any(path, axes)?, axes) {
        (opened @ Opened::Cloud(_), _) | (opened, None) => Ok(opened),
        (_, Some(_)) => {
            let (path, what) = (path.into(), "axes for what is no splat file".into());
            Err(IoError::Unsupported { path, what, remedy: "photos and trained scenes say how they lie" }.into())
        }
    }
}

/// As [`open_in`], with the cameras and photos that belong to another program's training whose Gaussians are in
/// checkpoints.
///
/// # Errors
/// As [`open_in`].
pub(crate) fn open_beside(path: &Path, axes: Option<Axes>) -> Result<(Opened, Option<GsOutput>)> {
    let is_training = match path.is_dir() {
        true => FOLDERS.iter().find(|l| (l.is)(path)).is_some_and(|l| l.name == TRAINING),
        false => is_training_file(path),
    };
    if !is_training {
        return Ok((open_in(path, axes)?, None));
    }
    let Training { cloud, beside } = trainings::open(path)?;
    Ok((Opened::Cloud(turned(cloud, axes)), Some(beside)))
}

/// Returns whether a file is a checkpoint, or the settings of a training whose Gaussians are in checkpoints.
fn is_training_file(path: &Path) -> bool {
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().to_lowercase());
    path.is_file() && (trainings::is_checkpoint(&name) || trainings::is_settings(path))
}

fn open_any(path: &Path, axes: Option<Axes>) -> Result<Opened> {
    let meta = fs::metadata(path).map_err(|cause| match cause.kind() {
        std::io::ErrorKind::NotFound => OpenError::NotFound { path: path.into() },
        _ => IoError::Read { path: path.into(), cause }.into(),
    })?;
    let mut opened = if meta.is_dir() { open_folder(path, axes) } else { open_file(path, axes) }?;
    if let Opened::Dataset(dataset) = &mut opened {
        pixel_masks::find(dataset);
        alpha::decide(dataset);
        dataset.warnings.extend(dataset.stray_warning());
    }
    Ok(opened)
}

fn open_folder(path: &Path, axes: Option<Axes>) -> Result<Opened> {
    if let Some(layout) = FOLDERS.iter().find(|l| (l.is)(path)) {
        return Ok(match (layout.open)(path)? {
            Opened::Cloud(cloud) => Opened::Cloud(turned(cloud, axes)),
            other => other,
        });
    }
    if let Some(dataset) = beside::other_list(path)? {
        return Ok(Opened::Dataset(dataset));
    }
    let photos = unposed::find(path);
    let beside = if matches!(photos, Ok(None)) { Ok(None) } else { beside::of_photos(path) };
    if let Ok(Some(dataset)) = beside {
        return Ok(Opened::Dataset(dataset));
    }
    if let Some(photos) = photos? {
        return Err(OpenError::NoPoses(Box::new(photos.with(beside.err()))));
    }
    Err(OpenError::Unrecognized {
        path: path.into(),
        looked_for: FOLDERS.map(|l| l.name).join("; "),
        found: contents(path)?,
    })
}

/// Turns a cloud of a format with the axes of the scene.
fn turned(cloud: GaussianCloud, axes: Option<Axes>) -> GaussianCloud {
    match axes {
        Some(axes) => GaussianCloud { up: None, ..cloud }.turned(&axes.scene_from_file(), true),
        None => cloud,
    }
}

fn open_file(path: &Path, axes: Option<Axes>) -> Result<Opened> {
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().to_lowercase());
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    match name.as_str() {
        trained::SCENE_FILE => return Ok(Opened::Trained(trained::load(folder)?)),
        "transforms_train.json" | "transforms_test.json" | "transforms_val.json"
            if folder.join("transforms_train.json").is_file() =>
        {
            return Ok(Opened::Dataset(transforms::read_blender(folder)?));
        }
        sog::META_FILE => return Ok(Opened::Cloud(turned(sog::read_folder(path)?, axes))),
        llff::POSES_FILE => return Ok(Opened::Dataset(llff::read(folder)?)),
        "images.bin" | "images.txt" | "cameras.bin" | "cameras.txt" | "points3d.bin" | "points3d.txt"
            if colmap::is_colmap(folder) =>
        {
            return Ok(Opened::Dataset(colmap::read(folder)?));
        }
        n if n.starts_with("transforms") && n.ends_with(".json") => {
            return Ok(Opened::Dataset(transforms::read(path)?));
        }
        _ => {}
    }
    if is_training_file(path) {
        return Ok(Opened::Cloud(turned(trainings::open(path)?.cloud, axes)));
    }
    if gs_output::is_settings(&name)
        && let Some(splat) = gs_output::latest(folder)
    {
        return Ok(Opened::Cloud(turned(splat_ply::read(&splat)?, axes)));
    }
    if footage::is_video(path) {
        footage::Footage::open(path, &std::env::var_os("PATH").unwrap_or_default())?;
        return Err(OpenError::NoPoses(Box::new(unposed::Unposed::of_video(path))));
    }
    let start = files::read_start(path, MAGIC_BYTES)?;
    packed::refuse(path, &name, &start)?;
    let cloud = match start.as_slice() {
        [b'p', b'l', b'y', b'\n' | b'\r'] | [0xEF, 0xBB, 0xBF, b'p'] => turned(splat_ply::read(path)?, axes),
        start if khr_gltf::is_gltf(start, &name) => khr_gltf::read(path, axes)?,
        b"PK\x03\x04" => turned(sog::read_archive(path)?, axes),
        start if spz::is_spz(start) => spz::read(path, axes)?,
        // These two formats have no signature.
        [_, ..] if name.ends_with(".splat") => turned(splat::read(path)?, axes),
        [_, ..] if name.ends_with(".ksplat") => turned(ksplat::read(path)?, axes),
        start => {
            return Err(OpenError::Unrecognized {
                path: path.into(),
                looked_for: FILES.into(),
                found: in_words(&name, start).into(),
            });
        }
    };
    Ok(Opened::Cloud(cloud))
}

/// Describes a file of an unknown format.
fn in_words(name: &str, start: &[u8]) -> &'static str {
    let is_called = |ending: &str| name.ends_with(ending);
    let is_text = |byte: &u8| byte.is_ascii_graphic() || byte.is_ascii_whitespace();
    match start {
        [] => "an empty file",
        _ if is_called(".ply") => "a file called .ply without PLY header",
        _ if is_called(".sog") => "a file called .sog that is no zip archive",
        _ if is_called(".spz") => "a file called .spz that is neither packed by gzip nor of version 4",
        _ if start.iter().all(is_text) => "a text file of another kind",
        _ => "a file of another kind",
    }
}

/// Lists the first few names in a folder, for display.
fn contents(folder: &Path) -> Result<String> {
    const SHOWN: usize = 8;
    let failed = |cause| IoError::Read { path: folder.into(), cause };
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let slash = if entry.path().is_dir() { "/" } else { "" };
        names.push(entry.file_name().to_string_lossy().into_owned() + slash);
    }
    names.retain(|name| !files::is_debris(name.trim_end_matches('/')));
    names.sort();
    let more = names.len().saturating_sub(SHOWN);
    names.truncate(SHOWN);
    Ok(match (names.is_empty(), more) {
        (true, _) => "an empty folder".into(),
        (false, 0) => names.join(", "),
        (false, more) => format!("{} and {more} more", names.join(", ")),
    })
}

#[cfg(test)]
mod tests;
