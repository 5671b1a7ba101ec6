//! Painting the true mask of a view by hand: dragging paints, a click fills the connected region of similar color.

use std::sync::Arc;

use egui::{Color32, ColorImage, PointerButton, Rect, Response, Slider, TextureHandle, TextureOptions, Ui};

use super::super::split::ViewArea;
use super::card::ToolCard;
use super::{CardPlaces, ToolScene, ViewTool};
use crate::math::grid::neighbors;
use crate::scene::{Camera, Mask};
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;

/// Largest color difference per channel between neighbors in a fill.
const SAME_COLOR: u8 = 14;

/// Color of the paint, unlikely to occur in a scene.
const PAINT: [u8; 3] = [255, 60, 200];

/// The true mask under edit.
pub(crate) struct MaskBrush {
    radius_px: f32,
    /// Camera of the painted view.
    camera: Option<Camera>,
    mask: Mask,
    changed: bool,
    texture: Option<TextureHandle>,
}

impl MaskBrush {
    /// An empty brush.
    pub(crate) fn new() -> Self {
        let mask = Mask::empty(0, 0);
        Self { radius_px: 12.0, camera: None, mask, changed: false, texture: None }
    }

    /// Starts over with the known mask if the view has changed: paint belongs to one view.
    fn on_view(&mut self, camera: &Camera, known: Option<&Mask>) {
        if self.camera.as_ref() != Some(camera) {
            let (width_px, height_px) = (camera.width_px as usize, camera.height_px as usize);
            self.mask = known.map_or_else(|| Mask::empty(width_px, height_px), |m| m.resized(width_px, height_px));
            self.camera = Some(camera.clone());
            self.changed = true;
        }
    }

    /// Paints a dab around a pixel, or erases one.
    fn dab(&mut self, at: [f32; 2], scale: f32, erase: bool) {
        let mut dab = Mask::empty(self.mask.width_px(), self.mask.height_px());
        let (w, h) = (self.mask.width_px() as i64, self.mask.height_px() as i64);
        let r = (self.radius_px * scale).max(1.0);
        let reach = r.ceil() as i64;
        let (cx, cy) = (at[0] as i64, at[1] as i64);
        for y in (cy - reach).max(0)..(cy + reach + 1).min(h) {
            for x in (cx - reach).max(0)..(cx + reach + 1).min(w) {
                if ((x - cx).pow(2) + (y - cy).pow(2)) as f32 <= r * r {
                    dab.insert((y * w + x) as usize);
                }
            }
        }
        self.take(&dab, erase);
    }

    fn take(&mut self, pixels: &Mask, erase: bool) {
        if erase {
            self.mask.subtract(pixels)
        } else {
            self.mask.add(pixels)
        }
        self.changed = true;
    }

    /// Paints or erases the connected region of similar color around a pixel.
    fn flood(&mut self, at: [usize; 2], rgb: &[[u8; 3]], erase: bool) {
        let (w, h) = (self.mask.width_px(), self.mask.height_px());
        if rgb.len() != w * h || at[0] >= w || at[1] >= h {
            return;
        }
        let first = at[1] * w + at[0];
        let alike = |a: usize, b: usize| rgb[a].iter().zip(rgb[b]).all(|(a, b)| a.abs_diff(b) <= SAME_COLOR);
        let mut seen = Mask::empty(w, h);
        let mut open = vec![first];
        while let Some(i) = open.pop() {
            // Similar to the neighbor it was reached from, and not too far from the first pixel.
            if seen.contains(i) || rgb[i].iter().zip(rgb[first]).any(|(a, b)| a.abs_diff(b) > 3 * SAME_COLOR) {
                continue;
            }
            seen.insert(i);
            open.extend(neighbors(i, w, w * h).filter(|j| alike(i, *j)));
        }
        self.take(&seen, erase);
    }

    fn true_mask_buttons(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>) {
        let ready = !self.mask.is_empty();
        if ui.add_enabled(ready, egui::Button::new("Save\u{2026}")).clicked() {
            cx.ask(Action::SaveTrueMask);
        }
        if ui.button("Clear").clicked() {
            self.camera = None;
            cx.ask(Action::TrueMask(None));
        }
        if ui.button("Done").clicked() {
            cx.ask(Action::SegmentNew(None));
        }
    }
}

impl ViewTool for MaskBrush {
    fn takes_drags(&self) -> bool {
        true
    }

