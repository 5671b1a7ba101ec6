//! The application: applies events, draws the window, sends commands.

use std::collections::VecDeque;
use std::sync::Arc;

use egui::{CentralPanel, Frame, Margin, Panel, Ui};

use super::camera::CameraPane;
use super::chat::Chat;
use super::dialogs::{self, Question};
use super::dock::{DockContents, Place};
use super::file_dialogs::FileDialogs;
use super::find_dialog::{AwaitedModels, FindDialog};
use super::history::{EditStep, Editing, FoundStep};
use super::keep_dialog::KeepDialog;
use super::layout::Layout;
use super::palette::{Palette, shortcut_sheet};
use super::panes::{
    bars, clean::CleanPane, dataset::PhotoThumbnails, empty::FirstPage, log, models::Models,
    object_thumbnails::ObjectThumbnails, objects::ObjectsPane, phrases::PhrasesPane, plan, problems,
    report::ReportPane, training, unposed,
};
use super::state::AppState;
use super::theme;
use super::toasts::Toasts;
use super::viewport::Viewport;
use crate::remote::ServerLink;
use crate::scene::plan::PlanOverride;
use crate::scene::resource_log::{self, ResourceKind};
use crate::ui::actions::{Action, Pane};
use crate::worker::{Event, JobKind, Jobs, Repaint, Worker};

mod contents;
mod keyboard;

/// The window's application.
pub struct App {
    /// State of the window, changed by events alone.
    pub state: AppState,
    /// Choices that are stored.
    pub layout: Layout,
    /// The view of the scene.
    pub viewport: Viewport,
    pub(super) worker: Worker,
    /// The server whose scene is on screen.
    pub(super) link: Option<ServerLink>,
    pub(super) repaint: Repaint,
    pub(super) dialogs: FileDialogs,
    pub(super) question: Option<Question>,
    pub(super) find_dialog: FindDialog,
    pub(super) awaited: Option<AwaitedModels>,
    /// True if the query field is open although queries are impossible.
    pub(super) asks_in_vain: bool,
    pub(super) palette: Palette,
    pub(super) sheet: bool,
    first_page: FirstPage,
    photo_thumbnails: PhotoThumbnails,
    object_thumbnails: ObjectThumbnails,
    /// The list of phrases.
    pub phrases: PhrasesPane,
    pub(super) objects: ObjectsPane,
    pub(super) models: Models,
    pub(super) clean: CleanPane,
    /// Error against run time.
    pub(crate) report: ReportPane,
    /// The camera's path and its player.
    pub(crate) camera: CameraPane,
    /// The conversation with the agent.
    pub(crate) chat: Chat,
    toasts: Toasts,
    pub(super) actions: Vec<Action>,
    /// Window time of the last frame, s.
    last_frame: f64,
    /// Lines of the trace that are in the log already.
    traced: usize,
    /// Edits of objects and parts that wait for the running one.
    pub(super) edits: VecDeque<EditStep>,
    pub(super) editing: Option<Editing>,
    /// The running search, if there were objects before.
    pub(super) finding: Option<FoundStep>,
    pub(super) keep_dialog: Option<KeepDialog>,
    /// True if the view fills the window.
    pub(super) full_view: bool,
    /// True if objects were known in the last frame.
    had_objects: bool,
}

