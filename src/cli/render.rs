//! `fmlgs render`: one picture, depth map or alpha map of a scene, from a given camera.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::json;

use super::progress::Console;
use super::scene_args::AxesArgs;
use super::{CliError, number, output, view};
use crate::io::video::{VideoEncoder, VideoSettings};
use crate::jobs::render::{self, Quantity};
use crate::jobs::video::{self, Video, VideoRequest};
use crate::jobs::{Scene, export, open, plan, query};
use crate::math::format;
use crate::navigate::camera_spline::MOST_PICTURES;
use crate::navigate::{CameraSpline, Speed};
use crate::render::{BackendChoice, RenderSettings};
use crate::scene::{Camera, CameraPath, LevelFilter};

/// Draw a scene from a given camera into a file
///
/// Pictures, normals and alpha are 8-bit PNG. Depth is the median distance along the camera's axis in scene
/// units, which 'fmlgs eval --depth' finds nearest to the truth, 0 where nothing is: as f32 in a
/// .npy array, or as 16-bit PNG whose full scale is printed.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs render scene/ --camera 12 --out view.png\n  \
    fmlgs render scene/ --camera IMG_0041 --size 1280x720 --out view.png\n  \
    fmlgs render scene/ --channel depth --out depth.npy\n  \
    fmlgs render splat.ply --camera camera.json --out view.png\n  \
    fmlgs render splat.ply --photos photos/ --camera 0 --out view.png\n  \
    fmlgs render scene/ --path path.json --size 1280x720 --out video.mp4\n\n\
    A camera file holds one entry of 'cameras' in the output of 'fmlgs info photos/ --json'.")]
pub(crate) struct RenderArgs {
    /// Trained scene or splat file
    scene: PathBuf,
    /// Photo by index from 0 or by name, or a JSON camera file [default: the first photo, or all of the splat]
    #[arg(long)]
    camera: Option<String>,
    /// Dataset whose cameras and background to use, for a splat that came without
    #[arg(long)]
    photos: Option<PathBuf>,
    /// Size of the image, for example 1280x720 [default: the camera's own]
    #[arg(long, value_parser = view::parse_size, conflicts_with = "max_side")]
    size: Option<[u32; 2]>,
    /// Shrink the image to at most this many px along its longer side
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16384))]
    max_side: Option<u32>,
    /// Channel to draw
    #[arg(long, value_enum, default_value_t = Quantity::Picture)]
    channel: Quantity,
    /// The file to write: .png, or .npy for depth and alpha
    #[arg(long, default_value = "render.png")]
    out: PathBuf,
    /// Draw a video along this camera path instead: .mp4, .gif, .webp, or a folder of frames
    #[arg(long, conflicts_with_all = ["camera", "channel"])]
    path: Option<PathBuf>,
    /// Frames per second of the video [default: the path's own]
    #[arg(long, requires = "path", value_parser = number::within(0.01..=CameraPath::MAX_FPS))]
    fps: Option<f64>,
    /// Quality of the video, 0 to 100
    #[arg(long, default_value_t = 80, value_parser = clap::value_parser!(u8).range(0..=100))]
    quality: u8,
    /// Mark what is asked for in every frame of the video
    #[arg(long, requires = "path")]
    mark: Option<String>,
    /// Let this ffmpeg write the video
    #[arg(long, requires = "path")]
    ffmpeg: Option<PathBuf>,
    /// Renderer to draw with: auto takes a GPU if it is a real one
    #[arg(long, value_enum, default_value_t = BackendChoice::Auto)]
    backend: BackendChoice,
    #[command(flatten)]
    axes: AxesArgs,
    /// Print one JSON document about what was drawn
    #[arg(long)]
    json: bool,
}

impl RenderArgs {
    fn check(&self) -> Result<(Scene, Camera), CliError> {
        let name = self.out.to_string_lossy().to_lowercase();
        if !self.channel.endings().iter().any(|e| name.ends_with(e)) {
            let file = self.out.display();
            return Err(CliError::Usage(format!("'{file}' must end in .png, or in .npy for depth and alpha")));
        }
        let mut scene = self.axes.open(&self.scene)?;
        if let Some(photos) = &self.photos {
            let dataset = open::dataset(photos)?;
            scene.settings = scene.settings_beside(&dataset);
            scene.cameras = open::cameras(&dataset, scene.config.holdout_every);
        }
        export::check(&self.out, &[], &scene.reads())?;
        let mut camera = view::choose(self.camera.as_deref(), &scene)?;
        if let Some([width, height]) = self.size {
            camera = camera.with_size(width, height);
        }
        if let Some(side) = self.max_side {
            camera = camera.limited_to(side);
        }
        render::check_room(camera.width_px, camera.height_px)?;
        Ok((scene, camera))
    }
}

