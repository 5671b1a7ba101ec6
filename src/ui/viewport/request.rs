//! Requests for new frames, sent after any change of their content.

use std::sync::Arc;

use egui::{Rect, Ui};

use super::Viewport;
use super::photo::PhotoView;
use super::selecting::SelectTool;
use super::visible::VisibleCloud;
use crate::render::RenderSettings;
use crate::scene::{Camera, GaussianCloud, PhotoPixels, SemanticMap};
use crate::ui::layout::Layout;
use crate::ui::state::AppState;
use crate::worker::view::{QualityBudget, SkipPasses, ViewRequest};
use crate::worker::{Versioned, ViewMode};

/// Rest after which the camera no longer counts as moving, s.
const REST_SECS: f64 = 0.15;
/// Longest side of a frame, px: more would add delay but no visible detail.
const MAX_SIDE_PX: u32 = 1600;

/// Content that the view shows now.
pub(super) struct Wanted {
    pub(super) cloud: Versioned<GaussianCloud>,
    pub(super) camera: Camera,
    pub(super) mode: ViewMode,
    /// Mode of the second view, if it differs.
    pub(super) second: Option<ViewMode>,
    /// Gaussians of the second view, if it shows another scene.
    pub(super) beside: Option<(Versioned<GaussianCloud>, RenderSettings)>,
    pub(super) settings: RenderSettings,
    pub(super) budget: QualityBudget,
    pub(super) photo: Option<Arc<PhotoPixels>>,
    /// Objects and parts, if identity maps are needed; with or without blended codes.
    pub(super) semantics: Option<Versioned<SemanticMap>>,
    pub(super) codes: bool,
    /// True if masks on screen follow the moving camera.
    pub(super) follow: bool,
    pub(super) skip: SkipPasses,
    /// True if the window can paint frames on the drawing device.
    pub(super) on_device: bool,
    pub(super) timed: bool,
}

/// Content of a requested frame: a change needs a new one.
#[derive(Clone, PartialEq)]
struct Key {
    camera: Camera,
    cloud: u64,
    semantics: Option<u64>,
    mode: ViewMode,
    second: Option<ViewMode>,
    beside: Option<u64>,
    settings: RenderSettings,
    budget: QualityBudget,
    with_photo: bool,
    codes: bool,
    follow: bool,
    skip: SkipPasses,
    timed: bool,
}

/// Change of the identities of a frame's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Moved {
    Nothing,
    /// The camera has moved.
    Eye,
    /// Gaussians or identities have changed.
    Scene,
}

/// State of the requests.
#[derive(Default)]
pub(super) struct Requests {
    last: Option<Key>,
    ticket: u64,
}

impl Requests {
    /// Ticket of the newest request.
    pub(super) fn ticket(&self) -> u64 {
        self.ticket
    }

    /// Forgets the last request, as the next frame is of another scene.
    pub(super) fn forget(&mut self) {
        self.last = None;
    }

    /// The request for `wanted`, unless it equals the last one and is not wanted `again`; and the change of its pixels.
    pub(super) fn next(&mut self, wanted: Wanted, again: bool) -> Option<(ViewRequest, Moved)> {
        let Wanted {
            cloud,
            camera,
            mode,
            second,
            beside,
            settings,
            budget,
            photo,
            semantics,
            codes,
            follow,
            skip,
            on_device,
            timed,
        } = wanted;
        let key = Key {
            camera: camera.clone(),
            cloud: cloud.generation(),
            semantics: semantics.as_ref().map(Versioned::generation),
            mode,
            second,
            beside: beside.as_ref().map(|b| b.0.generation()),
            settings: settings.clone(),
            budget,
            with_photo: photo.is_some(),
            codes,
            follow,
            skip,
            timed,
        };
        if self.last.as_ref() == Some(&key) && !again {
            return None;
        }
        let moved = match &self.last {
            Some(last) if last.cloud == key.cloud && last.semantics == key.semantics => {
                // A change of resolution alone does not change the identities of pixels.
                if last.camera == key.camera { Moved::Nothing } else { Moved::Eye }
            }
            _ => Moved::Scene,
        };
        self.last = Some(key);
        self.ticket += 1;
        let semantics = semantics.as_deref().cloned();
        let ticket = self.ticket;
        let request = ViewRequest {
            cloud,
            camera,
            mode,
            second,
            beside,
            settings,
            budget,
            photo,
            semantics,
            follow,
            codes,
            skip,
            on_device,
            timed,
            ticket,
        };
        Some((request, moved))
    }
}

impl Viewport {
    /// True if the camera moves.
    pub(super) fn moves(&self, now: f64) -> bool {
        now - self.moved_at < REST_SECS
    }