impl App {
    /// Starts the worker and carries out `first` in order. `jobs` does the work. Fails only if the system cannot start
    /// threads.
    pub fn new(
        cc: &eframe::CreationContext<'_>,
        jobs: impl Jobs,
        first: impl IntoIterator<Item = Action>,
    ) -> std::io::Result<Self> {
        theme::install(&cc.egui_ctx);
        // Frames answer input. Progress is read no faster than it is written, and every frame takes computing time from
        // the job that reports it.
        let (repaint, unhurried) = (super::repainter(&cc.egui_ctx, 8), super::repainter(&cc.egui_ctx, 120));
        resource_log::record(ResourceKind::Window, "window", "the program was started", 0);
        let layout = Layout::load(cc.storage);
        cc.egui_ctx.set_theme(layout.theme);
        cc.egui_ctx.set_zoom_factor(layout.zoom);
        let mut state = AppState::new(layout.recent.clone());
        state.say(super::state::Tone::Info, format!("FMLGS {}", env!("CARGO_PKG_VERSION")));
        Ok(Self {
            worker: Worker::start(jobs, unhurried)?,
            link: None,
            viewport: Viewport::new(Arc::clone(&repaint))?,
            state,
            layout,
            repaint,
            dialogs: FileDialogs::default(),
            question: None,
            find_dialog: FindDialog::default(),
            awaited: None,
            asks_in_vain: false,
            palette: Palette::default(),
            sheet: false,
            first_page: FirstPage::default(),
            photo_thumbnails: PhotoThumbnails::default(),
            object_thumbnails: ObjectThumbnails::default(),
            phrases: PhrasesPane::default(),
            objects: ObjectsPane::default(),
            models: Models::default(),
            clean: CleanPane::default(),
            report: ReportPane::default(),
            camera: CameraPane::default(),
            chat: Chat::default(),
            toasts: Toasts::default(),
            last_frame: 0.0,
            traced: 0,
            edits: VecDeque::new(),
            editing: None,
            finding: None,
            keep_dialog: None,
            full_view: false,
            had_objects: false,
            actions: first.into_iter().collect(),
        })
    }

    /// Queues an action, as a key or a button does.
    pub fn ask(&mut self, action: Action) {
        self.actions.push(action);
    }

    /// True if the window's own file dialog is open.
    pub fn chooses_file(&self) -> bool {
        self.dialogs.is_own_open()
    }

    /// The conversation so far, as Markdown, once all of it is answered.
    pub fn conversation(&self) -> Option<&str> {
        self.chat.transcript(false).filter(|_| self.chat.is_idle())
    }

    /// Sets the user's overrides of scene plans, for this run and, as they are stored, for later ones.
    pub fn override_plan(&mut self, overrides: impl IntoIterator<Item = PlanOverride>) {
        overrides.into_iter().for_each(|one| self.layout.plan.set(one));
    }

    /// Applies all events since the last call.
    fn take_events(&mut self, ctx: &egui::Context) {
        while let Some(event) = self.worker.next_event() {
            if self.is_of_earlier_server(&event) {
                continue;
            }
            self.hear(&event);
            if matches!(event, Event::Started { job, kind: JobKind::Train, .. } if job.is_remote()) {
                self.layout.dock.activate(Pane::Training);
            }
            let found = self.finding.take_if(|s| event.is_end() && event.job() == s.job);
            self.actions.extend(self.state.apply(event));
            found.into_iter().for_each(|step| self.found(step));
        }
        self.state.link = self.link.as_ref().map(ServerLink::status);
        self.state.replan(&self.layout.plan, self.layout.config.limits());
        self.state.stamp_log(resource_log::now_secs());
        for load in resource_log::since(self.traced) {
            self.traced += 1;
            self.state.say_at(Some(load.at_secs), super::state::Tone::Info, load.text());
        }
        // New objects are the next thing to work with, so their pane comes to the front.
        let has_objects = self.state.semantics.is_some();
        let news = if has_objects { Pane::Objects } else { Pane::Training };
        if std::mem::replace(&mut self.had_objects, has_objects) != has_objects && self.layout.shows(news) {
            self.layout.dock.activate(news);
        }
        self.viewport.update(&mut self.state, &self.worker);
        let brushed = self.viewport.take_brushed();
        let cloud = self.viewport.cloud().map(|cloud| &**cloud);
        let chosen = self.clean.update(&mut self.state, cloud, brushed, self.layout.shows(Pane::Clean));
        self.viewport.visibility.set_chosen(chosen);
        self.camera.on_scene(self.state.scene_number);
        self.visited();
        for effect in self.chat.news() {
            self.settle(false);
            self.effect(effect);
        }
        self.next_edit();
        self.next_stroke();
        self.send_chat();
        self.play(ctx);
        self.first_page.update(ctx, &mut self.state, &self.viewport, &self.worker);
        self.photo_thumbnails.update(ctx, &mut self.state);
        self.object_thumbnails.update(ctx, &mut self.state, self.viewport.cloud().map(|c| &**c), &self.worker);
    }

    /// Moves the camera along the flight or path that plays.
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

