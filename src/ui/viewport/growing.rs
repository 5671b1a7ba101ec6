//! Poses that are being found: the cameras and sparse points known so far, in place of the first page or of photos that
//! are not trained. A result in the view stays there.

use std::sync::Arc;

use egui::{Align2, RichText, Sense, Ui};
use glam::DVec3;

use super::display::Display;
use super::eye::Eye;
use super::input::{SteeredView, Steering};
use super::overlay::card;
use super::request::Requests;
use super::show::{MAX_SIDE_PX, REST_SECS};
use super::split::ViewArea;
use super::{Viewport, frusta};
use crate::math::format;
use crate::pipeline::observer::FoundSoFar;
use crate::pipeline::train::TrainConfig;
use crate::render::RenderSettings;
use crate::scene::{Bounds, Camera, GaussianCloud, HomeView, PhotoExposure};
use crate::ui::ctx::Ctx;
use crate::ui::state::AppState;
use crate::worker::view::{QualityBudget, SkipPasses, ViewRequest};
use crate::worker::{JobId, PosesSnapshot, Tasks, Versioned, ViewMode};

/// View of poses that are being found.
#[derive(Default)]
pub(super) struct GrowingView {
    /// Generation of the newest snapshot.
    seen: u64,
    shown: Option<GrownPoses>,
}

/// Poses on screen, with the eye that sees them.
struct GrownPoses {
    /// The search for them.
    job: JobId,
    snapshot: Arc<PosesSnapshot>,
    cloud: Option<Versioned<GaussianCloud>>,
    settings: RenderSettings,
    /// Radius of what the cameras look at.
    radius: f64,
    bounds: Bounds,
    eye: Eye,
    steering: Steering,
    /// Window time of the last camera motion, s.
    moved_at: f64,
    /// True if the user has turned the view, whose direction then stays.
    is_steered: bool,
    /// True until the view shows all of them.
    is_new: bool,
}

impl GrownPoses {
    /// The poses of a snapshot, in place of earlier ones of the same search; `None` without any camera.
    fn of(snapshot: Arc<PosesSnapshot>, before: Option<Self>) -> Option<Self> {
        let FoundSoFar { cameras, cloud, .. } = &snapshot.found;
        let bounds = bounds(cameras, cloud.as_deref())?;
        let home = HomeView::new(cameras, cloud.as_deref());
        let extent = Camera::extent_of(cameras.iter()).1;
        let mut now = Self {
            job: snapshot.job,
            cloud: cloud.clone().map(Versioned::new),
            settings: TrainConfig::default().render_settings(None, extent),
            radius: home.bounds.radius(),
            bounds,
            eye: Eye::framing(&bounds, home.up),
            steering: Steering::default(),
            moved_at: f64::NEG_INFINITY,
            is_steered: false,
            is_new: true,
            snapshot,
        };
        // Where the frame of the world turns between two snapshots, the user's direction stays that of the eye.
        if let Some(before) = before.filter(|before| before.job == now.job && before.is_steered) {
            now.eye = before.eye;
            now.eye.frame(&bounds);
            (now.steering, now.moved_at, now.is_steered) = (before.steering, before.moved_at, true);
        }
        Some(now)
    }

    /// Count of the poses, for display.
    fn text(&self) -> String {
        let FoundSoFar { cameras, cloud, photos } = &self.snapshot.found;
        let points = cloud.as_ref().map_or(0, |cloud| cloud.len());
        let (registered, photos) = (format::count(cameras.len() as u64), format::things(*photos, "photo"));
        format!("{registered} of {photos} have a pose  ·  {}", format::things(points, "point"))
    }

