//! Thumbnails of objects and parts as one texture, requested when objects or parts change.

use std::cell::Cell;
use std::sync::Arc;

use egui::{ColorImage, Rect, TextureHandle, TextureOptions, Ui, pos2, vec2};

use super::super::labels::ScreenNames;
use super::super::state::AppState;
use crate::jobs::thumbnails::{self, ThumbnailSet};
use crate::pipeline::semantics::thumbnails::SIDE_PX;
use crate::scene::{GaussianCloud, IdentityId, SemanticMap};
use crate::worker::{JobInfo, Task, Tasks};

/// Thumbnails in a row of the texture.
const COLUMNS: usize = 16;

/// Thumbnails of the identities on screen.
#[derive(Default)]
pub(crate) struct ObjectThumbnails {
    /// Number of the scene that they are of.
    scene: u64,
    /// True if any thumbnail was drawn since the last update.
    used: Cell<bool>,
    /// Map of the latest request, and its task until the result is taken.
    asked: Option<(Arc<SemanticMap>, Option<Task<ThumbnailSet>>)>,
    /// Map of the thumbnails in the texture, the texture, and its number of rows.
    shown: Option<(Arc<SemanticMap>, TextureHandle, usize)>,
}

impl ObjectThumbnails {
    /// Requests thumbnails if objects or parts have changed, and takes them over once they are drawn.
    pub(crate) fn update(
        &mut self,
        ctx: &egui::Context,
        state: &mut AppState,
        cloud: Option<&Arc<GaussianCloud>>,
        tasks: &Tasks,
    ) {
        if self.scene != state.scene_number {
            *self = Self { scene: state.scene_number, ..Self::default() };
        }
        let (Some(map), Some(cloud), Some(scene)) = (&state.semantics, cloud, &state.scene) else {
            *self = Self { scene: self.scene, ..Self::default() };
            return;
        };
        let wanted = self.used.take();
        if wanted
            && self.asked.as_ref().is_none_or(|(of, _)| !Arc::ptr_eq(of, map))
            && map.identity_of.len() == cloud.len()
        {
            let of: Arc<SemanticMap> = Arc::clone(map);
            let (map, cloud) = (Arc::clone(&of), Arc::clone(cloud));
            let (settings, home) = (state.render_settings(), scene.home.clone());
            let task = tasks.spawn(JobInfo::short("Rendering thumbnails"), move |_| {
                thumbnails::draw(&cloud, &map, &settings, &home)
            });
            // With a full queue the request is repeated at the next event.
            self.asked = task.ok().map(|task| (of, Some(task))).or(self.asked.take());
        }
        if let Some((of, drawing)) = &mut self.asked
            && let Some(Ok(drawn)) = Task::take(drawing)
        {
            let unit = state.scene.as_ref().and_then(|s| s.meters_per_unit());
            state.labels = ScreenNames::new(&drawn.appearances, unit);
            let pictures = drawn.pictures;
            let rows = pictures.len().div_ceil(COLUMNS).max(1);
            let texture = ctx.load_texture("object_thumbnails", atlas(&pictures, rows), TextureOptions::LINEAR);
            self.shown = Some((Arc::clone(of), texture, rows));
        }
    }

    /// Draws the thumbnail of an identity, `side` points wide; an empty place if there is none.
    pub(crate) fn show(&self, ui: &mut Ui, id: IdentityId, side: f32) {
        self.used.set(true);
        let (rect, _) = ui.allocate_exact_size(vec2(side, side), egui::Sense::hover());
        let Some((of, texture, rows)) = &self.shown else { return };
        if of.identities.get(id).is_none() {
            return;
        }
        let at = id as usize - 1;
        let (w, h) = (1.0 / COLUMNS as f32, 1.0 / *rows as f32);
        let uv = Rect::from_min_size(pos2((at % COLUMNS) as f32 * w, (at / COLUMNS) as f32 * h), vec2(w, h));
        ui.painter().image(texture.id(), rect, uv, egui::Color32::WHITE);
    }
}

fn atlas(pictures: &[Option<Vec<[u8; 3]>>], rows: usize) -> ColorImage {
    let (width, height) = (COLUMNS * SIDE_PX, rows * SIDE_PX);
    let mut pixels = vec![egui::Color32::TRANSPARENT; width * height];
    for (at, picture) in pictures.iter().enumerate() {
        let Some(picture) = picture else { continue };
        let (left, top) = (at % COLUMNS * SIDE_PX, at / COLUMNS * SIDE_PX);
        for (y, row) in picture.chunks_exact(SIDE_PX).enumerate() {
            let to = (top + y) * width + left;
            pixels[to..to + SIDE_PX]
                .iter_mut()
                .zip(row)
                .for_each(|(p, c)| *p = egui::Color32::from_rgb(c[0], c[1], c[2]));
        }
    }
    ColorImage::new([width, height], pixels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_thumbnail_has_its_place() {
        let of = |v: u8| Some(vec![[v; 3]; SIDE_PX * SIDE_PX]);
        let mut pictures = vec![None; 18];
        (pictures[0], pictures[17]) = (of(10), of(20));
        let image = atlas(&pictures, 2);
        let at = |x: usize, y: usize| image.pixels[y * COLUMNS * SIDE_PX + x];
        assert_eq!(
            (at(0, 0), at(SIDE_PX - 1, SIDE_PX - 1)),
            (egui::Color32::from_gray(10), egui::Color32::from_gray(10))
        );
        assert_eq!((at(SIDE_PX, SIDE_PX), at(SIDE_PX, 0)), (egui::Color32::from_gray(20), egui::Color32::TRANSPARENT));
    }
}
