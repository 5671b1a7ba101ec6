//! The demo: the trained scene that ships with the program, its recipe, and the photos to train it anew.
//!
//! `assets/demo/demo.zip` is what the recipe makes, and the recipe always makes the same (`demo/tests.rs`).

use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ImageFormat};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::demo_questions::{self, DemoQueries};
use super::evaluate::{self, EvaluateOptions, PhotoComparison};
use super::experiment::Experiment;
use super::train::IfChanged;
use super::{Folders, JobError, OpenedScene, Scene, open};
use crate::io::trained::{self, DatasetReference, History};
use crate::io::{IoError, bundle, files, semantic_map, splat_ply};
use crate::pipeline::observer::Observer;
use crate::pipeline::synth::{SynthOptions, SynthReport, demo};
use crate::pipeline::train::TrainConfig;
use crate::render::{BackendChoice, Features, Renderer};
use crate::scene::{GaussianCloud, Machine};

/// The trained demo.
const BUNDLE: &[u8] = include_bytes!("../../../assets/demo/demo.zip");
/// Name of the demo in errors.
const NAME: &str = "demo.zip";
/// Query that is asked at once.
pub(crate) const QUESTION: &str = "a button of the red controller";

const RECORD: &str = "record.json";
const PICTURE: &str = "picture.jpg";
/// Size in px of the picture that invites to open it.
const PICTURE_PX: [u32; 2] = [640, 480];

/// Recipe of a trained demo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct DemoRecipe {
    photos: SynthOptions,
    training: TrainConfig,
    /// Most photos whose labels are used to find objects.
    max_seeds: usize,
    /// Index of the photo whose camera gives the first view.
    home: usize,
    jpeg_quality: u8,
}

impl DemoRecipe {
    /// Recipe of the shipped demo: minutes on two cores, and reproducible on one machine.
    pub(crate) fn shipped() -> Self {
        let training = TrainConfig {
            steps: 5_000,
            max_side_px: 400,
            sh_degree: 1,
            max_gaussians: Some(60_000),
            backend: BackendChoice::Cpu,
            ..TrainConfig::default()
        };
        Self { photos: demo::demo_options(), training, max_seeds: 12, home: 38, jpeg_quality: 85 }
    }
}

/// Record of a trained demo: its recipe, and its quality on its held-out photos.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct DemoRecord {
    recipe: DemoRecipe,
    /// Fingerprint of the scene that was photographed.
    scene: u64,
    pub(crate) gaussians: usize,
    pub(crate) psnr: f64,
    pub(crate) ssim: f64,
    pub(crate) object_miou: f64,
    pub(crate) part_miou: f64,
}

/// Returns the picture that invites to open the demo, as a JPEG.
///
/// # Errors
/// If the archive in the program is broken.
pub(crate) fn picture() -> Result<Vec<u8>, IoError> {
    bundle::read(BUNDLE, PICTURE, Path::new(NAME))
}

/// Opens the trained demo.
///
/// # Errors
/// As [`unpacked()`] and [`open::open`].
pub(crate) fn open(folders: &Folders, machine: &Machine, observer: &mut dyn Observer) -> Result<OpenedScene, JobError> {
    let mut scene = open::open(&unpacked(folders, observer)?.join("scene"), folders, machine, observer)?;
    let photo = scene.dataset.as_ref().and_then(|d| d.photos.get(DemoRecipe::shipped().home));
    scene.home.camera = photo.map(|p| p.camera.clone()).or(scene.home.camera);
    Ok(scene)
}

/// Opens the demo's photos, to train on them; they are rendered unless they exist.
///
/// # Errors
/// If they cannot be made or read, or the observer asks to stop.
pub(crate) fn open_photos(
    folders: &Folders,
    machine: &Machine,
    observer: &mut dyn Observer,
) -> Result<OpenedScene, JobError> {
    let out = folders.demo();
    photograph(&out, &demo::demo_options(), observer)?;
    open::open(&out, folders, machine, observer)
}

/// Compares the trained demo with its held-out photos and asks its queries; heat maps go to `pictures`.
///
/// # Errors
/// If it cannot be read, or a picture cannot be written.
pub(crate) fn examine(
    folders: &Folders,
    pictures: &Path,
    observer: &mut dyn Observer,
) -> Result<([f64; 2], DemoQueries), JobError> {
    let folder = unpacked(folders, observer)?;
    let (scene, photos) = (open::scene(&folder.join("scene"))?, folder.join("photos"));
    let map = scene.semantics()?;
    let job = PhotoComparison::new(&scene, &photos, EvaluateOptions::default())?;
    let quality = evaluate::photometric(&job, observer)?;
    Ok(([quality.psnr, quality.ssim], demo_questions::ask(&map, &photos, &job, Some(pictures))?))
}

