//! Drawing of the window: its bars, the view, the panes in their dock, and the dialogs over them.

use std::path::Path;

use egui::{CentralPanel, Frame, Margin, Panel, ScrollArea, Ui};

use crate::jobs::locate::is_picture;
use crate::ui::act::{export, gaussians, objects, view};
use crate::ui::actions::{Action, Pane};
use crate::ui::app::App;
use crate::ui::ctx::Ctx;
use crate::ui::dialogs;
use crate::ui::dock::{DockContents, Place};
use crate::ui::help;
use crate::ui::object_menu::MenuThing;
use crate::ui::palette::shortcut_sheet;
use crate::ui::panes::log::LogPane;
use crate::ui::panes::plan::PlanPane;
use crate::ui::panes::query::QueryPane;
use crate::ui::panes::{PaneContents, bars, problems, unposed};
use crate::ui::theme;
use crate::ui::toasts::{self, ToastClick};
use crate::ui::viewport::query::closed;

/// The window's bars and panes.
pub(super) fn panes(app: &mut App, ui: &mut Ui) {
    app.toasts.update(ui.ctx(), &mut app.state, app.layout.shows(Pane::Log));
    let bar = Frame::new().fill(theme::panel()).inner_margin(Margin::symmetric(10, 6));
    if !fills_window(app) {
        let (mut cx, viewport) = app.context();
        Panel::top("menus").frame(bar).show(ui, |ui| bars::top(ui, &mut cx, viewport));
        let status = Panel::bottom("status").frame(bar);
        let clicked = status.show(ui, |ui| bars::status(ui, &mut cx, viewport)).inner;
        message_clicked(app, clicked);
    }
    problems::show(ui, &mut app.state);
    CentralPanel::no_frame().frame(Frame::new().fill(theme::canvas())).show(ui, |ui| {
        if fills_window(app) {
            return show_view(app, ui);
        }
        let mut dock = std::mem::take(&mut app.layout.dock);
        dock.show(ui, app);
        app.layout.dock = dock;
    });
}

/// Dialogs and messages over everything.
pub(super) fn over_everything(app: &mut App, ctx: &egui::Context) {
    if let Some(first) = ctx.input(|i| i.raw.hovered_files.first().cloned()) {
        let is_photo = |path: &Path| app.state.scene.is_some() && is_picture(path);
        let hint = match &first.path {
            Some(path) if is_photo(path) => "Drop to find where it was taken",
            Some(path) if path.is_dir() && app.state.why_no_added_photos().is_none() => {
                "Drop to add its photos to this scene, or to open it"
            }
            _ => "Drop to open",
        };
        dialogs::drop_hint(ctx, hint);
    }
    let selection = app.state.semantics.as_ref().zip(view::chosen_identity(app));
    let selection = selection.map(|(map, id)| {
        let is_hidden = app.viewport.visibility.draws(&map.identities, id) == Some(false);
        MenuThing { all: &map.identities, id, is_hidden }
    });
    if let Some(action) = app.palette.show(ctx, &app.layout, selection) {
        app.ask(action);
    }
    shortcut_sheet(ctx, &mut app.sheet);
    help::show(ctx, &mut app.help);
    let answer = app.question.as_ref().and_then(|(question, _)| question.show(ctx));
    if let Some((answer, (_, then))) = answer.zip(app.question.take_if(|_| answer.is_some())) {
        then(app, answer);
    }
    objects::show_dialogs(app, ctx);
    gaussians::show_dialog(app, ctx);
    export::show_video_dialog(app, ctx);
    if let Some(photos) = app.state.unposed.take() {
        let stays = unposed::show(ctx, &photos, &mut app.context().0);
        app.state.unposed = Some(photos).filter(|_| stays);
    }
    if let Some(error) = app.state.error.take() {
        let is_read = dialogs::show_error(ctx, &error, &mut app.context().0);
        app.state.error = Some(error).filter(|_| !is_read);
    }
    if let Some((then, kind, path)) = app.dialogs.show(ctx) {
        app.layout.remember_folder(kind, &path);
        then(app, path);
        // The view and the dialogs of this frame are drawn already.
        ctx.request_repaint();
    }
    if fills_window(app) {
        let clicked = toasts::float(ctx, &app.state.toasts);
        message_clicked(app, clicked);
    }
}

