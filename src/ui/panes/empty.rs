//! The page before any scene is open: the demo, recent scenes, a drop target for others.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::{
    Align2, Button, Color32, ColorImage, CornerRadius, FontId, Image, ProgressBar, RichText, ScrollArea, Sense, Shape,
    Stroke, TextureHandle, TextureOptions, Ui, Vec2, vec2,
};

use super::super::ctx::Ctx;
use super::super::short_names::{fitted, short_path};
use super::super::state::{AppState, RunningJob};
use super::super::viewport::Viewport;
use super::super::{keys, theme};
use crate::jobs::demo;
use crate::jobs::recent::{self, RecentScene};
use crate::jobs::runs::RunSummary;
use crate::jobs::workspace::Workspace;
use crate::pipeline::observer::{Observer, Severity};
use crate::scene::{PhotoPixels, text};
use crate::ui::actions::Action;
use crate::worker::{JobInfo, Stop, Task, Tasks};

/// Largest width of the page, points.
const WIDTH: f32 = 760.0;
/// Recent scenes on the page.
const RECENT: usize = 6;
const COLUMNS: usize = 3;
/// Radius of a card's corners, points.
const CARD_RADIUS: u8 = 8;

/// The first page and its images.
#[derive(Default)]
pub(crate) struct FirstPage {
    /// True if its images were requested.
    asked: bool,
    /// Request for images of recent scenes.
    pictures: Option<Task<Vec<(PathBuf, PhotoPixels)>>>,
    /// Recent scenes whose names and trainings were requested, with those of the open one, and the request.
    listed: Option<(Vec<PathBuf>, Vec<RunSummary>)>,
    listing: Option<Task<Vec<RecentScene>>>,
    demo: Option<TextureHandle>,
    recent: BTreeMap<PathBuf, TextureHandle>,
    /// What the image that was stored last is of: number of the scene, its folder, and whether it is trained.
    kept_for: (u64, PathBuf, bool),
    keeping: Option<Task<()>>,
}

impl FirstPage {
    /// Requests the images once, takes them over, and stores one of the current scene. Returns true once it is stored.
    pub(crate) fn update(
        &mut self,
        ctx: &egui::Context,
        state: &mut AppState,
        viewport: &Viewport,
        tasks: &Tasks,
        workspace: &Arc<Workspace>,
    ) -> bool {
        let texture = |name: &str, size: [u32; 2], rgb: &[u8]| {
            let image = ColorImage::from_rgb(size.map(|s| s as usize), rgb);
            ctx.load_texture(name, image, TextureOptions::LINEAR)
        };
        if !self.asked && state.scene.is_none() {
            self.asked = true;
            let picture = demo::picture().ok().and_then(|jpeg| image::load_from_memory(&jpeg).ok());
            self.demo = picture.map(|p| p.to_rgb8()).map(|p| texture("demo", p.dimensions().into(), p.as_raw()));
            if !state.recent.is_empty() {
                let (workspace, of) = (Arc::clone(workspace), state.recent.clone());
                let info = JobInfo::short("Loading thumbnails of recent scenes");
                // The page is usable without them.
                self.pictures = tasks.spawn(info, move |_| Ok::<_, Stop>(recent::load(workspace.folders(), of))).ok();
            }
        }
        let listed = (state.recent.clone(), state.scene.as_ref().map_or_else(Vec::new, |s| s.runs.clone()));
        if self.listed.as_ref() != Some(&listed) {
            let (workspace, of) = (Arc::clone(workspace), state.recent.clone());
            let list = move |_: &mut dyn Observer| {
                Ok::<_, Stop>(of.into_iter().map(|path| RecentScene::of(workspace.folders(), path)).collect())
            };
            self.listing = tasks.spawn(JobInfo::short("Listing recent scenes"), list).ok();
            self.listed = Some(listed);
        }
        if let Some(Ok(scenes)) = Task::take(&mut self.listing) {
            state.recent_scenes = scenes;
        }
        for (path, p) in Task::take(&mut self.pictures).and_then(Result::ok).into_iter().flatten() {
            let shown = texture(&path.to_string_lossy(), [p.width_px, p.height_px], p.rgb.as_flattened());
            self.recent.insert(path, shown);
        }
        self.keep_picture(state, viewport, tasks, workspace);
        Task::take(&mut self.keeping).is_some()
    }

