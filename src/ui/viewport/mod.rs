//! The viewport: shows the frames of the view thread and moves the camera.

mod act;
mod apart;
pub(crate) mod compared;
mod display;
pub mod eye;
pub(crate) mod frame_times;
mod frusta;
mod growing;
mod input;
mod legend;
mod marks;
mod measured;
mod numbers;
mod outline;
mod overlay;
pub(crate) mod overrides;
mod photo;
mod photo_bar;
pub mod picking;
pub(crate) mod query;
mod request;
pub(crate) mod route;
mod show;
pub(crate) mod splat_selection;
mod split;
mod straight;
pub(crate) mod tools;
pub(crate) mod visible;

use std::sync::Arc;

use glam::DVec3;

use self::compared::Compared;
use self::display::Display;
use self::eye::Eye;
use self::growing::GrowingView;
use self::input::Steering;
use self::marks::Marks;
use self::overrides::RenderOverrides;
use self::photo::PhotoView;
use self::picking::Picking;
use self::query::Queries;
use self::request::Requests;
use self::tools::preparation::SelectionPreparation;
use self::tools::{Tool, ToolScene, ViewTool};
use self::visible::Visibility;
use super::state::{AppState, Tone};
use crate::jobs::OpenedScene;
use crate::navigate::Pose;
use crate::render::GpuError;
use crate::scene::measurement::Measurement;
use crate::scene::{Bounds, Camera, GaussianCloud, PhotoPixels};
use crate::worker::view::{RenderThread, ViewPicture};
use crate::worker::{CloudSnapshot, Repaint, Tasks, Versioned};

/// State of the viewport.
pub struct Viewport {
    render_thread: RenderThread,
    requests: Requests,
    display: Display,
    eye: Eye,
    /// Up direction, if the user chose it.
    up: Option<DVec3>,
    /// Number of the scene of camera and cloud; 0 before the first.
    scene: u64,
    cloud: Option<Versioned<GaussianCloud>>,
    /// Generation of the newest snapshot taken from training.
    snapshot: u64,
    /// The photo whose camera the view looks through.
    photo: Option<PhotoView>,
    steering: Steering,
    /// Window time of the last camera motion, s.
    moved_at: f64,
    /// Queries and their answers.
    pub queries: Queries,
    /// The phrase that all scenes on screen are asked.
    pub compared: Compared,
    /// Hidden parts of the scene.
    pub(crate) visibility: Visibility,
    /// Hovered and selected identity.
    pub picking: Picking,
    marks: Marks,
    /// Measurements of the scene.
    pub measurements: Vec<Measurement>,
    /// Bounds to keep in view once the views have their shape.
    asked_for: Option<Bounds>,
    /// True if the next scene is shown from where the eye is, with the same queries.
    keeps_place: bool,
    /// The tool in use.
    tool: Option<Tool>,
    /// Preparation for selections in this scene.
    preparation: SelectionPreparation,
    /// Render settings in place of the scene's own.
    pub overrides: RenderOverrides,
    /// Poses that are being found.
    growing: GrowingView,
}

impl Viewport {
    /// An empty viewport. Fails only if the system cannot start a thread.
    pub(crate) fn new(repaint: Repaint) -> std::io::Result<Self> {
        let home = crate::scene::HomeView::default();
        Ok(Self {
            render_thread: RenderThread::start(repaint)?,
            requests: Requests::default(),
            display: Display::default(),
            eye: Eye::framing(&home.bounds, home.up),
            up: None,
            scene: 0,
            cloud: None,
            snapshot: 0,
            photo: None,
            steering: Steering::default(),
            moved_at: f64::NEG_INFINITY,
            queries: Queries::default(),
            compared: Compared::default(),
            visibility: Visibility::default(),
            picking: Picking::default(),
            marks: Marks::default(),
            measurements: Vec::new(),
            asked_for: None,
            keeps_place: false,
            tool: None,
            preparation: SelectionPreparation::default(),
            overrides: RenderOverrides::default(),
            growing: GrowingView::default(),
        })
    }

    /// Lets the worker draw with the device of this window.
    pub(super) fn share(&mut self, window: eframe::egui_wgpu::RenderState) {
        self.display.share(window);
    }

    /// The newest frame.
    pub fn picture(&self) -> Option<&ViewPicture> {
        self.display.picture()
    }

    /// The frame of the newest request, once it is drawn at full resolution.
    pub fn full_picture(&self) -> Option<&ViewPicture> {
        self.picture().filter(|picture| picture.is_full_of(self.requests.ticket()))
    }

    /// The Gaussians on screen.
    pub fn cloud(&self) -> Option<&Versioned<GaussianCloud>> {
        self.cloud.as_ref()
    }

    /// Shows other Gaussians of the scene.
    pub(crate) fn set_cloud(&mut self, cloud: Option<Arc<GaussianCloud>>) {
        self.cloud = cloud.map(Versioned::new);
    }

    /// Index of the photo of the scene's own whose camera the view looks through.
    pub(crate) fn own_photo_index(&self) -> Option<usize> {
        self.photo.as_ref().filter(|photo| !photo.is_located()).map(PhotoView::index)
    }

