//! Mouse and keys in the viewport.

use egui::{Key, PointerButton, Rect, Response, Ui};
use glam::{DVec2, DVec3};

use super::super::keys;
use super::Viewport;
use crate::jobs::OpenedScene;

/// Radians of orbit per point of mouse travel.
const ORBIT_RAD: f64 = 0.006;
/// Scene radii flown per second.
const FLY_RADII: f64 = 0.8;
/// Factor of the distance per point of scrolling; a notch of the wheel is about 50 points.
const ZOOM_PER_POINT: f64 = 0.9976;

impl Viewport {
    /// Moves the camera. Returns whether it moved.
    pub(super) fn handle_input(&mut self, ui: &Ui, response: &Response, rect: Rect, scene: &OpenedScene) -> bool {
        let shown = self.photo.as_mut().map_or(rect, |p| p.fit(rect));
        let by_drag = self.drag(response, rect);
        let by_wheel = self.wheel(ui, response, shown);
        let by_keys = self.fly(ui, scene);
        if response.double_clicked_by(PointerButton::Primary)
            && let Some(pos) = response.interact_pointer_pos()
        {
            self.eye.pivot = self.point_at(pos, shown);
        }
        by_drag || by_wheel || by_keys
    }

    fn drag(&mut self, response: &Response, rect: Rect) -> bool {
        let delta = response.drag_delta();
        if delta == egui::Vec2::ZERO {
            return false;
        }
        let delta = DVec2::new(f64::from(delta.x), f64::from(delta.y));
        if response.dragged_by(PointerButton::Primary) {
            // Painting and selecting use this gesture.
            if self.has_brush() {
                return false;
            }
            self.eye.orbit(-delta.x * ORBIT_RAD, -delta.y * ORBIT_RAD);
        } else {
            self.eye.pan(delta, f64::from(rect.height()));
        }
        true
    }

    fn wheel(&mut self, ui: &Ui, response: &Response, shown: Rect) -> bool {
        let (scroll, cursor) = ui.input(|i| (i.smooth_scroll_delta().y, i.pointer.hover_pos()));
        let Some(cursor) = cursor.filter(|_| scroll != 0.0 && response.hovered()) else { return false };
        // One gesture zooms to one point, even if depth is redrawn meanwhile.
        let target = match self.zoom_anchor {
            Some((at, point)) if at.distance(cursor) < 3.0 && self.point_is_ahead(point) => point,
            _ => self.point_at(cursor, shown),
        };
        self.zoom_anchor = Some((cursor, target));
        self.eye.zoom(target, ZOOM_PER_POINT.powf(f64::from(scroll)));
        true
    }

    fn point_is_ahead(&self, point: DVec3) -> bool {
        (point - self.eye.center).dot(self.eye.forward()) > 0.0
    }

    fn fly(&mut self, ui: &Ui, scene: &OpenedScene) -> bool {
        let has_menu = egui::Popup::is_any_open(ui.ctx());
        let is_taken = keys::is_typing(ui.ctx()) || has_menu || ui.memory(|m| m.top_modal_layer().is_some());
        if is_taken || !ui.is_enabled() {
            // The held keys were pressed for something else.
            self.flying.clear();
            return false;
        }
        ui.input(|i| keys::follow_held(&mut self.flying, i));
        let (direction, speed, dt) = ui.input(|i| {
            let held = |k| if self.flying.contains(&k) { 1.0 } else { 0.0 };
            let free = if i.modifiers.command || i.modifiers.ctrl { 0.0 } else { 1.0 };
            let direction =
                DVec3::new(held(Key::D) - held(Key::A), held(Key::E) - held(Key::Q), held(Key::W) - held(Key::S));
            let speed = match (i.modifiers.shift, i.modifiers.alt) {
                (true, false) => 4.0,
                (false, true) => 0.25,
                _ => 1.0,
            };
            (direction * free, speed, f64::from(i.stable_dt.min(0.1)))
        });
        let Some(direction) = direction.try_normalize() else { return false };
        self.eye.fly(direction * (scene.home.bounds.radius() * FLY_RADII * speed * dt));
        ui.ctx().request_repaint();
        true
    }

    /// The world point under a window position: at the rendered depth, else at the pivot's.
    pub(super) fn point_at(&self, pos: egui::Pos2, shown: Rect) -> DVec3 {
        let at = DVec2::new(
            f64::from((pos.x - shown.left()) / shown.width().max(1.0)),
            f64::from((pos.y - shown.top()) / shown.height().max(1.0)),
        );
        let aspect = f64::from(shown.height() / shown.width().max(1.0));
        self.display.picked(at, &self.eye).unwrap_or_else(|| self.eye.point_at_pivot_depth(at, aspect))
    }
}
