//! Renderer of the viewport's frames: on the GPU or the CPU, at a resolution that keeps up with the camera.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Instant;

use super::failure::Failure;
use super::levels::DetailLevels;
use super::thread::panic_failure;
use super::view_modes::{self, ViewMode};
use super::view_request::{PictureBeside, QualityBudget, ViewPicture, ViewRequest, ViewResult};
use crate::render::lod::{Cut, LodTree};
use crate::render::{self, BackendChoice, DevicePicture, Frame, RenderSettings, Renderer};
use crate::scene::Camera;

/// Least longer side of moving frames in px: smaller ones are too coarse to navigate by.
const LEAST_SIDE_PX: f64 = 300.0;

/// Draws requests, and learns how fast it can.
pub(super) struct ViewRenderer {
    pub(super) renderer: Renderer,
    /// True if no GPU was to be used.
    pub(super) without_gpu: bool,
    /// Reason for which the CPU draws though there is a GPU.
    instead_of_gpu: Option<String>,
    /// Draw the Gaussians of views beside, if they are others.
    others: Vec<Self>,
    /// Cost of recent frames; `None` before the first.
    cost: Option<Speed>,
    pub(super) levels: DetailLevels,
    /// Cut of the last frame's Gaussians that was drawn, if not all.
    cut: Option<Arc<Cut>>,
}

/// Cost of a frame: a fixed part of all Gaussians at any size, and a part per pixel.
#[derive(Clone, Copy, Debug)]
struct Speed {
    fixed_secs: f64,
    secs_per_px: f64,
}

/// Result of drawing a view.
enum Painting {
    Colors(Vec<[u8; 3]>),
    Texture(DevicePicture),
    Frame(Box<Frame<f32>>),
}

impl ViewRenderer {
    /// Draws with a real GPU if there is one and it is to be used, else with the CPU.
    pub(super) fn without_gpu(without_gpu: bool) -> Self {
        let choice = if without_gpu { BackendChoice::Cpu } else { BackendChoice::Auto };
        let mut instead_of_gpu = None;
        let renderer = Renderer::choose(choice, |why| instead_of_gpu = Some(why)).unwrap_or_default();
        Self {
            renderer,
            without_gpu,
            instead_of_gpu,
            others: Vec::new(),
            cost: None,
            levels: DetailLevels::default(),
            cut: None,
        }
    }

    /// Falls back to the CPU: a GPU has failed, or buffers may be in any state.
    fn fall_back(&mut self, why: &str) {
        if self.renderer.is_gpu() {
            self.instead_of_gpu = Some(render::instead_of_gpu(&why));
        }
        (self.renderer, self.cost) = (Renderer::new(), None);
    }

    pub(super) fn draw(&mut self, request: &ViewRequest) -> ViewResult {
        let _ = self.sees(request);
        self.draw_seen(request)
    }

    /// Draws a rough picture first if there are so many Gaussians that one of all of them takes long.
    pub(super) fn rough(&mut self, request: &ViewRequest) -> Option<ViewResult> {
        let first = self.sees(request) && request.budget == QualityBudget::Full;
        let request = ViewRequest { budget: QualityBudget::Moving, follow: false, ..request.clone() };
        first.then(|| self.draw_seen(&request))
    }

    /// Cut of the last frame's Gaussians that was drawn, if not all.
    pub(super) fn cut(&self) -> Option<Arc<Cut>> {
        self.cut.clone()
    }

    /// Returns whether levels of detail apply to these Gaussians, and a rough picture comes first: new and very many.
    fn sees(&mut self, request: &ViewRequest) -> bool {
        if request.skip.levels || self.renderer.is_gpu() {
            self.levels.forget();
            return false;
        }
        self.levels.see(&request.cloud)
    }

    /// Levels of detail to draw a request by: none at rest, when all is drawn.
    fn tree(&mut self, request: &ViewRequest) -> Option<Arc<LodTree>> {
        match request.budget {
            QualityBudget::Full => None,
            budget => self.levels.tree(budget == QualityBudget::Moving),
        }
    }