    fn panes(&mut self, ui: &mut Ui) {
        let bar = Frame::new().fill(theme::panel()).inner_margin(Margin::symmetric(10, 6));
        if !self.fills_window() {
            let Self { state, layout, actions, viewport, .. } = self;
            Panel::top("menus")
                .frame(bar)
                .show(ui, |ui| bars::top(ui, state, layout, viewport.queries.is_second(), actions));
            Panel::bottom("status")
                .frame(bar)
                .show(ui, |ui| bars::status(ui, state, layout, viewport.picture(), actions));
        }
        problems::show(ui, &mut self.state);
        CentralPanel::no_frame().frame(Frame::new().fill(theme::canvas())).show(ui, |ui| {
            if self.fills_window() {
                return DockContents::show(self, ui, Place::View);
            }
            let mut dock = std::mem::take(&mut self.layout.dock);
            dock.show(ui, self);
            self.layout.dock = dock;
        });
    }

    /// True if the view fills the window.
    fn fills_window(&self) -> bool {
        self.full_view && self.state.scene.is_some()
    }

    fn show_view(&mut self, ui: &mut Ui) {
        let rect = ui.available_rect_before_wrap();
        let Self { state, layout, actions, viewport, .. } = self;
        if state.scene.is_none() {
            self.first_page.show(ui, state, actions);
            return self.show_vain_query(ui, rect);
        }
        let route = layout.shows(Pane::Camera).then_some(&self.camera);
        theme::dark(ui, |ui| viewport.show(ui, state, layout, route, actions));
        theme::dark(ui, |ui| self.show_vain_query(ui, rect));
    }

    fn show_pane(&mut self, ui: &mut Ui, pane: Pane) {
        let Self { state, layout, actions, viewport, .. } = self;
        match pane {
            Pane::Dataset => {
                self.photo_thumbnails.show(ui, state, layout, viewport.photo_index(), &self.worker, actions);
            }
            Pane::Chat => {
                let map = state.semantics.clone();
                let identities = map.as_deref().map(|map| &map.identities);
                self.chat.show(ui, &mut layout.chat, &self.object_thumbnails, identities, actions);
            }
            Pane::Training => training::show(ui, state, layout, &self.report.curves(state), actions),
            Pane::Objects => {
                let (thumbnails, visibility) = (&self.object_thumbnails, &viewport.visibility);
                let selected = viewport.picking.selected();
                self.objects.show(ui, state, thumbnails, visibility, selected, actions);
            }
            Pane::Query => viewport.show_query(ui, state, actions),
            Pane::Plan => plan::show(ui, &state.plan, &mut layout.plan),
            Pane::Models => self.models.show(ui, state, &mut layout.finding, &self.worker, actions),
            Pane::Phrases => {
                let comparing = viewport.queries.truth().is_some();
                self.phrases.show(ui, state, comparing, actions);
            }
            Pane::Clean => self.clean.show(ui, state, viewport, actions),
            Pane::Camera => {
                let eye = viewport.pose();
                if let Some(pose) = self.camera.show(ui, state, &eye, actions) {
                    viewport.stand(&pose, state, ui.input(|i| i.time));
                }
            }
            Pane::Report => self.report.show(ui, state, layout, viewport, actions),
            Pane::Log => log::show(ui, state),
        }
    }

    fn over_everything(&mut self, ctx: &egui::Context) {
        if ctx.input(|i| !i.raw.hovered_files.is_empty()) {
            dialogs::drop_hint(ctx);
        }
        if let Some(action) = self.palette.show(ctx, &self.layout) {
            self.actions.push(action);
        }
        shortcut_sheet(ctx, &mut self.sheet);
        if let Some(question) = &self.question
            && let Some(answer) = question.show(ctx)
        {
            self.question = None;
            match answer {
                Some(Action::DeleteRemoved) => self.delete_removed(),
                Some(action @ Action::TrainChanged(_)) => self.actions.push(action),
                Some(action) => self.give_up_and(action),
                None => {}
            }
        }
        self.ask_for_means(ctx);
        self.ask_what_to_keep(ctx);
        if let Some(photos) = &self.state.unposed
            && !unposed::show(ctx, photos, &mut self.actions)
        {
            self.state.unposed = None;
        }
        let Self { state, actions, .. } = self;
        if state.error.as_ref().is_some_and(|e| dialogs::show_error(ctx, e, state.scene.is_some(), actions)) {
            state.error = None;
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
        theme::begin_frame(&ctx);
        self.layout.zoom = ctx.zoom_factor();
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
        theme::canvas().to_normalized_gamma_f32()
    }
}
