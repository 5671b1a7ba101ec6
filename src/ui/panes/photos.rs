//! Facts about the photos, and their thumbnails, loaded on demand.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use egui::{
    Button, Color32, ColorImage, Rect, RichText, ScrollArea, Sense, Stroke, TextureHandle, TextureOptions, Ui, pos2,
    vec2,
};

use super::super::ctx::Ctx;
use super::super::state::AppState;
use super::super::theme;
use super::super::viewport::Viewport;
use super::PaneContents;
use super::runs::RunsList;
use crate::math::format;
use crate::scene::{Dataset, PhotoPixels, text};
use crate::ui::actions::Action;
use crate::worker::{Task, Tasks, load_photo};

/// Longest side of a thumbnail in px.
const SIDE_PX: u32 = 224;
/// Thumbnails that load at the same time; more would delay a photo that is being looked at.
const AT_ONCE: usize = 2;
/// Thumbnails kept in memory.
const KEPT: usize = 400;
/// Height of the text under a thumbnail, points.
const CAPTION: f32 = 18.0;

/// The pane, with the thumbnails of one scene.
#[derive(Default)]
pub(crate) struct PhotosPane {
    scene: u64,
    /// State of the located photos that the last thumbnails are of.
    located: u64,
    loaded: BTreeMap<usize, TextureHandle>,
    loading: HashMap<usize, Task<PhotoPixels>>,
    failed: BTreeSet<usize>,
    /// Training runs of the photos.
    pub(crate) runs: RunsList,
}

impl PhotosPane {
    /// Takes over newly loaded thumbnails.
    pub(crate) fn update(&mut self, ctx: &egui::Context, state: &AppState) {
        if self.scene != state.scene_number {
            *self = Self { scene: state.scene_number, runs: std::mem::take(&mut self.runs), ..Self::default() };
        }
        if std::mem::replace(&mut self.located, state.located.revision) != state.located.revision {
            let own = state.own_photos();
            self.loaded.retain(|index, _| *index < own);
            self.failed.retain(|index| *index < own);
            self.loading.retain(|index, _| *index < own);
        }
        let (loaded, failed) = (&mut self.loaded, &mut self.failed);
        self.loading.retain(|&index, task| {
            match task.poll() {
                None => return true,
                Some(Ok(pixels)) => {
                    loaded.insert(index, upload(ctx, index, &pixels));
                }
                Some(Err(_)) => {
                    failed.insert(index);
                }
            }
            false
        });
    }

    fn request(&mut self, index: usize, state: &AppState, tasks: &Tasks) {
        let Some(photo) = state.photo(index).filter(|photo| photo.has_pixels()) else { return };
        let is_known =
            self.loaded.contains_key(&index) || self.failed.contains(&index) || self.loading.contains_key(&index);
        if is_known || self.loading.len() >= AT_ONCE {
            return;
        }
        // With a full queue the request is repeated at the next redraw.
        let own = state.placed(index).is_none().then_some(index);
        if let Ok(task) = load_photo(tasks, own, photo, SIDE_PX) {
            self.loading.insert(index, task);
        }
    }

    /// Forgets thumbnails far from the visible ones.
    fn forget_far(&mut self, visible: std::ops::Range<usize>) {
        while self.loaded.len() > KEPT {
            let (Some(first), Some(last)) =
                (self.loaded.keys().next().copied(), self.loaded.keys().next_back().copied())
            else {
                return;
            };
            let before = visible.start.saturating_sub(first);
            let after = last.saturating_sub(visible.end);
            self.loaded.remove(if before > after { &first } else { &last });
        }
    }

    fn cell(&self, ui: &mut Ui, size: egui::Vec2, index: usize, caption: &Caption<'_>, selected: bool) -> bool {
        let (rect, response) = ui.allocate_exact_size(size, Sense::click());
        let held = match caption.kind {
            PhotoKind::Train => "",
            PhotoKind::HeldOut => ", held-out",
            PhotoKind::Located => ", located",
        };
        response.widget_info(|| {
            egui::WidgetInfo::selected(egui::Role::Button, true, selected, format!("Photo {}{held}", caption.name))
        });
        let picture = Rect::from_min_max(rect.min, pos2(rect.right(), rect.bottom() - CAPTION));
        let painter = ui.painter();
        painter.rect_filled(picture, 5.0, theme::canvas());
        match self.loaded.get(&index) {
            Some(texture) => {
                let s = texture.size_vec2();
                let scale = (picture.width() / s.x).min(picture.height() / s.y);
                let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
                painter.image(texture.id(), Rect::from_center_size(picture.center(), s * scale), uv, Color32::WHITE);
            }
            None if self.failed.contains(&index) => {
                text(ui, picture.center(), egui::Align2::CENTER_CENTER, "unreadable", theme::warning());
            }
            None => {}
        }
        let border = match (selected, response.hovered()) {
            (true, _) => Stroke::new(2.0, theme::accent()),
            (false, true) => Stroke::new(1.0, theme::weak()),
            (false, false) => Stroke::new(1.0, theme::line()),
        };
        ui.painter().rect_stroke(picture, 5.0, border, egui::StrokeKind::Inside);
        let y = rect.bottom() - 0.5 * CAPTION;
        let file = caption.name.rsplit('/').next().unwrap_or(caption.name);
        let (color, what) = match caption.kind {
            PhotoKind::Train => (theme::weak(), "used for training"),
            PhotoKind::HeldOut => (theme::warning(), "held out for evaluation"),
            PhotoKind::Located => (theme::good(), "located in the scene, as long as it is open"),
        };
        let room = if caption.psnr.is_some() { 9 } else { 16 };
        text(ui, pos2(rect.left() + 2.0, y), egui::Align2::LEFT_CENTER, &text::elided_file(file, room), color);
        if let Some(psnr) = caption.psnr {
            text(ui, pos2(rect.right() - 2.0, y), egui::Align2::RIGHT_CENTER, &format!("{psnr:.1} dB"), theme::text());
        }
        response.on_hover_text(format!("{}\n{what}\nClick to look through its camera", caption.name)).clicked()
    }
}

