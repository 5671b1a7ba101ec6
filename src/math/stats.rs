//! Order statistics of small samples, and the largest of errors.
//!
//! [`worst`] fails on NaN and on empty input, so tests judge errors by it.

use super::Real;

/// Standard deviation of normally distributed values, as a multiple of the median of their sizes.
pub(crate) const OF_MAD: f64 = 1.4826;

/// The `q`-quantile (0 to 1) of `values` by linear interpolation; NaN for an empty sample.
pub(crate) fn quantile(values: &[f64], q: f64) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let mut v = values.to_vec();
    v.sort_by(f64::total_cmp);
    let at = q.clamp(0.0, 1.0) * (v.len() - 1) as f64;
    let (lo, hi) = (at.floor() as usize, at.ceil() as usize);
    v[lo] + (v[hi] - v[lo]) * (at - lo as f64)
}

/// The median; NaN for an empty sample.
pub(crate) fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// The arithmetic mean; NaN for an empty sample.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The largest of some errors, for judging them: NaN if one is NaN, which `max` would pass over, and for
/// none at all. A bound, held as `worst(..) < bound`, then holds for neither.
pub fn worst<R: Real>(errors: impl IntoIterator<Item = R>) -> f64 {
    let errors = errors.into_iter().map(Real::f64);
    errors.reduce(|w, e| if w.is_nan() || e.is_nan() { f64::NAN } else { w.max(e) }).unwrap_or(f64::NAN)
}

/// The [`worst`] difference of two lists, place by place; NaN if they are of different lengths.
pub fn worst_difference<A: Real, B: Real>(a: &[A], b: &[B]) -> f64 {
    if a.len() != b.len() {
        return f64::NAN;
    }
    worst(a.iter().zip(b).map(|(a, b)| (a.f64() - b.f64()).abs()))
}

/// PSNR in dB (peak 1) of a mean squared error; infinite for 0.
pub(crate) fn psnr_of(mse: f64) -> f64 {
    -10.0 * mse.log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_hides_from_the_worst() {
        assert_eq!(worst([0.5, 2.0, 1.0]), 2.0);
        assert_eq!(worst([1.0_f32, f32::INFINITY]), f64::INFINITY);
        for bad in [[f64::NAN, 1.0, 2.0], [1.0, f64::NAN, 2.0], [1.0, 2.0, f64::NAN]] {
            assert!(worst(bad).is_nan(), "{bad:?}");
        }
        assert!(worst([0.0_f64; 0]).is_nan(), "nothing was compared");
        assert_eq!(worst_difference(&[1.0_f32, 2.0], &[1.0_f64, 4.5]), 2.5);
        assert!(worst_difference(&[1.0_f32, 2.0], &[1.0_f32]).is_nan(), "one list is shorter");
        assert!(worst_difference(&[1.0, f64::NAN], &[1.0, 1.0]).is_nan());
        // Equal infinities are no agreement.
        assert!(worst_difference(&[f64::INFINITY], &[f64::INFINITY]).is_nan());
    }

    #[test]
    fn quantiles_of_any_place() {
        let v = [4.0, 1.0, 2.0, 8.0];
        let found = [0.0, 0.25, 0.5, 0.75, 1.0, -3.0, 7.0].map(|q| quantile(&v, q));
        // Sorted 1 2 4 8, places 0, 0.75, 1.5, 2.25, 3; outside of 0..1 the ends.
        assert_eq!(found, [1.0, 1.75, 3.0, 5.0, 8.0, 1.0, 8.0]);
        assert_eq!((mean(&v), mean(&[-3.0])), (3.75, -3.0));
        assert!(mean(&[]).is_nan() && median(&[]).is_nan());
    }
}
