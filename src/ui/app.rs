//! The application: takes events in, draws the window, sends commands out.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;

use egui::{CentralPanel, Frame, Margin, Panel, ScrollArea, Ui};

use super::camera::CameraPane;
use super::chat::Chat;
use super::dialogs::{self, Question};
use super::file_dialogs::FileDialogs;
use super::history::{EditStep, Editing};
use super::layout::Layout;
use super::palette::{Palette, shortcut_sheet};
use super::panes::{
    bars, dataset::PhotoThumbnails, empty::FirstPage, log, models::Models, object_thumbnails::ObjectThumbnails,
    objects::ObjectsPane, phrases::PhrasesPane, plan, problems, report::ReportPane, training, unposed,
};
use super::state::AppState;
use super::toasts::Toasts;
use super::viewport::Viewport;
use super::{keys, theme};
use crate::measure::is_report;
use crate::scene::plan::PlanOverride;
use crate::scene::resource_log::{self, ResourceKind};
use crate::ui::actions::{Action, Pane};
use crate::worker::{Jobs, Repaint, Worker};

/// The window's application.
pub struct App {
    /// What it knows.
    pub state: AppState,
    /// Choices that are kept.
    pub layout: Layout,
    /// The view of the scene.
    pub viewport: Viewport,
    pub(super) worker: Worker,
    pub(super) repaint: Repaint,
    pub(super) dialogs: FileDialogs,
    pub(super) question: Option<Question>,
    pub(super) palette: Palette,
    pub(super) sheet: bool,
    first_page: FirstPage,
    photo_thumbnails: PhotoThumbnails,
    object_thumbnails: ObjectThumbnails,
    /// The list of phrases.
    pub phrases: PhrasesPane,
    pub(super) objects: ObjectsPane,
    models: Models,
    /// Error against run time.
    pub(crate) report: ReportPane,
    /// The camera's path and its player.
    pub(crate) camera: CameraPane,
    /// The conversation with the agent.
    pub(crate) chat: Chat,
    toasts: Toasts,
    actions: Vec<Action>,
    /// Window time of the last frame.
    last_frame: f64,
    /// Number of the scene that was looked at before anybody wanted to go anywhere.
    pub(super) explored_for: u64,
    /// Lines of the trace that are in the log already.
    traced: usize,
    /// Edits of objects and parts that wait for the one that is under way.
    pub(super) edits: VecDeque<EditStep>,
    pub(super) editing: Option<Editing>,
    /// A pane that is to be unfolded.
    pub(super) unfold: Option<Pane>,
}

impl App {
    /// Starts the worker and does `first`, one after the other. `jobs` does the work. Fails only if
    /// the system gives no threads.
    pub fn new(
        cc: &eframe::CreationContext<'_>,
        jobs: impl Jobs,
        first: impl IntoIterator<Item = Action>,
    ) -> std::io::Result<Self> {
        theme::install(&cc.egui_ctx);
        // Frames answer a user's hand. Progress can be read no faster than it is written, and
        // every frame takes from what it reports on.
        let (repaint, unhurried) = (super::repainter(&cc.egui_ctx, 8), super::repainter(&cc.egui_ctx, 120));
        resource_log::record(ResourceKind::Window, "window", "the program was started", 0);
        let layout = Layout::load(cc.storage);
        let mut state = AppState::new(layout.recent.clone());
        state.say(super::state::Tone::Info, format!("FMLGS {}", env!("CARGO_PKG_VERSION")));
        Ok(Self {
            worker: Worker::start(jobs, unhurried)?,
            viewport: Viewport::new(Arc::clone(&repaint))?,
            state,
            layout,
            repaint,
            dialogs: FileDialogs::default(),
            question: None,
            palette: Palette::default(),
            sheet: false,
            first_page: FirstPage::default(),
            photo_thumbnails: PhotoThumbnails::default(),
            object_thumbnails: ObjectThumbnails::default(),
            phrases: PhrasesPane::default(),
            objects: ObjectsPane::default(),
            models: Models::default(),
            report: ReportPane::default(),
            camera: CameraPane::default(),
            chat: Chat::default(),
            toasts: Toasts::default(),
            last_frame: 0.0,
            explored_for: 0,
            traced: 0,
            edits: VecDeque::new(),
            editing: None,
            unfold: None,
            actions: first.into_iter().collect(),
        })
    }

    /// Asks for an action, as a key or a button would.
    pub fn ask(&mut self, action: Action) {
        self.actions.push(action);
    }

    /// Whether a file is being chosen in a dialog of the window's own.
    pub fn chooses_file(&self) -> bool {
        self.dialogs.is_own_open()
    }

    /// The conversation so far, as Markdown, once all of it is answered.
    pub fn conversation(&self) -> Option<&str> {
        self.chat.transcript(false).filter(|_| self.chat.is_idle())
    }

    /// Takes what a user wants of scene plans, for this run and, as it is kept, later ones.
    pub fn override_plan(&mut self, overrides: impl IntoIterator<Item = PlanOverride>) {
        overrides.into_iter().for_each(|one| self.layout.plan.set(one));
    }

