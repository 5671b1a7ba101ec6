//! The viewport: shows the frames of the view thread and moves the camera.

mod act;
pub(crate) mod arranging;
pub(crate) mod brush;
pub(crate) mod choosing;
pub(crate) mod chosen;
mod crop;
mod display;
pub mod eye;
pub(crate) mod frame_times;
mod frusta;
mod input;
mod inspector;
mod legend;
mod marks;
mod outline;
mod overlay;
pub(crate) mod overrides;
mod photo;
pub mod picking;
pub(crate) mod query;
mod ready;
mod request;
mod route;
mod ruler;
pub(crate) mod selecting;
mod split;
pub(crate) mod visible;

use std::collections::BTreeSet;
use std::sync::Arc;

use egui::{Rect, Sense, Ui};
use glam::DVec3;

use self::arranging::ArrangeTool;
use self::brush::Brush;
use self::choosing::SplatBrush;
use self::display::Display;
use self::eye::Eye;
use self::inspector::Inspector;
use self::marks::Marks;
use self::overrides::RenderOverrides;
use self::photo::PhotoView;
use self::picking::Picking;
use self::query::Queries;
use self::ready::ReadySelection;
use self::request::Requests;
use self::ruler::Ruler;
use self::selecting::SelectTool;
use self::split::Views;
use self::visible::Visibility;
use super::camera::CameraPane;
use super::layout::Layout;
use super::state::{AppState, Tone};
use crate::jobs::OpenedScene;
use crate::navigate::Pose;
use crate::render::GpuError;
use crate::scene::{Camera, GaussianCloud, Identities, PhotoPixels};
use crate::ui::actions::Action;
use crate::worker::view::{ViewLane, ViewPicture};
use crate::worker::{CloudSnapshot, Repaint, Versioned, Worker};

/// State of the viewport.
pub struct Viewport {
    lane: ViewLane,
    requests: Requests,
    display: Display,
    eye: Eye,
    /// Up direction, if the user chose it.
    up: Option<DVec3>,
    /// Number of the scene of camera and cloud.
    scene: u64,
    cloud: Option<Versioned<GaussianCloud>>,
    /// Generation of the newest snapshot taken from training.
    snapshot: u64,
    /// The photo whose camera the view looks through.
    photo: Option<PhotoView>,
    /// Window time of the last camera motion, s.
    moved_at: f64,
    /// Held keys that move the camera.
    flying: BTreeSet<egui::Key>,
    /// Queries and their answers.
    pub queries: Queries,
    /// Hidden parts of the scene.
    pub(crate) visibility: Visibility,
    /// Hovered and selected identity.
    pub picking: Picking,
    marks: Marks,
    /// The ruler in use.
    ruler: Option<Ruler>,
    /// True if the crop box is shown for editing.
    cropping: bool,
    /// The inspector in use.
    inspector: Option<Inspector>,
    /// The brush of the true mask.
    pub(crate) brush: Option<Brush>,
    /// The tool that selects by clicks and strokes.
    pub(crate) select: Option<SelectTool>,
    /// Preparation for selections in this scene.
    ready: ReadySelection,
    /// The brush that chooses Gaussians.
    choose: Option<SplatBrush>,
    /// The tool that arranges an object or part.
    pub(crate) arrange: Option<ArrangeTool>,
    /// Render settings in place of the scene's own.
    pub overrides: RenderOverrides,
    /// Cursor position, and the world point that the wheel zooms to while the cursor stays.
    zoom_anchor: Option<(egui::Pos2, DVec3)>,
}

