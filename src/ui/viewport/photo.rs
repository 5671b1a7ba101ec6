//! Looking through a photo's camera, with the photo beside the frame.

use std::borrow::Cow;
use std::sync::Arc;

use egui::{
    Align2, Color32, ColorImage, CursorIcon, Pos2, Rect, Sense, Stroke, TextureHandle, TextureId, TextureOptions, Ui,
    pos2, vec2,
};

use super::eye::Eye;
use crate::scene::{Camera, Photo, PhotoExposure, PhotoPixels};
use crate::ui::theme;
use crate::worker::{Task, Tasks, load_photo};

/// Step of an arrow key at the split between photo and rendering, as a share of the frame.
const KEY_STEP: f32 = 0.05;

/// Longest side of the loaded photo, px.
const SIDE_PX: u32 = 1600;

/// A photo whose camera the view looks through.
pub(super) struct PhotoView {
    index: usize,
    /// Exposure beside the scene's colors, if it was located; `None` for the scene's own photos.
    located: Option<PhotoExposure>,
    photo: Photo,
    /// The job that loads the photo.
    task: Option<Task<PhotoPixels>>,
    pixels: Option<Arc<PhotoPixels>>,
    texture: Option<TextureHandle>,
    failed: bool,
    /// Height of the viewport relative to the frame in it.
    margin: f64,
    /// The eye before a mode or the comparison went to the photo, and whether the comparison was on then.
    pub(super) came_from: Option<(Eye, bool)>,
}

impl PhotoView {
    /// Looks through the photo with this index; `located` is the exposure of one that is none of the scene's own.
    pub(super) fn new(index: usize, photo: &Photo, located: Option<PhotoExposure>, tasks: &Tasks) -> Self {
        // With a full queue there is no photo to compare with until the next visit.
        let own = located.is_none().then_some(index);
        let task = if photo.has_pixels() { load_photo(tasks, own, photo, SIDE_PX).ok() } else { None };
        let failed = task.is_none();
        let photo = photo.clone();
        Self { index, located, photo, task, pixels: None, texture: None, failed, margin: 1.0, came_from: None }
    }

    pub(super) fn index(&self) -> usize {
        self.index
    }

    pub(super) fn is_located(&self) -> bool {
        self.located.is_some()
    }

    /// Exposure beside the scene's colors: the usual one for the scene's own photos.
    pub(super) fn exposure(&self) -> PhotoExposure {
        self.located.unwrap_or_default()
    }

