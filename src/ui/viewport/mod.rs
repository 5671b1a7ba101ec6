//! The viewport: shows what the drawing lane rendered, and moves the eye.

pub mod brush;
pub mod drawing;
pub mod eye;
pub mod frame_times;
mod frusta;
mod input;
mod overlay;
mod photo;
pub mod query;
mod route;
pub mod visible;

use std::sync::Arc;
use std::time::Instant;

use egui::{Color32, ColorImage, Rect, Sense, TextureHandle, TextureOptions, Ui};
use glam::{DVec2, DVec3};

use self::brush::Brush;
use self::drawing::Drawing;
use self::eye::Eye;
use self::frame_times::FrameTimes;
use self::photo::PhotoView;
use self::query::Questions;
use self::visible::Visibility;
use super::camera::CameraPane;
use super::layout::Layout;
use super::state::{AppState, Tone};
use super::theme;
use crate::navigate::Pose;
use crate::render::Renderer;
use crate::scene::plan::When;
use crate::scene::trace::{self, Sort};
use crate::scene::{Camera, GaussianCloud, PhotoPixels};
use crate::worker::protocol::Failure;
use crate::worker::view::{Effort, Leave, ViewLane, ViewPicture, ViewRequest};
use crate::worker::{Action, CloudSnapshot, OpenedScene, Repaint, ViewMode, Worker};

/// The eye counts as moving until it has rested this long.
const REST_SECS: f64 = 0.15;
/// Longest side of a picture in px: beyond this the eye gains nothing and waiting costs.
const MAX_SIDE_PX: u32 = 1600;

/// State of the viewport.
pub struct Viewport {
    lane: ViewLane,
    eye: Eye,
    /// Upwards, where a person chose it.
    up: Option<DVec3>,
    /// Number of the scene that eye and cloud belong to.
    scene: u64,
    /// What is drawn.
    cloud: Option<Arc<GaussianCloud>>,
    /// Generation of the newest snapshot taken from training.
    snapshot: u64,
    /// Counts the clouds that were drawn.
    cloud_number: u64,
    /// The photo through whose camera the eye looks.
    photo: Option<PhotoView>,
    /// When the eye last moved, in window time.
    moved_at: f64,
    requested: Option<Asked>,
    tickets: u64,
    /// Generation of the newest picture.
    shown: u64,
    /// The same, when it was asked for last.
    counted: u64,
    picture: Option<Arc<ViewPicture>>,
    texture: Option<TextureHandle>,
    error: Option<String>,
    /// Why nobody knows what the pixels of this view belong to.
    unmapped: Option<String>,
    /// Why the CPU draws though there is a GPU, once that was told.
    instead_of_gpu: Option<String>,
    /// What was asked, and where the answers are.
    pub questions: Questions,
    /// What is left out of the picture.
    pub visibility: Visibility,
    /// What is being marked by hand.
    pub brush: Option<Brush>,
    /// What is drawn in another way than the scene says.
    pub drawing: Drawing,
    /// Times of the newest pictures, while they are shown.
    times: Option<FrameTimes>,
    /// Generation of the newest map of identities.
    mapped: u64,
    /// World point that the wheel zooms to, while the cursor stays.
    zoom_anchor: Option<(egui::Pos2, DVec3)>,
}

/// What a picture was asked for: a change means that a new one is needed.
#[derive(Clone, PartialEq)]
struct Asked {
    camera: Camera,
    /// Its number, and the address of what is drawn of it.
    cloud: (u64, usize),
    mode: ViewMode,
    effort: Effort,
    with_photo: bool,
    /// Which objects and parts, by address; 0 for none.
    semantics: usize,
    /// With blended codes.
    codes: bool,
    /// Up to which degree of harmonics.
    sh_degree: u8,
    /// Without what.
    leave: Leave,
    drawing: Drawing,
    /// With the times of its stages.
    timed: bool,
}

impl Viewport {
    /// An empty viewport. Fails only if the system gives no thread.
    pub fn new(repaint: Repaint) -> std::io::Result<Self> {
        let home = crate::scene::HomeView::default();
        Ok(Self {
            lane: ViewLane::start(repaint)?,
            eye: Eye::framing(&home.bounds, home.up),
            up: None,
            scene: 0,
            cloud: None,
            snapshot: 0,
            cloud_number: 0,
            photo: None,
            moved_at: f64::NEG_INFINITY,
            requested: None,
            tickets: 0,
            shown: 0,
            counted: 0,
            picture: None,
            texture: None,
            error: None,
            unmapped: None,
            instead_of_gpu: None,
            questions: Questions::default(),
            visibility: Visibility::default(),
            brush: None,
            drawing: Drawing::default(),
            times: None,
            mapped: 0,
            zoom_anchor: None,
        })
    }

