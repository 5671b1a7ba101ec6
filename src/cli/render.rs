//! `fmlgs render`: one picture, depth map or alpha map of a scene, from a given camera.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use image::ColorType;
use serde_json::json;

use super::opened::DrawableScene;
use super::{CliError, opened, output, view};
use crate::render::cpu::normals;
use crate::render::{Backend, BackendChoice, Frame, RenderSettings};
use crate::scene::Camera;

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
    fmlgs render splat.ply --photos photos/ --camera 0 --out view.png\n\n\
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
    /// Which renderer draws: auto takes a GPU if it is a real one
    #[arg(long, value_enum, default_value_t = BackendChoice::Auto)]
    backend: BackendChoice,
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
        let mut camera = view::choose(self.camera.as_deref(), &scene)?;
        if let Some([width, height]) = self.size {
            camera = view::with_size(&camera, width, height);
        }
        if let Some(side) = self.max_side {
            camera = camera.limited_to(side);
        }
        Ok(Job { scene, camera, storage })
    }
}

pub fn run(args: Args) -> Result<(), CliError> {
    let job = args.check()?;
    let settings = RenderSettings { depth: args.what.needs_depth(), ..job.scene.settings };
    let choice =
        if settings.surfels && args.backend == BackendChoice::Auto { BackendChoice::Cpu } else { args.backend };
    let mut backend = Backend::choose(choice)?;
    // Only the CPU draws surfels as such.
    let flat = settings.surfels && !matches!(backend, Backend::Cpu(_));
    let cloud = Arc::new(job.scene.cloud);
    let started = Instant::now();
    let frame = backend.render(&cloud, &job.camera, &settings)?;
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
            "backend": backend.name(),
            "render_ms": millis,
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
        backend.name()
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
