//! Views of the photos that are weighed again and again, kept within a budget of memory. Views beyond it are drawn anew,
//! with the same weights but for a last ten-thousandth of the light, which drawing may leave out.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};

use crate::render::{KeptView, RenderSettings, Renderer, ViewWeights};
use crate::scene::{Camera, GaussianCloud};

/// Memory of all kept views while labels are lifted. A view takes 56 to 60 bytes for each Gaussian that has a weight in
/// it, and 8 for each tile that such a Gaussian reaches.
pub(crate) const KEPT_BYTES: usize = 512 << 20;

/// Kept views of one size, by photo.
pub(crate) struct KeptViews {
    views: Vec<OnceLock<KeptView>>,
    budget_bytes: usize,
    bytes: AtomicUsize,
    /// True once a view did not fit.
    is_full: AtomicBool,
}

impl KeptViews {
    /// No view of so many photos yet.
    pub(crate) fn new(photos: usize, budget_bytes: usize) -> Self {
        let views = (0..photos).map(|_| OnceLock::new()).collect();
        Self { views, budget_bytes, bytes: AtomicUsize::new(0), is_full: AtomicBool::new(budget_bytes == 0) }
    }

    /// Memory that the views take.
    pub(crate) fn bytes(&self) -> usize {
        self.bytes.load(Relaxed)
    }

    /// The weights in a photo's view: of the kept one, or drawn.
    pub(crate) fn weights<'a>(
        &'a self,
        photo: usize,
        renderer: &'a mut Renderer,
        cloud: &'a GaussianCloud,
        camera: &'a Camera,
        settings: &'a RenderSettings,
    ) -> ViewWeights<'a> {
        let size = [camera.width_px as usize, camera.height_px as usize];
        match self.views.get(photo).and_then(OnceLock::get).filter(|kept| kept.size_px() == size) {
            Some(kept) => ViewWeights::kept(kept, cloud, camera),
            None => renderer.weights(cloud, camera, settings),
        }
    }

    /// The same view, which [`Self::offer`] can keep after the first pass if there is room.
    pub(crate) fn watch<'a>(&self, view: ViewWeights<'a>) -> ViewWeights<'a> {
        if self.is_full.load(Relaxed) { view } else { view.noting() }
    }

    /// Keeps a watched view, if it fits. A photo's first view is kept.
    pub(crate) fn offer(&self, photo: usize, view: ViewWeights<'_>) {
        let (Some(place), Some(kept)) = (self.views.get(photo), view.keep()) else { return };
        let bytes = kept.bytes();
        let fits = self.bytes.fetch_add(bytes, Relaxed) + bytes <= self.budget_bytes;
        if !fits {
            self.is_full.store(true, Relaxed);
        }
        if !fits || place.set(kept).is_err() {
            self.bytes.fetch_sub(bytes, Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::pipeline::semantics::lifting::view_votes::ViewVotes;
    use crate::pipeline::semantics::lifting::votes::{Assignment, LEAST_VOTES, Votes};
    use crate::pipeline::semantics::view_map::ViewMap;
    use crate::render;
    use crate::scene::{Identities, IdentityId};

    const SIDES: [u32; 2] = [64, 48];

    fn cloud() -> GaussianCloud {
        let place = |i: usize| [(i % 30) as f32 * 0.1 - 1.5, (i / 30) as f32 * 0.1 - 1.0, 0.3 * (i % 3) as f32];
        GaussianCloud::isotropic((0..600).map(place).collect(), -2.6, 1.0)
    }

    fn camera(k: usize) -> Camera {
        let from = DVec3::new(0.4 * k as f64 - 0.6, 0.1, -3.0);
        Camera::look_at(from, DVec3::ZERO, DVec3::NEG_Y, 0.8, SIDES[0], SIDES[1]).expect("valid")
    }

    /// Areas, id maps and decisions of four views, in passes like those of lifting.
    fn lifted(views: &KeptViews, shift: usize) -> (Vec<Vec<f32>>, Vec<ViewMap>, Vec<Assignment>) {
        let (cloud, settings, all) = (cloud(), RenderSettings::default(), Identities::objects(2));
        let (mut renderer, mut votes) = (Renderer::new(), Votes::new(cloud.len()));
        let mut areas = Vec::new();
        for k in 0..4 {
            let camera = camera(k + shift);
            let mut view = views.watch(renderer.weights(&cloud, &camera, &settings));
            areas.push(ViewVotes::areas_of(&mut view).expect("weighed"));
            views.offer(k, view);
            votes.note(&areas[k]);
        }
        let mut maps = Vec::new();
        for k in 0..4 {
            let camera = camera(k + shift);
            let of: Vec<IdentityId> = votes.decide(&all, LEAST_VOTES).iter().map(|a| a.identity).collect();
            let mut view = views.weights(k, &mut renderer, &cloud, &camera, &settings);
            maps.push(ViewMap::of(&mut view, &of, &all).expect("weighed"));
            let label = |i: usize| if i % SIDES[0] as usize % 40 < 20 + 4 * k { 1 } else { 2 };
            let labels: Vec<IdentityId> = (0..(SIDES[0] * SIDES[1]) as usize).map(label).collect();
            votes.add(&ViewVotes::of(&mut view, &labels).expect("weighed")).expect("finite");
        }
        (areas, maps, votes.decide(&all, LEAST_VOTES))
    }

    #[test]
    fn kept_views_and_views_beyond_the_budget_give_the_same_areas_maps_and_votes() {
        let kept = KeptViews::new(4, KEPT_BYTES);
        let all = lifted(&kept, 0);
        assert!(kept.views.iter().all(|v| v.get().is_some()) && kept.bytes() > 0 && !kept.is_full.load(Relaxed));
        assert!(all.1[3].identity.contains(&1) && all.1[3].identity.contains(&2));
        assert!(all.1[0].identity.contains(&render::UNKNOWN));
        // Room for two of the four, and for none.
        for (budget, count) in [(kept.bytes() * 5 / 8, 2), (1, 0), (0, 0)] {
            let some = KeptViews::new(4, budget);
            assert!(lifted(&some, 0) == all, "bit by bit, with {count} kept");
            assert_eq!(some.views.iter().filter(|v| v.get().is_some()).count(), count);
            assert!(some.bytes() <= budget && some.is_full.load(Relaxed));
        }
        // Again, on what is kept now.
        assert!(lifted(&kept, 0) == all);
        let other = lifted(&KeptViews::new(4, KEPT_BYTES), 1);
        assert!(other.0 != all.0 && other.1 != all.1 && other.2 != all.2, "the control, of other cameras");
        // A view of another size is not taken for it.
        let (cloud, settings, mut renderer) = (cloud(), RenderSettings::default(), Renderer::new());
        let small = camera(0).limited_to(32);
        let areas = |view: &mut ViewWeights<'_>| ViewVotes::areas_of(view).expect("weighed");
        let found = areas(&mut kept.weights(0, &mut renderer, &cloud, &small, &settings));
        assert_eq!(found, areas(&mut renderer.weights(&cloud, &small, &settings)));
        assert_ne!(found, all.0[0]);
    }
}
