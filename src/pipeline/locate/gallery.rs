//! Rendered views of a scene that photos are compared with: small ones of all cameras for their signatures, larger ones
//! with features only of the cameras that look like a photo.

use std::sync::Arc;

use glam::{DQuat, DVec2};

use super::descriptor::features;
use super::gray::GrayPlane;
use super::matching::WorldFeature;
use super::sharpness::samples_across;
use super::signature::{Placed, ViewSignature};
use crate::math::stats::median;
use crate::pipeline::locate::LocateError;
use crate::pipeline::observer::{Observer, Ticker};
use crate::render::{DifferentiableRenderer, Features, Frame, RenderSettings};
use crate::scene::{Camera, GaussianCloud};

/// Longer side of the small views, px: twelve cells of a signature.
const SMALL_PX: u32 = 96;
/// Longer side of pictures whose features are compared, px.
pub(super) const FEATURES_PX: u32 = 640;
/// Features of a picture at its finest level.
pub(super) const MOST_FEATURES: usize = 500;
/// Shares of the distance from a view to the scene at which a photo may have been taken, and weights of the likeness:
/// the smaller a photo is made, the more places it is like by chance.
const DISTANCES: [(f64, f32); 2] = [(1.0, 1.0), (0.5, 0.85)];
/// Size of finer views by that of the photos, and their longer side at most, px.
const FINER: u32 = 3;
const FINER_PX: u32 = 800;
/// Views at most; of more cameras, some evenly spaced.
const MOST_VIEWS: usize = 256;

/// Rendered views of a scene.
pub(super) struct Gallery {
    pub(super) cloud: Arc<GaussianCloud>,
    /// How photos are compared: with expected and median depth.
    pub(super) settings: RenderSettings,
    pub(super) renderer: DifferentiableRenderer,
    views: Vec<GalleryView>,
}

struct GalleryView {
    camera: Camera,
    signature: ViewSignature,
    /// Usual depth of what it sees, scene units.
    depth: f64,
    /// Features with places in the world at each fineness; made when they are first needed.
    features: [Option<Arc<Vec<WorldFeature>>>; 2],
}

/// Size of the views whose features are matched.
#[derive(Clone, Copy, Debug)]
pub(super) enum ViewFineness {
    /// That of the cameras' photos.
    Own,
    /// Larger, so that what fills a close-up is large enough to have features.
    Finer,
}

impl ViewFineness {
    fn of(self, camera: &Camera) -> Camera {
        match self {
            Self::Own => camera.limited_to(FEATURES_PX),
            Self::Finer => camera.resized(FINER * camera.width_px, FINER * camera.height_px).limited_to(FINER_PX),
        }
    }
}

/// A view that looks like a photo.
#[derive(Clone, Debug)]
pub(super) struct AlikeView {
    pub(super) view: usize,
    pub(super) likeness: f32,
    /// Pose of the photo if it were taken from the view's place or on the way to the scene: turned toward the shift, and
    /// by quarters.
    pub(super) pose: Camera,
}

impl Gallery {
    /// Renders the small views. `cameras` are those that the scene was trained on.
    pub(super) fn new(
        cloud: Arc<GaussianCloud>,
        settings: &RenderSettings,
        cameras: &[Camera],
        observer: &mut dyn Observer,
    ) -> Result<Self, LocateError> {
        let settings = RenderSettings { depth: true, keep_order: false, ..settings.clone() };
        let renderer = DifferentiableRenderer::new();
        let mut gallery = Self { cloud, settings, renderer, views: Vec::new() };
        let every = cameras.len().div_ceil(MOST_VIEWS).max(1);
        let chosen: Vec<&Camera> = cameras.iter().step_by(every).collect();
        let mut ticker = Ticker::new("Looking at the scene", chosen.len());
        for (done, camera) in chosen.into_iter().enumerate() {
            let small = camera.limited_to(SMALL_PX);
            let frame = gallery.draw(&small)?;
            let signature = ViewSignature::of(&GrayPlane::of_planes(&frame.color, frame.width_px));
            let depths: Vec<f64> = frame.median_depth.iter().filter(|d| **d > 0.0).map(|d| f64::from(*d)).collect();
            let depth = if depths.is_empty() { 0.0 } else { median(&depths) };
            gallery.views.push(GalleryView { camera: camera.clone(), signature, depth, features: [None, None] });
            ticker.tick(done + 1, observer)?;
        }
        Ok(gallery)
    }

    pub(super) fn draw(&mut self, camera: &Camera) -> Result<Frame<f32>, LocateError> {
        Ok(self.renderer.render(&self.cloud, Features::NONE, camera, &self.settings)?)
    }

    /// The usual focal length of the cameras, in longer sides of their pictures.
    pub(super) fn usual_focal_sides(&self) -> f64 {
        let sides = |c: &Camera| c.focal_px.x / f64::from(c.width_px.max(c.height_px));
        median(&self.views.iter().map(|v| sides(&v.camera)).collect::<Vec<_>>())
    }

