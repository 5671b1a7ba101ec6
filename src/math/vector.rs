//! Vectors of any length.

/// The vector with unit length; `None` for one that is zero or not finite.
pub fn unit(v: &[f32]) -> Option<Vec<f32>> {
    // In f64, so that neither tiny nor huge entries spoil the sum of squares.
    let length = v.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
    (length.is_finite() && length > 0.0).then(|| v.iter().map(|x| (f64::from(*x) / length) as f32).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_have_a_direction_or_none() {
        assert_eq!(unit(&[3.0, 0.0, 4.0]), Some(vec![0.6, 0.0, 0.8]));
        assert_eq!(unit(&[f32::MAX, 0.0]), Some(vec![1.0, 0.0]));
        assert_eq!(unit(&[1e-38, 0.0]), Some(vec![1.0, 0.0]));
        for none in [&[0.0, 0.0][..], &[], &[f32::NAN, 1.0], &[f32::INFINITY]] {
            assert_eq!(unit(none), None);
        }
    }
}
