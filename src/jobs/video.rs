//! Draws a video of a scene along a camera path.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::{JobError, export};
use crate::io::IoError;
use crate::io::camera_path::open;
use crate::io::video::{VideoSettings, VideoSummary};
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::video::{self, Marked};
use crate::render::{BackendChoice, RenderSettings, Renderer};
use crate::scene::{Camera, CameraPath, GaussianCloud, IdentityId, SemanticMap};

/// Color of marked identities.
pub(super) const MARK: [u8; 3] = [255, 64, 160];
/// Weight of that color inside their border in a video, of 8.
const FILL: u32 = 3;

/// A video to draw.
#[derive(Clone, Debug)]
pub struct VideoRequest {
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) draw: RenderSettings,
    pub(crate) cameras: Vec<Camera>,
    pub(crate) marked: Option<(Arc<SemanticMap>, Vec<IdentityId>)>,
    pub(crate) out: PathBuf,
    pub(crate) settings: VideoSettings,
    pub(crate) backend: BackendChoice,
}

#[derive(Clone, Debug)]
pub(crate) struct Video {
    pub(crate) summary: VideoSummary,
    /// The renderer: "CPU", or the name of the GPU.
    pub(crate) backend: String,
    pub(crate) secs: f64,
}

/// Returns the renderer for these settings. Only the CPU draws surfels as such, so they get the CPU, unless the user
/// demands another.
pub(crate) fn backend(wanted: BackendChoice, settings: &RenderSettings) -> BackendChoice {
    if settings.surfels && wanted == BackendChoice::Auto { BackendChoice::Cpu } else { wanted }
}

/// Draws a video.
///
/// # Errors
/// If the demanded renderer is not available, a frame cannot be drawn or written, or the observer asks to stop; nothing
/// is left of the video then.
pub(crate) fn run(request: VideoRequest, observer: &mut dyn Observer) -> Result<Video, JobError> {
    let VideoRequest { cloud, draw, cameras, marked, out, settings, backend } = request;
    let marked = marked.as_ref().map(|(map, ids)| Marked { map, ids, color: MARK, fill: FILL });
    let choice = self::backend(backend, &draw);
    let mut renderer = Renderer::choose(choice, |why| observer.note(Severity::Warning, why))?;
    let start = Instant::now();
    export::make_parent(&out)?;
    let summary = video::write(&cloud, &draw, &cameras, marked, &mut renderer, (&out, &settings), observer)?;
    Ok(Video { summary, backend: renderer.name().to_owned(), secs: start.elapsed().as_secs_f64() })
}

/// Reads a camera path from a file: this program's or nerfstudio's.
pub(crate) fn camera_path(path: &Path) -> Result<CameraPath, IoError> {
    open(path)
}
