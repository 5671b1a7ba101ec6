//! nerfstudio's splatfacto: `config.yml`, `nerfstudio_models/step-<n>.ckpt`, `dataparser_transforms.json`.
//!
//! nerfstudio turns, centers and scales the world before it trains. That is undone here, so that photos and Gaussians
//! fit: the file maps from the poses' original axes, and a `transforms.json` may have been changed from those itself.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use serde::Deserialize;

use super::parameters::{self, ColorMeaning, TensorNames};
use super::settings::YamlLines;
use super::similarity::Similarity;
use super::{Training, cameras, not_gaussians};
use crate::io::gs_output::GsOutput;
use crate::io::photo_list::straightened;
use crate::io::photo_source::PhotoSource;
use crate::io::torch::WeightFile;
use crate::io::{IoError, files, transforms};
use crate::scene::{GaussianCloud, SplatRenderMode, text};

const CONFIG: &str = "config.yml";
const MODELS_FOLDER: &str = "nerfstudio_models";
const TRANSFORM: &str = "dataparser_transforms.json";
/// Starts of the tensors' names, the later version's first.
pub(super) const MODELS: [&str; 2] = ["pipeline._model.gauss_params.", "pipeline._model."];
/// Folders below the opened one among which runs are looked for: name, method, time.
const BELOW: usize = 3;
/// Most folders that are looked at.
const MOST: usize = 500;

/// Finds the folder of a run: the opened one, the one of an opened file, or the newest below.
pub(super) fn run_of(path: &Path) -> Option<PathBuf> {
    let is_run = |folder: &Path| folder.join(MODELS_FOLDER).is_dir();
    if path.is_file() {
        let folder = files::folder_of(path);
        return [folder, files::folder_of(folder)].into_iter().find(|f| is_run(f)).map(Path::to_path_buf);
    }
    if is_run(path) {
        return Some(path.into());
    }
    if path.file_name().is_some_and(|name| name == MODELS_FOLDER) {
        return path.parent().map(Path::to_path_buf);
    }
    let (mut level, mut seen) = (vec![path.to_path_buf()], 0);
    for _ in 0..BELOW {
        let mut next = Vec::new();
        for folder in level {
            let names = files::names_in(&folder).unwrap_or_default();
            let below = names.iter().map(|name| folder.join(name)).filter(|p| p.is_dir() && !p.is_symlink());
            let before = next.len();
            next.extend(below.take(MOST - seen));
            seen += next.len() - before;
        }
        // Runs are named by their time.
        if let Some(run) = next.iter().filter(|p| is_run(p)).max_by_key(|p| p.file_name().map(|n| n.to_owned())) {
            return Some(run.clone());
        }
        level = next;
    }
    None
}

/// Returns the checkpoint of the latest step in a run.
fn newest(run: &Path) -> Result<PathBuf, IoError> {
    let folder = run.join(MODELS_FOLDER);
    let step = |name: &String| name.strip_prefix("step-")?.strip_suffix(".ckpt")?.parse::<u64>().ok();
    let names = files::names_in(&folder).map_err(|cause| IoError::Read { path: folder.clone(), cause })?;
    let latest = names.iter().filter_map(|name| Some((step(name)?, name))).max();
    let none = || IoError::syntax(&folder, "the checkpoints", "there is no step-<n>.ckpt; train on, or copy it here");
    latest.map(|(_, name)| folder.join(name)).ok_or_else(none)
}

/// Opens a run, or one of its checkpoints.
pub(super) fn open(path: &Path) -> Result<Training, IoError> {
    let run = run_of(path);
    let folder = run.as_deref().unwrap_or_else(|| files::folder_of(path));
    let config = YamlLines::read(&folder.join(CONFIG))?;
    let file =
        if path.is_file() && super::is_checkpoint(&path.to_string_lossy()) { path.into() } else { newest(folder)? };
    let mut weights = WeightFile::open(&file).map_err(|e| e.of(&file))?;
    let Some(model) = MODELS.iter().find(|model| weights.tensors.contains_key(&format!("{model}means"))) else {
        let method = config.value("method_name").unwrap_or("another method");
        return Err(not_gaussians(&file, format!("a radiance field or a model of '{method}' without Gaussians")));
    };
    let name = |tensor: &str| format!("{model}{tensor}");
    let names = TensorNames {
        means: name("means"),
        scales: name("scales"),
        quats: name("quats"),
        opacities: name("opacities"),
        constant: name("features_dc"),
        rest: name("features_rest"),
    };
    let mut cloud = parameters::read(&file, &mut weights, &names, ColorMeaning::Logits)?;
    if config.value("rasterize_mode") == Some("antialiased") {
        cloud.render_mode = SplatRenderMode::Mip;
    }
    let mut beside = GsOutput::of(folder);
    let data = || Some(text::name(&config.path("data")?.file_name()?.to_string_lossy()));
    beside.name = config.value("experiment_name").map(text::name).or_else(data);
    beside.white_background = config.value("background_color") == Some("white");
    beside.source = config.path("data").map(|stated| PhotoSource::find(&stated, folder));
    let photos = beside.source.as_ref().and_then(|s| s.found.clone());
    match Trained::read(folder) {
        Ok(Some(trained)) => match trained.for_photos(photos.as_deref()) {
            Ok(trained) => cloud = upright(cloud, &trained, &config),
            Err(why) => beside.warnings.push(format!("{TRANSFORM} was passed over, so that photos may not fit: {why}")),
        },
        Ok(None) => beside.warnings.push(format!(
            "there is no {TRANSFORM}, so that photos may not fit the Gaussians; copy it beside {CONFIG}"
        )),
        Err(e) => beside.warnings.push(format!("photos may not fit the Gaussians: {e}")),
    }
    let poses = "pipeline._model.camera_optimizer.pose_adjustment";
    if weights.tensors.contains_key(poses) && weights.floats(poses).is_ok_and(|v| v.iter().any(|x| *x != 0.0)) {
        beside.warnings.push("the training moved its cameras; photos are shown with their poses from before".into());
    }
    cameras::add(&mut beside, |all| held_out(&config, all));
    Ok(Training { cloud, beside })
}

