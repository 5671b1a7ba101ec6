//! Adaptive density control: adds and removes Gaussians.
//!
//! Until control ends, the number of Gaussians grows to the budget by equal shares. The Gaussians with the largest
//! screen gradients since the last round, summed over all pictures, are split. (3DGS takes the mean over pictures and
//! everything above a threshold, and uses up its budget early.) Each is replaced by two that together look like it
//! (3DGS-MCMC, arXiv 2404.09591, equation 9), offset by samples of it, so that a split causes no flicker.

use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use crate::math::Real;
pub use crate::render::DensityStats;
use crate::scene::GaussianCloud;

/// Mean screen gradient (loss per half picture side) below which a region is reconstructed well enough.
const LEAST_GRADIENT: f32 = 2e-5;
/// Opacity below which a Gaussian is removed.
const PRUNE_OPACITY: f32 = 0.005;
/// Largest opacity after a reset.
const RESET_OPACITY: f64 = 0.01;
/// Factor on the sample of a Gaussian by which each half is offset.
const APART: f32 = 0.5;
/// Largest opacity in the formula of a split.
const MOST_OPAQUE: f32 = 0.999;

/// Limits of a round of density control.
#[derive(Clone, Copy, Debug)]
pub struct DensityRound {
    /// Most Gaussians when control ends.
    pub budget: usize,
    /// Rounds until then, this one included.
    pub rounds: u64,
    /// Gaussians at the front of the cloud that are neither split nor removed.
    pub frozen: usize,
}

/// Report of a round of density control.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DensityReport {
    /// Gaussians that were split in two.
    pub(crate) divided: usize,
    pub(crate) pruned: usize,
}

/// Runs density control on the cloud and its optimizer moments.
pub fn control(
    cloud: &mut GaussianCloud,
    moments: &mut [GaussianCloud; 2],
    stats: &DensityStats,
    round: &DensityRound,
    rng: &mut Pcg64Mcg,
) -> DensityReport {
    let n = cloud.len();
    // 3DGS also removes large ones after the first reset. This removed the background (docs/notes/density-control.md).
    let shows = |(i, o): (usize, &f32)| i < round.frozen || o.sigmoid() >= PRUNE_OPACITY;
    let stays: Vec<bool> = cloud.opacity_logits.iter().enumerate().map(shows).collect();
    let left = stays.iter().filter(|s| **s).count();
    let room = round.budget.saturating_sub(left).div_ceil(round.rounds.max(1) as usize);
    let needs = |i: usize| stats.gradient[i] >= LEAST_GRADIENT * stats.seen[i].max(1) as f32;
    let mut dividing: Vec<usize> = (round.frozen..n).filter(|&i| stays[i] && needs(i)).collect();
    if dividing.len() > room {
        dividing.sort_by(|&a, &b| stats.gradient[b].total_cmp(&stats.gradient[a]).then(a.cmp(&b)));
        dividing.truncate(room);
        dividing.sort_unstable();
    }
    let mut keep = stays;
    dividing.iter().for_each(|&i| keep[i] = false);
    let halves = dividing.iter().flat_map(|&i| [i, i]);
    let source: Vec<usize> = (0..n).filter(|&i| keep[i]).chain(halves).collect();
    let old = source.len() - 2 * dividing.len();
    *cloud = cloud.select(&source);
    for m in moments.iter_mut() {
        *m = m.select(&source);
        forget(m, old);
    }
    for i in old..source.len() {
        make_half(cloud, i, rng);
    }
    DensityReport { divided: dividing.len(), pruned: n - left }
}

/// Clears the moments from Gaussian `from` on.
fn forget(m: &mut GaussianCloud, from: usize) {
    let stride = m.sh_stride();
    m.positions[from..].fill([0.0; 3]);
    m.log_scales[from..].fill([0.0; 3]);
    m.quaternions[from..].fill([0.0; 4]);
    m.opacity_logits[from..].fill(0.0);
    m.sh[from * stride..].fill([0.0; 3]);
}