    /// Paints along drags, fills at clicks; erases with Shift.
    fn pointer(&mut self, response: &Response, area: ViewArea, scene: &mut ToolScene<'_>, _cx: &mut Ctx<'_>) {
        // Only a full frame has the pixels of the maps, and a late one does not match the current view.
        let picture = scene.display.picture().filter(|picture| picture.is_full_of(scene.ticket));
        let Some(picture) = picture else { return };
        self.on_view(&picture.camera, scene.queries.truth().as_deref());
        let Some(pos) = response.interact_pointer_pos() else { return };
        let scale = picture.camera.width_px as f32 / area.shown.width();
        let at = [(pos.x - area.shown.left()) * scale, (pos.y - area.shown.top()) * scale];
        let erase = response.ctx.input(|i| i.modifiers.shift);
        if response.dragged_by(PointerButton::Primary) {
            self.dab(at, scale, erase);
        } else if response.clicked() && at.iter().all(|v| *v >= 0.0) {
            self.flood([at[0] as usize, at[1] as usize], &picture.rgb, erase);
        } else {
            return;
        }
        scene.queries.compare_with(Some((Arc::new(self.mask.clone()), scene.pose)));
    }

    /// Draws the paint over the frame; in a comparison with an answer, hits and misses are drawn instead.
    fn paint(&mut self, ui: &Ui, area: ViewArea, scene: &mut ToolScene<'_>, _cx: &mut Ctx<'_>) {
        if std::mem::take(&mut self.changed) {
            let size = [self.mask.width_px(), self.mask.height_px()];
            let pixel = |i| {
                if self.mask.contains(i) {
                    Color32::from_rgba_unmultiplied(PAINT[0], PAINT[1], PAINT[2], 140)
                } else {
                    Color32::TRANSPARENT
                }
            };
            let image = ColorImage::new(size, (0..size[0] * size[1]).map(pixel).collect());
            match &mut self.texture {
                Some(texture) => texture.set(image, TextureOptions::LINEAR),
                None => self.texture = Some(ui.ctx().load_texture("paint", image, TextureOptions::LINEAR)),
            }
        }
        let is_plain = !scene.queries.compares();
        if let Some(texture) = self.texture.as_ref().filter(|_| !self.mask.is_empty() && is_plain) {
            let uv = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
            ui.painter().image(texture.id(), area.shown, uv, Color32::WHITE);
        }
        if let Some(pos) = ui.input(|i| i.pointer.hover_pos()).filter(|p| area.shown.contains(*p)) {
            ui.painter().circle_stroke(pos, self.radius_px, egui::Stroke::new(1.0, Color32::WHITE));
        }
    }

    fn card(&mut self, ui: &Ui, places: CardPlaces, _scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>) {
        let rect = places.active_view;
        ToolCard::at_bottom("brush", "Paint the true mask of this view", rect, 200.0..=430.0).show(ui, |ui, _| {
            ui.label("Drag to paint, click to select what has the same color.");
            ui.weak("Shift erases. Right-drag and wheel move the view; the paint belongs to this one.");
            ui.horizontal(|ui| {
                ui.add(Slider::new(&mut self.radius_px, 2.0..=60.0).show_value(false).text("brush"));
                self.true_mask_buttons(ui, cx);
            });
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_click_takes_the_color_that_hangs_together() {
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 10, 10).expect("valid");
        // Red columns 4 to 7, and another one apart.
        let red = |x: usize| (4..8).contains(&x) || x == 9;
        let rgb: Vec<[u8; 3]> = (0..100).map(|i| if red(i % 10) { [200, 0, 0] } else { [0, 0, 200] }).collect();
        let mut brush = MaskBrush::new();
        brush.on_view(&camera, None);
        brush.flood([5, 5], &rgb, false);
        assert_eq!(brush.mask.area(), 40, "columns 4 to 7");
        brush.dab([1.0, 1.0], 0.1, false);
        assert!(brush.mask.contains(11) && brush.mask.area() < 50);
        // In another view the paint is cleared.
        brush.on_view(&camera.resized(12, 12), None);
        assert!(brush.mask.is_empty());
    }

    #[test]
    fn a_true_mask_is_erased_and_taken_up_again() {
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 10, 10).expect("valid");
        let rgb: Vec<[u8; 3]> = (0..100).map(|i| if i % 10 >= 4 { [200, 0, 0] } else { [0, 0, 200] }).collect();
        let mut brush = MaskBrush::new();
        brush.on_view(&camera, None);
        brush.flood([5, 5], &rgb, false);
        let before = brush.mask.area();
        brush.dab([7.0, 7.0], 0.1, true);
        assert!(before == 60 && brush.mask.area() < before);
        let known = brush.mask.clone();
        brush.on_view(&camera.resized(12, 12), None);
        assert!(brush.mask.is_empty());
        brush.on_view(&camera, Some(&known));
        assert_eq!(brush.mask, known, "back again");
        brush.flood([5, 5], &rgb, true);
        assert!(brush.mask.area() < known.area());
    }
}
