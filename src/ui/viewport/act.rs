//! Actions on the view and the viewer's camera.

use glam::DVec3;

use super::arranging::ArrangeTool;
use super::brush::Brush;
use super::choosing::SplatBrush;
use super::eye::Eye;
use super::inspector::Inspector;
use super::photo::PhotoView;
use super::ruler::Ruler;
use super::selecting::SelectTool;
use super::{AppState, OpenedScene, Viewport};
use crate::jobs::select::SelectFor;
use crate::navigate::Pose;
use crate::scene::{Bounds, CropBox};
use crate::ui::actions::Action;
use crate::worker::Worker;

impl Viewport {
    /// Carries out an action on the view.
    pub(crate) fn act(&mut self, action: &Action, state: &AppState, worker: &Worker, now: f64) {
        let Some(scene) = state.scene.clone() else { return };
        let photos = scene.dataset.as_ref().map_or(0, |d| d.photos.len());
        let (here, all) = (self.photo_index(), state.semantics.as_ref().map(|map| &map.identities));
        match action {
            Action::FrameScene => {
                self.leave_photo();
                let selected = self.selected_bounds(state.semantics.as_ref());
                self.eye.frame(selected.as_ref().unwrap_or(&scene.home.bounds));
            }
            Action::Paint(of) => {
                self.drop_tools();
                self.select = of.map(|of| SelectTool::new(SelectFor::New(of)));
            }
            Action::Arrange(id) => {
                self.drop_tools();
                let up = self.up(&scene);
                self.arrange = self
                    .cloud
                    .as_ref()
                    .zip(state.semantics.as_ref().filter(|_| state.is_trained()))
                    .map(|(cloud, map)| ArrangeTool::new(*id, cloud, map, up));
            }
            Action::Correct(id) => {
                self.drop_tools();
                self.select = all.map(|_| SelectTool::new(SelectFor::Extent(*id)));
            }
            Action::PaintTrueMask => {
                self.drop_tools();
                self.brush = all.map(|_| Brush::new());
            }
            Action::BrushSplats => {
                self.drop_tools();
                self.choose = state.is_trained().then(SplatBrush::new);
            }
            Action::Select(id) => return self.picking.select(*id),
            Action::Isolate(only) => return all.map_or((), |all| self.visibility.isolate(all, *only)),
            Action::Hide(id) => return all.map_or((), |all| self.visibility.toggle(all, *id)),
            Action::ResetView => {
                self.photo = None;
                self.eye = Eye::home(&scene.home, self.up);
            }
            Action::Measure | Action::Crop | Action::Inspect => return self.toggle_tool(action, &scene),
            Action::SetCrop(crop) => return self.visibility.set_crop(*crop),
            Action::TurnUp(axis) => self.turn_up(axis.vector()),
            Action::SetUp(up) => self.turn_up(*up),
            Action::NextPhoto if photos > 0 => self.look_through(here.map_or(0, |i| (i + 1) % photos), &scene, worker),
            Action::PreviousPhoto if photos > 0 => {
                self.look_through(here.map_or(photos - 1, |i| (i + photos - 1) % photos), &scene, worker);
            }
            Action::GoToPhoto(i) if *i < photos => self.look_through(*i, &scene, worker),
            _ => return,
        }
        self.moved_at = now;
    }

    /// Action that ends the tool in use.
    pub(crate) fn tool(&self) -> Option<Action> {
        let tools = [
            (self.has_brush() || self.arrange.is_some(), Action::Paint(None)),
            (self.ruler.is_some(), Action::Measure),
            (self.cropping, Action::Crop),
            (self.inspector.is_some(), Action::Inspect),
        ];
        tools.into_iter().find(|(used, _)| *used).map(|(_, action)| action)
    }

    /// True if dragging paints or selects and does not orbit.
    pub(super) fn has_brush(&self) -> bool {
        self.brush.is_some() || self.select.is_some() || self.choose.is_some()
    }

    /// Ends painting, selecting, choosing and arranging.
    pub(super) fn drop_tools(&mut self) {
        (self.brush, self.select, self.choose, self.arrange) = (None, None, None, None);
    }

    /// Switches to a tool, or ends it if it is in use.
    fn toggle_tool(&mut self, action: &Action, scene: &OpenedScene) {
        let begins = self.tool().as_ref() != Some(action);
        (self.ruler, self.cropping, self.inspector) = (None, false, None);
        match action {
            _ if !begins => {}
            Action::Measure => self.ruler = Some(Ruler::default()),
            Action::Inspect => self.inspector = Some(Inspector::default()),
            _ => {
                self.cropping = true;
                let crop = self.visibility.crop();
                // Initially around the main content, with a margin: the scene's box leaves out one in twenty.
                let (center, half) = (scene.home.bounds.center(), 0.8 * scene.home.bounds.size());
                let bounds = Bounds { min: center - half, max: center + half };
                let all = CropBox { bounds, outside: false };
                self.visibility.set_crop(Some(crop.unwrap_or(all)));
            }
        }
    }

    fn look_through(&mut self, index: usize, scene: &OpenedScene, worker: &Worker) {
        let Some(photo) = scene.dataset.as_ref().and_then(|d| d.photos.get(index)) else { return };
        let c = &photo.camera;
        let ahead = (scene.home.bounds.center() - c.center).dot(c.forward());
        let pivot = c.center + c.forward() * ahead.max(0.1 * scene.home.bounds.radius());
        self.eye = Eye::of_camera(c, pivot, self.up.unwrap_or(scene.home.up));
        self.photo = Some(PhotoView::new(index, photo, worker));
    }

    fn turn_up(&mut self, up: DVec3) {
        self.leave_photo();
        self.up = Some(up);
        self.eye.set_up(up);
    }

    /// Moves the camera to a pose.
    pub(crate) fn stand(&mut self, pose: &Pose, state: &AppState, now: f64) {
        let Some(scene) = state.scene.clone() else { return };
        self.photo = None;
        // The pivot stays ahead, at its distance.
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

    /// Leaves the photo's camera at its pose, with the scale of the frame.
    pub(super) fn leave_photo(&mut self) {
        if let Some(photo) = self.photo.take() {
            self.eye.fov_y_rad = photo.free_fov(self.eye.fov_y_rad);
        }
    }
}
