//! Requests for new frames, sent after any change of their content.

use crate::worker::view::ViewRequest;

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
    last: Option<ViewRequest>,
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

    /// The request with the next ticket, unless it is for the last frame; and the change of its pixels.
    pub(super) fn next(&mut self, wanted: ViewRequest) -> Option<(ViewRequest, Moved)> {
        if self.last.as_ref().is_some_and(|last| last.is_same_picture(&wanted)) {
            return None;
        }
        let moved = match &self.last {
            Some(last) if last.shows_same_scene(&wanted) => {
                // A change of resolution alone does not change the identities of pixels.
                if last.camera == wanted.camera { Moved::Nothing } else { Moved::Eye }
            }
            _ => Moved::Scene,
        };
        self.ticket += 1;
        let request = ViewRequest { ticket: self.ticket, ..wanted };
        self.last = Some(request.clone());
        Some((request, moved))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::render::RenderSettings;
    use crate::scene::{Camera, GaussianCloud, PhotoExposure, PhotoPixels};
    use crate::worker::view::{QualityBudget, SkipPasses};
    use crate::worker::{Versioned, ViewMode};

    #[test]
    fn a_frame_is_asked_for_once_and_anew_as_anything_changes() {
        let cloud = Versioned::new(Arc::new(GaussianCloud::default()));
        let photo = Arc::new(PhotoPixels { width_px: 1, height_px: 1, rgb: vec![[0; 3]], coverage: None, alpha: None });
        let wanted = |change: &dyn Fn(&mut ViewRequest)| {
            let mut wanted = ViewRequest {
                cloud: cloud.clone(),
                camera: Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 8, 8).expect("valid"),
                mode: ViewMode::Rgb,
                second: None,
                others: Vec::new(),
                settings: RenderSettings::default(),
                budget: QualityBudget::Full,
                photo: None,
                exposure: PhotoExposure::default(),
                semantics: None,
                codes: false,
                follow: false,
                skip: SkipPasses { parts: true, gpu: true, levels: true },
                on_device: false,
                timed: false,
                ticket: 0,
            };
            change(&mut wanted);
            wanted
        };
        let mut requests = Requests::default();
        let mut next = |change: &dyn Fn(&mut ViewRequest)| {
            let next = requests.next(wanted(change));
            next.map(|(request, moved)| (request.ticket, moved))
        };
        assert_eq!(next(&|_| {}), Some((1, Moved::Scene)), "the first");
        assert_eq!(next(&|_| {}), None, "nothing has changed");
        // Each alone causes a request; the first three leave the pixels in place.
        assert_eq!(next(&|w| w.budget = QualityBudget::Moving), Some((2, Moved::Nothing)));
        assert_eq!(next(&|w| w.settings.sh_degree = 1), Some((3, Moved::Nothing)));
        assert_eq!(next(&|w| w.photo = Some(Arc::clone(&photo))), Some((4, Moved::Nothing)));
        assert_eq!(next(&|w| w.second = Some(ViewMode::Depth)), Some((5, Moved::Nothing)));
        let other = Versioned::new(Arc::clone(&cloud));
        let others = |w: &mut ViewRequest| w.others.push((other.clone(), RenderSettings::default()));
        assert_eq!(next(&others), Some((6, Moved::Nothing)));
        assert_eq!(next(&|w| w.camera.center.x += 1.0), Some((7, Moved::Eye)));
        assert_eq!(next(&|_| {}), Some((8, Moved::Eye)), "and back");
        // The same Gaussians in a new generation.
        let newer = Versioned::new(Arc::clone(&cloud));
        assert_eq!(next(&|w| w.cloud = newer.clone()), Some((9, Moved::Scene)));
        assert_eq!(next(&|w| w.cloud = newer.clone()), None);
        requests.forget();
        assert!(requests.next(wanted(&|w| w.cloud = newer.clone())).is_some(), "another scene");
    }
}
