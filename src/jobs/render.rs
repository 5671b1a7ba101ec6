//! Draws a scene from a camera, and writes the image.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use image::ColorType;

use super::{JobError, Scene, export, plan, video};
use crate::io::{IoError, camera_file, memory};
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::video::{Marked, picture};
use crate::render::{BackendChoice, Frame, RenderSettings, Renderer, normals};
use crate::scene::{Camera, GaussianCloud, IdentityId, SemanticMap};

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Quantity {
    /// Colors
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

impl Quantity {
    /// Valid endings of its file names.
    pub(crate) fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Picture | Self::Normals => &[".png"],
            Self::Depth | Self::ExpectedDepth | Self::Alpha => &[".png", ".npy"],
        }
    }
}

pub(crate) struct Rendered {
    pub(crate) frame: Frame<f32>,
    /// The renderer: "CPU", or the name of the GPU.
    pub(crate) backend: String,
    pub(crate) millis: f64,
    /// Degree of the drawn spherical harmonics.
    pub(crate) sh_degree: u8,
    /// True if surfels were drawn as flat Gaussians: only the CPU draws them as surfels.
    pub(crate) flat: bool,
}

/// Draws `what` of a scene.
pub(crate) fn run(
    scene: &Scene,
    camera: &Camera,
    what: Quantity,
    wanted: BackendChoice,
    observer: &mut dyn Observer,
) -> Result<Rendered, JobError> {
    let depth = matches!(what, Quantity::Depth | Quantity::ExpectedDepth | Quantity::Normals);
    let settings = RenderSettings { depth, sh_degree: plan::of_scene(scene).sh_degree, ..scene.settings.clone() };
    let choice = video::backend(wanted, &settings);
    let mut renderer = Renderer::choose(choice, |why| observer.note(Severity::Warning, why))?;
    let flat = settings.surfels && renderer.is_gpu();
    let start = Instant::now();
    let frame = renderer.draw(&scene.cloud, camera, &settings)?;
    let millis = start.elapsed().as_secs_f64() * 1e3;
    Ok(Rendered { frame, backend: renderer.name().to_owned(), millis, sh_degree: settings.sh_degree, flat })
}

/// Draws the colors of Gaussians as PNG, with these identities outlined.
pub(crate) fn png(
    cloud: &Arc<GaussianCloud>,
    camera: &Camera,
    settings: &RenderSettings,
    (map, ids): (&SemanticMap, &[IdentityId]),
) -> Result<Vec<u8>, JobError> {
    let marked = Marked { map, ids, color: video::MARK, fill: 0 };
    let pixels = picture(cloud, settings, camera, Some(marked), &mut Renderer::new())?;
    let mut png = Vec::new();
    let size = [camera.width_px, camera.height_px];
    let encoded = export::encode_png(&mut png, pixels.as_flattened(), size, ColorType::Rgb8);
    encoded.map_err(|e| JobError::Output(format!("the picture cannot be encoded: {e}")))?;
    Ok(png)
}

pub(crate) fn camera(path: &Path) -> Result<Camera, IoError> {
    camera_file::read(path)
}

/// Bytes per pixel to draw: color, depth and opacity, their copies on the way to the file.
const BYTES_PER_PX: u64 = 64;

/// Refuses a picture that does not fit in free memory.
pub(crate) fn check_room(width_px: u32, height_px: u32) -> Result<(), JobError> {
    let bytes = u64::from(width_px) * u64::from(height_px) * BYTES_PER_PX;
    let what = format!("drawing {width_px} x {height_px} px");
    Ok(memory::room(what, bytes, "make it smaller with --size or --max-side")?)
}

/// Writes a frame as a `.png`, or as an array if the name ends in `.npy`. Returns the depth that 65535 stands for, if
/// depth is stored so.
pub fn write(path: &Path, frame: &Frame<f32>, camera: &Camera, what: Quantity) -> Result<Option<f32>, IoError> {
    export::make_parent(path)?;
    let size = [frame.width_px as u32, frame.height_px as u32];
    let array = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy"));
    let depth = match what {
        Quantity::Picture => {
            return export::png(path, frame.to_rgb8().as_flattened(), size, ColorType::Rgb8).map(|()| None);
        }
        Quantity::Normals => {
            // A pixel without a normal has 0, the gray in the middle.
            let code = |n: [f32; 3]| n.map(|c| (c * 127.5 + 128.0) as u8);
            let rgb: Vec<[u8; 3]> = normals::of_depth(&frame.median_depth, camera).into_iter().map(code).collect();
            return export::png(path, rgb.as_flattened(), size, ColorType::Rgb8).map(|()| None);
        }
        Quantity::Alpha if array => return export::npy(path, &frame.alpha, size).map(|()| None),
        Quantity::Alpha => {
            let bytes: Vec<u8> = frame.alpha.iter().map(|a| (a.clamp(0.0, 1.0) * 255.0 + 0.5) as u8).collect();
            return export::png(path, &bytes, size, ColorType::L8).map(|()| None);
        }
        Quantity::Depth => frame.median_depth.clone(),
        Quantity::ExpectedDepth => frame.expected_depth(),
    };
    if array {
        return export::npy(path, &depth, size).map(|()| None);
    }
    let far = depth.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
    let code = |d: &f32| ((d / far * 65535.0 + 0.5) as u16).to_ne_bytes();
    let bytes: Vec<u8> = depth.iter().flat_map(code).collect();
    export::png(path, &bytes, size, ColorType::L16).map(|()| Some(far))
}