/// Turns a Gaussian into one of the two that replace it.
fn make_half(cloud: &mut GaussianCloud, i: usize, rng: &mut Pcg64Mcg) {
    let opacity = cloud.opacity_logits[i].sigmoid().min(MOST_OPAQUE);
    let through_one = (1.0 - opacity).sqrt();
    let half = opacity / (1.0 + through_one);
    let local = cloud.log_scales[i].map(|s| APART * s.exp() * gaussian(rng));
    cloud.opacity_logits[i] = (half / through_one).ln();
    let shrink = (opacity / (half * (2.0 - half * std::f32::consts::FRAC_1_SQRT_2))).ln();
    cloud.log_scales[i].iter_mut().for_each(|s| *s += shrink);
    let Some(rotation) = crate::math::rotation::matrix_from_quaternion(cloud.quaternions[i]) else { return };
    let mut place = cloud.positions[i];
    for (p, row) in place.iter_mut().zip(rotation) {
        *p += row[0] * local[0] + row[1] * local[1] + row[2] * local[2];
    }
    // The sample of a huge Gaussian may overflow; such a one keeps its position.
    if place.iter().all(|p| p.is_finite()) {
        cloud.positions[i] = place;
    }
}

/// Draws a standard normal sample (Box-Muller).
pub(super) fn gaussian(rng: &mut Pcg64Mcg) -> f32 {
    let u: f64 = rng.random_range(f64::MIN_POSITIVE..1.0);
    let v: f64 = rng.random_range(0.0..std::f64::consts::TAU);
    ((-2.0 * u.ln()).sqrt() * v.cos()) as f32
}

