//! The user's actions on the view: its camera, its photo and its tool.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::eye::{Eye, is_in_view};
use super::photo::PhotoView;
use super::splat_selection::SplatSelection;
use super::straight::front_of;
use super::tools::Tool;
use super::tools::crop::CropTool;
use super::tools::mask_brush::MaskBrush;
use super::tools::ruler::Ruler;
use super::tools::select::SelectTool;
use super::tools::transform::TransformTool;
use super::visible::VisibleCloud;
use super::{AppState, Viewport};
use crate::jobs::OpenedScene;
use crate::jobs::inspect::InspectRequest;
use crate::jobs::rearrange::Arrangement;
use crate::jobs::select::SelectFor;
use crate::navigate::Pose;
use crate::pipeline::semantics::lifting::edit::Edit;
use crate::scene::{Bounds, CropBox, IdentityId, NO_IDENTITY};
use crate::ui::actions::{Action, Face};
use crate::ui::layout::Layout;
use crate::ui::select_shape::SelectShape;
use crate::worker::Tasks;

/// The camera.
impl Viewport {
    /// Frames the selected identity, or else the scene.
    pub(crate) fn frame(&mut self, state: &AppState, now: f64) {
        let Some(scene) = &state.scene else { return };
        self.leave_photo();
        let selected = self.parts().1.selected_bounds(state.semantics.as_ref());
        self.eye.frame(selected.as_ref().unwrap_or(&scene.home.bounds));
        self.moved_at = now;
    }

    /// Bounds of an identity without outliers, if it has Gaussians.
    pub(crate) fn bounds_of(&mut self, id: IdentityId, state: &AppState) -> Option<Bounds> {
        self.marks.bounds(self.cloud.as_ref()?, state.semantics.as_ref()?, id)
    }

    /// Goes to the first view of the scene.
    pub(crate) fn reset_view(&mut self, state: &AppState, now: f64) {
        let Some(scene) = &state.scene else { return };
        self.photo = None;
        self.eye = Eye::home(&scene.home, self.up);
        self.moved_at = now;
    }

    /// Sets the up direction and turns upright.
    pub(crate) fn turn_up(&mut self, up: DVec3, now: f64) {
        if !self.has_scene() {
            return;
        }
        self.leave_photo();
        self.up = Some(up);
        self.eye.set_up(up);
        self.moved_at = now;
    }

    /// True if the view is orthographic.
    pub fn is_orthographic(&self) -> bool {
        self.eye.is_orthographic()
    }

    /// Switches between perspective and orthographic view.
    pub(crate) fn toggle_orthographic(&mut self, now: f64) {
        self.leave_photo();
        self.eye.set_orthographic(!self.eye.is_orthographic());
        self.moved_at = now;
    }

    /// Looks straight at the selected identity, or else at the scene, from a side; orthographic until the user ends that.
    pub(crate) fn look_from(&mut self, face: Face, state: &AppState, now: f64) {
        let Some(scene) = &state.scene else { return };
        self.leave_photo();
        let selected = self.parts().1.selected_bounds(state.semantics.as_ref());
        self.eye.look_from(face, front_of(Some(&scene.home)));
        self.eye.set_orthographic(true);
        self.eye.frame(selected.as_ref().unwrap_or(&scene.home.bounds));
        self.moved_at = now;
    }

    /// Looks through the photo `by` places after the current one, around the end of the list; from a free view,
    /// through the first or the last.
    pub(crate) fn step_photo(&mut self, by: isize, state: &AppState, tasks: &Tasks, now: f64) {
        let photos = state.photo_count();
        if photos == 0 {
            return;
        }
        let first = if by > 0 { 0 } else { photos - 1 };
        let next = self.photo_index().map_or(first, |i| (i as isize + by).rem_euclid(photos as isize) as usize);
        self.look_through(next, state, tasks, now);
    }

