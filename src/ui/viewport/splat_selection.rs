//! Gaussians chosen for deletion, as the view shows them: marked or hidden.

use crate::math::sh::SH_C0;
use crate::scene::GaussianCloud;

/// Magenta, which is rare in photos.
const MARK: [f64; 3] = [1.0, 0.0, 0.8];
/// Least opacity logit of marked Gaussians, so that faint ones are visible.
const LEAST_OPACITY: f32 = -2.5;

/// A choice of Gaussians.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct SplatSelection {
    /// True for each chosen Gaussian.
    pub(crate) of: Vec<bool>,
    pub(crate) count: usize,
    /// True if they are hidden in the view.
    pub(super) hide: bool,
}

impl SplatSelection {
    pub(crate) fn new(of: Vec<bool>, hide: bool) -> Self {
        let count = of.iter().filter(|c| **c).count();
        Self { of, count, hide }
    }

    /// Marks these Gaussians among `n`.
    pub(crate) fn of_numbers(n: usize, numbers: &[u32]) -> Self {
        let mut of = vec![false; n];
        numbers.iter().for_each(|i| of.get_mut(*i as usize).into_iter().for_each(|of| *of = true));
        Self::new(of, false)
    }

    /// True if a Gaussian is drawn.
    pub(super) fn draws(&self, i: usize) -> bool {
        !self.hide || self.of.get(i) != Some(&true)
    }

    /// Recolors the chosen Gaussians in `cloud`, which consists of `numbers` of the whole.
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
