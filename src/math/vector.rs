//! Vectors of any length.

/// The vector with unit length; `None` for one that is zero or not finite.
pub fn unit(v: &[f32]) -> Option<Vec<f32>> {
    // In f64, so that neither tiny nor huge entries spoil the sum of squares.
    let length = v.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
    (length.is_finite() && length > 0.0).then(|| v.iter().map(|x| (f64::from(*x) / length) as f32).collect())
}

/// Scalar product; of two vectors of unit length, their cosine.
pub fn dot(a: &[f32], b: &[f32]) -> f32 {
    // Eight sums side by side, because one alone would wait for itself at every step.
    let mut sums = [0.0_f32; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f32 = a8.remainder().iter().zip(b8.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a8.zip(b8) {
        sums.iter_mut().zip(a.iter().zip(b)).for_each(|(sum, (a, b))| *sum += a * b);
    }
    sums.iter().sum::<f32>() + rest
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

    #[test]
    fn products_of_any_length_are_summed() {
        for n in [0, 1, 7, 8, 9, 128, 131] {
            let a: Vec<f32> = (0..n).map(|i| (i as f32 * 0.37).sin()).collect();
            let b: Vec<f32> = (0..n).map(|i| (i as f32 * 0.61).cos()).collect();
            let plain: f64 = a.iter().zip(&b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
            assert!((f64::from(dot(&a, &b)) - plain).abs() < 1e-5, "{n}");
        }
    }
}