    /// The views by falling likeness with a photo, which `lens` tells the size and focal length of.
    pub(super) fn alike(&self, photo: &GrayPlane, lens: &Camera) -> Vec<AlikeView> {
        let mut shrunk: Vec<(f64, [ViewSignature; 4])> = Vec::new();
        let mut found = Vec::with_capacity(self.views.len());
        for (view, GalleryView { camera, signature, depth, .. }) in self.views.iter().enumerate() {
            let small = camera.limited_to(SMALL_PX);
            let mut best: Option<AlikeView> = None;
            for (distance, weight) in DISTANCES {
                // The photo at the size at which things of that distance are as large as in the view.
                let scale = distance * small.focal_px.y / lens.focal_px.y;
                let known = shrunk.iter().position(|(s, _)| (s / scale - 1.0).abs() < 0.02);
                let at = known.unwrap_or_else(|| {
                    shrunk.push((scale, turned_signatures(photo, scale)));
                    shrunk.len() - 1
                });
                for (turns, turned) in shrunk[at].1.iter().enumerate() {
                    let placed = turned.placed_on(signature);
                    let likeness = weight * placed.likeness;
                    if best.as_ref().is_none_or(|b| likeness > b.likeness) {
                        let pose = pose_of(&small, lens, turns, placed, (1.0 - distance) * depth);
                        best = Some(AlikeView { view, likeness, pose });
                    }
                }
            }
            found.extend(best);
        }
        found.sort_by(|a, b| b.likeness.total_cmp(&a.likeness));
        found
    }

    /// The features of a view.
    pub(super) fn features(
        &mut self,
        view: usize,
        fineness: ViewFineness,
    ) -> Result<Arc<Vec<WorldFeature>>, LocateError> {
        if let Some(known) = &self.views[view].features[fineness as usize] {
            return Ok(Arc::clone(known));
        }
        let camera = fineness.of(&self.views[view].camera);
        let found = Arc::new(self.features_from(&camera)?);
        self.views[view].features[fineness as usize] = Some(Arc::clone(&found));
        Ok(found)
    }

    /// Samples along the longer side of a picture that the training photos had of what it shows.
    pub(super) fn samples_across(&self, camera: &Camera, frame: &Frame<f32>) -> Option<f64> {
        let views: Vec<&Camera> = self.views.iter().map(|v| &v.camera).collect();
        samples_across(camera, &frame.median_depth, &views)
    }

    /// The features that a camera sees, where the scene has a depth.
    pub(super) fn features_from(&mut self, camera: &Camera) -> Result<Vec<WorldFeature>, LocateError> {
        let frame = self.draw(camera)?;
        let gray = GrayPlane::of_planes(&frame.color, frame.width_px);
        let depth = |at: DVec2| {
            let place = |v: f64, size: usize| (v.max(0.0) as usize).min(size - 1);
            frame.median_depth[place(at.y, frame.height_px) * frame.width_px + place(at.x, frame.width_px)]
        };
        let known = features(&gray, MOST_FEATURES).into_iter().filter_map(|f| {
            let depth = f64::from(depth(f.at));
            let world = camera.center + camera.ray(f.at) * depth;
            (depth > 0.0 && world.is_finite()).then_some(WorldFeature { world, at: f.at, descriptor: f.descriptor })
        });
        Ok(known.collect())
    }
}

/// Signatures of a photo at a share of its size: upright, and turned clockwise by one to three quarters.
fn turned_signatures(photo: &GrayPlane, scale: f64) -> [ViewSignature; 4] {
    let side = |s: usize| ((s as f64 * scale).round() as usize).clamp(1, 4 * SMALL_PX as usize);
    let upright = photo.resized(side(photo.width), side(photo.height));
    let once = upright.turned();
    let twice = once.turned();
    let thrice = twice.turned();
    [upright, once, twice, thrice].map(|gray| ViewSignature::of(&gray))
}

/// The pose of a photo that is like a view after so many quarter turns, at this place, and so much nearer (scene units).
fn pose_of(view: &Camera, lens: &Camera, turns: usize, placed: Placed, nearer: f64) -> Camera {
    let middle = DVec2::new(f64::from(view.width_px), f64::from(view.height_px)) * 0.5;
    let [toward, ahead] =
        [middle + DVec2::from(placed.shift_px), middle].map(|at| view.ray(at).normalize_or(view.forward()));
    let swing = glam::DMat3::from_quat(DQuat::from_rotation_arc(ahead, toward));
    let mut axes = swing * view.world_from_camera;
    for _ in 0..turns {
        axes = glam::DMat3::from_cols(axes.y_axis, -axes.x_axis, axes.z_axis);
    }
    Camera { world_from_camera: axes, center: view.center + toward * nearer, ..lens.clone() }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn a_quarter_turn_of_the_photo_turns_its_pose() {
        let view = Camera::look_at(DVec3::new(0.0, -4.0, 1.0), DVec3::ZERO, DVec3::Z, 0.8, 96, 72).expect("valid");
        let placed = Placed { likeness: 1.0, shift_px: [0.0; 2] };
        let point = DVec3::new(0.4, 0.0, 0.7);
        let seen = view.project(point).expect("in front");
        // The photo that, turned clockwise once, is the view: (x, y) there was (y, 72 - x) before.
        let lens = Camera { width_px: 72, height_px: 96, principal_px: DVec2::new(36.0, 48.0), ..view.clone() };
        let photo = pose_of(&view, &lens, 1, placed, 0.0).project(point).expect("in front");
        let turned = DVec2::new(96.0 - photo.y, photo.x);
        assert!(turned.distance(seen) < 1e-9, "{turned} {seen}");
    }

    #[test]
    fn a_shift_turns_the_camera_toward_it() {
        let view = Camera::look_at(DVec3::new(0.0, -4.0, 1.0), DVec3::ZERO, DVec3::Z, 0.8, 96, 72).expect("valid");
        let posed = pose_of(&view, &view, 0, Placed { likeness: 1.0, shift_px: [16.0, -8.0] }, 0.5);
        let there = view.center + 2.0 * view.ray(DVec2::new(64.0, 28.0));
        assert!(posed.project(there).expect("in front").distance(DVec2::new(48.0, 36.0)) < 1e-9);
    }
}