impl Viewport {
    /// An empty viewport. Fails only if the system cannot start a thread.
    pub(crate) fn new(repaint: Repaint) -> std::io::Result<Self> {
        let home = crate::scene::HomeView::default();
        Ok(Self {
            lane: ViewLane::start(repaint)?,
            requests: Requests::default(),
            display: Display::default(),
            eye: Eye::framing(&home.bounds, home.up),
            up: None,
            scene: 0,
            cloud: None,
            snapshot: 0,
            photo: None,
            moved_at: f64::NEG_INFINITY,
            flying: BTreeSet::new(),
            queries: Queries::default(),
            visibility: Visibility::default(),
            picking: Picking::default(),
            marks: Marks::default(),
            ruler: None,
            cropping: false,
            inspector: None,
            brush: None,
            select: None,
            ready: ReadySelection::default(),
            choose: None,
            arrange: None,
            overrides: RenderOverrides::default(),
            zoom_anchor: None,
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

    /// The Gaussians on screen.
    pub fn cloud(&self) -> Option<&Versioned<GaussianCloud>> {
        self.cloud.as_ref()
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

    /// Takes over a new scene, new Gaussians and loaded photos.
    pub(crate) fn update(&mut self, state: &mut AppState, worker: &Worker) {
        if let Some(scene) = state.scene.as_ref().filter(|_| state.scene_number != self.scene) {
            self.scene = state.scene_number;
            self.photo = None;
            self.ready.forget(worker);
            self.requests.forget();
            self.display.clear();
            self.set_cloud(scene.cloud.clone());
            self.up = None;
            self.queries.clear();
            self.visibility = Visibility::default();
            self.picking = Picking::default();
            (self.ruler, self.cropping, self.inspector) = (None, false, None);
            self.drop_tools();
            self.overrides = RenderOverrides::default();
            self.eye = Eye::home(&scene.home, None);
        }
        if let Some((generation, snapshot)) = worker.clouds().newer_than(self.snapshot) {
            self.snapshot = generation;
            let CloudSnapshot { job, cloud, .. } = &*snapshot;
            if state.training_job == Some(*job) {
                self.set_cloud(Some(Arc::clone(cloud)));
            }
        }
        if let Some(cloud) = state.rearranged.take() {
            self.set_cloud(Some(cloud));
        }
        if let Some((job, found)) = state.selected.take() {
            self.ready.take(job, &found);
            self.select.iter_mut().for_each(|tool| tool.take(job, Arc::clone(&found)));
        }
        if let (Some(found), Some(inspector)) = (state.inspected.take(), &mut self.inspector) {
            inspector.take(found);
        }
        if let Some(why) = self.display.newly_instead_of_gpu() {
            state.toast(Tone::Warning, why);
        }
        if let Some(why) = self.queries.newly_failed() {
            let remedy = "Install the encoder (Models pane), or find the objects again with another";
            state.problem(None, &format!("The text encoder failed, so queries match names only: {why}. {remedy}."));
        }
        if let Some(photo) = &mut self.photo {
            photo.take_loaded(state);
        }
    }

    fn set_cloud(&mut self, cloud: Option<Arc<GaussianCloud>>) {
        self.cloud = cloud.map(Versioned::new);
    }

    /// The camera for overlays of the frame: the frame's own, so that both move together.
    fn overlay_camera(&self, rect: Rect) -> Camera {
        match self.picture() {
            Some(p) => p.camera.resized(rect.width().max(1.0) as u32, rect.height().max(1.0) as u32),
            None => self.eye.camera(rect.width() as u32, rect.height() as u32),
        }
    }

    /// Current camera pose.
    pub fn pose(&self) -> Pose {
        let (center, world_from_camera) = (self.eye.center, self.eye.world_from_eye);
        let fov_y_rad = match &self.photo {
            Some(photo) => photo.free_fov(self.eye.fov_y_rad),
            None => self.eye.fov_y_rad,
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

    /// Draws the viewport into the rest of `ui`.
    pub(crate) fn show(
        &mut self,
        ui: &mut Ui,
        state: &AppState,
        layout: &mut Layout,
        route: Option<&CameraPane>,
        actions: &mut Vec<Action>,
    ) {
        let Some(scene) = state.scene.clone() else { return };
        let whole = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(whole, Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Viewport"));
        let views = Views::of(whole, layout.split_view);
        self.work_where_pressed(ui, &views);
        self.display.time_frames(layout.times);
        self.take_frame(ui.ctx());
        let now = ui.input(|i| i.time);
        let under = views.under_pointer(ui);
        self.use_brush(&response, under);
        self.use_splat_brush(&response, under);
        self.use_select_tool(&response, under, state);
        if self.handle_input(ui, &response, under, &scene) {
            self.leave_photo();
            self.moved_at = now;
        }
        let shown = self.photo.as_mut().map_or(views.first, |p| p.fit(views.first));
        // All views have the same size, so positions carry over between them.
        let shown_in = |view: Rect| shown.translate(view.min - views.first.min);
        self.request(ui, shown, state, layout, now);
        if let Some(semantics) = &state.semantics {
            self.queries.keep_up(ui.ctx(), semantics, &state.plan);
            self.queries.stand(self.pose());
        }
        let takes_clicks = self.is_measuring() || self.is_inspecting();
        let (mut on_camera, mut works_in) = (false, self.queries.is_second());
        for (second, rect) in views.each() {
            self.queries.work_in(second);
            self.display.paint(ui, (rect, shown_in(rect)), second);
            // Answers belong to the scene, not to another one beside it.
            let is_other = second && state.beside.is_some();
            if let Some(semantics) = state.semantics.as_ref().filter(|_| !is_other) {
                let lit = layout.dim.then(|| self.picking.selected().into_iter().collect());
                self.queries.paint(ui, shown_in(rect), semantics, lit);
            }
            if let Some(photo) = self.photo.as_mut().filter(|_| layout.compare && !second) {
                photo.show_split(ui, shown, &mut layout.split);
            }
            on_camera |= layout.cameras
                && self.photo.is_none()
                && !takes_clicks
                && self.show_frusta(ui, rect, &scene, &response, layout, actions);
        }
        let picks = !self.has_brush() && !takes_clicks;
        if let Some(semantics) = state.semantics.as_ref().filter(|_| picks) {
            let is_other = state.beside.is_some() && under != views.first;
            let maps = self.queries.maps().map(|m| &***m).filter(|_| !on_camera && !is_other);
            self.picking.update(&response, shown_in(under), (semantics, &state.labels), maps, actions);
        }
        self.show_crop(ui, shown, state, actions);
        self.show_arranging(ui, shown, state, actions);
        self.show_inspector(ui, &response, shown, state, actions);
        for (second, rect) in views.each() {
            self.queries.work_in(second);
            let shown = shown_in(rect);
            self.show_ruler(ui, &response, shown, scene.meters_per_unit());
            let is_other = second && state.beside.is_some();
            if let (Some(semantics), Some(cloud)) = (&state.semantics, self.cloud.clone())
                && picks
                && !is_other
            {
                if let Some(maps) = self.queries.shown_maps().cloned() {
                    self.picking.paint(ui, shown, (semantics, &state.labels), &maps);
                }
                self.show_marks(ui, shown, &cloud, (semantics, &state.labels), actions);
            }
            if let Some(pane) = route {
                self.show_route(ui, rect, pane, state.explored.as_deref());
            }
            self.show_overlay(ui, rect, &scene, state, layout, actions);
            if let Some(brush) = &mut self.brush {
                brush.paint(ui, shown, !self.queries.compares());
            }
            if let Some(brush) = &self.choose {
                brush.paint(ui, shown);
            }
            if let Some(tool) = self.select.as_mut().filter(|_| !(second && state.beside.is_some())) {
                tool.paint(ui, shown, self.queries.shown_maps());
            }
            if let (Some(semantics), Some(cloud)) = (&state.semantics, &self.cloud)
                && !is_other
                && self.queries.show(ui, (rect, views.first), state, (semantics, cloud, &self.visibility), actions)
            {
                works_in = second;
            }
            if views.is_split() && works_in == second {
                split::mark_worked_in(ui, rect);
            }
        }
        self.queries.work_in(works_in);
        let worked_in = views.each().last().filter(|_| works_in).map_or(views.first, |(_, rect)| rect);
        self.show_ruler_card(ui, worked_in, scene.meters_per_unit(), actions);
        if let Some(brush) = &mut self.brush {
            brush.show(ui, worked_in, actions);
        }
        if let Some(brush) = &mut self.choose {
            brush.show(ui, worked_in, actions);
        }
        if let Some(tool) = &mut self.select {
            let none = Identities::default();
            tool.show(ui, worked_in, state.semantics.as_ref().map_or(&none, |map| &map.identities), actions);
        }
    }

    /// Takes over the newest frame and its identity maps.
    fn take_frame(&mut self, ctx: &egui::Context) {
        if let Some((maps, exact)) = self.display.take_maps(self.lane.maps(), self.requests.ticket()) {
            self.queries.set_maps(maps, exact);
        }
        self.display.take(ctx, self.lane.pictures());
    }

    /// True if a GPU draws the view.
    pub(crate) fn on_gpu(&self) -> bool {
        self.display.picture().is_some_and(|p| p.on_gpu())
    }
}