pub(crate) fn run(args: RenderArgs, quiet: bool) -> Result<(), CliError> {
    if let Some(path) = args.path.clone() {
        return video(&args, &path, quiet);
    }
    let (scene, camera) = args.check()?;
    let drawn = render::run(&scene, &camera, args.channel, args.backend, &mut Console::new(quiet))?;
    let far = render::write(&args.out, &drawn.frame, &camera, args.channel)?;
    let (size, millis) = ([camera.width_px, camera.height_px], drawn.millis);
    if args.json {
        return output::print_json(&json!({
            "out": args.out,
            "size_px": size,
            "camera": camera,
            "gaussians": scene.cloud.len(),
            "backend": drawn.backend,
            "render_ms": millis,
            "sh_degree": drawn.sh_degree,
            "depth_full_scale": far,
            "surfels_as_flat_gaussians": drawn.flat,
        }));
    }
    let scale = far.map_or(String::new(), |far| format!(", value 65535 = {far} scene units"));
    let [width, height] = size;
    let flat = if drawn.flat { ", surfels as flat Gaussians" } else { "" };
    output::print(&format!(
        "{}: {width} x {height} px, drawn in {} on {}{flat}{scale}",
        args.out.display(),
        format::millis(millis / 1e3),
        drawn.backend
    ))
}

/// Draws a video along the camera path in `path`.
fn video(args: &RenderArgs, path: &Path, quiet: bool) -> Result<(), CliError> {
    let keys = video::camera_path(path)?;
    let spline = CameraSpline::new(&keys, Speed::Constant);
    let spline = spline.ok_or_else(|| CliError::failed(format!("{}: there are no keys in it", path.display())))?;
    let mut scene = args.axes.open(&args.scene)?;
    if let Some(photos) = &args.photos {
        scene.settings = scene.settings_beside(&open::dataset(photos)?);
    }
    let reads: Vec<&Path> = scene.reads().into_iter().chain([path]).collect();
    // Without an ending it is a folder of frames.
    if args.out.is_dir() || args.out.extension().is_none() {
        export::check_folder(&args.out, &reads)?;
    } else {
        export::check(&args.out, &[], &reads)?;
    }
    let draw = RenderSettings { sh_degree: plan::of_scene(&scene).sh_degree, ..scene.settings.clone() };
    let fps = args.fps.unwrap_or(keys.fps);
    let [width, height] = args.size.unwrap_or_else(|| {
        let limit = args.max_side.unwrap_or(1280);
        [limit, (f64::from(limit) * 9.0 / 16.0).round().max(1.0) as u32]
    });
    render::check_room(width, height)?;
    let mut settings = VideoSettings::new(width, height, fps);
    (settings.quality, settings.overwrite) = (args.quality, true);
    if let Some(program) = &args.ffmpeg {
        settings.encoder = VideoEncoder::Ffmpeg { program: program.clone(), args: Vec::new() };
    }
    let cameras: Vec<Camera> = spline.poses(fps, MOST_PICTURES).iter().map(|p| p.camera(width, height)).collect();
    let marked = match &args.mark {
        Some(query) => {
            let map = scene.semantics()?;
            let ids = query::identities(&map, &query::seen_from(&scene, None), query, LevelFilter::Auto, 1)?;
            Some((Arc::new(map), ids))
        }
        None => None,
    };
    let (cloud, out, backend) = (Arc::clone(&scene.cloud), args.out.clone(), args.backend);
    let request = VideoRequest { cloud, draw, cameras, marked, out, settings, backend };
    let Video { summary, backend, secs } =
        video::run(request, &mut Console::new(quiet)).map_err(|e| CliError::of_work(e, "no video was written"))?;
    let (w, h) = summary.size_px;
    if args.json {
        return output::print_json(&json!({
            "out": summary.path, "frames": summary.frames, "bytes": summary.bytes, "film_secs": summary.secs,
            "size_px": [w, h], "backend": backend, "secs": secs,
        }));
    }
    output::print(&format!(
        "{}: {} frames of {w} x {h} px, {:.1} s long, {}, drawn in {secs:.1} s on {}",
        summary.path.display(),
        summary.frames,
        summary.secs,
        format::bytes(summary.bytes),
        backend
    ))
}
