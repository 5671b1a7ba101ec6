//! What the actions about the view do.

use super::brush::Brush;
use super::eye::Eye;
use super::photo::PhotoView;
use super::{AppState, OpenedScene, Viewport};
use crate::ui::actions::Action;
use crate::worker::Worker;

impl Viewport {
    /// Does what a user asked of the view.
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
            Action::Paint(of) => self.brush = of.filter(|_| state.semantics.is_some()).map(Brush::new),
            Action::Select(id) => return self.picking.select(*id),
            Action::Isolate(only) => return all.map_or((), |all| self.visibility.isolate(all, *only)),
            Action::Hide(id) => return all.map_or((), |all| self.visibility.toggle(all, *id)),
            Action::ResetView => {
                self.photo = None;
                self.eye = Eye::home(&scene.home, self.up);
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

    fn look_through(&mut self, index: usize, scene: &OpenedScene, worker: &Worker) {
        let Some(photo) = scene.dataset.as_ref().and_then(|d| d.photos.get(index)) else { return };
        let c = &photo.camera;
        let ahead = (scene.home.bounds.center() - c.center).dot(c.forward());
        let pivot = c.center + c.forward() * ahead.max(0.1 * scene.home.bounds.radius());
        self.eye = Eye::of_camera(c, pivot, self.up.unwrap_or(scene.home.up));
        self.photo = Some(PhotoView::new(index, photo, worker));
    }
}