fn message_clicked(app: &mut App, clicked: Option<ToastClick>) {
    match clicked {
        Some(ToastClick::Dismiss) => drop(app.state.toasts.pop()),
        Some(ToastClick::OpenLog) => app.ask(Action::ShowPane(Pane::Log)),
        None => {}
    }
}

/// True if the view fills the window.
fn fills_window(app: &App) -> bool {
    app.full_view && app.state.scene.is_some()
}

fn show_view(app: &mut App, ui: &mut Ui) {
    let rect = ui.available_rect_before_wrap();
    let vain = app.state.why_no_query().filter(|_| app.asks_in_vain);
    let App { state, layout, tasks, thumbnails, actions, viewport, camera, first_page, .. } = app;
    let route = layout.shows(Pane::Camera).then(|| camera.route(viewport.pose().center));
    let has_scene = state.scene.is_some();
    let mut cx = Ctx { state, layout, tasks, thumbnails, actions };
    match (viewport.shows_growth(), has_scene) {
        (true, _) => theme::dark(ui, |ui| viewport.show_growth(ui, &cx)),
        (false, true) => theme::dark(ui, |ui| viewport.show(ui, &mut cx, route.as_ref())),
        (false, false) => first_page.show(ui, &mut cx),
    }
    let Some(why) = vain else { return };
    match has_scene {
        true => theme::dark(ui, |ui| closed::show(ui, rect, &why)),
        false => closed::show(ui, rect, &why),
    }
}

fn show_pane(app: &mut App, ui: &mut Ui, pane: Pane) {
    let App { state, layout, tasks, thumbnails, actions, viewport, .. } = app;
    let mut cx = Ctx { state, layout, tasks, thumbnails, actions };
    let contents: &mut dyn PaneContents = match pane {
        Pane::Dataset => &mut app.photos,
        Pane::Chat => &mut app.chat,
        Pane::Training => &mut app.training,
        Pane::Objects => &mut app.objects,
        Pane::Query => &mut QueryPane,
        Pane::Plan => &mut PlanPane,
        Pane::Models => &mut app.models,
        Pane::Phrases => &mut app.phrases,
        Pane::Camera => &mut app.camera,
        Pane::Clean => &mut app.clean,
        Pane::Report => &mut app.report,
        Pane::Log => &mut LogPane,
    };
    match contents.scrolls() {
        true => {
            let all = ScrollArea::vertical().auto_shrink([false, false]);
            all.show(ui, |ui| contents.ui(ui, &mut cx, viewport));
        }
        false => contents.ui(ui, &mut cx, viewport),
    }
}

impl DockContents for App {
    fn has(&self, place: Place) -> bool {
        let Place::Pane(pane) = place else { return true };
        let scene = self.state.scene.as_ref();
        let has_photos = scene.is_some_and(|s| s.dataset.is_some());
        let has_objects = self.state.semantics.is_some();
        self.layout.shows(pane)
            && match pane {
                Pane::Report | Pane::Log => true,
                Pane::Dataset | Pane::Training => has_photos,
                Pane::Objects => has_photos || has_objects,
                Pane::Phrases => has_objects,
                Pane::Chat | Pane::Query | Pane::Plan | Pane::Models | Pane::Camera | Pane::Clean => scene.is_some(),
            }
    }

    fn show(&mut self, ui: &mut Ui, place: Place) {
        let Place::Pane(pane) = place else { return show_view(self, ui) };
        Frame::new().fill(theme::panel()).inner_margin(Margin::same(12)).show(ui, |ui| {
            ui.set_min_size(ui.available_size());
            show_pane(self, ui, pane);
        });
    }

    fn hide(&mut self, pane: Pane) {
        self.ask(Action::TogglePane(pane));
    }
}
