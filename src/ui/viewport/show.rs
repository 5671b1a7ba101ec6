//! One pass of the viewport: its views, their frames, and all that is drawn over them.

use egui::{Frame, Margin, Panel, Rect, Response, Sense, Ui};
use glam::DVec2;

use super::input::SteeredView;
use super::marks::MarkedScene;
use super::measured::{self, DrawnMeasurement};
use super::overlay::ViewCards;
use super::photo::PhotoView;
use super::query::SearchedScene;
use super::request::Moved;
use super::route::CameraRoute;
use super::split::{self, ViewArea, Views};
use super::tools::select::SelectTool;
use super::tools::{CardPlaces, Tool};
use super::visible::VisibleCloud;
use super::{Viewport, frusta, query, route};
use crate::pipeline::semantics::query::language::QueryPlace;
use crate::pipeline::semantics::query::language::viewpoint::Viewpoint;
use crate::scene::measurement::Measurement;
use crate::ui::color_by::ColorBy;
use crate::ui::ctx::Ctx;
use crate::ui::select_shape::SelectShape;
use crate::ui::theme;
use crate::worker::ViewMode;
use crate::worker::view::{QualityBudget, SkipPasses, ViewRequest};

/// Rest after which the camera no longer counts as moving, s.
pub(super) const REST_SECS: f64 = 0.15;
/// Longest side of a frame, px: more would add delay but no visible detail.
pub(super) const MAX_SIDE_PX: u32 = 1600;