    fn draw_seen(&mut self, request: &ViewRequest) -> ViewResult {
        let shares = 1 + u8::from(request.follow) + request.others.len() as u8;
        let camera = match self.tree(request).filter(|_| self.levels.pace.leaves_out()) {
            Some(_) => self.levels.pace.camera(&request.camera),
            None => self.fitting_camera(&request.camera, request.budget, shares),
        };
        let drawn = self.draw_at(request, camera.clone(), shares)?;
        let without_gpu = self.without_gpu;
        self.others.resize_with(request.others.len(), || Self::without_gpu(without_gpu));
        if request.others.is_empty() {
            return Ok(Arc::new(drawn));
        }
        let mode = request.second.unwrap_or(request.mode);
        let mut beside = Vec::with_capacity(request.others.len());
        for (painter, (cloud, settings)) in self.others.iter_mut().zip(request.others.clone()) {
            let others = Vec::new();
            let other =
                ViewRequest { cloud, settings, mode, second: None, others, on_device: false, ..request.clone() };
            let _ = painter.sees(&other);
            let ViewPicture { rgb, depth_range, psnr, .. } = painter.draw_at(&other, camera.clone(), shares)?;
            beside.push(PictureBeside { rgb, depth_range, psnr });
        }
        Ok(Arc::new(ViewPicture { beside, ..drawn }))
    }

    fn draw_at(&mut self, request: &ViewRequest, camera: Camera, shares: u8) -> Result<ViewPicture, Failure> {
        let budget = request.budget.secs().map(|secs| secs / f64::from(shares));
        let start = Instant::now();
        let near = request.settings.near;
        let tree = self.tree(request);
        self.cut = tree.map(|tree| Arc::new(self.levels.pace.cut(&tree, &camera, near)));
        self.renderer.limit_to(self.cut.clone());
        let full = camera == request.camera && self.cut.is_none();
        // Without times there is still a frame.
        let _ = self.renderer.time_stages(request.timed);
        let drawn = match self.try_render(request, &camera) {
            // A GPU that fails (lost, out of memory) leaves the CPU to draw from then on.
            Err(failure) if self.renderer.is_gpu() => {
                self.fall_back(&failure.message);
                self.try_render(request, &camera)?
            }
            result => result?,
        };
        let secs = start.elapsed().as_secs_f64();
        if let (Some(_), Some(budget)) = (&self.cut, budget) {
            self.levels.pace.learn(secs, budget);
        }
        if self.cut.is_none() || !self.levels.pace.leaves_out() {
            self.learn(secs, f64::from(camera.width_px * camera.height_px));
        }
        let stages = self.renderer.stage_times();
        let start = Instant::now();
        let nothing = view_modes::Drawn::default;
        let mut texture = None;
        let (drawn, second, median_depth) = match drawn {
            Painting::Colors(rgb) => (view_modes::Drawn { rgb, ..nothing() }, None, None),
            Painting::Texture(picture) => {
                texture = Some(picture);
                (nothing(), None, None)
            }
            Painting::Frame(frame) => {
                let paint = |mode| view_modes::paint(&frame, mode, request.photo.as_deref(), &request.exposure);
                let second = request.second.map(|mode| {
                    let view_modes::Drawn { rgb, depth_range, psnr } = paint(mode);
                    PictureBeside { rgb, depth_range, psnr }
                });
                let median_depth = |frame: Frame<f32>| Some(frame.median_depth).filter(|depth| !depth.is_empty());
                (paint(request.mode), second, median_depth(*frame))
            }
        };
        let paint_secs = start.elapsed().as_secs_f64();
        Ok(ViewPicture {
            ticket: request.ticket,
            full,
            camera,
            rgb: drawn.rgb,
            texture,
            median_depth,
            depth_range: drawn.depth_range,
            psnr: drawn.psnr,
            beside: second.into_iter().collect(),
            secs,
            stages,
            paint_secs,
            drawn_by: self.renderer.name().to_owned(),
            instead_of_gpu: self.instead_of_gpu.clone(),
        })
    }

