//! Views of the photos' cameras with a thing and without.

use glam::{DVec2, DVec3};

use super::RemovalError;
use super::extent::Ball;
use crate::math::grid;
use crate::pipeline::observer::{Observer, Ticker};
use crate::render::{Features, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud};

/// Most cameras that are rendered, and the side of their pictures, px.
const MOST: usize = 48;
const SIDE_PX: u32 = 512;
/// Least share of a pixel that the thing covers, and largest share of a pixel that it does not touch.
pub(super) const COVERED: f32 = 0.5;
pub(super) const TOUCHED: f32 = 0.05;
/// Most points around the thing per view.
const POINTS: usize = 400;

/// Pixels in row-major order.
pub(super) struct SeenView {
    pub(super) camera: Camera,
    /// Share of the thing in each pixel.
    pub(super) thing: Vec<f32>,
    /// Depth with it, along the camera's axis; 0 = empty.
    pub(super) before: Vec<f32>,
    /// Depth without it.
    pub(super) after: Vec<f32>,
    /// Color with it.
    pub(super) rgb: [Vec<f32>; 3],
}

impl SeenView {
    /// Returns the pixel that shows a point in front of the camera.
    pub(super) fn pixel(&self, point: DVec3) -> Option<usize> {
        let DVec2 { x, y } = self.camera.project(point)?;
        let (w, h) = (f64::from(self.camera.width_px), f64::from(self.camera.height_px));
        ((0.0..w).contains(&x) && (0.0..h).contains(&y))
            .then(|| y as usize * self.camera.width_px as usize + x as usize)
    }

    /// Returns the point at this depth behind a pixel.
    pub(super) fn point(&self, pixel: usize, depth: f32) -> DVec3 {
        let w = self.camera.width_px as usize;
        let at = DVec2::new((pixel % w) as f64 + 0.5, (pixel / w) as f64 + 0.5);
        self.camera.center + self.camera.ray(at) * f64::from(depth)
    }
}

/// Returns the cameras that see a thing, spread over all of them.
pub(super) fn choose(photos: &[Camera], ball: &Ball) -> Vec<Camera> {
    let sees = |camera: &&Camera| {
        let depth = camera.camera_from_world(ball.center).z;
        let near = camera.project(ball.center).is_some_and(|at| {
            let reach = ball.radius / depth * camera.focal_px.max_element();
            let end = DVec2::new(f64::from(camera.width_px), f64::from(camera.height_px));
            at.cmpge(DVec2::splat(-reach)).all() && at.cmple(end + reach).all()
        });
        depth > 0.0 && near
    };
    let all: Vec<Camera> = photos.iter().filter(sees).map(|c| c.limited_to(SIDE_PX)).collect();
    let n = all.len().min(MOST);
    (0..n).map(|k| all[k * all.len() / n].clone()).collect()
}

/// Renders the scene with the `gone` Gaussians and without.
pub(super) fn look(
    cloud: &GaussianCloud,
    gone: &[bool],
    cameras: &[Camera],
    settings: &RenderSettings,
    observer: &mut dyn Observer,
) -> Result<Vec<SeenView>, RemovalError> {
    let kept: Vec<usize> = (0..cloud.len()).filter(|&i| !gone[i]).collect();
    let rest = cloud.select(&kept);
    let is_gone: Vec<f32> = gone.iter().map(|g| f32::from(u8::from(*g))).collect();
    let features = Features { channels: 1, values: &is_gone };
    let settings = RenderSettings { depth: true, ..settings.clone() };
    let mut renderer = Renderer::new();
    let mut ticker = Ticker::new("Looking at what was hidden", cameras.len());
    let mut seen = Vec::with_capacity(cameras.len());
    for (k, camera) in cameras.iter().enumerate() {
        ticker.tick(k, observer)?;
        let mut before = renderer.render(cloud, features, camera, &settings)?;
        let bare = RenderSettings { sh_degree: 0, ..settings.clone() };
        let after = renderer.render(&rest, Features::NONE, camera, &bare)?;
        seen.push(SeenView {
            camera: camera.clone(),
            thing: before.features.swap_remove(0),
            before: before.median_depth,
            after: after.median_depth,
            rgb: before.color,
        });
    }
    Ok(seen)
}

/// Returns points of surfaces beside the thing in the photos, at most `reach` radii away from it.
pub(super) fn around(seen: &[SeenView], ball: &Ball, reach: f64) -> Vec<DVec3> {
    let of_view = |view: &SeenView| -> Vec<DVec3> {
        let width = view.camera.width_px as usize;
        let covered: Vec<bool> = view.thing.iter().map(|t| *t >= COVERED).collect();
        let area = covered.iter().filter(|c| **c).count();
        let ring = grid::grown(width, covered, (0.25 * (area as f64).sqrt()).ceil() as usize);
        let beside: Vec<usize> =
            (0..ring.len()).filter(|&i| ring[i] && view.thing[i] < TOUCHED && view.after[i] > 0.0).collect();
        let step = beside.len().div_ceil(POINTS).max(1);
        beside.iter().step_by(step).map(|&i| view.point(i, view.after[i])).collect()
    };
    let near = |p: &DVec3| p.distance(ball.center) < reach * ball.radius;
    seen.iter().flat_map(of_view).filter(near).collect()
}
