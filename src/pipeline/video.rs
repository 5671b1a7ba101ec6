//! Videos: a scene rendered from one camera after another, optionally with highlighted identities.

use std::path::Path;
use std::sync::Arc;

use super::observer::{Interrupted, Observer, Ticker};
use super::semantics::view_map::ViewMap;
use crate::io::video::{VideoFileError, VideoSettings, VideoSummary, VideoWriter};

use crate::render::{DrawError, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, IdentityId, SemanticMap};

#[derive(Clone, Copy)]
pub(crate) struct Marked<'a> {
    pub(crate) map: &'a SemanticMap,
    pub(crate) ids: &'a [IdentityId],
    pub(crate) color: [u8; 3],
    /// Weight of the color inside the border, of 8.
    pub(crate) fill: u32,
}

/// Reasons for which a video could not be made.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum VideoError {
    #[error(transparent)]
    Draw(#[from] DrawError),
    #[error(transparent)]
    File(#[from] VideoFileError),
    /// The observer asked to stop; nothing is left of the video.
    #[error("canceled")]
    Interrupted(#[from] Interrupted),
}

/// Renders the scene from every camera into a video at `out`.
pub(crate) fn write(
    cloud: &Arc<GaussianCloud>,
    draw: &RenderSettings,
    cameras: &[Camera],
    marked: Option<Marked<'_>>,
    renderer: &mut Renderer,
    out: (&Path, &VideoSettings),
    observer: &mut dyn Observer,
) -> Result<VideoSummary, VideoError> {
    let mut ticker = Ticker::new("Drawing the video", cameras.len());
    observer.proceed()?;
    let mut writer = VideoWriter::create(out.0, out.1)?;
    for (done, camera) in cameras.iter().enumerate() {
        writer.push(picture(cloud, draw, camera, marked, renderer)?.as_flattened())?;
        ticker.tick(done + 1, observer)?;
    }
    Ok(writer.finish()?)
}

/// Renders the scene from one camera.
pub(crate) fn picture(
    cloud: &Arc<GaussianCloud>,
    draw: &RenderSettings,
    camera: &Camera,
    marked: Option<Marked<'_>>,
    renderer: &mut Renderer,
) -> Result<Vec<[u8; 3]>, DrawError> {
    let mut pixels = renderer.draw_rgb8(cloud, camera, draw)?;
    if let Some(marked) = marked.filter(|m| !m.ids.is_empty()) {
        let Marked { map, ids, color, fill } = marked;
        let view = ViewMap::render(renderer, cloud, &map.identity_of, &map.identities, camera, draw)?;
        for id in ids {
            let mask = view.mask(&map.identities, *id);
            mark(&mut pixels, camera.width_px as usize, |i| mask.contains(i), color, fill);
        }
    }
    Ok(pixels)
}

/// Tints the pixels of a mask, its border strongest.
fn mark(pixels: &mut [[u8; 3]], width: usize, inside: impl Fn(usize) -> bool, color: [u8; 3], fill: u32) {
    let height = pixels.len() / width.max(1);
    for y in 0..height {
        for x in 0..width {
            let i = y * width + x;
            if !inside(i) {
                continue;
            }
            let edge = x == 0 || y == 0 || x + 1 == width || y + 1 == height;
            let border = edge || [i - 1, i + 1, i - width, i + width].iter().any(|n| !inside(*n));
            let weight = if border { 8 } else { fill };
            let mix = |c: usize| ((u32::from(pixels[i][c]) * (8 - weight) + u32::from(color[c]) * weight) / 8) as u8;
            pixels[i] = [mix(0), mix(1), mix(2)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::observer::Silent;
    use crate::pipeline::observer::testing::StopsAfter;

    #[test]
    fn a_video_has_a_frame_per_camera_and_a_canceled_one_leaves_nothing() {
        let folder = tempfile::tempdir().expect("folder");
        let eye =
            |x: f64| Camera::look_at(glam::DVec3::new(x, 0.0, -2.0), glam::DVec3::ZERO, glam::DVec3::Y, 0.8, 32, 16);
        let cameras: Vec<Camera> = (0..5).filter_map(|i| eye(f64::from(i) * 0.1)).collect();
        let mut cloud = GaussianCloud::default();
        cloud.positions.push([0.0; 3]);
        cloud.log_scales.push([-2.0; 3]);
        cloud.quaternions.push([1.0, 0.0, 0.0, 0.0]);
        cloud.opacity_logits.push(3.0);
        cloud.sh.push([1.0; 3]);
        let cloud = Arc::new(cloud);
        let mut backend = Renderer::new();
        let mut video = |name: &str, observer: &mut dyn Observer| {
            let path = folder.path().join(name);
            let settings = VideoSettings::new(32, 16, 10.0);
            let made =
                write(&cloud, &RenderSettings::default(), &cameras, None, &mut backend, (&path, &settings), observer);
            (made, path)
        };
        let (made, path) = video("a.gif", &mut Silent);
        let summary = made.expect("a video");
        assert_eq!((summary.frames, summary.size_px), (5, (32, 16)));
        assert!(path.is_file());
        let (stopped, path) = video("b.gif", &mut StopsAfter::new(0));
        assert!(matches!(stopped, Err(VideoError::Interrupted(_))) && !path.exists());
        assert_eq!(std::fs::read_dir(folder.path()).expect("lists").count(), 1, "no half file");
    }

    #[test]
    fn marks_are_strongest_at_their_border() {
        let marked = |fill| {
            let mut pixels = vec![[0; 3]; 49];
            let inside = |i: usize| (1..6).contains(&(i % 7)) && (1..6).contains(&(i / 7));
            mark(&mut pixels, 7, inside, [255, 0, 0], fill);
            [0, 8, 24].map(|i| pixels[i])
        };
        assert_eq!(marked(3), [[0; 3], [255, 0, 0], [95, 0, 0]]);
        assert_eq!(marked(0), [[0; 3], [255, 0, 0], [0; 3]], "an outline");
    }
}