    /// Takes in everything that happened since.
    fn take_events(&mut self, ctx: &egui::Context) {
        while let Some(event) = self.worker.next_event() {
            let next = self.state.apply(event);
            self.actions.extend(next);
        }
        self.state.replan(&self.layout.plan, self.layout.config.limits());
        for load in resource_log::since(self.traced) {
            self.traced += 1;
            self.state.say(super::state::Tone::Info, load.line());
        }
        self.explore();
        self.viewport.update(&mut self.state, &self.worker);
        self.camera.on_scene(self.state.scene_number);
        self.visited();
        for effect in self.chat.news() {
            self.settle(false);
            self.effect(effect);
        }
        self.next_edit();
        self.send_chat();
        self.play(ctx);
        self.first_page.update(ctx, &mut self.state, &self.viewport, &self.worker);
        self.photo_thumbnails.update(ctx, &mut self.state);
        self.object_thumbnails.update(ctx, &mut self.state, self.viewport.cloud().map(|c| &**c), &self.worker);
    }

    /// Moves the eye along what is played.
    fn play(&mut self, ctx: &egui::Context) {
        let now = ctx.input(|i| i.time);
        let step = now - std::mem::replace(&mut self.last_frame, now);
        if let Some(pose) = self.camera.tick(step) {
            self.viewport.stand(&pose, &self.state, now);
            ctx.request_repaint();
        }
        if self.viewport.take_new_picture() && self.camera.player.playing {
            self.camera.player.count(now);
        }
    }

