//! Marking a new piece by hand: dragging paints, a click takes what has the same color around it.

use egui::{Align2, Area, Color32, ColorImage, Id, Order, Rect, Slider, TextEdit, TextureHandle, TextureOptions, Ui};

use super::super::state::AppState;
use super::super::theme;
use super::Viewport;
use crate::jobs::edit::EditRequest;
use crate::math::grid::neighbors;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::scene::{Camera, Identities, IdentityId, Mask, NOBODY};
use crate::ui::actions::Action;

/// Largest difference of color, per channel, over which a click spreads.
const SAME_COLOR: u8 = 14;

/// Color of the paint: nothing in a scene is likely to have it.
const PAINT: [u8; 3] = [255, 60, 200];

/// What is being marked.
pub(crate) struct Brush {
    /// Whose piece it will be; of no one, an object.
    pub(crate) of: IdentityId,
    name: String,
    radius_px: f32,
    /// The view that is painted on.
    camera: Option<Camera>,
    mask: Mask,
    changed: bool,
    texture: Option<TextureHandle>,
}

impl Brush {
    /// An empty brush for a piece of `of`.
    pub(crate) fn new(of: IdentityId) -> Self {
        let mask = Mask::empty(0, 0);
        Self { of, name: String::new(), radius_px: 12.0, camera: None, mask, changed: false, texture: None }
    }

    /// Starts over if the view has changed: paint lies on one view.
    pub(crate) fn on_view(&mut self, camera: &Camera) {
        if self.camera.as_ref() != Some(camera) {
            self.mask = Mask::empty(camera.width_px as usize, camera.height_px as usize);
            self.camera = Some(camera.clone());
            self.changed = true;
        }
    }

    /// Paints a dab around a pixel.
    pub(crate) fn dab(&mut self, at: [f32; 2], scale: f32) {
        let (w, h) = (self.mask.width_px() as i64, self.mask.height_px() as i64);
        let r = (self.radius_px * scale).max(1.0);
        let reach = r.ceil() as i64;
        let (cx, cy) = (at[0] as i64, at[1] as i64);
        for y in (cy - reach).max(0)..(cy + reach + 1).min(h) {
            for x in (cx - reach).max(0)..(cx + reach + 1).min(w) {
                if ((x - cx).pow(2) + (y - cy).pow(2)) as f32 <= r * r {
                    self.mask.insert((y * w + x) as usize);
                }
            }
        }
        self.changed = true;
    }

    /// Marks what hangs together with a pixel in color and belongs to the same whole.
    pub(crate) fn flood(&mut self, at: [usize; 2], rgb: &[[u8; 3]], map: &ViewMap, identities: &Identities) {
        let (w, h) = (self.mask.width_px(), self.mask.height_px());
        if rgb.len() != w * h || map.identity.len() != w * h || at[0] >= w || at[1] >= h {
            return;
        }
        let inside = identities.descendants(self.of);
        let mine = |i: usize| {
            let id = map.identity[i];
            if self.of == NOBODY { id == NOBODY } else { inside.get(id as usize) == Some(&true) }
        };
        let first = at[1] * w + at[0];
        let alike = |a: usize, b: usize| rgb[a].iter().zip(rgb[b]).all(|(a, b)| a.abs_diff(b) <= SAME_COLOR);
        let mut seen = Mask::empty(w, h);
        let mut open = vec![first];
        while let Some(i) = open.pop() {
            // Alike the neighbor it was reached from, and not too far from where it began.
            if seen.contains(i)
                || !mine(i)
                || rgb[i].iter().zip(rgb[first]).any(|(a, b)| a.abs_diff(b) > 3 * SAME_COLOR)
            {
                continue;
            }
            seen.insert(i);
            open.extend(neighbors(i, w, w * h).filter(|j| alike(i, *j)));
        }
        self.mask.add(&seen);
        self.changed = true;
    }

