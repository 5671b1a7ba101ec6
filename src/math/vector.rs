//! Vectors of any length.

use super::Real;
use super::lanes::{LANES, LaneOp, Lanes};

/// The vector with unit length; `None` for one that is zero or not finite.
pub fn unit(v: &[f32]) -> Option<Vec<f32>> {
    // In f64, so that neither tiny nor huge entries spoil the sum of squares.
    let length = v.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
    (length.is_finite() && length > 0.0).then(|| v.iter().map(|x| (f64::from(*x) / length) as f32).collect())
}

/// Scalar product; of two vectors of unit length, their cosine.
pub fn dot(a: &[f32], b: &[f32]) -> f32 {
    f32::vectorize(Dot { a, b })
}

struct Dot<'a> {
    a: &'a [f32],
    b: &'a [f32],
}

impl LaneOp<f32> for Dot<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes<f32>>(self, l: L) -> f32 {
        let (a, a_rest) = self.a.as_chunks::<LANES>();
        let (b, b_rest) = self.b.as_chunks::<LANES>();
        // Two sums side by side, because one alone would wait for itself at every step.
        let (mut even, mut odd) = (l.splat(0.0), l.splat(0.0));
        let (mut k, n) = (0, a.len().min(b.len()));
        while k + 1 < n {
            even = l.mul_add(l.load(&a[k]), l.load(&b[k]), even);
            odd = l.mul_add(l.load(&a[k + 1]), l.load(&b[k + 1]), odd);
            k += 2;
        }
        if k < n {
            even = l.mul_add(l.load(&a[k]), l.load(&b[k]), even);
        }
        let rest: f32 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
        l.sum(l.add(even, odd)) + rest
    }
}

/// Adds `by` times a vector to another one, as far as both reach.
pub fn add_scaled(out: &mut [f32], from: &[f32], by: f32) {
    f32::vectorize(AddScaled { out, from, by });
}

struct AddScaled<'a> {
    out: &'a mut [f32],
    from: &'a [f32],
    by: f32,
}

impl LaneOp<f32> for AddScaled<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<f32>>(self, l: L) {
        let (out, out_rest) = self.out.as_chunks_mut::<LANES>();
        let (from, from_rest) = self.from.as_chunks::<LANES>();
        let by = l.splat(self.by);
        let (mut k, n) = (0, out.len().min(from.len()));
        while k < n {
            out[k] = l.store(l.mul_add(by, l.load(&from[k]), l.load(&out[k])));
            k += 1;
        }
        out_rest.iter_mut().zip(from_rest).for_each(|(out, from)| *out += self.by * from);
    }
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
