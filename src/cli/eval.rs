//! `fmlgs eval`: PSNR and SSIM on held-out photos, with pictures side by side.

use std::path::{Path, PathBuf};

use image::ColorType;
use serde_json::json;

use super::eval_masks::{self, Protocol};
use super::opened::DrawableScene;
use super::progress::Console;
use super::{CliError, eval_depth, number, opened, output};
use crate::io;
use crate::math::stats::mean;
use crate::pipeline::evaluate::evaluate;
use crate::pipeline::observer::{Observer, Severity, Ticker, ViewScore};
use crate::pipeline::train::TrainView;
use crate::pipeline::train::border::Borders;
use crate::render::{Features, RenderSettings, Renderer};
use crate::scene::{Dataset, GaussianCloud};

/// The difference picture shows errors this many times larger.
const DIFFERENCE_GAIN: i32 = 4;

/// Measure PSNR and SSIM of a scene on held-out photos
///
/// The held-out photos are those that training left out; for a splat that was trained elsewhere,
/// give the photos with --photos. SSIM is that of the 3D Gaussian Splatting literature (11 x 11
/// Gaussian window). Photos are undistorted and scaled as in training.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs eval scene/\n  \
    fmlgs eval scene/ --pictures compare/       photo | render | difference x 4, one PNG per view\n  \
    fmlgs eval scene/ --depth                   depth, on photos made by 'fmlgs synth'\n  \
    fmlgs eval scene/ --masks photos/           objects and parts against labels\n  \
    fmlgs eval scene/ --masks photos/ --protocol part-recall\n  \
    fmlgs eval splat.ply --photos photos/ --max-side 1600 --json")]
