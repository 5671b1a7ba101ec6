//! Relevancy: the advantage of a phrase over the canonical phrases in describing a picture; and semantic deviation,
//! which moves a part's feature toward its whole's.
//!
//! The paper's score `min_i exp(q) / (exp(q) + exp(c_i))` is `sigmoid(tau d)` with
//! `d = q - max_i c_i` and temperature `tau = 1`; `q`, `c` are cosines. Order and the crossing at
//! one half do not depend on the temperature; the spread does.

use crate::math::Real;
use crate::math::vector::{dot, unit};

/// Advantage of a feature's similarity to the query over that to the nearest `canonical` phrase. Positive for an
/// identity that answers the query.
pub fn advantage(feature: &[f32], query: &[f32], canonical: &[Vec<f32>]) -> f32 {
    dot(feature, query) - nearest(canonical.iter().map(|c| dot(feature, c)))
}

/// Similarity to the nearest canonical phrase; 0 without any.
pub(crate) fn nearest(canonical: impl Iterator<Item = f32>) -> f32 {
    let nearest = canonical.fold(f32::NEG_INFINITY, f32::max);
    if nearest.is_finite() { nearest } else { 0.0 }
}

/// Share of LERF's scale from which a pixel belongs to the answer.
pub(crate) const LERFS_SHARE: f32 = 0.2;

/// Relevancy on LERF's scale: from one half (no more relevant than a canonical phrase) to the largest of the view.
pub(crate) fn on_lerfs_scale(relevancy: f32, most: f32) -> f32 {
    if most > 0.5 { (relevancy - 0.5) / (most - 0.5) } else { 0.0 }
}

/// The score of an advantage, 0 to 1.
pub fn score(advantage: f32, temperature: f32) -> f32 {
    1.0 / (1.0 + (-temperature * advantage).exp())
}

/// As [`score`], within a millionth, and free of branches so that loops over it vectorize.
#[inline(always)]
pub(crate) fn quick_score(advantage: f32, temperature: f32) -> f32 {
    let x = temperature * advantage;
    let e = Real::exp_neg(-x.abs());
    let upper = 1.0 / (1.0 + e);
    if x < 0.0 { e * upper } else { upper }
}

/// Moves a part's feature toward its whole's (the paper's semantic deviation) and normalizes it: the sum of two unit
/// vectors is shorter, which would penalize parts. `None` if the two cancel out.
pub fn deviate(part: &[f32], whole: &[f32], part_weight: f32) -> Option<Vec<f32>> {
    unit(&part.iter().zip(whole).map(|(p, o)| (1.0 - part_weight) * o + part_weight * p).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::scene::PART_WEIGHT;

    fn random(rng: &mut Pcg64Mcg) -> Vec<f32> {
        let v: Vec<f32> = (0..16).map(|_| rng.random_range(-1.0..1.0)).collect();
        unit(&v).expect("not zero")
    }

    #[test]
    fn the_stable_form_is_the_papers() {
        let mut rng = Pcg64Mcg::seed_from_u64(7);
        for _ in 0..500 {
            let (feature, query) = (random(&mut rng), random(&mut rng));
            let canonical: Vec<Vec<f32>> = (0..3).map(|_| random(&mut rng)).collect();
            let q = f64::from(dot(&feature, &query)).exp();
            let paper = canonical.iter().map(|c| q / (f64::from(dot(&feature, c)).exp() + q));
            let paper = paper.fold(f64::INFINITY, f64::min);
            let ours = f64::from(score(advantage(&feature, &query, &canonical), 1.0));
            assert!((paper - ours).abs() < 1e-6, "{paper} {ours}");
        }
    }

    #[test]
    fn order_and_the_crossing_do_not_depend_on_temperature() {
        let mut rng = Pcg64Mcg::seed_from_u64(8);
        for _ in 0..200 {
            let d: [f32; 2] = [rng.random_range(-0.5..0.5), rng.random_range(-0.5..0.5)];
            for tau in [0.1, 1.0, 10.0, 100.0] {
                let s = d.map(|d| score(d, tau));
                assert!((s[0] - s[1]) * (d[0] - d[1]) >= 0.0);
                assert!(d.iter().zip(s).all(|(d, s)| (s > 0.5) == (*d > 0.0) || d.abs() * tau < 1e-6));
            }
        }
    }

    #[test]
    fn extremes_stay_in_range() {
        for d in [-2.0, 0.0, 2.0, f32::MIN, f32::MAX] {
            for tau in [0.0, 1.0, 1e6] {
                let s = [score(d, tau), quick_score(d, tau)];
                assert!(s.iter().all(|s| (0.0..=1.0).contains(s)), "{d} {tau}: {s:?}");
            }
        }
        assert_eq!(advantage(&[1.0, 0.0], &[1.0, 0.0], &[]), 1.0);
    }

    #[test]
    fn the_quick_score_is_the_score() {
        let most = |quick: fn(f32, f32) -> f32| {
            let apart = |i: i32| (quick(i as f32 * 1e-3, 10.0) - score(i as f32 * 1e-3, 10.0)).abs();
            (-2_000..=2_000).map(apart).fold(0.0, f32::max)
        };
        assert!(most(quick_score) < 1e-6, "{}", most(quick_score));
        assert!(most(|d, tau| quick_score(d, tau * 1.001)) > 1e-4, "the control: another temperature");
        assert_eq!(quick_score(0.0, 10.0), 0.5);
    }

    #[test]
    fn deviation_goes_from_the_whole_to_the_part() {
        let mut rng = Pcg64Mcg::seed_from_u64(9);
        let (part, whole) = (random(&mut rng), random(&mut rng));
        assert!(dot(&deviate(&part, &whole, 1.0).expect("unit"), &part) > 1.0 - 1e-6);
        assert!(dot(&deviate(&part, &whole, 0.0).expect("unit"), &whole) > 1.0 - 1e-6);
        let mixed = deviate(&part, &whole, PART_WEIGHT).expect("unit");
        assert!((dot(&mixed, &mixed) - 1.0).abs() < 1e-5, "unit length");
        assert!(dot(&mixed, &whole) > dot(&part, &whole));
        assert_eq!(deviate(&[1.0, 0.0], &[-1.0, 0.0], 0.5), None, "opposites cancel out");
    }
}