/// Lowers every opacity to at most 0.01 and clears the moments of the opacities.
pub(crate) fn reset_opacity(cloud: &mut GaussianCloud, moments: &mut [GaussianCloud; 2]) {
    let ceiling = (RESET_OPACITY / (1.0 - RESET_OPACITY)).ln() as f32;
    for o in &mut cloud.opacity_logits {
        *o = o.min(ceiling);
    }
    for m in moments {
        m.opacity_logits.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    const ROUND: DensityRound = DensityRound { budget: 100, rounds: 1, frozen: 0 };

    fn setup(n: usize) -> (GaussianCloud, [GaussianCloud; 2], DensityStats, Pcg64Mcg) {
        let cloud = GaussianCloud {
            sh: vec![[1.0; 3]; n],
            ..GaussianCloud::isotropic((0..n).map(|i| [i as f32, 0.0, 0.0]).collect(), -9.0, 0.0)
        };
        let m = cloud.clone();
        (cloud, [m.clone(), m], DensityStats { seen: vec![1; n], ..DensityStats::new(n) }, Pcg64Mcg::seed_from_u64(1))
    }

    #[test]
    fn what_moves_is_divided_and_what_is_faint_removed() {
        let (mut cloud, mut moments, mut stats, mut rng) = setup(4);
        stats.gradient = vec![1.0, 0.0, 1.0, 0.0];
        cloud.opacity_logits[2] = -20.0;
        let report = control(&mut cloud, &mut moments, &stats, &ROUND, &mut rng);
        assert_eq!(report, DensityReport { divided: 1, pruned: 1 });
        // 1 and 3 stay, 0 becomes two.
        assert_eq!(cloud.len(), 4);
        cloud.validate().expect("valid");
        assert_eq!([cloud.positions[0], cloud.positions[1]], [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]]);
        assert_ne!(cloud.positions[2], cloud.positions[3]);
        assert_eq!(moments[0].positions[1], [3.0, 0.0, 0.0]);
        assert!(moments[1].sh[2..].iter().all(|v| *v == [0.0; 3]));
    }

    #[test]
    fn frozen_gaussians_keep_their_place_and_all_their_bits() {
        let (before, mut moments, mut stats, mut rng) = setup(6);
        let mut cloud = before.clone();
        stats.gradient = vec![1.0; 6];
        cloud.opacity_logits = vec![-20.0; 6];
        let (frozen, before) = (4, cloud.clone());
        let report = control(&mut cloud, &mut moments, &stats, &DensityRound { frozen, ..ROUND }, &mut rng);
        assert_eq!(report, DensityReport { divided: 0, pruned: 2 });
        assert_eq!(cloud, before.select(&[0, 1, 2, 3]));
        let mut all = before;
        control(&mut all, &mut moments, &DensityStats::new(6), &ROUND, &mut rng);
        assert!(all.is_empty(), "the control: all are faint");
    }

    /// Both halves at one position have the transmittance and the integrated alpha of the original.
    #[test]
    fn two_halves_look_like_the_one() {
        for opacity in [0.004_f64, 0.3, 0.9, 0.998] {
            let (mut cloud, _, _, mut rng) = setup(1);
            cloud.opacity_logits[0] = (opacity / (1.0 - opacity)).ln() as f32;
            make_half(&mut cloud, 0, &mut rng);
            let half = f64::from(cloud.opacity_logits[0].sigmoid());
            assert!(((1.0 - half).powi(2) - (1.0 - opacity)).abs() < 1e-5, "{opacity}: {half}");
            // Summed along a line through the center: one Gaussian, and two overlaid.
            let line = |alpha: &dyn Fn(f64) -> f64| (-8_000..=8_000).map(|x| alpha(f64::from(x) * 1e-3)).sum::<f64>();
            let width = f64::from(cloud.log_scales[0][0] + 9.0).exp();
            let one = line(&|x| opacity * (-0.5 * x * x).exp());
            let each = |x: f64| half * (-0.5 * (x / width).powi(2)).exp();
            let two = line(&|x| 1.0 - (1.0 - each(x)).powi(2));
            assert!((two / one - 1.0).abs() < 1e-3, "{opacity}: {two} for {one}");
        }
    }

    #[test]
    fn growth_is_spread_over_the_rounds_and_goes_to_the_neediest() {
        let (mut cloud, mut moments, mut stats, mut rng) = setup(10);
        stats.gradient = (0..10).map(|i| i as f32).collect();
        let round = DensityRound { budget: 16, rounds: 3, frozen: 0 };
        assert_eq!(control(&mut cloud, &mut moments, &stats, &round, &mut rng).divided, 2);
        assert_eq!((cloud.len(), cloud.positions[7]), (12, [7.0, 0.0, 0.0]));
        // The sum counts, not the mean: a Gaussian in few pictures ranks below one in many.
        let (mut cloud, mut moments, mut stats, mut rng) = setup(2);
        (stats.gradient, stats.seen) = (vec![2.0, 3.0], vec![1, 10]);
        control(&mut cloud, &mut moments, &stats, &DensityRound { budget: 3, ..ROUND }, &mut rng);
        assert_eq!(cloud.positions[0], [0.0; 3]);
    }

    #[test]
    fn what_is_good_is_left_alone_and_a_full_budget_only_shrinks() {
        let (mut cloud, mut moments, mut stats, mut rng) = setup(3);
        stats.gradient = vec![LEAST_GRADIENT * 0.9; 3];
        assert_eq!(control(&mut cloud, &mut moments, &stats, &ROUND, &mut rng), DensityReport::default());
        stats.gradient = vec![1.0; 3];
        let full = DensityRound { budget: 2, ..ROUND };
        assert_eq!(control(&mut cloud, &mut moments, &stats, &full, &mut rng).divided, 0);
    }

    #[test]
    fn a_reset_lowers_but_never_raises() {
        let (mut cloud, mut moments, ..) = setup(2);
        cloud.opacity_logits = vec![5.0, -9.0];
        reset_opacity(&mut cloud, &mut moments);
        assert!((Real::sigmoid(cloud.opacity_logits[0]) - 0.01).abs() < 1e-6);
        assert_eq!(cloud.opacity_logits[1], -9.0);
    }
}