pub struct Args {
    /// Trained scene or splat file
    scene: PathBuf,
    /// Dataset with the photos [default: where the scene's photos are]
    #[arg(long)]
    photos: Option<PathBuf>,
    #[command(flatten)]
    options: Options,
    /// Compare objects and parts instead, with these labels: each named region of a held-out photo
    /// is asked for by its name
    #[arg(long)]
    masks: Option<PathBuf>,
    /// How objects and parts are compared
    #[arg(long, value_enum, default_value_t = Protocol::Masks, requires = "masks")]
    protocol: Protocol,
    /// What to ask for, where labels do not name it (spin-nerf)
    #[arg(long, requires = "masks")]
    query: Option<String>,
    /// Compare depth instead, with the true depths that came with synthetic photos
    #[arg(long, conflicts_with = "masks")]
    depth: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// What is compared; by default as in training.
#[derive(Debug, Default, clap::Args)]
pub struct Options {
    /// Longer side of the compared pictures in px [default: as in training, else 512]
    #[arg(long, value_parser = clap::value_parser!(u32).range(16..=16384))]
    pub max_side: Option<u32>,
    /// Which photos count as held out: every n-th, 0 = all photos [default: as in training, else 8]
    #[arg(long, value_parser = number::within(0..=1_000_000_usize))]
    pub holdout_every: Option<usize>,
    /// Compare the black borders of photos that were undistorted elsewhere, too
    #[arg(long)]
    pub keep_borders: bool,
    /// Folder for pictures: photo, render and difference side by side
    #[arg(long)]
    pub pictures: Option<PathBuf>,
}

/// A checked evaluation.
pub struct Job {
    /// The Gaussians.
    pub cloud: GaussianCloud,
    /// How they are drawn.
    pub settings: RenderSettings,
    /// The photos.
    pub dataset: Dataset,
    /// Indices of the photos to compare with.
    pub views: Vec<usize>,
    /// Longer side of the compared pictures in px.
    pub max_side_px: u32,
    /// Borders of the photos, which are left out.
    pub borders: Option<Borders>,
    /// Folder for pictures.
    pub pictures: Option<PathBuf>,
    /// Id of the save that the scene's files are of.
    pub state: Option<String>,
}

impl Args {
    fn check(self) -> Result<Job, CliError> {
        let scene = opened::drawable(&self.scene)?;
        let photos = self.photos.or_else(|| scene.dataset_path.clone()).ok_or_else(|| {
            let path = self.scene.display();
            CliError::failed(format!("{path}: its photos are not known or no longer there; give them with --photos"))
        })?;
        if let Some(folder) = &self.options.pictures {
            output::check_folder(folder, &[&photos])?;
        }
        job(scene, &photos, self.options)
    }
}

/// The evaluation of `scene` on `photos`.
pub fn job(scene: DrawableScene, photos: &Path, options: Options) -> Result<Job, CliError> {
    let Options { max_side, holdout_every, keep_borders, pictures } = options;
    let dataset = opened::dataset(photos)?;
    let mut views = match holdout_every {
        Some(every) => dataset.split(every).1,
        None if scene.cameras.is_empty() => dataset.split(scene.config.holdout_every).1,
        // By name: the dataset may have gained or lost photos since.
        None => {
            let held = |name: &str| scene.cameras.iter().any(|c| c.held_out && c.name == name);
            (0..dataset.photos.len()).filter(|&i| held(&dataset.photos[i].name)).collect()
        }
    };
    if holdout_every == Some(0) {
        views = (0..dataset.photos.len()).collect();
    }
    if views.is_empty() {
        return Err(CliError::failed(format!(
            "{}: no photo is held out; --holdout-every 0 compares with all of them",
            photos.display()
        )));
    }
    let max_side_px = max_side.unwrap_or(scene.config.max_side_px);
    let (training, _) = dataset.split(holdout_every.unwrap_or(scene.config.holdout_every));
    let borders = if keep_borders { None } else { Some(Borders::of(&dataset, &training, max_side_px)?) };
    let DrawableScene { cloud, settings, state, .. } = scene;
    Ok(Job { cloud, settings, dataset, views, max_side_px, borders, pictures, state })
}

pub fn run(args: Args, quiet: bool) -> Result<(), CliError> {
    let json = args.json;
    let scene = args.scene.clone();
    if let Some(masks) = args.masks.clone() {
        let (protocol, query) = (args.protocol, args.query.clone());
        return eval_masks::run(&scene, &masks, protocol, query.as_deref(), args.check()?, json);
    }
    let depth = args.depth;
    let job = args.check()?;
    if depth {
        return eval_depth::run(&scene, &job, json, &mut Console::new(quiet));
    }
    let scores = measure(&job, &mut Console::new(quiet))?;
    let (psnr, ssim) = means(&scores);
    if json {
        return output::print_json(&json!({
            "scene": scene,
            "gaussians": job.cloud.len(),
            "max_side_px": job.max_side_px,
            "psnr": psnr,
            "ssim": ssim,
            "views": scores,
        }));
    }
    let mut rows = vec![vec!["view".to_owned(), "PSNR dB".to_owned(), "SSIM".to_owned()]];
    rows.extend(scores.iter().map(|s| vec![s.name.clone(), format!("{:.2}", s.psnr), format!("{:.4}", s.ssim)]));
    rows.push(vec![format!("mean of {}", scores.len()), format!("{psnr:.2}"), format!("{ssim:.4}")]);
    output::print(&output::table(&rows))
}

/// Mean PSNR in dB and mean SSIM.
pub fn means(scores: &[ViewScore]) -> (f64, f64) {
    let of = |f: fn(&ViewScore) -> f64| mean(&scores.iter().map(f).collect::<Vec<_>>());
    (of(|s| s.psnr), of(|s| s.ssim))
}

/// Scores every view, one at a time so that memory holds one photo, and writes its picture.
pub fn measure(job: &Job, observer: &mut dyn Observer) -> Result<Vec<ViewScore>, CliError> {
    let mut ticker = Ticker::new("Measuring", job.views.len());
    let mut scores = Vec::with_capacity(job.views.len());
    if let Some(folder) = &job.pictures {
        output::make_folder(folder)?;
    }
    for warning in &job.dataset.warnings {
        observer.note(Severity::Warning, warning.clone());
    }
    for (done, &index) in job.views.iter().enumerate() {
        if ticker.proceed(observer).is_err() {
            return Err(CliError::Cancelled(format!("{done} of {} views were measured", job.views.len())));
        }
        let photo = &job.dataset.photos[index];
        let pixels = match &job.borders {
            Some(borders) => borders.load(photo)?,
            None => io::photo::load(photo, job.max_side_px)?,
        };
        let camera = photo.camera.resized(pixels.width_px, pixels.height_px);
        let view = TrainView { name: photo.name.clone(), camera, pixels };
        let evaluation = evaluate(&job.cloud, std::slice::from_ref(&view), &job.settings, 0, 0.0)?;
        scores.extend(evaluation.views);
        if let Some(folder) = &job.pictures {
            write_comparison(&job.cloud, &job.settings, &view, &folder.join(picture_name(index, &view.name)))?;
        }
        ticker.report(done as u64 + 1, observer);
    }
    Ok(scores)
}

/// `012_images_0012.png` for photo 12, `images/0012.jpg`: in order, and safe as a file name.
fn picture_name(index: usize, photo: &str) -> String {
    let stem = photo.rsplit_once('.').map_or(photo, |(stem, _)| stem);
    let safe: String = stem.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect();
    format!("{index:03}_{safe}.png")
}

/// Photo, render and amplified difference side by side.
fn write_comparison(
    cloud: &GaussianCloud,
    settings: &RenderSettings,
    view: &TrainView,
    path: &Path,
) -> Result<(), CliError> {
    let frame = Renderer::new().render(cloud, Features::NONE, &view.camera, settings)?;
    let mut render = frame.to_rgb8();
    let width = frame.width_px;
    let difference = |(a, b): (&[u8; 3], &[u8; 3])| {
        std::array::from_fn(|c| ((i32::from(a[c]) - i32::from(b[c])).abs() * DIFFERENCE_GAIN).min(255) as u8)
    };
    let mut pixels: Vec<[u8; 3]> = Vec::with_capacity(3 * render.len());
    if let Some(coverage) = &view.pixels.coverage {
        render.iter_mut().zip(coverage).filter(|(_, c)| **c == 0).for_each(|(rgb, _)| *rgb = [0; 3]);
    }
    for (photo_row, render_row) in view.pixels.rgb.chunks_exact(width).zip(render.chunks_exact(width)) {
        pixels.extend_from_slice(photo_row);
        pixels.extend_from_slice(render_row);
        pixels.extend(photo_row.iter().zip(render_row).map(difference));
    }
    let size = [3 * frame.width_px as u32, frame.height_px as u32];
    output::write_png(path, pixels.as_flattened(), size, ColorType::Rgb8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn picture_names_are_safe() {
        assert_eq!(picture_name(7, "images/../a b.JPG"), "007_images____a_b.png");
        assert_eq!(picture_name(1234, "x"), "1234_x.png");
    }
}
