//! `fmlgs render`: one picture, depth map or alpha map of a scene, from a given camera.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use image::ColorType;
use serde_json::json;

use super::asking::{Asker, semantics};
use super::opened::DrawableScene;
use super::plan::PlanArgs;
use super::progress::Console;
use super::{CliError, number, opened, output, view};
use crate::io;
use crate::io::animation::{Encoder, Settings};
use crate::navigate::film::MOST_PICTURES;
use crate::navigate::{Film, Speed};
use crate::pipeline::film::{self, Marked};
use crate::pipeline::semantics::grammar::Kind;
use crate::render::{BackendChoice, Frame, RenderSettings, Renderer, normals};
use crate::scene::{Camera, CameraPath, ScenePlan};

/// Draw a scene from a given camera into a file
///
/// Pictures, normals and alpha are 8-bit PNG. Depth is the median distance along the camera's axis in scene
/// units, which 'fmlgs eval --depth' finds nearest to the truth, 0 where nothing is: as f32 in a
/// .npy array, or as 16-bit PNG whose full scale is printed.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs render scene/ --camera 12 --out view.png\n  \
    fmlgs render scene/ --camera IMG_0041 --size 1280x720 --out view.png\n  \
    fmlgs render scene/ --what depth --out depth.npy\n  \
    fmlgs render splat.ply --camera camera.json --out view.png\n  \
    fmlgs render splat.ply --photos photos/ --camera 0 --out view.png\n  \
    fmlgs render scene/ --path path.json --size 1280x720 --out film.mp4\n\n\
    A camera file holds one entry of 'cameras' in the output of 'fmlgs info photos/ --json'.")]
pub struct Args {
    /// Trained scene or splat file
    scene: PathBuf,
    /// Photo by index from 0 or by name, or a JSON camera file [default: the first photo, or all of the splat]
    #[arg(long)]
    camera: Option<String>,
    /// Dataset whose cameras to use, for a splat that came without
    #[arg(long)]
    photos: Option<PathBuf>,
    /// Size of the picture, for example 1280x720 [default: the camera's own]
    #[arg(long, value_parser = view::parse_size, conflicts_with = "max_side")]
    size: Option<[u32; 2]>,
    /// Shrink the picture to at most this many px along its longer side
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16384))]
    max_side: Option<u32>,
    /// What to draw
    #[arg(long, value_enum, default_value_t = What::Picture)]
    what: What,
    /// The file to write: .png, or .npy for depth and alpha
    #[arg(long, default_value = "render.png")]
    out: PathBuf,
    /// Draw a film along this camera path instead: .mp4, .gif, .webp, or a folder of frames
    #[arg(long, conflicts_with_all = ["camera", "what"])]
    path: Option<PathBuf>,
    /// Pictures per second of the film [default: the path's own]
    #[arg(long, requires = "path", value_parser = number::within(0.01..=CameraPath::MAX_FPS))]
    fps: Option<f64>,
    /// Quality of the film, 0 to 100
    #[arg(long, default_value_t = 80, value_parser = clap::value_parser!(u8).range(0..=100))]
    quality: u8,
    /// Mark what is asked for in every picture of the film
    #[arg(long, requires = "path")]
    mark: Option<String>,
    /// Let this ffmpeg write the film
    #[arg(long, requires = "path")]
    ffmpeg: Option<PathBuf>,
    /// Which renderer draws: auto takes a GPU if it is a real one
    #[arg(long, value_enum, default_value_t = BackendChoice::Auto)]
    backend: BackendChoice,
    #[command(flatten)]
    plan: PlanArgs,
    /// Print one JSON document about what was drawn
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum What {
    /// Colours
    Picture,
    /// Distance along the camera's axis at which half of the light is spent
    Depth,
    /// The mean of that distance over the light
    ExpectedDepth,
    /// Normals of the surface that median depth describes, world axes, -1 to 1 as 0 to 255
    Normals,
    /// Accumulated opacity
    Alpha,
}

impl What {
    /// Whether depth must be drawn for it.
    fn needs_depth(self) -> bool {
        matches!(self, Self::Depth | Self::ExpectedDepth | Self::Normals)
    }
}

/// How the values are stored, by the file's extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Storage {
    Png,
    Npy,
}

/// A checked request.
struct Job {
    scene: DrawableScene,
    camera: Camera,
    storage: Storage,
}

