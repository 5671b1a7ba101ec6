//! Adaptive density control: where Gaussians are added, split and removed (3DGS section 5.2).

use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use crate::math::Real;
pub use crate::render::DensityStats;
use crate::scene::GaussianCloud;

/// Mean screen gradient (loss per half picture side) above which a region is under-reconstructed.
const GROW_GRADIENT: f32 = 2e-4;
/// Share of the scene's extent above which a Gaussian is split rather than cloned.
const SPLIT_EXTENT: f64 = 0.01;
/// Share of the scene's extent above which a Gaussian is removed, after the first opacity reset.
const PRUNE_EXTENT: f64 = 0.3;
/// Share of the picture's longer side above which a splat is removed, after the first reset.
const PRUNE_SCREEN: f32 = 0.3;
/// Opacity under which a Gaussian is removed.
const PRUNE_OPACITY: f32 = 0.005;
/// Opacities are lowered to this by a reset.
const RESET_OPACITY: f64 = 0.01;
/// Split Gaussians shrink by this.
const SPLIT_SHRINK: f32 = 1.6;

/// What a round of density control did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DensityReport {
    pub(crate) cloned: usize,
    /// Large Gaussians replaced by two.
    pub(crate) split: usize,
    pub(crate) pruned: usize,
    /// Growth left out for lack of budget.
    pub(crate) refused: usize,
}

/// Runs density control on the cloud and its optimizer moments. `extent` as in
/// `Dataset::camera_extent`; `budget` is the most Gaussians allowed; large ones are removed only
/// if `prune_large`.
pub fn control(
    cloud: &mut GaussianCloud,
    moments: &mut [GaussianCloud; 2],
    stats: &DensityStats,
    extent: f64,
    budget: usize,
    prune_large: bool,
    rng: &mut Pcg64Mcg,
) -> DensityReport {
    let n = cloud.len();
    let widest = |c: &GaussianCloud, i: usize| c.log_scales[i].iter().fold(f32::NEG_INFINITY, |m, &s| m.max(s)).exp();
    let mean_gradient = |i: usize| stats.gradient[i] / stats.seen[i].max(1) as f32;
    let mut growing: Vec<usize> = (0..n).filter(|&i| mean_gradient(i) > GROW_GRADIENT).collect();
    let room = budget.saturating_sub(n);
    let refused = growing.len().saturating_sub(room);
    if refused > 0 {
        growing.sort_by(|&a, &b| mean_gradient(b).total_cmp(&mean_gradient(a)).then(a.cmp(&b)));
        growing.truncate(room);
        growing.sort_unstable();
    }
    let (split, clone): (Vec<usize>, Vec<usize>) =
        growing.into_iter().partition(|&i| f64::from(widest(cloud, i)) > SPLIT_EXTENT * extent);

    let mut keep = vec![true; n];
    for &i in &split {
        keep[i] = false;
    }
    let mut pruned = 0;
    for i in 0..n {
        let faint = cloud.opacity_logits[i].sigmoid() < PRUNE_OPACITY;
        let large =
            prune_large && (f64::from(widest(cloud, i)) > PRUNE_EXTENT * extent || stats.radius[i] > PRUNE_SCREEN);
        if keep[i] && (faint || large) {
            keep[i] = false;
            pruned += 1;
        }
    }
    let survivors = (0..n).filter(|&i| keep[i]);
    let cloned = clone.iter().filter(|&&i| keep[i]).count();
    let halves = split.iter().flat_map(|&i| [i, i]);
    let source: Vec<usize> = survivors.chain(clone.iter().copied().filter(|&i| keep[i])).chain(halves).collect();
    let old = source.len() - cloned - 2 * split.len();
    *cloud = cloud.select(&source);
    for m in moments.iter_mut() {
        *m = m.select(&source);
        forget(m, old);
    }
    for i in source.len() - 2 * split.len()..source.len() {
        scatter(cloud, i, rng);
    }
    DensityReport { cloned, split: split.len(), pruned, refused }
}

/// Zeroes moments from Gaussian `from` on.
fn forget(m: &mut GaussianCloud, from: usize) {
    let stride = m.sh_stride();
    m.positions[from..].fill([0.0; 3]);
    m.log_scales[from..].fill([0.0; 3]);
    m.quaternions[from..].fill([0.0; 4]);
    m.opacity_logits[from..].fill(0.0);
    m.sh[from * stride..].fill([0.0; 3]);
}