/// The Gaussians in the photos' axes, with the up direction that nerfstudio gave them.
fn upright(cloud: GaussianCloud, trained: &Similarity, config: &YamlLines) -> GaussianCloud {
    let cloud = trained.undone(cloud);
    let is_up = matches!(config.value("orientation_method").unwrap_or("up"), "up" | "vertical");
    GaussianCloud { up: is_up.then(|| trained.rotation.transpose() * DVec3::Z), ..cloud }
}

/// Returns for each of `all` photos, in the order of their names, whether nerfstudio holds it out.
fn held_out(config: &YamlLines, all: usize) -> Vec<bool> {
    let number = |key: &str| config.value(key).and_then(|v| v.parse::<f64>().ok());
    let is_colmap = config.path("colmap_path").is_some();
    match config.value("eval_mode").unwrap_or(if is_colmap { "interval" } else { "fraction" }) {
        "interval" => {
            let every = number("eval_interval").filter(|v| *v >= 1.0).unwrap_or(8.0) as usize;
            (0..all).map(|i| i % every == 0).collect()
        }
        "fraction" => {
            let part = number("train_split_fraction").unwrap_or(0.9);
            let trained = (all as f64 * part).ceil().min(all as f64) as usize;
            let mut held = vec![true; all];
            // As many as are trained on, evenly from the first to the last.
            let step = if trained > 1 { (all - 1) as f64 / (trained - 1) as f64 } else { 0.0 };
            let of = |k: usize| if k + 1 == trained { all - 1 } else { (k as f64 * step) as usize };
            (0..trained).for_each(|k| held[if trained > 1 { of(k) } else { 0 }] = false);
            held
        }
        _ => vec![false; all],
    }
}

/// Contents of `dataparser_transforms.json`.
#[derive(Deserialize)]
struct Trained {
    transform: Vec<[f64; 4]>,
    scale: f64,
}

/// Change of the poses of a `transforms.json` when it was made.
#[derive(Default, Deserialize)]
struct Applied {
    applied_transform: Option<Vec<[f64; 4]>>,
    applied_scale: Option<f64>,
}

impl Trained {
    fn read(run: &Path) -> Result<Option<Self>, IoError> {
        let file = run.join(TRANSFORM);
        file.is_file().then(|| files::read_json(&file)).transpose()
    }

    /// Returns the map from the axes in which the photos at `path` are read to those of the training. Without photos,
    /// those are their original axes.
    fn for_photos(&self, path: Option<&Path>) -> Result<Similarity, String> {
        let (rotation, shift) = parts(&self.transform)?;
        let original = Similarity { scale: self.scale, rotation, shift };
        if !(self.scale.is_finite() && self.scale > 0.0) {
            return Err(format!("its scale is {}", self.scale));
        }
        let list = path.and_then(|path| match path.is_file() {
            true => Some(path.to_path_buf()),
            false => files::called(path, transforms::USUAL),
        });
        let Some(list) = list else { return Ok(original) };
        let applied: Applied = files::read_json(&list).unwrap_or_default();
        let (turn, moved) = match &applied.applied_transform {
            Some(rows) => parts(rows).map_err(|e| format!("in {}: {e}", list.display()))?,
            // The one of nerfstudio's first versions, which did not state it.
            None if files::folder_of(&list).join("colmap/sparse/0").is_dir() => {
                (DMat3::from_cols(DVec3::Y, DVec3::X, DVec3::NEG_Z), DVec3::ZERO)
            }
            None => (DMat3::IDENTITY, DVec3::ZERO),
        };
        let rotation = rotation * turn.transpose();
        let scale = self.scale / applied.applied_scale.filter(|s| s.is_finite() && *s > 0.0).unwrap_or(1.0);
        Ok(Similarity { scale, rotation, shift: shift - rotation * moved })
    }
}

