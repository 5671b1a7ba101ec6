//! Training runs of the photos, as a list in their pane.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::SystemTime;

use egui::{
    Align, Button, ColorImage, Id, Image, Label, Layout, Rect, RichText, ScrollArea, Sense, Stroke, StrokeKind,
    TextureHandle, TextureOptions, Ui, UiBuilder, pos2, vec2,
};

use super::super::ctx::Ctx;
use super::super::state::AppState;
use super::super::text_field::{NameField, TypedName};
use super::super::theme;
use crate::jobs::recent;
use crate::jobs::runs::{self, RunSummary};
use crate::jobs::workspace::Workspace;
use crate::math::format;
use crate::pipeline::observer::Observer;
use crate::scene::{PhotoPixels, text};
use crate::ui::actions::Action;
use crate::worker::{JobInfo, Stop, Task, Tasks};

/// Height of a row, and size of its picture, points.
const ROW_PT: f32 = 62.0;
const PICTURE_PT: [f32; 2] = [62.0, 46.0];
/// Height of the list, points: the last row that is cut off says that there are more.
const LIST_PT: f32 = 3.6 * ROW_PT;

/// Runs with their pictures.
type Listed = (Vec<RunSummary>, Vec<(PathBuf, PhotoPixels)>);

/// State of the window that the list was made for: the scene, its folder, its objects, whether a job runs, and whether
/// its training has done a step.
type ListedFor = (u64, PathBuf, Option<u64>, bool, bool);

/// The list of the open photos' training runs.
#[derive(Default)]
pub(crate) struct RunsList {
    listed_for: Option<ListedFor>,
    listing: Option<Task<Listed>>,
    pictures: BTreeMap<PathBuf, TextureHandle>,
    renaming: Option<NameField<PathBuf>>,
}

impl RunsList {
    /// Lists the runs anew.
    pub(crate) fn refresh(&mut self) {
        self.listed_for = None;
    }

    /// Lists the runs of the open photos after each change, in the background.
    pub(crate) fn update(
        &mut self,
        ctx: &egui::Context,
        state: &mut AppState,
        tasks: &Tasks,
        workspace: &Arc<Workspace>,
    ) {
        let Some(scene) = state.scene.as_ref().filter(|s| s.remote.is_none()) else { return };
        let Some(source) = scene.dataset.as_ref().map(|d| d.source().to_path_buf()) else { return };
        let objects = state.semantics.as_ref().map(|map| map.generation());
        let trains = state.is_training() && !state.history.steps.is_empty();
        let now = (state.scene_number, scene.out.clone(), objects, state.job.is_some(), trains);
        if self.listed_for.as_ref() != Some(&now) {
            self.listed_for = Some(now);
            let workspace = Arc::clone(workspace);
            let list = move |_: &mut dyn Observer| {
                let runs = runs::list(workspace.folders(), &source);
                let pictures = recent::load(workspace.folders(), runs.iter().map(|run| run.folder.clone()).collect());
                Ok::<_, Stop>((runs, pictures))
            };
            // With a full queue the list stays as it is until the next change.
            self.listing = tasks.spawn(JobInfo::short("Listing trainings"), list).ok();
        }
        if let Some(Ok((runs, pictures))) = Task::take(&mut self.listing) {
            let texture = |(path, p): (PathBuf, PhotoPixels)| {
                let image = ColorImage::from_rgb([p.width_px, p.height_px].map(|s| s as usize), p.rgb.as_flattened());
                let texture = ctx.load_texture(path.to_string_lossy(), image, TextureOptions::LINEAR);
                (path, texture)
            };
            self.pictures = pictures.into_iter().map(texture).collect();
            if let Some(scene) = &mut state.scene {
                Arc::make_mut(scene).runs = runs;
            }
        }
    }

    /// Draws the list, if there is anything in it.
    pub(crate) fn show(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>) {
        let state = cx.state;
        let Some(scene) = state.scene.as_ref().filter(|s| !s.runs.is_empty()) else { return };
        theme::section(ui, "Trainings");
        let height = (scene.runs.len() as f32 * (ROW_PT + ui.spacing().item_spacing.y)).min(LIST_PT);
        let list = ScrollArea::vertical().id_salt("trainings").max_height(height).auto_shrink([false, true]);
        list.show(ui, |ui| {
            // What is on screen is that of a new training once there is one.
            let held = |run: &&RunSummary| run.holder.as_ref().is_some_and(|holder| holder.is_own);
            let anew = state.trains_anew().then(|| scene.runs.iter().rfind(held)).flatten();
            let open = anew.map_or(&scene.out, |run| &run.folder);
            for run in &scene.runs {
                self.row(ui, run, run.folder == *open, cx);
            }
        });
    }