/// Moves a half of a split Gaussian to a sample of it and shrinks it.
fn scatter(cloud: &mut GaussianCloud, i: usize, rng: &mut Pcg64Mcg) {
    let Some(rotation) = crate::math::rotation::matrix_from_quaternion(cloud.quaternions[i]) else { return };
    let local = cloud.log_scales[i].map(|s| s.exp() * gaussian(rng));
    let mut place = cloud.positions[i];
    for (p, row) in place.iter_mut().zip(rotation) {
        *p += row[0] * local[0] + row[1] * local[1] + row[2] * local[2];
    }
    // One so large that a sample of it is nowhere stays where it is.
    if place.iter().all(|p| p.is_finite()) {
        cloud.positions[i] = place;
    }
    for s in &mut cloud.log_scales[i] {
        *s -= SPLIT_SHRINK.ln();
    }
}

/// A standard normal sample (Box-Muller).
pub(super) fn gaussian(rng: &mut Pcg64Mcg) -> f32 {
    let u: f64 = rng.random_range(f64::MIN_POSITIVE..1.0);
    let v: f64 = rng.random_range(0.0..std::f64::consts::TAU);
    ((-2.0 * u.ln()).sqrt() * v.cos()) as f32
}

/// Lowers every opacity to at most 0.01 and forgets the opacities' moments.
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

    fn setup(n: usize) -> (GaussianCloud, [GaussianCloud; 2], DensityStats, Pcg64Mcg) {
        let cloud = GaussianCloud {
            sh: vec![[1.0; 3]; n],
            ..GaussianCloud::isotropic((0..n).map(|i| [i as f32, 0.0, 0.0]).collect(), -9.0, 0.0)
        };
        let m = cloud.clone();
        (cloud, [m.clone(), m], DensityStats { seen: vec![1; n], ..DensityStats::new(n) }, Pcg64Mcg::seed_from_u64(1))
    }

    #[test]
    fn small_ones_are_cloned_large_ones_split_faint_ones_removed() {
        let (mut cloud, mut moments, mut stats, mut rng) = setup(4);
        stats.gradient = vec![1.0, 1.0, 0.0, 0.0];
        cloud.log_scales[1] = [0.0; 3];
        cloud.opacity_logits[2] = -20.0;
        let report = control(&mut cloud, &mut moments, &stats, 1.0, 100, false, &mut rng);
        assert_eq!(report, DensityReport { cloned: 1, split: 1, pruned: 1, refused: 0 });
        // 0 and 3 survive, 0 is cloned, 1 becomes two.
        assert_eq!(cloud.len(), 5);
        cloud.validate().expect("valid");
        assert_eq!(cloud.positions[2], [0.0; 3]);
        assert!((cloud.log_scales[4][0] + SPLIT_SHRINK.ln()).abs() < 1e-6);
        assert_ne!(cloud.positions[3], cloud.positions[4]);
        assert_eq!(moments[0].positions[1], [3.0, 0.0, 0.0]);
        assert!(moments[1].sh[2..].iter().all(|v| *v == [0.0; 3]));
    }

    #[test]
    fn the_budget_takes_the_neediest() {
        let (mut cloud, mut moments, mut stats, mut rng) = setup(10);
        stats.gradient = (0..10).map(|i| i as f32).collect();
        let report = control(&mut cloud, &mut moments, &stats, 1.0, 12, false, &mut rng);
        assert_eq!((report.cloned, report.refused), (2, 7));
        assert_eq!(cloud.positions[10][0], 8.0);
        assert_eq!(cloud.positions[11][0], 9.0);
    }

    #[test]
    fn large_ones_go_only_when_asked() {
        let (mut cloud, mut moments, stats, mut rng) = setup(3);
        cloud.log_scales[1] = [2.0; 3];
        assert_eq!(control(&mut cloud, &mut moments, &stats, 1.0, 9, false, &mut rng).pruned, 0);
        assert_eq!(control(&mut cloud, &mut moments, &stats, 1.0, 9, true, &mut rng).pruned, 1);
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