    pub(super) fn name(&self) -> Cow<'_, str> {
        self.photo.title()
    }

    pub(super) fn camera(&self) -> &Camera {
        &self.photo.camera
    }

    pub(super) fn pixels(&self) -> Option<Arc<PhotoPixels>> {
        self.pixels.clone()
    }

    pub(super) fn failed(&self) -> bool {
        self.failed
    }

    /// Takes over the photo once it is loaded.
    pub(super) fn update(&mut self) {
        match Task::take(&mut self.task) {
            Some(Ok(pixels)) => self.pixels = Some(Arc::new(pixels)),
            Some(Err(_)) => self.failed = true,
            None => {}
        }
    }

    /// The largest rectangle with the photo's aspect ratio in `rect`.
    pub(super) fn fit(&mut self, rect: Rect) -> Rect {
        let (w, h) = (self.photo.camera.width_px as f32, self.photo.camera.height_px as f32);
        let scale = (rect.width() / w).min(rect.height() / h);
        self.margin = f64::from(rect.height() / (h * scale).max(1.0));
        Rect::from_center_size(rect.center(), vec2(w * scale, h * scale))
    }

    /// The field of view of the whole viewport at the scale of the photo's frame.
    pub(super) fn free_fov(&self, fov_y_rad: f64) -> f64 {
        (2.0 * ((0.5 * fov_y_rad).tan() * self.margin).atan()).clamp(0.1, 2.2)
    }

    /// The photo as a texture, once it is loaded.
    fn texture(&mut self, ui: &Ui) -> Option<TextureId> {
        let pixels = self.pixels.as_ref()?;
        let texture = self.texture.get_or_insert_with(|| {
            let size = [pixels.width_px as usize, pixels.height_px as usize];
            let colors = pixels.rgb.iter().map(|&[r, g, b]| Color32::from_rgb(r, g, b)).collect();
            ui.ctx().load_texture("photo", ColorImage::new(size, colors), TextureOptions::LINEAR)
        });
        Some(texture.id())
    }

    /// Draws the photo in place of a rendering, which there is not yet.
    pub(super) fn show_alone(&mut self, ui: &mut Ui, shown: Rect) {
        let texture = self.texture(ui);
        let text = match texture {
            Some(_) => "Photo: there are no Gaussians yet",
            None if self.failed => "The photo is not loaded, and there are no Gaussians yet",
            None => "Loading the photo\u{2026}",
        };
        if let Some(texture) = texture {
            let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            ui.painter().image(texture, shown, uv, Color32::WHITE);
        }
        caption(ui, shown.center_bottom() - vec2(0.0, 12.0), text, Align2::CENTER_BOTTOM);
        let rect = Rect::from_center_size(shown.center_bottom(), vec2(1.0, 1.0));
        ui.interact(rect, ui.scope_id().with("photo alone"), Sense::empty())
            .widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, text));
    }

    /// Draws the photo right of the split.
    pub(super) fn paint_right(&mut self, ui: &Ui, shown: Rect, split: f32) {
        let Some(texture) = self.texture(ui) else { return };
        let right = Rect::from_min_max(pos2(shown.left() + shown.width() * split, shown.top()), shown.max);
        let uv = Rect::from_min_max(pos2(split, 0.0), pos2(1.0, 1.0));
        ui.painter().image(texture, right, uv, Color32::WHITE);
    }

    /// Draws the handle of the split, once the photo is loaded; `left` names what is on the left.
    pub(super) fn show_split(&self, ui: &mut Ui, shown: Rect, left: &str, split: &mut f32) {
        if self.texture.is_none() {
            return;
        }
        let x = shown.left() + shown.width() * *split;
        let grip = Rect::from_center_size(pos2(x, shown.center().y), vec2(16.0, shown.height()));
        let response =
            ui.interact(grip, ui.scope_id().with("split"), Sense::drag()).on_hover_cursor(CursorIcon::ResizeHorizontal);
        if let Some(pos) = response.interact_pointer_pos().filter(|_| response.dragged()) {
            *split = (pos.x - shown.left()) / shown.width().max(1.0);
        }
        response.widget_info(|| egui::WidgetInfo::slider(true, f64::from(*split), "Compare with the photo"));
        if response.has_focus() {
            let sideways = egui::EventFilter { horizontal_arrows: true, ..Default::default() };
            ui.memory_mut(|m| m.set_focus_lock_filter(response.id, sideways));
            let steps = |key| ui.input(|i| i.num_presses(key)) as f32;
            *split += KEY_STEP * (steps(egui::Key::ArrowRight) - steps(egui::Key::ArrowLeft));
        }
        *split = split.clamp(0.02, 0.98);
        let color = if response.hovered() || response.dragged() || response.has_focus() {
            theme::accent()
        } else {
            Color32::from_white_alpha(220)
        };
        ui.painter().vline(x, shown.y_range(), Stroke::new(1.5, color));
        ui.painter().circle(pos2(x, shown.center().y), 9.0, theme::panel(), Stroke::new(1.5, color));
        for (side, text, align) in [(-1.0, left, Align2::RIGHT_BOTTOM), (1.0, "Photo", Align2::LEFT_BOTTOM)] {
            caption(ui, pos2(x + side * 10.0, shown.bottom() - 12.0), text, align);
        }
    }
}

/// Draws words over a picture.
fn caption(ui: &Ui, at: Pos2, text: &str, align: Align2) {
    let font = egui::FontId::proportional(12.5);
    ui.painter().text(at + vec2(1.0, 1.0), align, text, font.clone(), Color32::BLACK);
    ui.painter().text(at, align, text, font, Color32::WHITE);
}
