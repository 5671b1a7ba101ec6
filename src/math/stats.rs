//! Order statistics of small samples.

/// The `q`-quantile (0 to 1) of `values` by linear interpolation; NaN for an empty sample.
pub fn quantile(values: &[f64], q: f64) -> f64 {
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
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// The arithmetic mean; NaN for an empty sample.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_interpolate() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[1.0, 2.0]), 1.5);
        assert_eq!(quantile(&[0.0, 10.0], 0.95), 9.5);
        assert!(median(&[]).is_nan());
    }

    #[test]
    fn quantiles_of_any_place() {
        let v = [4.0, 1.0, 2.0, 8.0];
        let found = [0.0, 0.25, 0.5, 0.75, 1.0, -3.0, 7.0].map(|q| quantile(&v, q));
        // Sorted 1 2 4 8, places 0, 0.75, 1.5, 2.25, 3; outside of 0..1 the ends.
        assert_eq!(found, [1.0, 1.75, 3.0, 5.0, 8.0, 1.0, 8.0]);
        assert_eq!((mean(&v), mean(&[-3.0])), (3.75, -3.0));
        assert!(mean(&[]).is_nan());
    }
}