    /// The newest picture.
    pub fn picture(&self) -> Option<&ViewPicture> {
        self.picture.as_deref()
    }

    /// The Gaussians on screen.
    pub fn cloud(&self) -> Option<&Arc<GaussianCloud>> {
        self.cloud.as_ref()
    }

    /// Index of the photo through whose camera the eye looks.
    pub fn photo_index(&self) -> Option<usize> {
        self.photo.as_ref().map(PhotoView::index)
    }

    /// The picture as pixels, for saving.
    pub fn pixels(&self) -> Option<PhotoPixels> {
        let p = self.picture.as_ref()?;
        let (width_px, height_px) = (p.camera.width_px, p.camera.height_px);
        Some(PhotoPixels { width_px, height_px, rgb: p.rgb.clone(), coverage: None })
    }

    /// Takes over a new scene, new Gaussians and loaded photos.
    pub fn update(&mut self, state: &mut AppState, worker: &Worker) {
        if let Some(scene) = state.scene.as_ref().filter(|_| state.scene_number != self.scene) {
            self.scene = state.scene_number;
            self.photo = None;
            self.requested = None;
            (self.picture, self.texture, self.error, self.unmapped) = (None, None, None, None);
            self.set_cloud(scene.cloud.clone());
            self.up = None;
            self.questions.clear();
            self.visibility = Visibility::default();
            self.brush = None;
            self.drawing = Drawing::default();
            self.eye = home_eye(scene, None);
        }
        if let Some((generation, snapshot)) = worker.clouds().newer_than(self.snapshot) {
            self.snapshot = generation;
            let CloudSnapshot { job, cloud, .. } = &*snapshot;
            if state.training_job == Some(*job) {
                self.set_cloud(Some(Arc::clone(cloud)));
            }
        }
        let instead_of_gpu = self.picture.as_ref().and_then(|p| p.instead_of_gpu.as_ref());
        if let Some(why) = instead_of_gpu.filter(|why| self.instead_of_gpu.as_ref() != Some(why)) {
            state.toast(Tone::Warning, why);
            self.instead_of_gpu = Some(why.clone());
        }
        if let Some(photo) = &mut self.photo {
            photo.take_loaded(state, worker);
        }
    }

    /// Does what a person asked of the view.
    pub fn act(&mut self, action: &Action, state: &AppState, worker: &Worker, now: f64) {
        let Some(scene) = state.scene.clone() else { return };
        let photos = scene.dataset.as_ref().map_or(0, |d| d.photos.len());
        let here = self.photo_index();
        match action {
            Action::FrameScene => {
                self.leave_photo();
                self.eye.frame(&scene.home.bounds);
            }
            Action::Paint(of) => self.brush = of.filter(|_| state.semantics.is_some()).map(Brush::new),
            Action::Isolate(only) => self.visibility.isolate(*only),
            Action::Hide(id) => self.visibility.toggle(*id),
            Action::ResetView => {
                self.photo = None;
                self.eye = home_eye(&scene, self.up);
            }
            Action::TurnUp(axis) => {
                self.leave_photo();
                self.up = Some(axis.vector());
                self.eye.set_up(axis.vector());
            }
            Action::NextPhoto if photos > 0 => self.look_through(here.map_or(0, |i| (i + 1) % photos), &scene, worker),
            Action::PreviousPhoto if photos > 0 => {
                self.look_through(here.map_or(photos - 1, |i| (i + photos - 1) % photos), &scene, worker);
            }
            Action::GoToPhoto(i) if *i < photos => self.look_through(*i, &scene, worker),
            _ => return,
        }
        self.moved_at = now;
    }

    fn set_cloud(&mut self, cloud: Option<Arc<GaussianCloud>>) {
        self.cloud = cloud;
        self.cloud_number += 1;
    }

    fn look_through(&mut self, index: usize, scene: &OpenedScene, worker: &Worker) {
        let Some(photo) = scene.dataset.as_ref().and_then(|d| d.photos.get(index)) else { return };
        let c = &photo.camera;
        let ahead = (scene.home.bounds.center() - c.center).dot(c.forward());
        let pivot = c.center + c.forward() * ahead.max(0.1 * scene.home.bounds.radius());
        self.eye = Eye::of_camera(c, pivot, self.up.unwrap_or(scene.home.up));
        self.photo = Some(PhotoView::new(index, photo, worker));
    }