    /// Draws a row: picture on the left, name and facts, menu on the right.
    fn row(&mut self, ui: &mut Ui, run: &RunSummary, is_open: bool, cx: &mut Ctx<'_>) {
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW_PT), Sense::click());
        response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, is_open, run.text()));
        if is_open || response.hovered() || response.has_focus() {
            ui.painter().rect_filled(rect, 6.0, theme::surface());
        }
        if is_open {
            ui.painter().rect_stroke(rect, 6.0, Stroke::new(1.0, theme::accent()), StrokeKind::Inside);
        }
        let at = rect.left_top() + vec2(6.0, 0.5 * (ROW_PT - PICTURE_PT[1]));
        let picture = Rect::from_min_size(at, PICTURE_PT.into());
        ui.painter().rect_filled(picture, 4.0, theme::canvas());
        if let Some(texture) = self.pictures.get(&run.folder) {
            let uv = theme::filling(texture.size_vec2(), picture.size());
            Image::new(texture).uv(uv).corner_radius(4).paint_at(ui, picture);
        }
        let room = Rect::from_min_max(pos2(picture.right() + 8.0, rect.top() + 5.0), rect.max - vec2(6.0, 4.0));
        let mut text = ui.new_child(UiBuilder::new().max_rect(room).layout(Layout::top_down(Align::Min)));
        text.spacing_mut().item_spacing.y = 1.0;
        text.spacing_mut().interact_size.y = 16.0;
        self.texts(&mut text, run, is_open, cx);
        let response = response.on_hover_cursor(egui::CursorIcon::PointingHand);
        if response.on_hover_text(format!("{}\n{}", run.text(), text::path(&run.folder))).clicked() && !is_open {
            cx.ask(Action::Open(run.folder.clone()));
        }
    }

    fn texts(&mut self, ui: &mut Ui, run: &RunSummary, is_open: bool, cx: &mut Ctx<'_>) {
        let weak =
            |text: String| Label::new(RichText::new(text).small().color(theme::weak())).selectable(false).truncate();
        let holder = run.holder.as_ref();
        let first = |ui: &mut Ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.spacing_mut().button_padding = vec2(6.0, 1.0);
            let menu = ui.menu_button("\u{2026}", |ui| self.menu(ui, run, is_open, cx));
            menu.response.on_hover_text(format!("Actions on {}", run.name));
            if self.renaming.as_ref().is_some_and(|renaming| renaming.of == run.folder) {
                return self.name_field(ui, cx);
            }
            match (holder, run.changed) {
                (Some(holder), _) => {
                    let what = if holder.what.is_empty() { "in use" } else { &holder.what };
                    let label = ui.add(weak(what.into()));
                    if !holder.is_own {
                        label.on_hover_text("Another program writes to it.");
                    }
                }
                (None, Some(time)) => {
                    let ago = ui.add(weak(format::ago(time, SystemTime::now())));
                    ago.on_hover_text(format!("Saved {}", format::moment(time)));
                }
                (None, None) => {}
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let name = RichText::new(&run.name).strong().color(theme::text());
                ui.add(Label::new(name).selectable(false).truncate());
            });
        };
        ui.horizontal(|ui| ui.with_layout(Layout::right_to_left(Align::Center), first));
        let [quality, objects] = run.lines();
        ui.add(weak(quality));
        ui.add(weak(objects));
    }

    fn menu(&mut self, ui: &mut Ui, run: &RunSummary, is_open: bool, cx: &mut Ctx<'_>) {
        ui.set_min_width(150.0);
        let is_saved = run.changed.is_some();
        if ui.add_enabled(!is_open && is_saved, Button::new("Open")).clicked() {
            cx.ask(Action::Open(run.folder.clone()));
        }
        // What was made of a training has its name in its own file.
        if run.is_training && is_saved && ui.button("Rename\u{2026}").clicked() {
            self.renaming = Some(NameField::new(run.folder.clone(), run.name.clone()));
        }
        if ui.button("Show in folder").clicked() {
            cx.ask(Action::ShowFolder(Some(run.folder.clone())));
        }
        if ui.button("Copy path").clicked() {
            ui.ctx().copy_text(run.folder.display().to_string());
        }
        ui.separator();
        let delete = Button::new(RichText::new("Delete\u{2026}").color(theme::error()));
        let delete = ui.add_enabled(run.holder.is_none(), delete).on_disabled_hover_text("It is being written to.");
        if delete.clicked() {
            cx.ask(Action::DeleteRun(run.folder.clone()));
        }
    }

    fn name_field(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>) {
        let Some(renaming) = self.renaming.as_mut() else { return };
        match renaming.show(ui, Id::unique("name of a training")) {
            TypedName::Open => return,
            TypedName::Kept(name) => cx.ask(Action::RenameRun(renaming.of.clone(), name)),
            TypedName::Dropped => {}
        }
        self.renaming = None;
    }
}