    fn try_render(&mut self, request: &ViewRequest, camera: &Camera) -> Result<Painting, Failure> {
        let shows_depth = [Some(request.mode), request.second].contains(&Some(ViewMode::Depth));
        let depth = request.budget == QualityBudget::Full || shows_depth;
        let settings = RenderSettings { depth, ..request.settings.clone() };
        let (renderer, cloud) = (&mut self.renderer, &request.cloud);
        // Of a moving view colors are enough, of which there is less to copy from a GPU.
        let colors = !depth && request.mode == ViewMode::Rgb && request.second.is_none() && request.photo.is_none();
        let draw = || {
            if colors
                && request.on_device
                && request.budget == QualityBudget::Moving
                && let Some(picture) = renderer.draw_texture(cloud, camera, &settings)?
            {
                return Ok(Painting::Texture(picture));
            }
            match colors {
                true => renderer.draw_rgb8(cloud, camera, &settings).map(Painting::Colors),
                false => renderer.draw(cloud, camera, &settings).map(|frame| Painting::Frame(Box::new(frame))),
            }
        };
        match catch_unwind(AssertUnwindSafe(draw)) {
            Ok(result) => result.map_err(|e| Failure::of(&e, "Reset the view (Home), or open the scene again.")),
            Err(payload) => {
                let failure = panic_failure(payload.as_ref());
                self.fall_back(&failure.message);
                Err(failure)
            }
        }
    }

    /// Takes in what the last frame cost.
    fn learn(&mut self, secs: f64, pixels: f64) {
        let cost = self.renderer.cost(secs);
        let now = Speed { fixed_secs: cost.fixed_secs, secs_per_px: cost.pixels_secs / pixels };
        let old = self.cost.unwrap_or(now);
        let mix = |old: f64, new: f64| 0.6 * old + 0.4 * new;
        self.cost = Some(Speed {
            fixed_secs: mix(old.fixed_secs, now.fixed_secs),
            secs_per_px: mix(old.secs_per_px, now.secs_per_px),
        });
    }