    fn keys_and_drops(&mut self, ctx: &egui::Context) {
        keys::watch_typing(ctx);
        let has_dialog = self.state.error.is_some()
            || self.state.unposed.is_some()
            || self.question.is_some()
            || self.dialogs.is_own_open();
        if !self.palette.is_open() && !has_dialog && !self.sheet {
            self.actions.extend(keys::pressed(ctx));
        }
        let dropped: Vec<PathBuf> =
            ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_path_buf()).take(2).collect());
        match dropped.as_slice() {
            [one, other] if is_report(one) && is_report(other) => {
                self.actions.extend([Action::OpenReport(one.clone()), Action::CompareReport(other.clone())]);
            }
            all => self.actions.extend(all.first().cloned().map(Action::Open)),
        }
    }

    fn panes(&mut self, ui: &mut Ui) {
        let bar = Frame::new().fill(theme::PANEL).inner_margin(Margin::symmetric(10, 6));
        let pane = Frame::new().fill(theme::PANEL).inner_margin(Margin::same(12));
        let Self { state, layout, actions, viewport, .. } = self;
        let unfold = self.unfold.take();
        let header = |pane: Pane| egui::CollapsingHeader::new(pane.text()).open((unfold == Some(pane)).then_some(true));
        Panel::top("menus")
            .frame(bar)
            .show(ui, |ui| bars::top(ui, state, layout, viewport.queries.is_second(), actions));
        Panel::bottom("status").frame(bar).show(ui, |ui| bars::status(ui, state, layout, viewport.picture(), actions));
        problems::show(ui, state);
        if layout.shows(Pane::Log) {
            Panel::bottom("log")
                .frame(pane)
                .resizable(true)
                .default_size(150.0)
                .min_size(80.0)
                .show(ui, |ui| log::show(ui, state));
        }
        if layout.shows(Pane::Camera) && state.scene.is_some() {
            let eye = viewport.pose();
            let shown = Panel::bottom("camera").frame(pane).resizable(true).default_size(260.0).min_size(240.0);
            let wanted = shown.show(ui, |ui| self.camera.show(ui, state, &eye, actions)).inner;
            if let Some(pose) = wanted {
                viewport.stand(&pose, state, ui.input(|i| i.time));
            }
        }
        if layout.shows(Pane::Phrases) && state.semantics.is_some() {
            let comparing = viewport.queries.truth().is_some();
            let shown = Panel::bottom("phrases").frame(pane).resizable(true).default_size(220.0).min_size(150.0);
            shown.show(ui, |ui| self.phrases.show(ui, state, comparing, actions));
        }
        if layout.shows(Pane::Report) {
            // The view stays larger than what is said about it.
            let most = (0.55 * ui.available_height()).max(200.0);
            let shown =
                Panel::bottom("report").frame(pane).resizable(true).default_size(400.0).size_range(200.0..=most);
            shown.show(ui, |ui| self.report.show(ui, state, layout, viewport, actions));
        }
        let Some(scene) = state.scene.clone() else {
            let canvas = Frame::new().fill(theme::CANVAS);
            CentralPanel::no_frame().frame(canvas).show(ui, |ui| self.first_page.show(ui, state, actions));
            return;
        };
        if scene.dataset.is_some() && layout.shows(Pane::Dataset) {
            Panel::left("photos").frame(pane).resizable(true).default_size(270.0).size_range(180.0..=600.0).show(
                ui,
                |ui| {
                    self.photo_thumbnails.show(ui, state, layout, viewport.photo_index(), &self.worker, actions);
                },
            );
        }
        if [Pane::Chat, Pane::Query, Pane::Training, Pane::Objects, Pane::Plan, Pane::Models]
            .iter()
            .any(|p| layout.shows(*p))
        {
            Panel::right("work").frame(pane).resizable(true).default_size(350.0).size_range(290.0..=640.0).show(
                ui,
                |ui| {
                    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
                        if layout.shows(Pane::Query) {
                            header(Pane::Query)
                                .default_open(true)
                                .show(ui, |ui| viewport.show_query(ui, state, actions));
                            ui.add_space(8.0);
                        }
                        let can_have = scene.dataset.is_some() || state.semantics.is_some();
                        let objects = layout.shows(Pane::Objects) && can_have;
                        let mut show_objects = |ui: &mut Ui, actions: &mut Vec<Action>| {
                            header(Pane::Objects).default_open(true).show(ui, |ui| {
                                let (thumbnails, visibility) = (&self.object_thumbnails, &viewport.visibility);
                                let selected = viewport.picking.selected();
                                self.objects.show(ui, state, thumbnails, visibility, selected, actions);
                            });
                            ui.add_space(10.0);
                        };
                        if layout.shows(Pane::Chat) {
                            let map = state.semantics.clone();
                            header(Pane::Chat).default_open(map.is_some()).show(ui, |ui| {
                                let identities = map.as_deref().map(|map| &map.identities);
                                self.chat.show(ui, &mut layout.chat, &self.object_thumbnails, identities, actions);
                            });
                            ui.add_space(8.0);
                        }
                        // Once there are any, they are what a user works with.
                        if objects && state.semantics.is_some() {
                            show_objects(ui, actions);
                        }
                        if layout.shows(Pane::Training) {
                            ui.heading(Pane::Training.text());
                            training::show(ui, state, layout, &self.report.curves(state), actions);
                            ui.add_space(10.0);
                        }
                        if objects && state.semantics.is_none() {
                            show_objects(ui, actions);
                        }
                        if layout.shows(Pane::Plan) {
                            header(Pane::Plan)
                                .default_open(state.history.steps.is_empty())
                                .show(ui, |ui| plan::show(ui, &state.plan, &mut layout.plan));
                        }
                        if layout.shows(Pane::Models) {
                            header(Pane::Models)
                                .show(ui, |ui| self.models.show(ui, state, &mut layout.finding, &self.worker, actions));
                        }
                    });
                },
            );
        }
        let route = layout.shows(Pane::Camera).then_some(&self.camera);
        CentralPanel::no_frame().show(ui, |ui| viewport.show(ui, state, layout, route, actions));
    }

    fn over_everything(&mut self, ctx: &egui::Context) {
        if ctx.input(|i| !i.raw.hovered_files.is_empty()) {
            drop_hint(ctx);
        }
        if let Some(action) = self.palette.show(ctx, &self.layout) {
            self.actions.push(action);
        }
        shortcut_sheet(ctx, &mut self.sheet);
        if let Some(question) = &self.question
            && let Some(yes) = dialogs::show_question(ctx, &question.text, question.yes, question.no)
            && let Some(question) = self.question.take()
            && yes
        {
            self.give_up_and(question.action);
        }
        if let Some(photos) = &self.state.unposed
            && !unposed::show(ctx, photos, &mut self.actions)
        {
            self.state.unposed = None;
        }
        if self.state.error.as_ref().is_some_and(|e| dialogs::show_error(ctx, e)) {
            self.state.error = None;
        }
        if let Some((action, path)) = self.dialogs.show(ctx) {
            self.chosen(action, path);
        }
        self.toasts.show(ctx, &mut self.state, ctx.content_rect().shrink2(egui::vec2(0.0, 44.0)));
    }
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        self.take_events(ctx);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.keys_and_drops(&ctx);
        self.panes(ui);
        self.over_everything(&ctx);
        for action in std::mem::take(&mut self.actions) {
            self.settle(false);
            self.act(action, &ctx);
            ctx.request_repaint();
        }
        self.settle(!ctx.input(|i| i.pointer.any_down()) && !ctx.text_edit_focused());
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        self.layout.recent = self.state.recent.clone();
        self.layout.save(storage);
    }

    fn clear_color(&self, _visuals: &egui::Visuals) -> [f32; 4] {
        theme::CANVAS.to_normalized_gamma_f32()
    }
}

fn drop_hint(ctx: &egui::Context) {
    let painter = ctx.layer_painter(egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("drop")));
    let rect = ctx.content_rect();
    painter.rect_filled(rect, 0.0, egui::Color32::from_black_alpha(170));
    painter.rect_stroke(rect.shrink(24.0), 12.0, egui::Stroke::new(2.0, theme::ACCENT), egui::StrokeKind::Inside);
    let font = egui::FontId::proportional(24.0);
    painter.text(rect.center(), egui::Align2::CENTER_CENTER, "Drop to open", font, theme::TEXT);
}
