//! Mouse and keys that move the camera.

use std::collections::BTreeSet;

use egui::{Key, PointerButton, Pos2, Response, Ui};
use glam::{DVec2, DVec3};

use super::display::Display;
use super::eye::Eye;
use super::split::ViewArea;
use crate::ui::keys;

/// Radians of orbit per point of mouse travel.
const ORBIT_RAD: f64 = 0.006;
/// Scene radii flown per second.
const FLY_RADII: f64 = 0.8;
/// Factor of the distance per point of scrolling; a notch of the wheel is about 50 points.
const ZOOM_PER_POINT: f64 = 0.9976;

/// Motion of the camera by mouse and keys.
#[derive(Default)]
pub(super) struct Steering {
    /// Held keys that move the camera.
    flying: BTreeSet<Key>,
    /// Cursor position, and the world point that the wheel zooms to while the cursor stays.
    zoom_anchor: Option<(Pos2, DVec3)>,
}

/// Content of the view, for moving in it.
pub(super) struct SteeredView<'a> {
    pub(super) display: &'a Display,
    /// The view under the pointer.
    pub(super) area: ViewArea,
    /// Radius of the scene.
    pub(super) radius: f64,
    /// True if a tool takes drags with the primary button.
    pub(super) tool_takes_drags: bool,
}

impl Steering {
    /// Moves the camera. Returns true if it moved.
    pub(super) fn steer(&mut self, ui: &Ui, response: &Response, eye: &mut Eye, view: &SteeredView<'_>) -> bool {
        let by_drag = view.drag(response, eye);
        let by_wheel = self.wheel(ui, response, eye, view);
        let by_keys = self.fly(ui, eye, view.radius);
        if response.double_clicked_by(PointerButton::Primary)
            && let Some(pos) = response.interact_pointer_pos()
        {
            eye.pivot = view.point_at(pos, eye);
        }
        by_drag || by_wheel || by_keys
    }

    fn wheel(&mut self, ui: &Ui, response: &Response, eye: &mut Eye, view: &SteeredView<'_>) -> bool {
        let (scroll, cursor) = ui.input(|i| (i.smooth_scroll_delta().y, i.pointer.hover_pos()));
        let Some(cursor) = cursor.filter(|_| scroll != 0.0 && response.hovered()) else { return false };
        // One gesture zooms to one point, even if depth is redrawn meanwhile.
        let target = match self.zoom_anchor {
            Some((at, point)) if at.distance(cursor) < 3.0 && eye.has_ahead(point) => point,
            _ => view.point_at(cursor, eye),
        };
        self.zoom_anchor = Some((cursor, target));
        eye.zoom(target, ZOOM_PER_POINT.powf(f64::from(scroll)));
        true
    }

    fn fly(&mut self, ui: &Ui, eye: &mut Eye, radius: f64) -> bool {
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
        eye.fly(direction * (radius * FLY_RADII * speed * dt));
        ui.ctx().request_repaint();
        true
    }
}

impl SteeredView<'_> {
    /// Orbits or pans along a drag.
    fn drag(&self, response: &Response, eye: &mut Eye) -> bool {
        let delta = response.drag_delta();
        if delta == egui::Vec2::ZERO {
            return false;
        }
        let delta = DVec2::new(f64::from(delta.x), f64::from(delta.y));
        if response.dragged_by(PointerButton::Primary) {
            // Painting and selecting use this gesture.
            if self.tool_takes_drags {
                return false;
            }
            eye.orbit(-delta.x * ORBIT_RAD, -delta.y * ORBIT_RAD);
        } else {
            eye.pan(delta, f64::from(self.area.rect.height()));
        }
        true
    }

    /// The world point under a window position: at the rendered depth, else at the pivot's.
    fn point_at(&self, pos: Pos2, eye: &Eye) -> DVec3 {
        let shown = self.area.shown;
        let at = DVec2::new(
            f64::from((pos.x - shown.left()) / shown.width().max(1.0)),
            f64::from((pos.y - shown.top()) / shown.height().max(1.0)),
        );
        let aspect = f64::from(shown.height() / shown.width().max(1.0));
        self.display.picked(at, eye).unwrap_or_else(|| eye.point_at_pivot_depth(at, aspect))
    }
}