    /// The paint, over the frame in `rect`.
    pub(crate) fn paint(&mut self, ui: &Ui, rect: Rect) {
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
        if let Some(texture) = self.texture.as_ref().filter(|_| !self.mask.is_empty()) {
            let uv = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
            ui.painter().image(texture.id(), rect, uv, Color32::WHITE);
        }
        if let Some(pos) = ui.input(|i| i.pointer.hover_pos()).filter(|p| rect.contains(*p)) {
            ui.painter().circle_stroke(pos, self.radius_px, egui::Stroke::new(1.0, Color32::WHITE));
        }
    }

    pub(crate) fn show(&mut self, ui: &Ui, rect: Rect, identities: &Identities, actions: &mut Vec<Action>) {
        let at = Align2::CENTER_BOTTOM.pos_in_rect(&rect.shrink(44.0));
        let area = Area::new(Id::unique("brush")).order(Order::Foreground).pivot(Align2::CENTER_BOTTOM).fixed_pos(at);
        area.show(ui.ctx(), |ui| {
            theme::overlay().show(ui, |ui| {
                ui.set_width(430.0);
                let what = match self.of {
                    NOBODY => "a new object".to_owned(),
                    of => format!("a new part of the {}", identities.full_name(of)),
                };
                ui.label(format!("Paint {what}: drag to paint, click to select what has the same color."));
                ui.weak("Right-drag and wheel move the view, which clears the paint.");
                ui.horizontal(|ui| {
                    ui.add(TextEdit::singleline(&mut self.name).hint_text("Name").char_limit(80).desired_width(120.0));
                    ui.add(Slider::new(&mut self.radius_px, 2.0..=60.0).show_value(false).text("brush"));
                });
                ui.horizontal(|ui| {
                    let ready = !self.mask.is_empty();
                    if ui.add_enabled(ready, theme::primary_button("Add")).clicked() {
                        actions.push(Action::AddPainted);
                    }
                    if ui.button("Clear").clicked() {
                        self.camera = None;
                    }
                    if ui.button("Cancel").clicked() {
                        actions.push(Action::Paint(None));
                    }
                });
            });
        });
    }

    /// The edit that adds what is marked; `None` if nothing is.
    pub(crate) fn request(&self) -> Option<EditRequest> {
        let camera = self.camera.clone().filter(|_| !self.mask.is_empty())?;
        let (of, name, mask) = (self.of, self.name.trim().to_owned(), self.mask.clone());
        Some(EditRequest::Paint { of, name, camera: Box::new(camera), mask })
    }
}

impl Viewport {
    /// Paints where the pointer drags, floods where it clicks.
    pub(super) fn use_brush(&mut self, response: &egui::Response, rect: Rect, state: &AppState) {
        let (Some(brush), Some(picture)) = (&mut self.brush, self.display.picture()) else { return };
        let shown = self.photo.as_mut().map_or(rect, |p| p.fit(rect));
        // Only a full frame has the pixels that the maps have.
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
            && let (Some(maps), Some(semantics)) = (self.queries.maps(), &state.semantics)
            && at.iter().all(|v| *v >= 0.0)
        {
            brush.flood([at[0] as usize, at[1] as usize], &picture.rgb, &maps.identities, &semantics.identities);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Level;
    use glam::DVec3;

    #[test]
    fn a_click_takes_the_color_and_only_of_the_whole() {
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 10, 10).expect("valid");
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NOBODY, vec![]);
        let identity = (0..100).map(|i| if i % 10 < 8 { doll } else { NOBODY }).collect();
        let map = ViewMap::certain(10, identity);
        let rgb: Vec<[u8; 3]> = (0..100).map(|i| if i % 10 >= 4 { [200, 0, 0] } else { [0, 0, 200] }).collect();
        let mut brush = Brush::new(doll);
        brush.on_view(&camera);
        assert!(brush.request().is_none());
        brush.flood([5, 5], &rgb, &map, &all);
        assert_eq!(brush.mask.area(), 40, "columns 4 to 7");
        brush.dab([1.0, 1.0], 0.1);
        assert!(brush.mask.contains(11) && brush.mask.area() < 50);
        assert!(matches!(brush.request(), Some(EditRequest::Paint { of, .. }) if of == doll));
        // Another view: the paint is gone.
        brush.on_view(&camera.resized(12, 12));
        assert!(brush.mask.is_empty());
    }
}