    /// Stores an image of the open scene for lists, and again once it is trained.
    fn keep_picture(&mut self, state: &AppState, viewport: &Viewport, tasks: &Tasks, workspace: &Arc<Workspace>) {
        let Some(scene) = state.scene.as_ref().filter(|_| !state.is_training()) else { return };
        let now = (state.scene_number, scene.out.clone(), state.is_trained());
        if self.kept_for == now || viewport.shows_growth() || viewport.full_picture().is_none() {
            return;
        }
        let Ok(Some(pixels)) = viewport.pixels() else { return };
        self.kept_for = now;
        let recent = Some(&scene.path).filter(|path| state.recent.contains(path));
        let run = Some(&scene.out).filter(|out| workspace.folders().keeps(out) && state.is_trained());
        let of: Vec<PathBuf> = recent.into_iter().chain(run).cloned().collect();
        let workspace = Arc::clone(workspace);
        let keep = move |observer: &mut dyn Observer| {
            for of in of {
                // A full disk is no error here: the user did not ask for this record.
                if let Err(e) = recent::keep(workspace.folders(), &of, &pixels) {
                    observer.note(Severity::Warning, e.to_string());
                }
            }
            Ok::<_, Stop>(())
        };
        let info = JobInfo::short(format!("Saving the thumbnail of {}", scene.name)).aside();
        self.keeping = tasks.spawn(info, keep).ok();
    }

    /// Draws the page.
    pub(crate) fn show(&self, ui: &mut Ui, cx: &mut Ctx<'_>) {
        let state = cx.state;
        if let Some(job) = &state.job {
            return busy(ui, job, cx);
        }
        let room = ui.available_size();
        let width = (room.x - 48.0).clamp(260.0, WIDTH);
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            let rows = state.recent.len().min(RECENT).div_ceil(COLUMNS) as f32;
            let height = 90.0 + 0.4125 * width + 96.0 + if rows > 0.0 { 34.0 + rows * 0.25 * width } else { 0.0 };
            ui.add_space(((room.y - height) * 0.45).max(18.0));
            ui.horizontal(|ui| {
                ui.add_space(((room.x - width) * 0.5).max(0.0));
                ui.vertical(|ui| {
                    ui.set_width(width);
                    ui.label(RichText::new("FMLGS").size(34.0).strong().color(theme::text()));
                    let what = "3D Gaussians with objects and parts, from posed photos";
                    ui.label(RichText::new(what).size(15.0).color(theme::weak()));
                    ui.add_space(16.0);
                    self.start(ui, width, cx);
                    self.recent(ui, width, cx);
                    ui.add_space(16.0);
                    drop_area(ui, width);
                });
            });
        });
    }

    fn start(&self, ui: &mut Ui, width: f32, cx: &mut Ctx<'_>) {
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing = vec2(20.0, 8.0);
            if let Some(texture) = &self.demo {
                let size = vec2(0.55, 0.4125) * width;
                let picture = Image::new(texture).fit_to_exact_size(size).corner_radius(8).sense(Sense::click());
                let tip = Action::OpenDemo.tooltip();
                let shown = ui.add(picture.alt_text("Demo image")).on_hover_text_at_pointer(tip);
                if shown.on_hover_cursor(egui::CursorIcon::PointingHand).clicked() {
                    cx.ask(Action::OpenDemo);
                }
            }
            ui.vertical(|ui| {
                let wide = vec2(ui.available_width(), 36.0);
                let mut button = |ui: &mut Ui, button: Button<'_>, action: Action| {
                    let tip = format!("{}  {}", action.tooltip(), keys::label(ui.ctx(), &action));
                    if ui.add_sized(wide, button).on_hover_text(tip).clicked() {
                        cx.ask(action);
                    }
                };
                let note = |ui: &mut Ui, text: &str| ui.label(RichText::new(text).small().color(theme::weak()));
                button(ui, theme::primary_button("Open the demo"), Action::OpenDemo);
                note(ui, &format!("Ready-made, in seconds. It asks for \u{201c}{}\u{201d}.", demo::QUESTION));
                button(ui, Button::new("Train it yourself"), Action::TrainDemo);
                note(ui, "The same from its photos: about 15 minutes on two cores.");
                ui.add_space(10.0);
                button(ui, Button::new("Open folder…"), Action::OpenFolder);
                button(ui, Button::new("Open file…"), Action::OpenFile);
            });
        });
    }

    fn recent(&self, ui: &mut Ui, width: f32, cx: &mut Ctx<'_>) {
        let state = cx.state;
        if state.recent.is_empty() {
            return;
        }
        ui.add_space(18.0);
        ui.horizontal(|ui| {
            ui.label(RichText::new("Recent").small().strong().color(theme::weak()));
            ui.label(RichText::new("Enter opens the first").small().color(theme::weak()));
        });
        let gap = 10.0;
        let size = vec2((width - gap * (COLUMNS - 1) as f32) / COLUMNS as f32, 0.23 * width);
        for row in state.recent.iter().take(RECENT).collect::<Vec<_>>().chunks(COLUMNS) {
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing = vec2(gap, gap);
                for path in row {
                    let known = state.recent_scenes.iter().find(|known| known.path == **path);
                    if self.card(ui, (path, &state.recent), known, size) {
                        cx.ask(Action::Open((*path).clone()));
                    }
                }
            });
            ui.add_space(gap - 4.0);
        }
        for RecentScene { name, runs, .. } in state.recent_scenes.iter().filter(|known| known.runs.len() > 1) {
            ui.horizontal_wrapped(|ui| {
                let text = format!("{name} was trained {} times:", runs.len());
                ui.label(RichText::new(text).small().color(theme::weak()));
                for run in runs {
                    if ui.link(RichText::new(run.text()).small()).clicked() {
                        cx.ask(Action::Open(run.folder.clone()));
                    }
                }
            });
        }
    }

    /// Draws a recent scene: image, name, and its training, its number of trainings or its folder. Returns true if it
    /// was clicked.
    fn card(&self, ui: &mut Ui, (path, recent): (&Path, &[PathBuf]), known: Option<&RecentScene>, size: Vec2) -> bool {
        let file = || text::path(path.file_name().map_or(path, Path::new));
        let name = known.map_or_else(file, |known| known.name.clone());
        let (rect, response) = ui.allocate_exact_size(size, Sense::click());
        let response = response.on_hover_text(text::path(path)).on_hover_cursor(egui::CursorIcon::PointingHand);
        let label = name.clone();
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &label));
        let painter = ui.painter().with_clip_rect(rect);
        painter.rect_filled(rect, CARD_RADIUS, theme::surface());
        if let Some(texture) = self.recent.get(path) {
            let uv = theme::filling(texture.size_vec2(), size);
            Image::new(texture).uv(uv).corner_radius(CARD_RADIUS).paint_at(ui, rect);
        }
        let bar = rect.with_min_y(rect.max.y - 40.0);
        let below = CornerRadius { nw: 0, ne: 0, sw: CARD_RADIUS, se: CARD_RADIUS };
        painter.rect_filled(bar, below, Color32::from_black_alpha(170));
        let at = bar.left_top() + vec2(10.0, 5.0);
        let (large, small, width) = (FontId::proportional(14.0), FontId::proportional(10.5), size.x - 20.0);
        let name = fitted(ui, &name, &large, width);
        painter.text(at, Align2::LEFT_TOP, name, large, Color32::WHITE);
        let parent = || {
            let above = |path: &Path| path.parent().map(Path::to_path_buf).unwrap_or_default();
            let others: Vec<PathBuf> = recent.iter().map(|path| above(path)).collect();
            short_path(&above(path), &others, 48)
        };
        let about = match known.map_or(&[][..], |known| &known.runs) {
            [] => parent(),
            [run] => run.facts(),
            several => format!("{} trainings", several.len()),
        };
        let about = fitted(ui, &about, &small, width);
        painter.text(at + vec2(0.0, 17.0), Align2::LEFT_TOP, about, small, Color32::from_gray(200));
        if response.hovered() || response.has_focus() {
            let line = Stroke::new(1.5, theme::accent());
            ui.painter().rect_stroke(rect, CARD_RADIUS, line, egui::StrokeKind::Inside);
        }
        response.clicked()
    }
}