impl Args {
    fn check(&self) -> Result<Job, CliError> {
        let extension = self.out.extension().map(|e| e.to_string_lossy().to_lowercase());
        let storage = match (extension.as_deref(), self.what) {
            (Some("png"), _) => Storage::Png,
            (Some("npy"), What::Depth | What::ExpectedDepth | What::Alpha) => Storage::Npy,
            _ => {
                let file = self.out.display();
                return Err(CliError::Usage(format!("'{file}' must end in .png, or in .npy for depth and alpha")));
            }
        };
        let mut scene = opened::drawable(&self.scene)?;
        if let Some(photos) = &self.photos {
            scene.cameras = opened::named_cameras(&opened::dataset(photos)?, scene.config.holdout_every);
        }
        output::check(&self.out, &[], &scene.reads(&self.scene))?;
        let mut camera = view::choose(self.camera.as_deref(), &scene)?;
        if let Some([width, height]) = self.size {
            camera = view::with_size(&camera, width, height);
        }
        if let Some(side) = self.max_side {
            camera = camera.limited_to(side);
        }
        view::check_room(camera.width_px, camera.height_px)?;
        Ok(Job { scene, camera, storage })
    }
}

pub fn run(args: Args, quiet: bool) -> Result<(), CliError> {
    if let Some(path) = args.path.clone() {
        return film(&args, &path, quiet);
    }
    let job = args.check()?;
    let plan = args.plan.of_scene(&job.scene);
    let settings = RenderSettings { depth: args.what.needs_depth(), sh_degree: plan.sh_degree, ..job.scene.settings };
    let mut renderer = Renderer::choose(choice(args.backend, &settings, &plan), output::warn)?;
    // Only the CPU draws surfels as such.
    let flat = settings.surfels && renderer.is_gpu();
    let cloud = Arc::new(job.scene.cloud);
    let started = Instant::now();
    let frame = renderer.draw(&cloud, &job.camera, &settings)?;
    let millis = started.elapsed().as_secs_f64() * 1e3;

    output::make_parent(&args.out)?;
    let far = save(&frame, &job.camera, args.what, job.storage, &args.out)?;
    let size = [job.camera.width_px, job.camera.height_px];
    if args.json {
        return output::print_json(&json!({
            "out": args.out,
            "size_px": size,
            "camera": job.camera,
            "gaussians": cloud.len(),
            "backend": renderer.name(),
            "render_ms": millis,
            "sh_degree": settings.sh_degree,
            "depth_full_scale": far,
            "surfels_as_flat_gaussians": flat,
        }));
    }
    let scale = far.map_or(String::new(), |far| format!(", value 65535 = {far} scene units"));
    let [width, height] = size;
    let flat = if flat { ", surfels as flat Gaussians" } else { "" };
    output::print(&format!(
        "{}: {width} x {height} px, drawn in {millis:.0} ms on {}{flat}{scale}",
        args.out.display(),
        renderer.name()
    ))
}

/// Only the CPU draws surfels as such: it is chosen for them unless a person wants otherwise.
fn choice(wanted: BackendChoice, settings: &RenderSettings, plan: &ScenePlan) -> BackendChoice {
    let cpu = (settings.surfels || plan.on_cpu) && wanted == BackendChoice::Auto;
    if cpu { BackendChoice::Cpu } else { wanted }
}

