//! A frame of the window: takes events and input, draws, carries out actions.

mod draw;
mod input;

use egui::Ui;

use super::act::{act, camera_path, edits, elsewhere, locate, measure, query, remote, view, window};
use super::actions::Pane;
use super::app::App;
use super::state::Tone;
use super::theme;
use crate::scene::resource_log;

impl eframe::App for App {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        take_news(self, ctx);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        theme::begin_frame(&ctx);
        self.layout.zoom = ctx.zoom_factor();
        input::take(self, &ctx);
        window::watch_close(self, &ctx);
        elsewhere::watch(self, &ctx);
        draw::panes(self, ui);
        draw::over_everything(self, &ctx);
        for action in std::mem::take(&mut self.actions) {
            edits::settle(self, false);
            act(action, self, &ctx);
            ctx.request_repaint();
        }
        let at_rest = !ctx.input(|i| i.pointer.any_down()) && !ctx.text_edit_focused();
        edits::settle(self, at_rest);
        if at_rest {
            measure::keep_up(self);
            camera_path::keep_up(self);
        }
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        self.layout.recent = self.state.recent.clone();
        self.layout.save(storage);
    }

    fn clear_color(&self, _visuals: &egui::Visuals) -> [f32; 4] {
        theme::canvas().to_normalized_gamma_f32()
    }
}

/// Takes over all events, results and updates since the last frame.
fn take_news(app: &mut App, ctx: &egui::Context) {
    app.take_events();
    remote::take_updates(app);
    app.state.replan(&app.layout.plan, app.layout.config.limits());
    app.state.stamp_log(resource_log::now_secs());
    for load in resource_log::since(app.traced) {
        app.traced += 1;
        app.state.say_at(Some(load.at_secs), Tone::Info, load.text());
    }
    // New objects are the next thing to work with, so their pane comes to the front. Those that came along with a
    // training are not: its plot is looked at.
    let has_objects = app.state.semantics.is_some();
    let news = if has_objects { Pane::Objects } else { Pane::Training };
    let is_news = std::mem::replace(&mut app.had_objects, has_objects) != has_objects;
    if is_news && !(has_objects && app.state.has_carried_objects) && app.layout.shows(news) {
        app.layout.dock.activate(news);
    }
    app.viewport.update(&mut app.state, &app.tasks);
    let cloud = app.viewport.cloud().map(|cloud| &**cloud);
    let chosen = app.clean.update(cloud, app.layout.shows(Pane::Clean));
    let marked = if app.viewport.is_selecting() { app.viewport.marked() } else { chosen };
    app.viewport.visibility.set_chosen(marked);
    app.camera.on_scene(app.state.scene_number, app.state.scene.as_ref().and_then(|scene| scene.camera_path.as_ref()));
    for effect in app.chat.news() {
        edits::settle(app, false);
        query::effect(app, effect);
        edits::settle_as(app, false, Some(app.chat.sent));
    }
    edits::next(app);
    query::send_chat(app);
    view::play(app, ctx);
    locate::keep_up(app, ctx);
    let App { state, viewport, tasks, workspace, .. } = app;
    if app.first_page.update(ctx, state, viewport, tasks, workspace) {
        app.photos.runs.refresh();
    }
    app.photos.update(ctx, state);
    app.photos.runs.update(ctx, state, tasks, workspace);
    app.thumbnails.update(ctx, state, viewport.cloud().map(|c| &**c), tasks);
    if viewport.compared.is_on() {
        app.models.keep_listed(state, tasks);
    }
    app.models.update(state);
    if app.layout.shows(Pane::Training) {
        app.training.curves = app.report.curves(state);
    }
}