    /// Requests a new frame if anything has changed.
    fn request(
        &self,
        ui: &Ui,
        area: ViewArea,
        state: &AppState,
        display: &Display,
        requests: &mut Requests,
    ) -> Option<ViewRequest> {
        let rests = ui.input(|i| i.time) - self.moved_at - REST_SECS;
        if rests < 0.0 {
            ui.ctx().request_repaint_after_secs((-rests + 0.01) as f32);
        }
        let size = area.rect.size() * ui.pixels_per_point();
        let wanted = ViewRequest {
            cloud: self.cloud.clone()?,
            camera: self.eye.camera(size.x.round() as u32, size.y.round() as u32).limited_to(MAX_SIDE_PX),
            mode: ViewMode::Rgb,
            second: None,
            others: Vec::new(),
            settings: self.settings.clone(),
            budget: if rests < 0.0 { QualityBudget::Moving } else { QualityBudget::Shared },
            photo: None,
            exposure: PhotoExposure::default(),
            semantics: None,
            follow: false,
            codes: false,
            skip: SkipPasses::of(&state.plan),
            on_device: display.shares_device(),
            timed: false,
            ticket: 0,
        };
        requests.next(wanted).map(|(request, _)| request)
    }
}

impl Viewport {
    /// True if poses that are being found are on screen.
    pub(crate) fn shows_growth(&self) -> bool {
        self.growing.shown.is_some()
    }

    /// Takes over the newest snapshot of a search for poses; ends with the search.
    pub(super) fn follow_growth(&mut self, state: &AppState, tasks: &Tasks) {
        let shown_before = self.shows_growth();
        let before = self.growing.shown.take().filter(|shown| may_show(state, shown.job));
        let newer = tasks.poses().newer_than(self.growing.seen);
        self.growing.seen = newer.as_ref().map_or(self.growing.seen, |(generation, _)| *generation);
        self.growing.shown = match newer.filter(|(_, snapshot)| may_show(state, snapshot.job)) {
            Some((_, snapshot)) => GrownPoses::of(snapshot, before),
            None => before,
        };
        if self.shows_growth() != shown_before {
            // The frame on screen is of something else.
            self.display.clear();
            self.requests.forget();
        }
    }

    /// Draws them into the rest of `ui`.
    pub(crate) fn show_growth(&mut self, ui: &mut Ui, cx: &Ctx<'_>) {
        let Self { growing, display, requests, render_thread, .. } = self;
        let Some(shown) = &mut growing.shown else { return };
        let rect = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Poses found so far"));
        display.take(ui.ctx(), render_thread.pictures());
        if std::mem::take(&mut shown.is_new) {
            // A narrow view shows less.
            shown.eye.turn_to(&shown.bounds, f64::from(rect.width() / rect.height().max(1.0)));
        }
        let area = ViewArea { index: 0, rect, shown: rect, second: false, is_other: false };
        let steered = SteeredView { display, area, radius: shown.radius, tool_takes_drags: false };
        if shown.steering.steer(ui, &response, &mut shown.eye, &steered) {
            (shown.is_steered, shown.moved_at) = (true, ui.input(|i| i.time));
        }
        if let Some(request) = shown.request(ui, area, cx.state, display, requests) {
            render_thread.request(request);
        }
        display.paint(ui, area);
        let eye = display.overlay_camera(&shown.eye, rect);
        frusta::show_all(ui, rect, &eye, &shown.snapshot.found.cameras, frusta::size_in(shown.radius));
        let text = RichText::new(shown.text()).strong();
        card(ui, rect, "poses so far", Align2::LEFT_BOTTOM, 0.0, |ui| {
            ui.label(text);
        });
    }
}

/// True if the poses that this job finds may take the view: it is running, and no result is there.
fn may_show(state: &AppState, job: JobId) -> bool {
    let is_running = state.job.as_ref().is_some_and(|running| running.id == job);
    is_running && !state.is_trained() && state.beside.is_empty()
}