impl Viewport {
    /// Draws the viewport into the rest of `ui`.
    pub(crate) fn show(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>, route: Option<&CameraRoute>) {
        let state = cx.state;
        let Some(scene) = &state.scene else { return };
        self.compared.follow(state, cx.layout.split_view);
        if self.compared.is_on() {
            let ctx = ui.ctx().clone();
            theme::in_window_theme(&ctx, || {
                let frame = Frame::new().fill(theme::panel()).inner_margin(Margin::symmetric(10, 6));
                Panel::top("compared").frame(frame).show(ui, |ui| {
                    ui.set_style(ctx.style_of(ctx.theme()));
                    self.compared.bar(ui, cx);
                });
            });
        }
        let whole = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(whole, Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Viewport"));
        let views = Views::of(whole, if cx.layout.split_view { 1 + state.beside.len().max(1) } else { 1 });
        if let Some(second) = views.pressed(ui) {
            self.queries.work_in(second);
        }
        self.display.time_frames(cx.layout.times);
        self.take_frame(ui.ctx());
        let (now, has_other) = (ui.input(|i| i.time), !state.beside.is_empty());
        let under = views.area_under_pointer(ui, self.fit(views.first), has_other);
        if let Some((tool, mut rest)) = self.tool_in_use() {
            tool.pointer(&response, under, &mut rest, cx);
        }
        let tool = self.tool.as_mut().map(Tool::as_dyn);
        let (takes_drags, takes_clicks) = tool.map_or((false, false), |t| (t.takes_drags(), t.takes_clicks()));
        let radius = scene.home.bounds.radius();
        let steered = SteeredView { display: &self.display, area: under, radius, tool_takes_drags: takes_drags };
        if self.steering.steer(ui, &response, &mut self.eye, &steered) {
            self.leave_photo();
            self.moved_at = now;
        }
        self.come_back(cx.layout, now);
        if let Some(bounds) = self.asked_for.take() {
            self.keep_in_view(&bounds, views.first.size(), now);
        }
        let shown = self.fit(views.first);
        self.request(ui, shown, now, cx);
        if let Some(semantics) = &state.semantics {
            self.queries.keep_up(ui.ctx(), semantics, &state.plan);
            let (pose, up) = (self.pose(), self.up(scene));
            self.queries.stand(pose);
            let view = Viewpoint { eye: pose.center, forward: pose.forward(), up };
            let place = QueryPlace { view: Some(view), meters: scene.meters_per_unit(), ..QueryPlace::default() };
            self.queries.ask_from(place, semantics);
        }
        let areas: Vec<ViewArea> = views.areas(shown, has_other).collect();
        if areas.len() == 3 {
            // In two rows of two, a place is empty.
            ui.painter().rect_filled(whole, 0.0, theme::canvas());
        }
        let is_second = self.queries.is_second();
        let with_cameras = cx.layout.cameras && self.has_nothing_to_look_at() && !route.is_some_and(|r| r.plays);
        self.compared.keep_up(ui.ctx(), self.display.picture());
        let on_camera = self.show_frames(ui, &areas, &response, with_cameras, cx);
        let asks_all = self.compared.is_on();
        if asks_all && !takes_drags && !takes_clicks && response.clicked() && !on_camera {
            let under = views.area_under_pointer(ui, shown, has_other);
            let at = response.interact_pointer_pos().map(|pos| (pos - under.shown.min) / under.shown.size());
            let point = at.and_then(|at| self.display.picked(DVec2::new(f64::from(at.x), f64::from(at.y)), &self.eye));
            self.compared.point_at(point);
        }
        let picks = !takes_drags && !takes_clicks && !asks_all;
        if let Some(semantics) = state.semantics.as_ref().filter(|_| picks) {
            let under = views.area_under_pointer(ui, shown, has_other);
            let maps = self.queries.maps().map(|m| &***m).filter(|_| !on_camera && !under.is_other);
            let before = self.picking.selected();
            self.picking.update(&response, under.shown, semantics, maps, &self.visibility, cx);
            if matches!(&self.tool, Some(Tool::Transform(tool)) if tool.is_something()) {
                // What is changed but not applied stays the selection.
                self.picking.select(before);
            }
        }
        let works_in = self.show_over_frames(ui, &areas, is_second, picks, route, cx);
        self.queries.work_in(works_in);
        let active_view = areas.last().filter(|_| works_in).map_or(views.first, |area| area.rect);
        if let Some((tool, mut rest)) = self.tool_in_use() {
            tool.card(ui, CardPlaces { first_frame: shown, active_view }, &mut rest, cx);
        }
    }

    /// Returns whether all scenes on screen are asked something.
    fn asks_all(&self) -> bool {
        self.compared.is_on() && self.compared.asks()
    }

    /// Draws the pane of the query: its answer and the options.
    pub(crate) fn show_query(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>) {
        let state = cx.state;
        let (Some(semantics), Some(cloud)) = (&state.semantics, &self.cloud) else {
            ui.weak("Find objects first: queries search among them.");
            return;
        };
        query::details::show(ui, &mut self.queries, semantics, cloud, cx);
    }

    /// Returns whether cameras would cover nothing: no tool is in use, and nothing is asked for, selected, isolated or
    /// seen through a photo's camera.
    fn has_nothing_to_look_at(&self) -> bool {
        let is_free = self.tool.is_none() && self.photo.is_none() && !self.visibility.is_isolated();
        is_free && self.picking.selected().is_none() && !self.queries.is_asked() && !self.asks_all()
    }

    /// The frame in a view: all of it, or what the photo's aspect ratio leaves.
    fn fit(&mut self, view: Rect) -> Rect {
        self.photo.as_mut().map_or(view, |photo| photo.fit(view))
    }

    /// Takes over the newest frame and its identity maps.
    fn take_frame(&mut self, ctx: &egui::Context) {
        if let Some((maps, exact)) = self.display.take_maps(self.render_thread.maps(), self.requests.ticket()) {
            self.queries.set_maps(maps, exact);
        }
        self.display.take(ctx, self.render_thread.pictures());
    }

    /// Draws the frames with masks and tints, the photo beside them, and the photos' cameras. Returns true if the
    /// cursor is on a camera.
    fn show_frames(
        &mut self,
        ui: &mut Ui,
        areas: &[ViewArea],
        response: &Response,
        with_cameras: bool,
        cx: &mut Ctx<'_>,
    ) -> bool {
        let state = cx.state;
        // The outlines of an answer would look like the selection.
        let (mut on_camera, selects) = (false, self.is_selecting());
        for area in areas {
            self.queries.work_in(area.second);
            self.display.paint(ui, *area);
            let compares = cx.layout.compare && !area.second;
            // Masks lie over the photo, too, whose camera they are seen by; a tint would cover it.
            let masked = self.queries.settings().color_by == ColorBy::Masks;
            if let Some(photo) = self.photo.as_mut().filter(|_| compares && masked) {
                photo.paint_right(ui, area.shown, cx.layout.split);
            }
            // Answers belong to the scene, not to another one beside it.
            if let Some(semantics) =
                state.semantics.as_ref().filter(|_| !area.is_other && !selects && !self.compared.is_on())
            {
                let lit = cx.layout.dim.then(|| self.picking.selected().into_iter().collect());
                self.queries.paint(ui, area.shown, semantics, lit);
            }
            let has_result = state.is_trained() || state.is_training();
            if let Some(photo) = self.photo.as_mut().filter(|_| !area.second) {
                match cx.layout.mode {
                    mode if compares => {
                        if !masked {
                            photo.paint_right(ui, area.shown, cx.layout.split);
                        }
                        let of = match mode {
                            ViewMode::Rgb if has_result => "Rendering",
                            ViewMode::Rgb => "Sparse points",
                            other => other.text(),
                        };
                        photo.show_split(ui, area.shown, of, &mut cx.layout.split);
                    }
                    ViewMode::Rgb if !has_result => photo.show_alone(ui, area.shown),
                    _ => {}
                }
            }
            if with_cameras {
                let eye = self.display.overlay_camera(&self.eye, area.rect);
                on_camera |= frusta::show(ui, area.rect, &eye, response, cx);
            }
        }
        self.compared.paint(ui, areas, self.display.picture());
        on_camera
    }

    /// Draws over the frames: the tool, outlines and marks, the route, the cards and the query. Returns true if the
    /// second view is active then.
    fn show_over_frames(
        &mut self,
        ui: &mut Ui,
        areas: &[ViewArea],
        is_second: bool,
        picks: bool,
        route: Option<&CameraRoute>,
        cx: &mut Ctx<'_>,
    ) -> bool {
        let (state, now) = (cx.state, ui.input(|i| i.time));
        let (first, mut works_in) = (areas.first().map_or(Rect::NOTHING, |area| area.rect), is_second);
        let truth = self.queries.truth();
        for &area in areas {
            self.queries.work_in(area.second);
            if let Some((tool, mut rest)) = self.tool_in_use() {
                tool.paint(ui, area, &mut rest, cx);
            }
            // Outlines first: they run through no label.
            let picked = state.semantics.as_ref().filter(|_| picks && !area.is_other);
            if let Some((semantics, maps)) = picked.zip(self.queries.shown_maps()) {
                self.picking.paint(ui, area.shown, semantics, maps);
            }
            // A path that plays is shown as a video of it would be.
            let measures = cx.layout.measurements || self.is_measuring();
            if measures && !area.is_other && !route.is_some_and(|route| route.plays) {
                self.show_measurements(ui, area, cx);
            }
            let searched = state.semantics.as_ref().zip(self.cloud.as_ref()).filter(|_| !area.is_other);
            if let Some((semantics, cloud)) = searched.filter(|_| picks) {
                let (visibility, selected) = (&self.visibility, self.picking.selected());
                let eye = self.display.overlay_camera(&self.eye, area.shown);
                let marked = MarkedScene { cloud, semantics, visibility, selected, eye };
                self.marks.show(ui, area.shown, &marked, &mut self.queries, cx);
                if self.queries.shown_maps().is_some() {
                    self.picking.paint_name(ui, area.shown, &semantics.identities, &state.labels);
                }
            }
            if let Some(route) = route {
                let eye = self.display.overlay_camera(&self.eye, area.rect);
                route::show(ui, area.rect, &eye, route, state.explored.as_deref());
            }
            let mut cards = ViewCards {
                moves: now - self.moved_at < REST_SECS,
                display: &self.display,
                photo: self.photo.as_ref(),
                gaussians: self.cloud.as_ref().map_or(0, |cloud| cloud.len()),
                visibility: &self.visibility,
                overrides: &self.overrides,
                orthographic: self.eye.straight_name(state.scene.as_ref().map(|scene| &scene.home)),
                queries: &mut self.queries,
            };
            let name = state.scene.as_ref().map_or("", |scene| &scene.name);
            cards.show(ui, area, self.compared.figures(area.index, name, truth.as_deref()), cx);
            if let Some((semantics, cloud)) = searched.filter(|_| !self.compared.is_on()) {
                let scene = SearchedScene { semantics, cloud, visibility: &self.visibility };
                if query::panel::show(ui, &mut self.queries, area.rect, first, scene, cx) {
                    works_in = area.second;
                }
            }
            if areas.len() == 2 && works_in == area.second {
                split::mark_worked_in(ui, area.rect);
            }
        }
        works_in
    }

    /// Draws the kept measurements, and the one that is being made.
    fn show_measurements(&mut self, ui: &Ui, area: ViewArea, cx: &Ctx<'_>) {
        let meters = cx.state.scene.as_ref().and_then(|scene| scene.meters_per_unit());
        let (tool, rest) = self.parts();
        let new = match tool {
            Some(Tool::Ruler(ruler)) => Some(ruler.drawn(&rest, cx.state)),
            _ => None,
        };
        let kept: Vec<&Measurement> = rest.measurements.iter().filter(|m| !m.hidden).collect();
        // One that was just kept is drawn once, with its name.
        let new = new.filter(|new| !kept.iter().any(|kept| new.is_of(kept)));
        let kept = kept.into_iter().rev().map(|m| DrawnMeasurement::kept(m, meters));
        let all: Vec<DrawnMeasurement> = new.into_iter().chain(kept).collect();
        measured::show(ui, area.shown, &rest.camera(area.shown), &all, meters);
    }

    /// Requests a new frame if anything has changed.
    pub(super) fn request(&mut self, ui: &Ui, shown: Rect, now: f64, cx: &Ctx<'_>) {
        let (state, layout) = (cx.state, &*cx.layout);
        let Some(cloud) = self.cloud.clone() else { return };
        let plan = &state.plan;
        let transformed = match &mut self.tool {
            Some(Tool::Transform(tool)) => tool.preview(&cloud, state.semantics.as_ref()),
            _ => None,
        };
        let (cloud, map) = transformed.unwrap_or_else(|| (cloud, state.semantics.clone()));
        let preview = self.select_tool().and_then(SelectTool::preview).cloned();
        let VisibleCloud { cloud, semantics, .. } = self.visibility.apply(&cloud, preview.as_ref().or(map.as_ref()));
        let picks_objects = self.select_tool().is_some_and(|tool| tool.shape == SelectShape::Object);
        let is_wanted = self.queries.wanted() || self.picking.wanted() || picks_objects;
        let with_maps = plan.maps.now(is_wanted) || preview.is_some();
        let semantics = semantics.filter(|_| with_maps);
        let rests = now - self.moved_at - REST_SECS;
        if rests < 0.0 {
            ui.ctx().request_repaint_after_secs((-rests + 0.01) as f32);
        }
        // While another job needs the processor, depth is drawn only for a tool; of a training, which changes the scene
        // all the time, only once a click waits for it.
        let tool_waits = self.tool.as_mut().is_some_and(|tool| tool.as_dyn().waits_for_depth());
        let needs_depth = tool_waits || self.is_measuring() && !state.is_training();
        let busy = state.job.as_ref().is_some_and(|j| !j.paused) && !needs_depth;
        let budget = match (rests < 0.0, busy) {
            (true, _) => QualityBudget::Moving,
            (false, true) => QualityBudget::Shared,
            (false, false) => QualityBudget::Full,
        };
        let size = shown.size() * ui.pixels_per_point();
        let (w, h) = ((size.x.round() as u32).max(1), (size.y.round() as u32).max(1));
        let camera = match &self.photo {
            Some(p) => p.camera().resized(w, h),
            None => self.eye.camera(w, h),
        };
        let differs = |mode: &ViewMode| *mode != layout.mode || !state.beside.is_empty();
        let others = state.beside.iter().filter(|_| layout.split_view);
        let wanted = ViewRequest {
            cloud,
            camera: camera.limited_to(MAX_SIDE_PX),
            mode: layout.mode,
            second: Some(layout.second_mode).filter(|_| layout.split_view).filter(differs),
            others: others.map(|b| (b.cloud.clone(), b.settings.clone())).collect(),
            settings: self.overrides.over(state.render_settings(), self.on_gpu()),
            budget,
            photo: self.photo.as_ref().and_then(PhotoView::pixels),
            exposure: self.photo.as_ref().map(PhotoView::exposure).unwrap_or_default(),
            codes: semantics.is_some() && self.queries.wants_codes(),
            follow: budget == QualityBudget::Moving
                && (self.queries.tints() || self.picking.selected().is_some() || preview.is_some()),
            semantics,
            skip: SkipPasses::of(plan),
            on_device: self.display.shares_device(),
            timed: layout.times,
            ticket: 0,
        };
        if let Some((request, moved)) = self.requests.next(wanted) {
            self.render_thread.request(request);
            if moved != Moved::Nothing {
                self.queries.forget_maps(moved == Moved::Eye);
                self.display.forget_maps();
            }
        }
    }
}