/// Makes a trained demo: renders photos, trains, finds objects, and packs the files for viewing it. Earlier work in the
/// folder `work` is reused.
///
/// # Errors
/// If anything fails on the way, or the observer asks to stop.
pub(crate) fn make(
    recipe: &DemoRecipe,
    work: &Path,
    observer: &mut dyn Observer,
) -> Result<(Vec<u8>, DemoRecord), JobError> {
    let (photos, scene) = (work.join("photos"), work.join("scene"));
    photograph(&photos, &recipe.photos, observer)?;
    let dataset = Arc::new(open::dataset(&photos)?);
    let experiment = Experiment { dataset: Arc::clone(&dataset), folder: &scene };
    let outcome = experiment.train(&recipe.training, IfChanged::Ask, observer)?.finished()?;
    let mut info = trained::load_info(&scene)?;
    let cloud = Arc::new(rounded(&outcome.cloud));
    let settings = recipe.training.render_settings(dataset.background, dataset.camera_extent().1);
    let seen = Scene {
        path: scene,
        cloud: Arc::clone(&cloud),
        cameras: info.cameras.clone(),
        settings: settings.clone(),
        config: recipe.training.clone(),
        ..Scene::default()
    };
    let job = PhotoComparison::of(&seen, Arc::clone(&dataset), EvaluateOptions::default())?;
    let mut map = demo_questions::find(&photos, &job, recipe.max_seeds, observer)?;

    // Labels of the photos that objects were found with, and of the held-out photos.
    let held_out = job.views.iter().map(|i| dataset.photos[*i].name.clone());
    let labeled: Vec<String> = map.seeds.iter().cloned().chain(held_out).collect();
    let packed = photo_files(&photos, &dataset.photos, &labeled, recipe.jpeg_quality)?;
    // Measured on the shipped photos, JPEG and all, so that anyone can measure the same.
    let shipped = work.join("shipped");
    if shipped.exists() {
        std::fs::remove_dir_all(&shipped).map_err(unwritten)?;
    }
    bundle::unpack(&bundle::pack(&packed).map_err(unwritten)?, &shipped)?;
    let shipped = shipped.join("photos");
    info.cameras.iter_mut().for_each(|c| c.name = as_jpeg(&c.name));
    let seen = Scene { cameras: info.cameras.clone(), ..seen };
    let job = PhotoComparison::of(&seen, Arc::new(open::dataset(&shipped)?), EvaluateOptions::default())?;
    let quality = evaluate::photometric(&job, observer)?;
    let DemoQueries { object_miou, part_miou, .. } = demo_questions::ask(&map, &shipped, &job, None)?;
    let (psnr, ssim) = (quality.psnr, quality.ssim);
    let gaussians = cloud.len();
    let record = DemoRecord {
        recipe: recipe.clone(),
        scene: demo::fingerprint(),
        gaussians,
        psnr,
        ssim,
        object_miou,
        part_miou,
    };

    let home = dataset.photos.get(recipe.home).or(dataset.photos.first());
    let home = home.ok_or_else(|| JobError::NoPhotos(photos.clone()))?.camera.resized(PICTURE_PX[0], PICTURE_PX[1]);
    let frame = Renderer::new().render(&cloud, Features::NONE, &home, &settings)?;
    let rgb = image::RgbImage::from_raw(PICTURE_PX[0], PICTURE_PX[1], frame.to_rgb8().into_flattened());

    info.name = "Demo".into();
    info.dataset = Some(DatasetReference { path: "../photos".into(), format: dataset.format.clone() });
    // Times differ from run to run.
    let last = crate::scene::Evaluation { step: outcome.steps, ..quality };
    info.history = History { steps: Vec::new(), evaluations: vec![last] };
    info.state = None;
    let found_in = map.findings.iter_mut().flat_map(|f| &mut f.photos).map(|p| &mut p.name);
    map.seeds.iter_mut().chain(found_in).for_each(|name| *name = as_jpeg(name));
    let mut stored = (*cloud).clone();
    map.store(&mut stored);
    let mut ply = Vec::new();
    splat_ply::encode(&mut ply, &stored, None).map_err(unwritten)?;
    let mut all = vec![
        (RECORD.to_owned(), json(&record)?),
        (PICTURE.to_owned(), jpeg(&DynamicImage::from(rgb.unwrap_or_default()), recipe.jpeg_quality)?),
        ("scene/scene.json".to_owned(), json(&info)?),
        ("scene/point_cloud.ply".to_owned(), ply),
        ("scene/semantic_map.safetensors".to_owned(), semantic_map::encode(&map, None, Path::new(NAME))?),
    ];
    all.extend(packed);
    Ok((bundle::pack(&all).map_err(unwritten)?, record))
}

