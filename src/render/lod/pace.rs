//! Number of Gaussians that fit into a time budget, learned from the times of pictures.

use std::sync::Arc;

use super::cut::FINEST_PX;
use super::{Cut, LodTree};
use crate::scene::Camera;

/// First number, and the fewest that still show the way of a flight.
const FIRST: usize = 60_000;
const FEWEST: usize = 15_000;
/// Most Gaussians: enough for any picture.
const MOST: usize = 4_000_000;
/// Seconds that a moving picture may take: thirty a second.
pub(crate) const MOVING_SECS: f64 = 0.030;
/// Share of the size of pictures of which something is left out: for the time of all pixels, more Gaussians show more.
const SCALE: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// By how much a single picture changes the number at most, and the share of the time that is aimed at, as the next
/// picture may take longer.
const STEP: f64 = 1.3;
const AIM: f64 = 0.9;

/// A number of Gaussians that keeps to a budget of time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    most: usize,
    /// Grain at which the next cut starts its search.
    grain_px: f64,
    /// True if the last cut used up the number.
    full: bool,
}

impl Default for Pace {
    fn default() -> Self {
        Self { most: FIRST, grain_px: 1.0, full: false }
    }
}

impl Pace {
    /// Cut for a view.
    pub(crate) fn cut(&mut self, tree: &Arc<LodTree>, camera: &Camera, near: f64) -> Cut {
        let cut = Cut::of_budget(tree, camera, near, self.most, &mut self.grain_px);
        // Hysteresis where there is just enough time for all.
        self.full = self.grain_px > if self.full { FINEST_PX } else { 2.0 * FINEST_PX };
        cut
    }

    /// Returns whether visible Gaussians are left out for lack of time.
    pub(crate) fn leaves_out(&self) -> bool {
        self.full
    }

    /// The camera with pictures of the size that shows most.
    pub(crate) fn camera(&self, camera: &Camera) -> Camera {
        if !self.leaves_out() {
            return camera.clone();
        }
        let side = |s: u32| ((f64::from(s) * SCALE).round() as u32).max(1);
        camera.resized(side(camera.width_px), side(camera.height_px))
    }

    /// Learns from the time that the last cut took, given its budget.
    pub(crate) fn learn(&mut self, secs: f64, budget_secs: f64) {
        let factor = (AIM * budget_secs / secs.max(1e-6)).clamp(1.0 / STEP, STEP);
        // A picture of all Gaussians says nothing about more of them.
        if self.full || factor < 1.0 {
            self.most = ((self.most as f64 * factor.sqrt()) as usize).clamp(FEWEST, MOST);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_follows_the_time() {
        // A machine on which each Gaussian takes 0.2 microseconds and the rest 5 ms.
        let secs = |pace: &Pace| 5e-3 + 2e-7 * pace.most as f64;
        let settle = |budget: f64| {
            let mut pace = Pace { full: true, ..Pace::default() };
            for _ in 0..60 {
                pace.learn(secs(&pace), budget);
            }
            pace
        };
        for budget in [0.03, 0.12] {
            let found = secs(&settle(budget));
            assert!((found / (AIM * budget) - 1.0).abs() < 0.05, "{found} of {budget}");
        }
        assert_eq!(settle(1e-3).most, FEWEST, "never less");
        // A cloud that is drawn whole in less time does not raise the number without end.
        let mut pace = Pace::default();
        (0..60).for_each(|_| pace.learn(1e-3, 0.03));
        assert_eq!(pace.most, FIRST);
    }
}