    /// The camera for what is drawn over the picture: the picture's own, so that both move together.
    fn overlay_camera(&self, rect: Rect) -> Camera {
        match &self.picture {
            Some(p) => p.camera.resized(rect.width().max(1.0) as u32, rect.height().max(1.0) as u32),
            None => self.eye.camera(rect.width() as u32, rect.height() as u32),
        }
    }

    /// Where the eye is.
    pub fn pose(&self) -> Pose {
        let (center, world_from_camera) = (self.eye.center, self.eye.world_from_eye);
        let fov_y_rad = match &self.photo {
            Some(photo) => photo.free_fov(self.eye.fov_y_rad),
            None => self.eye.fov_y_rad,
        };
        Pose { center, world_from_camera, fov_y_rad }
    }

    /// The camera of the newest picture, or one of the eye.
    pub fn camera(&self) -> Camera {
        self.picture.as_ref().map_or_else(|| self.eye.camera(640, 480), |p| p.camera.clone())
    }

    /// Width by height of the picture.
    pub fn aspect(&self) -> f64 {
        self.picture.as_ref().map_or(16.0 / 9.0, |p| f64::from(p.camera.width_px) / f64::from(p.camera.height_px))
    }

    /// Which way is up in a scene.
    pub fn up(&self, scene: &OpenedScene) -> DVec3 {
        self.up.unwrap_or(scene.home.up)
    }

    /// Puts the eye into a pose.
    pub fn stand(&mut self, pose: &Pose, state: &AppState, now: f64) {
        let Some(scene) = state.scene.clone() else { return };
        self.photo = None;
        // What it turns about stays ahead, at the distance that it has.
        let ahead = (self.eye.pivot - pose.center).dot(pose.forward());
        let distance = if ahead > 0.0 { ahead } else { 0.5 * scene.home.bounds.radius() };
        self.eye = Eye {
            center: pose.center,
            world_from_eye: pose.world_from_camera,
            pivot: pose.center + pose.forward() * distance,
            up: self.up(&scene),
            fov_y_rad: pose.fov_y_rad,
        };
        self.moved_at = now;
    }

    /// Turns about this point from now on.
    pub fn turn_about(&mut self, point: DVec3) {
        self.eye.pivot = point;
    }

    /// Whether a picture has come since this was asked last.
    pub fn take_new_picture(&mut self) -> bool {
        std::mem::replace(&mut self.counted, self.shown) != self.shown
    }

    /// Goes on freely from the photo's place, at the scale that the picture had.
    fn leave_photo(&mut self) {
        if let Some(photo) = self.photo.take() {
            self.eye.fov_y_rad = photo.free_fov(self.eye.fov_y_rad);
        }
    }