/// Rotation and translation of the first three rows of a matrix.
fn parts(rows: &[[f64; 4]]) -> Result<(DMat3, DVec3), String> {
    let [x, y, z] = *rows.first_chunk::<3>().ok_or("its matrix has fewer than three rows")?;
    let row = |r: [f64; 4]| DVec3::new(r[0], r[1], r[2]);
    let m = DMat3::from_cols(row(x), row(y), row(z)).transpose();
    let (rotation, scaled) = straightened(m).map_err(|e| e.to_string())?;
    let shift = DVec3::new(x[3], y[3], z[3]);
    match scaled || !shift.is_finite() {
        true => Err("its matrix is no rotation with a translation".into()),
        false => Ok((rotation, shift)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: [[f64; 4]; 3] = [[0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0]];

    #[test]
    fn poses_that_were_changed_before_are_met_where_they_are_now() {
        let folder = tempfile::tempdir().expect("folder");
        let turn = DMat3::from_rotation_y(0.7);
        let c = turn.transpose();
        let rows = [c.x_axis, c.y_axis, c.z_axis];
        let transform = [0, 1, 2].map(|k| [rows[k].x, rows[k].y, rows[k].z, [0.5, -1.0, 2.0][k]]).to_vec();
        let trained = Trained { transform, scale: 0.25 };
        let original = trained.for_photos(None).expect("a similarity");
        let p = DVec3::new(1.0, 2.0, 3.0);
        let there = original.of(p);
        assert!((there - 0.25 * (turn * p + DVec3::new(0.5, -1.0, 2.0))).length() < 1e-12);
        // nerfstudio: out = scale * T(p), original -> saved = A * original, and the file has T * A.
        let list = folder.path().join("transforms.json");
        let write = |json: serde_json::Value| std::fs::write(&list, json.to_string()).expect("written");
        let of = |p: DVec3| trained.for_photos(Some(folder.path())).expect("a similarity").of(p);
        write(serde_json::json!({ "frames": [] }));
        assert!((of(p) - there).length() < 1e-12, "nothing was applied");
        let moved = [[0.0, 1.0, 0.0, 7.0], [1.0, 0.0, 0.0, -3.0], [0.0, 0.0, -1.0, 0.5]];
        write(serde_json::json!({ "applied_transform": moved }));
        let saved = DVec3::new(p.y + 7.0, p.x - 3.0, -p.z + 0.5);
        assert!((of(saved) - there).length() < 1e-12);
        assert!((of(p) - there).length() > 0.1, "the control");
        write(serde_json::json!({ "applied_transform": A, "applied_scale": 0.5 }));
        let saved = DVec3::new(p.y, p.x, -p.z);
        assert!((of(saved) - 2.0 * there).length() < 1e-12);
        // The first versions applied this one without saying so.
        std::fs::create_dir_all(folder.path().join("colmap/sparse/0")).expect("made");
        write(serde_json::json!({ "frames": [] }));
        assert!((of(saved) - there).length() < 1e-12);
    }

    #[test]
    fn matrices_that_are_no_similarity_are_refused() {
        let of = |transform: Vec<[f64; 4]>, scale| Trained { transform, scale }.for_photos(None);
        assert!(of(A.to_vec(), 1.0).is_ok());
        let mut mirrored = A;
        mirrored[2][2] = 1.0;
        let mut gone = A;
        gone[0][3] = f64::NAN;
        for (rows, scale) in [
            (mirrored.to_vec(), 1.0),
            (gone.to_vec(), 1.0),
            (A[..2].to_vec(), 1.0),
            (A.map(|r| r.map(|v| v * 2.0)).to_vec(), 1.0),
            (A.to_vec(), 0.0),
            (A.to_vec(), f64::INFINITY),
        ] {
            assert!(of(rows.clone(), scale).is_err(), "{rows:?} {scale}");
        }
    }

    #[test]
    fn photos_are_held_out_as_nerfstudio_does_it() {
        let of = |text: &str, all| {
            let held = held_out(&YamlLines::of(text), all);
            (0..all).filter(|i| held[*i]).collect::<Vec<_>>()
        };
        // numpy.linspace(0, 19, 18, dtype=int) leaves out two.
        assert_eq!(of("", 20), [9, 18]);
        assert_eq!(of("eval_mode: fraction\ntrain_split_fraction: 0.5", 5), [1, 3]);
        assert_eq!(of("eval_mode: interval", 20), [0, 8, 16]);
        assert_eq!(of("eval_mode: interval\neval_interval: 5", 11), [0, 5, 10]);
        assert_eq!((of("eval_mode: all", 20), of("", 0), of("", 1)), (vec![], vec![], vec![]));
    }
}