    /// Requests a new frame if anything has changed.
    pub(super) fn request(&mut self, ui: &Ui, shown: Rect, state: &AppState, layout: &Layout, now: f64) {
        let Some(cloud) = self.cloud.clone() else { return };
        let plan = &state.plan;
        let preview = self.select.as_ref().and_then(SelectTool::preview);
        let arranged = self.arrange.as_mut().and_then(|tool| tool.preview(&cloud, state.semantics.as_ref()));
        let (cloud, map) = arranged.unwrap_or_else(|| (cloud, state.semantics.clone()));
        let VisibleCloud { cloud, semantics, .. } = self.visibility.apply(&cloud, preview.or(map.as_ref()));
        let with_maps = plan.maps.now(self.queries.wanted() || self.picking.wanted()) || preview.is_some();
        let semantics = semantics.filter(|_| with_maps);
        let rests = now - self.moved_at - REST_SECS;
        if rests < 0.0 {
            ui.ctx().request_repaint_after_secs((-rests + 0.01) as f32);
        }
        let busy = state.job.as_ref().is_some_and(|j| !j.paused);
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
        let beside = state.beside.as_ref().map(|b| (b.cloud.clone(), b.settings.clone()));
        let wanted = Wanted {
            cloud,
            camera: camera.limited_to(MAX_SIDE_PX),
            mode: layout.mode,
            second: layout
                .split_view
                .then_some(layout.second_mode)
                .filter(|mode| *mode != layout.mode || state.beside.is_some()),
            beside: beside.filter(|_| layout.split_view),
            settings: self.overrides.over(state.render_settings(), self.on_gpu()),
            budget,
            photo: self.photo.as_ref().and_then(PhotoView::pixels),
            codes: semantics.is_some() && self.queries.wants_codes(),
            follow: budget == QualityBudget::Moving
                && (self.queries.tints() || self.picking.selected().is_some() || preview.is_some()),
            semantics,
            skip: SkipPasses::of(plan),
            on_device: self.display.shares_device(),
            timed: layout.times,
        };
        if let Some((request, moved)) = self.requests.next(wanted, false) {
            self.lane.request(request);
            if moved != Moved::Nothing {
                self.queries.forget_maps(moved == Moved::Eye);
                self.display.forget_maps();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_frame_is_asked_for_once_and_anew_as_anything_changes() {
        let cloud = Versioned::new(Arc::new(GaussianCloud::default()));
        let photo = Arc::new(PhotoPixels { width_px: 1, height_px: 1, rgb: vec![[0; 3]], coverage: None, alpha: None });
        let wanted = |change: &dyn Fn(&mut Wanted)| {
            let mut wanted = Wanted {
                cloud: cloud.clone(),
                camera: Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 8, 8).expect("valid"),
                mode: ViewMode::Rgb,
                second: None,
                beside: None,
                settings: RenderSettings::default(),
                budget: QualityBudget::Full,
                photo: None,
                semantics: None,
                codes: false,
                follow: false,
                skip: SkipPasses { parts: true, gpu: true, levels: true },
                on_device: false,
                timed: false,
            };
            change(&mut wanted);
            wanted
        };
        let mut requests = Requests::default();
        let mut next = |change: &dyn Fn(&mut Wanted), again| {
            let next = requests.next(wanted(change), again);
            next.map(|(request, moved)| (request.ticket, moved))
        };
        assert_eq!(next(&|_| {}, false), Some((1, Moved::Scene)), "the first");
        assert_eq!(next(&|_| {}, false), None, "nothing has changed");
        assert_eq!(next(&|_| {}, true), Some((2, Moved::Nothing)));
        // Each alone causes a request; the first three leave the pixels in place.
        assert_eq!(next(&|w| w.budget = QualityBudget::Moving, false), Some((3, Moved::Nothing)));
        assert_eq!(next(&|w| w.settings.sh_degree = 1, false), Some((4, Moved::Nothing)));
        assert_eq!(next(&|w| w.photo = Some(Arc::clone(&photo)), false), Some((5, Moved::Nothing)));
        assert_eq!(next(&|w| w.second = Some(ViewMode::Depth), false), Some((6, Moved::Nothing)));
        let other = Versioned::new(Arc::clone(&cloud));
        let beside = |w: &mut Wanted| w.beside = Some((other.clone(), RenderSettings::default()));
        assert_eq!(next(&beside, false), Some((7, Moved::Nothing)));
        assert_eq!(next(&|w| w.camera.center.x += 1.0, false), Some((8, Moved::Eye)));
        assert_eq!(next(&|_| {}, false), Some((9, Moved::Eye)), "and back");
        // The same Gaussians in a new generation.
        let newer = Versioned::new(Arc::clone(&cloud));
        assert_eq!(next(&|w| w.cloud = newer.clone(), false), Some((10, Moved::Scene)));
        assert_eq!(next(&|w| w.cloud = newer.clone(), false), None);
        requests.forget();
        assert!(requests.next(wanted(&|w| w.cloud = newer.clone()), false).is_some(), "another scene");
    }
}