    /// Draws the viewport into all that is left of `ui`.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        state: &AppState,
        layout: &mut Layout,
        route: Option<&CameraPane>,
        actions: &mut Vec<Action>,
    ) {
        let Some(scene) = state.scene.clone() else { return };
        let rect = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Viewport"));
        match layout.times {
            true => drop(self.times.get_or_insert_default()),
            false => self.times = None,
        }
        self.take_picture(ui);
        let now = ui.input(|i| i.time);
        self.use_brush(&response, rect, state);
        if self.handle_input(ui, &response, rect, &scene, actions) {
            self.leave_photo();
            self.moved_at = now;
        }
        let shown = self.photo.as_mut().map_or(rect, |p| p.fit(rect));
        self.request(ui, shown, state, layout, now);
        // Filling what the picture covers anyway would be a fifth of a frame on an emulated adapter.
        if self.texture.is_none() || shown != rect {
            ui.painter().rect_filled(rect, 0.0, theme::CANVAS);
        }
        if let Some(texture) = &self.texture {
            let uv = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
            ui.painter().image(texture.id(), shown, uv, Color32::WHITE);
        }
        if let Some(semantics) = &state.semantics {
            self.questions.keep_up(ui.ctx(), semantics, &state.plan);
            self.questions.paint(ui, shown, semantics);
        }
        if let Some(photo) = self.photo.as_mut().filter(|_| layout.compare) {
            photo.show_split(ui, shown, &mut layout.split);
        }
        if layout.cameras && self.photo.is_none() {
            self.show_frusta(ui, rect, &scene, &response, layout, actions);
        }
        if let Some(pane) = route {
            self.show_route(ui, rect, pane, state.explored.as_deref());
        }
        self.show_overlay(ui, rect, &scene, state, layout, actions);
        if let (Some(brush), Some(semantics)) = (&mut self.brush, &state.semantics) {
            brush.paint(ui, shown);
            brush.show(ui, shown, &semantics.identities, actions);
        }
        if let (Some(semantics), Some(cloud)) = (&state.semantics, &self.cloud) {
            self.questions.show(ui, shown, semantics, cloud, actions);
        }
    }

    /// Paints where the pointer drags, floods where it clicks.
    fn use_brush(&mut self, response: &egui::Response, rect: Rect, state: &AppState) {
        let (Some(brush), Some(picture)) = (&mut self.brush, &self.picture) else { return };
        let shown = self.photo.as_mut().map_or(rect, |p| p.fit(rect));
        // Only a full picture has the pixels that the maps have.
        if !picture.full {
            return;
        }
        brush.on_view(&picture.camera);
        let Some(pos) = response.interact_pointer_pos() else { return };
        let scale = picture.camera.width_px as f32 / shown.width();
        let at = [(pos.x - shown.left()) * scale, (pos.y - shown.top()) * scale];
        if response.dragged_by(egui::PointerButton::Primary) {
            brush.dab(at, scale);
        } else if response.clicked()
            && let (Some(maps), Some(semantics)) = (self.questions.maps(), &state.semantics)
            && at.iter().all(|v| *v >= 0.0)
        {
            brush.flood([at[0] as usize, at[1] as usize], &picture.rgb, &maps.identities, &semantics.identities);
        }
    }

    /// Uploads the newest picture if there is one, and takes over what its pixels belong to.
    fn take_picture(&mut self, ui: &Ui) {
        if let Some((generation, mapped)) = self.lane.maps().newer_than(self.mapped) {
            self.mapped = generation;
            if let Some(times) = &mut self.times {
                times.add_maps(mapped.secs);
            }
            // One of an earlier request is of another view.
            if mapped.ticket == self.tickets {
                match &mapped.maps {
                    Ok(maps) => self.questions.set_maps(Some(Arc::clone(maps))),
                    Err(failure) => self.unmapped = Some(told(failure)),
                }
            }
        }
        let Some((generation, result)) = self.lane.pictures().newer_than(self.shown) else { return };
        self.shown = generation;
        match &*result {
            Ok(picture) => {
                let start = Instant::now();
                let size = [picture.camera.width_px as usize, picture.camera.height_px as usize];
                let pixels = picture.rgb.iter().map(|&[r, g, b]| Color32::from_rgb(r, g, b)).collect();
                let image = ColorImage::new(size, pixels);
                match &mut self.texture {
                    Some(texture) => texture.set(image, TextureOptions::LINEAR),
                    None => self.texture = Some(ui.ctx().load_texture("viewport", image, TextureOptions::LINEAR)),
                }
                if self.picture.is_none() {
                    trace::record(Sort::Picture, "first picture", "the scene is on screen", 0);
                }
                if let Some(times) = &mut self.times {
                    times.add(picture, start.elapsed().as_secs_f64());
                }
                self.picture = Some(Arc::clone(picture));
                self.error = None;
            }
            Err(failure) => self.error = Some(told(failure)),
        }
    }

    /// Asks for a new picture if anything changed.
    fn request(&mut self, ui: &Ui, shown: Rect, state: &AppState, layout: &Layout, now: f64) {
        let Some(cloud) = self.cloud.clone() else { return };
        let plan = &state.plan;
        let (cloud, semantics) = match &state.semantics {
            Some(semantics) => {
                let (cloud, semantics) = self.visibility.apply(&cloud, semantics);
                (cloud, Some(semantics).filter(|_| plan.maps.now(self.questions.wanted() || self.brush.is_some())))
            }
            None => (cloud, None),
        };
        let rests = now - self.moved_at - REST_SECS;
        if rests < 0.0 {
            ui.ctx().request_repaint_after_secs((-rests + 0.01) as f32);
        }
        let busy = state.job.as_ref().is_some_and(|j| !j.paused);
        let effort = match (rests < 0.0, busy) {
            (true, _) => Effort::Moving,
            (false, true) => Effort::Shared,
            (false, false) => Effort::Full,
        };
        let size = shown.size() * ui.pixels_per_point();
        let (w, h) = ((size.x.round() as u32).max(1), (size.y.round() as u32).max(1));
        let camera = match &self.photo {
            Some(p) => p.camera().resized(w, h),
            None => self.eye.camera(w, h),
        };
        let photo = self.photo.as_ref().and_then(PhotoView::pixels);
        let asked = Asked {
            camera: camera.limited_to(MAX_SIDE_PX),
            cloud: (self.cloud_number, Arc::as_ptr(&cloud) as usize),
            mode: layout.mode,
            effort,
            with_photo: photo.is_some(),
            semantics: semantics.as_ref().map_or(0, |s| Arc::as_ptr(s) as usize),
            codes: semantics.is_some() && self.questions.wants_codes(),
            sh_degree: state.drawing().sh_degree,
            leave: Leave::of(plan),
            drawing: self.drawing.clone(),
            timed: layout.times,
        };
        let again = plan.redraw == When::Always;
        if again {
            ui.ctx().request_repaint();
        }
        // A newer request would keep what belongs to the last one from ever being drawn.
        let drawn = self.picture.as_ref().is_some_and(|p| p.ticket == self.tickets)
            && (semantics.is_none() || self.questions.maps().is_some());
        if self.requested.as_ref() == Some(&asked) && !(again && drawn) {
            return;
        }
        self.tickets += 1;
        self.lane.request(ViewRequest {
            cloud,
            camera: asked.camera.clone(),
            mode: asked.mode,
            settings: self.drawing.over(state.drawing(), self.on_gpu()),
            effort,
            photo,
            semantics,
            codes: asked.codes,
            leave: asked.leave,
            timed: asked.timed,
            ticket: self.tickets,
        });
        // A change of resolution alone does not move what the pixels belong to.
        let same_view =
            |r: &Asked| r.camera == asked.camera && r.cloud == asked.cloud && r.semantics == asked.semantics;
        if !self.requested.as_ref().is_some_and(same_view) {
            self.questions.set_maps(None);
            self.unmapped = None;
        }
        self.requested = Some(asked);
    }

    /// Whether a GPU draws the view.
    pub fn on_gpu(&self) -> bool {
        self.picture.as_ref().is_some_and(|p| p.drawn_by != Renderer::CPU)
    }

    /// The world point under a window position: at the drawn depth, else at the pivot's.
    fn point_at(&self, pos: egui::Pos2, shown: Rect) -> DVec3 {
        let at = DVec2::new(
            f64::from((pos.x - shown.left()) / shown.width().max(1.0)),
            f64::from((pos.y - shown.top()) / shown.height().max(1.0)),
        );
        self.picked(at).unwrap_or_else(|| {
            let camera = self.eye.camera(1000, (1000.0 * shown.height() / shown.width().max(1.0)).max(1.0) as u32);
            let ray = camera.ray(at * DVec2::new(f64::from(camera.width_px), f64::from(camera.height_px)));
            let depth =
                (self.eye.pivot - self.eye.center).dot(self.eye.forward()).abs().max(0.05 * self.eye.distance());
            self.eye.center + ray * depth
        })
    }

    /// The drawn surface at a relative position of the picture, if its depth was drawn.
    fn picked(&self, at: DVec2) -> Option<DVec3> {
        let picture = self.picture.as_ref()?;
        // A picture from somewhere else says nothing about here.
        if picture.camera.center.distance(self.eye.center) > 1e-3 * self.eye.distance() {
            return None;
        }
        let size = DVec2::new(f64::from(picture.camera.width_px), f64::from(picture.camera.height_px));
        let px = (at * size).clamp(DVec2::ZERO, size - 1.0);
        let index = px.y as usize * picture.camera.width_px as usize + px.x as usize;
        let depth = f64::from(*picture.median_depth.as_ref()?.get(index)?);
        (depth > 0.0).then(|| picture.camera.center + picture.camera.ray(at * size) * depth)
    }
}

/// What went wrong and what can be done, in one line.
fn told(failure: &Failure) -> String {
    format!("{} {}", failure.message, failure.remedy)
}

/// The first view of a scene: from its first camera if it has one, else framed as a whole; upright
/// if a person chose what is up.
fn home_eye(scene: &OpenedScene, up: Option<DVec3>) -> Eye {
    let home = &scene.home;
    let mut eye = match &home.camera {
        Some(c) => {
            let mut eye = Eye::of_camera(c, home.bounds.center(), home.up);
            eye.fov_y_rad = eye.fov_y_rad.clamp(0.5, 1.2);
            eye
        }
        None => Eye::framing(&home.bounds, up.unwrap_or(home.up)),
    };
    if let Some(up) = up {
        eye.set_up(up);
    }
    eye
}