fn drop_area(ui: &mut Ui, width: f32) {
    let (rect, _) = ui.allocate_exact_size(vec2(width, 62.0), Sense::hover());
    let corners = [rect.left_top(), rect.right_top(), rect.right_bottom(), rect.left_bottom(), rect.left_top()];
    ui.painter().extend(Shape::dashed_line(&corners, Stroke::new(1.0, theme::weak()), 6.0, 5.0));
    let mut child = ui.new_child(egui::UiBuilder::new().max_rect(rect.shrink(8.0)));
    child.vertical_centered(|ui| {
        ui.label(RichText::new("Drop a folder or a file anywhere in the window").color(theme::text()));
        let formats =
            "COLMAP  ·  transforms.json  ·  Blender  ·  LLFF  ·  photos  ·  splat .ply, .sog, .glb  ·  trained scene";
        ui.label(RichText::new(formats).small().color(theme::weak()));
    });
}

/// The first page while the first scene is read or trained.
fn busy(ui: &mut Ui, job: &RunningJob, cx: &mut Ctx<'_>) {
    ui.vertical_centered(|ui| {
        ui.add_space((ui.available_height() * 0.4).max(20.0));
        ui.set_max_width(380.0);
        ui.label(RichText::new(job.text()).size(20.0));
        ui.add_space(10.0);
        // The page has the color that a progress bar's track has elsewhere.
        ui.visuals_mut().extreme_bg_color = theme::surface();
        match job.fraction() {
            Some(fraction) => {
                ui.add(ProgressBar::new(fraction).desired_height(8.0).fill(theme::accent()));
                ui.label(RichText::new(job.stage_text()).color(theme::weak()));
            }
            None => {
                ui.spinner();
            }
        }
        if !job.info.hint.is_empty() {
            ui.add_space(6.0);
            ui.label(RichText::new(job.info.hint).color(theme::weak()));
        }
        ui.add_space(14.0);
        let button = ui.add(Button::new("Stop").min_size(vec2(110.0, 30.0)));
        if button.accessible_name(Action::Cancel.text()).clicked() {
            cx.ask(Action::Cancel);
        }
    });
}