    /// Looks through the camera of a photo.
    pub(crate) fn look_through(&mut self, index: usize, state: &AppState, tasks: &Tasks, now: f64) {
        let Some(scene) = &state.scene else { return };
        let Some(photo) = state.photo(index) else { return };
        self.eye = Eye::of_photo(&photo.camera, &scene.home, self.up(scene));
        let located = state.placed(index).map(|placed| placed.found.exposure());
        self.photo = Some(PhotoView::new(index, photo, located, tasks));
        self.moved_at = now;
    }

    /// Looks through the camera of a photo as long as a mode or the comparison needs one: then the eye comes back.
    pub(crate) fn visit_photo(&mut self, index: usize, state: &AppState, tasks: &Tasks, compared: bool, now: f64) {
        let before = (self.eye.clone(), compared);
        self.look_through(index, state, tasks, now);
        self.photo.iter_mut().for_each(|photo| photo.came_from = Some(before.clone()));
    }

    /// Comes back from a photo that was visited for a mode or the comparison, once nothing needs it.
    pub(super) fn come_back(&mut self, layout: &Layout, now: f64) {
        let modes = [Some(layout.mode), layout.split_view.then_some(layout.second_mode)];
        let needs =
            |compared: bool| modes.iter().flatten().any(|mode| mode.needs_photo()) || layout.compare && !compared;
        let visit = self.photo.as_ref().and_then(|photo| photo.came_from.clone());
        if let Some((eye, _)) = visit.filter(|(_, compared)| !needs(*compared)) {
            self.photo = None;
            self.eye = eye;
            self.moved_at = now;
        }
    }

    /// True if the middle of `bounds` is in the frame on screen.
    pub(crate) fn sees(&self, bounds: &Bounds) -> bool {
        let camera = self.camera();
        let size = DVec2::new(f64::from(camera.width_px), f64::from(camera.height_px));
        camera.project(bounds.center()).is_some_and(|p| p.cmpge(DVec2::ZERO).all() && p.cmple(size).all())
    }

    /// Keeps `bounds` in the views of the next frame, which may be of another shape.
    pub(crate) fn ask_for(&mut self, bounds: Bounds) {
        self.asked_for = Some(bounds);
    }

    /// Turns to `bounds` if not all of it is in a view of this size.
    pub(super) fn keep_in_view(&mut self, bounds: &Bounds, view: egui::Vec2, now: f64) {
        // All of a photo's frame is always shown.
        if self.photo.as_ref().is_some_and(|photo| is_in_view(photo.camera(), bounds, 0.0)) {
            return;
        }
        let before = self.eye.clone();
        let fov = self.photo.as_ref().map(|photo| photo.free_fov(before.fov_y_rad));
        let mut eye = Eye { fov_y_rad: fov.unwrap_or(before.fov_y_rad), ..before };
        if eye.turn_to(bounds, f64::from(view.x / view.y.max(1.0))) {
            self.photo = None;
            self.eye = eye;
            self.moved_at = now;
        }
    }

    /// Moves the camera to a pose.
    pub(crate) fn stand(&mut self, pose: &Pose, state: &AppState, now: f64) {
        let Some(scene) = &state.scene else { return };
        self.photo = None;
        let up = self.up(scene);
        self.eye.stand(pose, scene.home.bounds.radius(), up);
        self.moved_at = now;
    }

    /// Leaves the photo's camera at its pose, with the scale of the frame.
    pub(crate) fn leave_photo(&mut self) {
        if let Some(photo) = self.photo.take() {
            self.eye.fov_y_rad = photo.free_fov(self.eye.fov_y_rad);
        }
    }

    /// Sets the crop box.
    pub(crate) fn set_crop(&mut self, crop: Option<CropBox>) {
        if self.has_scene() {
            self.visibility.set_crop(crop);
        }
    }
}

/// The tools.
impl Viewport {
    /// True if a tool is in use.
    pub(crate) fn has_tool(&self) -> bool {
        self.tool.is_some()
    }