    /// Index of the photo whose camera the view looks through.
    pub fn photo_index(&self) -> Option<usize> {
        self.photo.as_ref().map(PhotoView::index)
    }

    /// The frame of the active view as pixels, for saving.
    ///
    /// # Errors
    /// If the frame is on a device that cannot be read back.
    pub(crate) fn pixels(&self) -> Result<Option<PhotoPixels>, GpuError> {
        self.picture().map(|picture| picture.pixels(self.queries.is_second())).transpose()
    }

    /// Current camera pose.
    pub fn pose(&self) -> Pose {
        let eye = self.eye.in_perspective();
        let (center, world_from_camera) = (eye.center, eye.world_from_eye);
        let fov_y_rad = match &self.photo {
            Some(photo) => photo.free_fov(eye.fov_y_rad),
            None => eye.fov_y_rad,
        };
        Pose { center, world_from_camera, fov_y_rad }
    }

    /// The camera of the newest frame, or one at the current pose.
    pub(crate) fn camera(&self) -> Camera {
        self.picture().map_or_else(|| self.eye.camera(640, 480), |p| p.camera.clone())
    }

    /// Aspect ratio of the frame, width / height.
    pub(crate) fn aspect(&self) -> f64 {
        self.picture().map_or(16.0 / 9.0, |p| f64::from(p.camera.width_px) / f64::from(p.camera.height_px))
    }

    /// Up direction of a scene.
    pub(crate) fn up(&self, scene: &OpenedScene) -> DVec3 {
        self.up.unwrap_or(scene.home.up)
    }

    /// Sets the pivot.
    pub(crate) fn turn_about(&mut self, point: DVec3) {
        self.eye.pivot = point;
    }

    /// True if a frame has arrived since the last call.
    pub(crate) fn take_new_picture(&mut self) -> bool {
        self.display.take_new()
    }

    /// True if a GPU draws the view.
    pub(crate) fn on_gpu(&self) -> bool {
        self.display.on_gpu()
    }

    /// Number of preparations of the scene for selecting by clicks and strokes.
    pub fn times_prepared(&self) -> usize {
        self.preparation.times()
    }

    /// Shows the next scene from where the eye is, with the same queries: it is of the same place.
    pub(crate) fn keep_place(&mut self) {
        self.keeps_place = true;
    }

    /// True if it shows the scene of this number.
    pub(crate) fn is_of(&self, scene_number: u64) -> bool {
        self.scene == scene_number
    }

    fn has_scene(&self) -> bool {
        self.scene > 0
    }

    /// Takes over a new scene, new Gaussians, and the results of the viewport's own jobs; begins their next steps.
    pub(crate) fn update(&mut self, state: &mut AppState, tasks: &Tasks) {
        self.follow_growth(state, tasks);
        if let Some(scene) = state.scene.as_ref().filter(|_| state.scene_number != self.scene) {
            self.scene = state.scene_number;
            let keeps_place = std::mem::take(&mut self.keeps_place);
            self.leave_photo();
            self.asked_for = None;
            self.preparation.forget(tasks);
            self.requests.forget();
            self.display.clear();
            self.set_cloud(scene.gaussians().cloned());
            self.queries.change_scene(state.semantics.as_deref().filter(|_| keeps_place).map(|map| &**map));
            self.visibility = Visibility::default();
            self.picking = Picking::default();
            self.measurements.clone_from(&scene.measurements);
            self.tool = None;
            self.overrides = RenderOverrides::default();
            if !keeps_place {
                self.up = None;
                self.eye = Eye::home(&scene.home, None);
            }
        }
        if let Some((generation, snapshot)) = tasks.clouds().newer_than(self.snapshot) {
            self.snapshot = generation;
            let CloudSnapshot { job, cloud, .. } = &*snapshot;
            if state.training_job == Some(*job) {
                self.set_cloud(Some(Arc::clone(cloud)));
            }
        }
        self.preparation.update();
        if let Some((tool, mut rest)) = self.tool_in_use() {
            tool.update(&mut rest, state, tasks);
        }
        self.photo.iter_mut().for_each(PhotoView::update);
        if let Some(why) = self.display.newly_instead_of_gpu() {
            state.toast(Tone::Warning, why);
        }
        if let Some(why) = self.queries.newly_failed() {
            let remedy = "Install the encoder (Models pane), or find the objects again with another";
            state.problem(None, &format!("The text encoder failed, so queries match names only: {why}. {remedy}."));
        }
    }

    /// The tool in use, and the rest of the viewport for it.
    fn tool_in_use(&mut self) -> Option<(&mut dyn ViewTool, ToolScene<'_>)> {
        let (tool, rest) = self.parts();
        Some((tool.as_mut()?.as_dyn(), rest))
    }

    fn parts(&mut self) -> (&mut Option<Tool>, ToolScene<'_>) {
        let (pose, ticket) = (self.pose(), self.requests.ticket());
        let Self { display, eye, cloud, visibility, queries, picking, marks, measurements, tool, preparation, .. } =
            self;
        let cloud = cloud.as_ref();
        let rest = ToolScene {
            display,
            eye,
            pose,
            cloud,
            visibility,
            queries,
            picking,
            marks,
            measurements,
            preparation,
            ticket,
        };
        (tool, rest)
    }
}