/// The part of the world with all cameras and most points.
fn bounds(cameras: &[Camera], cloud: Option<&GaussianCloud>) -> Option<Bounds> {
    let points = cloud.and_then(|cloud| Bounds::robust((0..cloud.len()).map(|i| cloud.world_position(i))));
    let centers: Vec<DVec3> = cameras.iter().map(|camera| camera.center).collect();
    let corners = points.iter().flat_map(|points| [points.min, points.max]);
    (!centers.is_empty()).then(|| Bounds::of(centers.iter().copied().chain(corners))).flatten()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::jobs::OpenedScene;
    use crate::pipeline::observer::Observer;
    use crate::ui::viewport::eye::is_in_view;
    use crate::worker::{Event, JobInfo, Stop};

    const JOB: JobId = JobId::Local(7);

    /// Cameras around a few points, all in a world of this scale.
    fn snapshot(scale: f64) -> Arc<PosesSnapshot> {
        let camera = |i: u32| {
            let a = f64::from(i);
            let center = DVec3::new(3.0 * a.cos(), 3.0 * a.sin(), 1.0) * scale;
            Camera::look_at(center, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid")
        };
        let positions = (0..20).map(|i| [(i as f32).sin(), (i as f32).cos(), 0.1].map(|v| v * scale as f32)).collect();
        let cloud = Some(Arc::new(GaussianCloud::isotropic(positions, -3.0, 3.0)));
        Arc::new(PosesSnapshot {
            job: JOB,
            found: FoundSoFar { cameras: (0..5).map(camera).collect(), cloud, photos: 9 },
        })
    }

    fn sees_all(shown: &GrownPoses) -> bool {
        let eye = shown.eye.camera(800, 600);
        let cameras = &shown.snapshot.found.cameras;
        is_in_view(&eye, &shown.bounds, 0.0)
            && cameras.iter().all(|c| is_in_view(&eye, &Bounds { min: c.center, max: c.center }, 0.0))
    }

    #[test]
    fn every_snapshot_is_framed_and_the_users_direction_stays() {
        let first = GrownPoses::of(snapshot(1.0), None).expect("cameras");
        assert!(sees_all(&first));
        assert_eq!(first.text(), "5 of 9 photos have a pose  ·  20 points");
        let forward = first.eye.forward();
        let mut second = GrownPoses::of(snapshot(50.0), Some(first)).expect("cameras");
        assert!(sees_all(&second) && second.eye.forward().distance(forward) < 1e-6);
        second.eye.orbit(0.7, 0.1);
        second.is_steered = true;
        let (turned, distance) = (second.eye.forward(), second.eye.distance());
        let third = GrownPoses::of(snapshot(2.0), Some(second)).expect("cameras");
        assert!(third.eye.forward() == turned && third.eye.distance() < 0.1 * distance && third.is_steered);
        assert!(sees_all(&third));
        // Control: the eye of the one before sees nothing of use.
        let other = GrownPoses { eye: third.eye.clone(), ..GrownPoses::of(snapshot(50.0), None).expect("cameras") };
        assert!(!sees_all(&other));
        let nothing = PosesSnapshot { job: JOB, found: FoundSoFar::default() };
        assert!(GrownPoses::of(Arc::new(nothing), None).is_none());
    }

    #[test]
    fn the_view_is_lent_to_a_search_until_it_ends() {
        for trained in [false, true] {
            let tasks = Tasks::start(Arc::new(|| ())).expect("threads");
            let mut viewport = Viewport::new(Arc::new(|| ())).expect("a thread");
            let mut state = AppState::default();
            state.scene = Some(Arc::new(OpenedScene { trained, ..OpenedScene::default() }));
            let found = snapshot(1.0).found.clone();
            let find = move |observer: &mut dyn Observer| {
                observer.poses(found);
                Ok::<_, Stop>(())
            };
            let _task = tasks.spawn(JobInfo::long("Finding camera poses"), find).expect("room");
            let mut has_ended = false;
            while !has_ended {
                let event = tasks.wait_event(Duration::from_secs(20)).expect("the job ends");
                has_ended = event.is_end();
                if has_ended {
                    viewport.update(&mut state, &tasks);
                    assert_eq!(viewport.shows_growth(), !trained);
                }
                state.apply(event);
            }
            viewport.update(&mut state, &tasks);
            assert!(!viewport.shows_growth());
        }
    }

    #[test]
    fn a_result_keeps_the_view() {
        let mut state = AppState::default();
        assert!(!may_show(&state, JOB), "nothing runs");
        state.apply(Event::Started(JOB, JobInfo::long("Finding camera poses")));
        assert!(may_show(&state, JOB) && !may_show(&state, JobId::Local(8)), "another job's");
        for trained in [false, true] {
            state.scene = Some(Arc::new(OpenedScene { trained, ..OpenedScene::default() }));
            assert_eq!(may_show(&state, JOB), !trained);
        }
    }
}