    /// Names the unfinished work that another tool would drop, if there is any.
    pub(crate) fn unfinished(&self) -> Option<&'static str> {
        match &self.tool {
            Some(Tool::Select(tool)) if tool.has_steps() => Some("selection"),
            Some(Tool::Transform(tool)) if tool.is_something() => Some("change"),
            // Measurements and crop boxes are made anew at once, and a painted mask stays with its view.
            _ => None,
        }
    }

    /// True if the unfinished work can be kept as it is.
    pub(crate) fn can_keep(&self) -> bool {
        self.select_tool().is_none_or(|tool| tool.gaussians().is_some())
    }

    /// Ends the tool in use. A crop box stays.
    pub(crate) fn end_tool(&mut self) {
        self.tool = None;
    }

    /// Begins or ends measuring.
    pub(crate) fn measure(&mut self, state: &AppState) {
        let in_use = self.is_measuring();
        self.toggle(in_use, state, |_, _| Tool::Ruler(Ruler::default()));
    }

    /// True if the ruler is in use.
    pub(crate) fn is_measuring(&self) -> bool {
        matches!(self.tool, Some(Tool::Ruler(_)))
    }

    /// What Enter does with the tool in use.
    pub(crate) fn on_enter(&self) -> Option<Action> {
        match &self.tool {
            Some(Tool::Ruler(_)) => Some(Action::KeepMeasurement),
            Some(Tool::Transform(tool)) if tool.is_something() => Some(Action::ApplyTransform),
            _ => None,
        }
    }

    /// Keeps what the ruler has measured. Returns false if there is nothing to keep.
    pub(crate) fn take_measurement(&mut self, state: &AppState) -> bool {
        let (tool, rest) = self.parts();
        let Some(Tool::Ruler(ruler)) = tool else { return false };
        let made = ruler.take(&rest, state);
        made.map(|made| rest.measurements.push(made)).is_some()
    }

    /// Begins or ends the edit of the crop box; without one, a box is offered.
    pub(crate) fn crop(&mut self, state: &AppState) {
        let in_use = matches!(self.tool, Some(Tool::Crop(_)));
        self.toggle(in_use, state, |view, scene| {
            let (cloud, eye) = (view.cloud.as_ref().map(|c| &***c), view.camera());
            Tool::Crop(CropTool::new(cloud, &scene.home.bounds, &eye, view.eye.pivot))
        });
    }

    /// Begins or ends inspecting; it begins in the middle of the view.
    pub(crate) fn inspect(&mut self, state: &AppState, tasks: &Tasks) {
        let in_use = matches!(self.tool, Some(Tool::Inspect(_)));
        self.toggle(in_use, state, |_, _| Tool::Inspect(Box::default()));
        self.inspect_at(DVec2::splat(0.5), state, tasks);
    }

    /// Inspects the pixel at a relative position of the view, if the inspector is in use.
    pub(crate) fn inspect_at(&mut self, at: DVec2, state: &AppState, tasks: &Tasks) {
        let Some(Tool::Inspect(inspector)) = &mut self.tool else { return };
        let (Some(cloud), Some(picture)) = (&self.cloud, self.display.picture()) else { return };
        let camera = picture.camera.clone();
        let VisibleCloud { cloud, semantics, numbers } = self.visibility.apply(cloud, state.semantics.as_ref());
        let size = DVec2::new(f64::from(camera.width_px), f64::from(camera.height_px));
        let pixel = (at * size).clamp(DVec2::ZERO, size - 1.0);
        let request = InspectRequest {
            cloud: (*cloud).clone(),
            map: semantics.as_deref().cloned(),
            numbers,
            settings: self.overrides.over(state.render_settings(), self.display.on_gpu()),
            camera,
            pixel: [pixel.x as u32, pixel.y as u32],
        };
        inspector.inspect(request, tasks);
    }

    /// Selects Gaussians for `purpose`; `None` ends painting, selecting and transforming.
    pub(crate) fn select(&mut self, purpose: Option<SelectFor>, state: &AppState) {
        match purpose {
            None => drop(self.tool.take_if(|tool| tool.is_edit())),
            // Only known objects and parts can be corrected.
            Some(SelectFor::Extent(_)) if state.semantics.is_none() => self.tool = None,
            Some(purpose) => self.select_from(purpose, None, Vec::new(), state),
        }
    }

    /// Selects with a shape, in the selection that there is, or in a new one.
    pub(crate) fn select_with(&mut self, shape: SelectShape, state: &AppState) {
        match &mut self.tool {
            Some(Tool::Select(tool)) => tool.shape = shape,
            _ => self.select_from(SelectFor::New(NO_IDENTITY), Some(shape), Vec::new(), state),
        }
    }

    /// Selects Gaussians for `purpose`, from `first` on. Without a shape, the one used last goes on.
    pub(crate) fn select_from(
        &mut self,
        purpose: SelectFor,
        shape: Option<SelectShape>,
        first: Vec<u32>,
        state: &AppState,
    ) {
        if state.scene.is_some() {
            let shape = shape.or(self.select_tool().map(|tool| tool.shape)).unwrap_or_default();
            self.tool = Some(Tool::Select(Box::new(SelectTool::new(purpose, shape, first))));
        }
    }

    /// Indices of the selected Gaussians, if there are any.
    pub(crate) fn selected_gaussians(&self) -> Option<&[u32]> {
        self.select_tool()?.gaussians()
    }

    /// True if the tool in use selects.
    pub(crate) fn is_selecting(&self) -> bool {
        self.select_tool().is_some()
    }

    /// Selected Gaussians that the view marks.
    pub(crate) fn marked(&mut self) -> Option<Arc<SplatSelection>> {
        let n = self.cloud.as_ref()?.len();
        match &mut self.tool {
            Some(Tool::Select(tool)) => tool.marked(n),
            _ => None,
        }
    }

    /// Transforms an object or part.
    pub(crate) fn transform(&mut self, id: IdentityId, state: &AppState) {
        let Some(scene) = &state.scene else { return };
        let up = self.up(scene);
        let map = state.semantics.as_ref().filter(|_| state.is_trained());
        let known = self.cloud.as_ref().zip(map);
        self.tool = known.map(|(cloud, map)| Tool::Transform(TransformTool::new(id, cloud, map, up)));
    }

    /// Paints the true mask of the view.
    pub(crate) fn paint_true_mask(&mut self, state: &AppState) {
        if state.scene.is_some() {
            self.tool = state.semantics.as_ref().map(|_| Tool::MaskBrush(MaskBrush::new()));
        }
    }

    /// Ends selecting; returns the edit that applies the selection, if there is one.
    pub(crate) fn take_edit(&mut self) -> Option<Edit> {
        let edit = self.select_tool()?.edit();
        self.tool = None;
        edit
    }

    /// Ends transforming; returns the arrangement that the view previews.
    pub(crate) fn take_transform(&mut self) -> Option<Arrangement> {
        let Some(Tool::Transform(tool)) = &self.tool else { return None };
        let arrangement = tool.arrangement();
        self.tool = None;
        Some(arrangement)
    }

    /// Number of selected Gaussians, once all clicks and strokes are processed.
    pub fn selection(&self) -> Option<usize> {
        self.select_tool()?.count()
    }

    /// Number of drawn lines that are not processed yet.
    pub fn lines_drawn(&self) -> usize {
        self.select_tool().map_or(0, SelectTool::lines_drawn)
    }

    /// Width of the lines of the selection tool, px of the view in the window.
    pub fn line_width_px(&self) -> Option<f32> {
        self.select_tool().map(|tool| tool.tip.line_width_px)
    }

    /// Makes the lines of the selection tool wider or narrower. Returns false if it is not in use.
    pub(crate) fn widen_line(&mut self, is_wider: bool) -> bool {
        let Some(Tool::Select(tool)) = &mut self.tool else { return false };
        tool.tip.step(tool.shape, is_wider);
        true
    }

    pub(super) fn select_tool(&self) -> Option<&SelectTool> {
        match &self.tool {
            Some(Tool::Select(tool)) => Some(tool),
            _ => None,
        }
    }

    /// Ends the tool if it is in use, or else begins it in place of another.
    fn toggle(&mut self, in_use: bool, state: &AppState, begin: impl FnOnce(&mut Self, &OpenedScene) -> Tool) {
        let Some(scene) = &state.scene else { return };
        self.tool = None;
        if !in_use {
            self.tool = Some(begin(self, scene));
        }
    }
}