impl PaneContents for PhotosPane {
    fn ui(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>, view: &mut Viewport) {
        let (state, current) = (cx.state, view.photo_index());
        let Some((scene, dataset)) = state.scene.as_ref().and_then(|s| Some((s, s.dataset.as_ref()?))) else {
            ui.weak("This scene has no photos.");
            return;
        };
        let test: BTreeSet<usize> = scene.held_out(cx.layout.config.holdout_every).into_iter().collect();
        facts(ui, dataset, dataset.photos.len() - test.len(), test.len());
        if scene.remote.as_ref().is_some_and(|origin| !origin.photos) {
            ui.weak("The photos are missing there; only their cameras are known.");
        }
        if state.is_trained() {
            let why = state.why_no_added_photos();
            let button = ui.add_enabled(why.is_none(), Button::new(Action::AddFolder.text()).small());
            let button = button.on_hover_text(Action::AddFolder.tooltip());
            if button.on_disabled_hover_text(why.unwrap_or_default()).clicked() {
                cx.ask(Action::AddFolder);
            }
        }
        self.runs.show(ui, cx);
        let scores: HashMap<&str, f64> = state
            .history
            .evaluations
            .last()
            .map(|e| e.views.iter().map(|v| (v.name.as_str(), v.psnr)).collect())
            .unwrap_or_default();
        ui.add_space(4.0);
        let columns = ((ui.available_width() / 120.0) as usize).max(2);
        let gap = 6.0;
        let width = (ui.available_width() - gap * (columns - 1) as f32 - 4.0) / columns as f32;
        let cell = vec2(width, width * 0.75 + CAPTION);
        let count = state.photo_count();
        let rows = count.div_ceil(columns);
        ui.spacing_mut().item_spacing.y = gap;
        ScrollArea::vertical().auto_shrink([false, false]).show_rows(ui, cell.y, rows, |ui, visible| {
            for row in visible.clone() {
                ui.horizontal(|ui| {
                    ui.spacing_mut().item_spacing.x = gap;
                    for index in (row * columns..(row + 1) * columns).take_while(|i| *i < count) {
                        let Some(photo) = state.photo(index) else { continue };
                        self.request(index, state, cx.tasks);
                        let kind = match state.placed(index) {
                            Some(_) => PhotoKind::Located,
                            None if test.contains(&index) => PhotoKind::HeldOut,
                            None => PhotoKind::Train,
                        };
                        let psnr = scores.get(photo.name.as_str()).copied().filter(|_| kind != PhotoKind::Located);
                        let caption = Caption { name: &photo.title(), kind, psnr };
                        if self.cell(ui, cell, index, &caption, current == Some(index)) {
                            cx.ask(Action::GoToPhoto(index));
                        }
                    }
                });
            }
            self.forget_far(visible.start * columns..visible.end * columns);
        });
    }
}

/// Use of a photo.
#[derive(Clone, Copy, PartialEq, Eq)]
enum PhotoKind {
    Train,
    HeldOut,
    Located,
}

struct Caption<'a> {
    name: &'a str,
    kind: PhotoKind,
    psnr: Option<f64>,
}

fn text(ui: &Ui, at: egui::Pos2, align: egui::Align2, text: &str, color: Color32) {
    ui.painter().text(at, align, text, egui::FontId::proportional(11.0), color);
}

fn facts(ui: &mut Ui, dataset: &Dataset, train: usize, test: usize) {
    ui.spacing_mut().item_spacing.y = 3.0;
    ui.label(RichText::new(&dataset.name).heading()).on_hover_text(text::path(&dataset.root));
    let size = dataset.photos.first().map(|p| format!("{} x {} px", p.camera.width_px, p.camera.height_px));
    let parts = [Some(dataset.format.clone()), size];
    ui.label(RichText::new(parts.into_iter().flatten().collect::<Vec<_>>().join("  ·  ")).color(theme::weak()));
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.label(RichText::new(format!("{train} train")).color(theme::text()));
        ui.weak("·");
        ui.label(RichText::new(format!("{test} held-out")).color(theme::warning()));
        if !dataset.points.is_empty() {
            ui.weak(format!("·  {} points", format::count(dataset.points.len() as u64)));
        }
    });
    for note in dataset.pixel_notes() {
        ui.weak(note);
    }
    if !dataset.warnings.is_empty() {
        let text = format!("{} warning{}", dataset.warnings.len(), if dataset.warnings.len() == 1 { "" } else { "s" });
        ui.label(RichText::new(text).color(theme::warning())).on_hover_text(text::lines(&dataset.warnings.join("\n")));
    }
}

fn upload(ctx: &egui::Context, index: usize, pixels: &PhotoPixels) -> TextureHandle {
    let size = [pixels.width_px as usize, pixels.height_px as usize];
    let colors = pixels.rgb.iter().map(|&[r, g, b]| Color32::from_rgb(r, g, b)).collect();
    ctx.load_texture(format!("thumbnail {index}"), ColorImage::new(size, colors), TextureOptions::LINEAR)
}