    /// The camera at a resolution that is likely to keep to the budget, which is shared with masks that follow and with
    /// other Gaussians.
    fn fitting_camera(&self, camera: &Camera, budget: QualityBudget, shares: u8) -> Camera {
        let pixels = f64::from(camera.width_px) * f64::from(camera.height_px);
        // The first frame says how fast this machine is with this scene; it must be quick itself.
        let cost = self.cost.unwrap_or(Speed { fixed_secs: 0.0, secs_per_px: 4e-7 });
        let Some(secs) = budget.secs().map(|secs| secs / f64::from(shares)) else {
            return camera.clone();
        };
        // Where the fixed part alone breaks the budget, smaller frames would help no one.
        let left = (secs - cost.fixed_secs).max(0.4 * secs);
        let scale = (left / (cost.secs_per_px * pixels)).sqrt().clamp(0.2, 1.0);
        // In quarter-octave steps, so that the frame does not change its grain all the time.
        let scale = 2.0_f64.powf((scale.log2() * 4.0).floor() / 4.0);
        let scale = scale.max(LEAST_SIDE_PX / f64::from(camera.width_px.max(camera.height_px)));
        if scale >= 1.0 {
            return camera.clone();
        }
        let side = |s: u32| ((f64::from(s) * scale).round() as u32).max(1);
        camera.resized(side(camera.width_px), side(camera.height_px))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Device;
    use crate::scene::GaussianCloud;
    use crate::worker::Versioned;
    use crate::worker::view_request::SkipPasses;
    use glam::DVec3;

    fn of(renderer: Renderer, cost: Option<Speed>) -> ViewRenderer {
        ViewRenderer {
            renderer,
            without_gpu: true,
            instead_of_gpu: None,
            others: Vec::new(),
            cost,
            levels: DetailLevels::default(),
            cut: None,
        }
    }

    #[test]
    fn moving_frames_stay_on_a_device_that_the_window_paints_from() {
        let Ok(device) = Device::new() else { return };
        let cloud = GaussianCloud { sh: vec![[0.9; 3]], ..GaussianCloud::isotropic(vec![[0.0; 3]], -1.0, 2.0) };
        let cloud = Versioned::new(Arc::new(cloud));
        let moving = ViewRequest {
            cloud: cloud.clone(),
            camera: Camera::look_at(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, DVec3::NEG_Y, 0.8, 32, 24).expect("valid"),
            mode: ViewMode::Rgb,
            second: None,
            others: Vec::new(),
            settings: RenderSettings::default(),
            budget: QualityBudget::Moving,
            photo: None,
            exposure: Default::default(),
            semantics: None,
            follow: false,
            codes: false,
            skip: SkipPasses { parts: true, gpu: false, levels: true },
            on_device: true,
            timed: false,
            ticket: 1,
        };
        let (mut gpu, mut cpu) = (of(Renderer::on_gpu(&device).expect("a renderer"), None), of(Renderer::new(), None));
        let picture = gpu.draw(&moving).expect("drawn");
        let texture = picture.texture.as_ref().expect("it stays there");
        assert!(picture.rgb.is_empty());
        let copied = gpu.draw(&ViewRequest { on_device: false, ..moving.clone() }).expect("drawn");
        assert!(copied.texture.is_none() && copied.rgb == texture.to_rgb8().expect("copied"));
        assert_eq!(picture.pixels(false).expect("copied"), copied.pixels(false).expect("there"));
        assert!(copied.rgb.iter().any(|c| *c != [0; 3]), "there is something to see");
        // What is picked from, painted over or compared is on the host, and so is all that the CPU draws.
        let full = ViewRequest { budget: QualityBudget::Full, ..moving.clone() };
        let shared = ViewRequest { budget: QualityBudget::Shared, ..moving.clone() };
        let depth = ViewRequest { mode: ViewMode::Depth, ..moving.clone() };
        for request in [&full, &shared, &depth] {
            let picture = gpu.draw(request).expect("drawn");
            assert!(picture.texture.is_none() && !picture.rgb.is_empty());
        }
        assert!(cpu.draw(&moving).expect("drawn").texture.is_none());
        // So are other Gaussians beside.
        let others = vec![(cloud, RenderSettings::default()); 3];
        let all = gpu.draw(&ViewRequest { others, ..moving }).expect("drawn");
        assert!(all.beside.len() == 3 && all.beside.iter().all(|b| !b.rgb.is_empty()));
    }

    #[test]
    fn a_slow_machine_draws_smaller_while_the_eye_moves() {
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 1000, 600).expect("valid");
        let of = |fixed_secs, secs_per_px| of(Renderer::new(), Some(Speed { fixed_secs, secs_per_px }));
        let slow = of(0.0, 1e-6);
        let moving = slow.fitting_camera(&camera, QualityBudget::Moving, 1);
        assert_eq!(moving.width_px, 300, "never smaller");
        let quicker = of(0.0, 2e-7);
        let fits = |shares| quicker.fitting_camera(&camera, QualityBudget::Moving, shares).width_px;
        assert!(300 < fits(2) && fits(2) < fits(1) && fits(1) < 1000, "{} {}", fits(2), fits(1));
        assert!((f64::from(moving.width_px) / f64::from(moving.height_px) - 5.0 / 3.0).abs() < 0.02);
        assert!(slow.fitting_camera(&camera, QualityBudget::Shared, 1).width_px > moving.width_px);
        assert_eq!(slow.fitting_camera(&camera, QualityBudget::Full, 1), camera);
        assert_eq!(of(0.0, 1e-9).fitting_camera(&camera, QualityBudget::Moving, 1), camera);
        // A scene whose Gaussians alone take longer than the budget is not drawn any smaller for it.
        assert_eq!(of(5.0, 1e-9).fitting_camera(&camera, QualityBudget::Moving, 1), camera);
    }
}