/// Renders the demo's photos, unless they exist.
pub(super) fn photograph(
    out: &Path,
    options: &SynthOptions,
    observer: &mut dyn Observer,
) -> Result<Option<SynthReport>, JobError> {
    let written = demo::demo_is_written(out, options);
    Ok(if written { None } else { Some(demo::write_demo(out, options, observer)?) })
}

/// Returns the photos as JPEG, their poses and sparse points, and the labels of some of them.
fn photo_files(
    folder: &Path,
    photos: &[crate::scene::Photo],
    labeled: &[String],
    quality: u8,
) -> Result<Vec<(String, Vec<u8>)>, JobError> {
    let read = |name: &str| files::read(&folder.join(name), files::MAX_PICTURE_BYTES);
    let mut all = Vec::new();
    let transforms = String::from_utf8_lossy(&read("transforms.json")?).replace(".png\"", ".jpg\"");
    all.push(("photos/transforms.json".to_owned(), transforms.into_bytes()));
    for name in ["identities.json", "points3D.ply"] {
        all.push((format!("photos/{name}"), read(name)?));
    }
    for photo in photos {
        let bytes = read(&photo.name)?;
        let broken = |e: image::ImageError| IoError::Picture { path: photo.path.clone(), reason: e.to_string() };
        let picture = image::load_from_memory_with_format(&bytes, ImageFormat::Png).map_err(broken)?;
        all.push((format!("photos/{}", as_jpeg(&photo.name)), jpeg(&picture, quality)?));
    }
    for name in labeled {
        for ids in ["object_ids", "part_ids"] {
            let name = name.replace("images/", &format!("{ids}/"));
            all.push((format!("photos/{name}"), read(&name)?));
        }
    }
    Ok(all)
}

fn as_jpeg(name: &str) -> String {
    name.strip_suffix(".png").map_or_else(|| name.to_owned(), |stem| format!("{stem}.jpg"))
}

fn jpeg(picture: &DynamicImage, quality: u8) -> Result<Vec<u8>, IoError> {
    let mut bytes = Cursor::new(Vec::new());
    let result = picture.to_rgb8().write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, quality));
    result.map_err(|e| unwritten(std::io::Error::other(e)))?;
    Ok(bytes.into_inner())
}

fn json(value: &impl Serialize) -> Result<Vec<u8>, IoError> {
    serde_json::to_vec(value).map_err(|e| unwritten(e.into()))
}

fn unwritten(cause: std::io::Error) -> IoError {
    IoError::Write { path: NAME.into(), remedy: "the archive cannot be packed", cause }
}

/// SHA-256, in hexadecimal.
pub(crate) fn digest(bytes: &[u8]) -> String {
    files::hex(&Sha256::digest(bytes))
}

/// Rounds the Gaussians' values below visible differences, to a third of the bytes.
fn rounded(cloud: &GaussianCloud) -> GaussianCloud {
    let to = |steps: f32| move |v: f32| (v * steps).round() / steps;
    let (near, size, turn, opacity) = (to(16_384.0), to(64.0), to(128.0), to(16.0));
    let (color, tint) = (to(256.0), to(64.0));
    let stride = cloud.sh_stride();
    let positions = (0..cloud.len()).map(|i| cloud.world_position(i).as_vec3().to_array().map(near));
    let unit = |q: &[f32; 4]| {
        let length = q.iter().map(|v| v * v).sum::<f32>().sqrt().max(f32::MIN_POSITIVE);
        let sign = if q[0] < 0.0 { -1.0 } else { 1.0 };
        q.map(|v| turn(sign * v / length))
    };
    GaussianCloud {
        positions: positions.collect(),
        log_scales: cloud.log_scales.iter().map(|s| s.map(size)).collect(),
        quaternions: cloud.quaternions.iter().map(unit).collect(),
        opacity_logits: cloud.opacity_logits.iter().map(|v| opacity(*v)).collect(),
        sh_degree: cloud.sh_degree,
        sh: cloud
            .sh
            .iter()
            .enumerate()
            .map(|(i, c)| c.map(|v| if i % stride == 0 { color(v) } else { tint(v) }))
            .collect(),
        ..GaussianCloud::default()
    }
}

mod unpacked;
pub(crate) use self::unpacked::unpacked;

#[cfg(test)]
mod tests;
