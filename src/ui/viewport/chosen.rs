//! Gaussians that are chosen to be deleted, as the view shows them: marked, or left out.

use crate::math::sh::SH_C0;
use crate::scene::GaussianCloud;

/// Magenta, which little in photos is.
const MARK: [f64; 3] = [1.0, 0.0, 0.8];
/// Opacity that marked Gaussians have at least, before the sigmoid, so that faint ones are seen.
const LEAST_OPACITY: f32 = -2.5;

/// A choice of Gaussians.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ChosenSplats {
    /// Whether each is chosen.
    pub(crate) of: Vec<bool>,
    pub(crate) count: usize,
    /// Whether they are left out of the view.
    pub(super) hide: bool,
}

impl ChosenSplats {
    pub(crate) fn new(of: Vec<bool>, hide: bool) -> Self {
        let count = of.iter().filter(|c| **c).count();
        Self { of, count, hide }
    }

    /// Whether a Gaussian is drawn.
    pub(super) fn draws(&self, i: usize) -> bool {
        !self.hide || self.of.get(i) != Some(&true)
    }

    /// Gives those that are chosen among `numbers` another color in `cloud`, which consists of these.
    pub(super) fn mark(&self, cloud: &mut GaussianCloud, numbers: &[usize]) {
        let stride = cloud.sh_stride();
        for (k, _) in numbers.iter().enumerate().filter(|(_, i)| self.of.get(**i) == Some(&true)) {
            let own = &mut cloud.sh[k * stride..(k + 1) * stride];
            own.fill([0.0; 3]);
            own[0] = MARK.map(|c| ((c - 0.5) / SH_C0) as f32);
            cloud.opacity_logits[k] = cloud.opacity_logits[k].max(LEAST_OPACITY);
        }
    }
}