/// Draws a film along the camera path in `path`.
fn film(args: &Args, path: &Path, quiet: bool) -> Result<(), CliError> {
    let keys = io::camera_path::open(path)?;
    let film = Film::new(&keys, Speed::Constant);
    let film = film.ok_or_else(|| CliError::failed(format!("{}: there are no keys in it", path.display())))?;
    let mut scene = opened::drawable(&args.scene)?;
    let reads: Vec<&Path> = scene.reads(&args.scene).into_iter().chain([path]).collect();
    if args.out.is_dir() {
        output::check_folder(&args.out, &reads)?
    } else {
        output::check(&args.out, &[], &reads)?
    }
    let plan = args.plan.of_scene(&scene);
    scene.settings.sh_degree = plan.sh_degree;
    let fps = args.fps.unwrap_or(keys.fps);
    let [width, height] = args.size.unwrap_or_else(|| {
        let limit = args.max_side.unwrap_or(1280);
        [limit, (f64::from(limit) * 9.0 / 16.0).round().max(1.0) as u32]
    });
    view::check_room(width, height)?;
    let mut settings = Settings::new(width, height, fps);
    (settings.quality, settings.overwrite) = (args.quality, true);
    if let Some(program) = &args.ffmpeg {
        settings.encoder = Encoder::Ffmpeg { program: program.clone(), args: Vec::new() };
    }
    let cameras: Vec<Camera> = film.pictures(fps, MOST_PICTURES).iter().map(|p| p.camera(width, height)).collect();
    let map = match &args.mark {
        Some(_) => Some(semantics(&args.scene, scene.state.as_deref(), &scene.cloud)?),
        None => None,
    };
    let mut ids = Vec::new();
    if let (Some(map), Some(query)) = (&map, &args.mark) {
        let answered = Asker::new(map)?.ask(query, Kind::Auto)?;
        ids = answered.map(|a| a.chosen(1)).unwrap_or_default();
        if ids.is_empty() {
            return Err(CliError::failed(format!("nothing here fits '{query}'; see 'fmlgs query'")));
        }
    }
    let marked = map.as_ref().map(|map| Marked { map, ids: &ids, color: [255, 64, 160] });
    let mut renderer = Renderer::choose(choice(args.backend, &scene.settings, &plan), output::warn)?;
    let started = Instant::now();
    output::make_parent(&args.out)?;
    let mut console = Console::new(quiet);
    let cloud = Arc::new(scene.cloud);
    let out = (args.out.as_path(), &settings);
    let made = film::write(&cloud, &scene.settings, &cameras, marked, &mut renderer, out, &mut console);
    let summary = made.map_err(|e| CliError::of_work(e, "no video was written"))?;
    let secs = started.elapsed().as_secs_f64();
    let (w, h) = summary.size_px;
    if args.json {
        return output::print_json(&json!({
            "out": summary.path, "frames": summary.frames, "bytes": summary.bytes, "film_secs": summary.secs,
            "size_px": [w, h], "backend": renderer.name(), "secs": secs,
        }));
    }
    output::print(&format!(
        "{}: {} pictures of {w} x {h} px, {:.1} s long, {:.1} MB, drawn in {secs:.1} s on {}",
        summary.path.display(),
        summary.frames,
        summary.secs,
        summary.bytes as f64 / 1e6,
        renderer.name()
    ))
}

/// Writes the file; returns the depth that 65535 stands for, where that is how it is stored.
fn save(
    frame: &Frame<f32>,
    camera: &Camera,
    what: What,
    storage: Storage,
    out: &Path,
) -> Result<Option<f32>, CliError> {
    let size = [frame.width_px as u32, frame.height_px as u32];
    match (what, storage) {
        (What::Picture, _) => {
            output::write_png(out, frame.to_rgb8().as_flattened(), size, ColorType::Rgb8)?;
        }
        (What::Normals, _) => {
            // Where there is none it is 0, which is the grey in the middle.
            let code = |n: [f32; 3]| n.map(|c| (c * 127.5 + 128.0) as u8);
            let rgb: Vec<[u8; 3]> = normals::of_depth(&frame.median_depth, camera).into_iter().map(code).collect();
            output::write_png(out, rgb.as_flattened(), size, ColorType::Rgb8)?;
        }
        (What::Alpha, Storage::Npy) => output::write_npy(out, &frame.alpha, size)?,
        (What::Alpha, Storage::Png) => {
            let bytes: Vec<u8> = frame.alpha.iter().map(|a| (a.clamp(0.0, 1.0) * 255.0 + 0.5) as u8).collect();
            output::write_png(out, &bytes, size, ColorType::L8)?;
        }
        (What::Depth | What::ExpectedDepth, _) => {
            let depth = if what == What::Depth { frame.median_depth.clone() } else { frame.expected_depth() };
            if storage == Storage::Npy {
                output::write_npy(out, &depth, size)?;
                return Ok(None);
            }
            let far = depth.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
            let code = |d: &f32| ((d / far * 65535.0 + 0.5) as u16).to_ne_bytes();
            let bytes: Vec<u8> = depth.iter().flat_map(code).collect();
            output::write_png(out, &bytes, size, ColorType::L16)?;
            return Ok(Some(far));
        }
    }
    Ok(None)
}
