//! The scalar that the CPU renderer is generic over: `f32` is the fast path, `f64` the oracle.

use super::lanes::{LaneOp, Plain};
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// A real number: the few operations that splatting needs, with stable forms of the
/// transcendental ones.
#[allow(missing_docs, reason = "each name says what it is")]
pub trait Real:
    Copy
    + Default
    + Send
    + Sync
    + PartialOrd
    + std::fmt::Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + Sum
    + 'static
{
    const ZERO: Self;
    const ONE: Self;
    const HALF: Self;
    fn of(x: f64) -> Self;
    fn f64(self) -> f64;
    fn f32(self) -> f32;
    fn sqrt(self) -> Self;
    /// Natural exponential, correctly rounded to a few ulp.
    fn exp(self) -> Self;
    /// Natural exponential of `x <= 0`, free of branches so that loops over it vectorize.
    /// Below -87 it returns a value under 2e-38. Relative error under 3e-7 in `f32`.
    fn exp_neg(self) -> Self;
    fn ln(self) -> Self;
    fn abs(self) -> Self;
    /// The smaller; the other operand if one is NaN.
    fn min(self, other: Self) -> Self;
    /// The larger; the other operand if one is NaN.
    fn max(self, other: Self) -> Self;
    fn is_finite(self) -> bool;

    /// Runs a vector computation with the best vectors that this machine has for this type.
    #[inline(always)]
    fn vectorize<O: LaneOp<Self>>(op: O) -> O::Output {
        op.run(Plain)
    }

    /// `1 / (1 + exp(-x))` without overflow for any `x`.
    #[inline(always)]
    fn sigmoid(self) -> Self {
        if self >= Self::ZERO {
            Self::ONE / (Self::ONE + (-self).exp())
        } else {
            let e = self.exp();
            e / (Self::ONE + e)
        }
    }
}

/// The constants, and the methods that are the type's own.
macro_rules! own {
    ($type:ident: $($method:ident($($other:ident)?) -> $out:ty),*) => {
        const ZERO: Self = 0.0;
        const ONE: Self = 1.0;
        const HALF: Self = 0.5;
        $(
            #[inline(always)]
            fn $method(self $(, $other: Self)?) -> $out {
                $type::$method(self $(, $other)?)
            }
        )*
    };
}

impl Real for f64 {
    own!(f64: sqrt() -> Self, ln() -> Self, abs() -> Self, min(other) -> Self, max(other) -> Self, is_finite() -> bool);
    fn of(x: f64) -> Self {
        x
    }
    fn f64(self) -> f64 {
        self
    }
    fn f32(self) -> f32 {
        self as f32
    }
    fn exp(self) -> Self {
        f64::exp(self)
    }
    fn exp_neg(self) -> Self {
        f64::exp(self)
    }
}

impl Real for f32 {
    own!(f32: sqrt() -> Self, ln() -> Self, abs() -> Self, min(other) -> Self, max(other) -> Self, is_finite() -> bool);
    #[inline(always)]
    fn of(x: f64) -> Self {
        x as f32
    }
    #[inline(always)]
    fn f64(self) -> f64 {
        f64::from(self)
    }
    #[inline(always)]
    fn f32(self) -> f32 {
        self
    }
    #[inline(always)]
    fn exp(self) -> Self {
        // The fast form holds for positive numbers too, up to where the exponent field ends.
        if self.abs() <= -super::fast_exp::SMALLEST { self.exp_neg() } else { f32::exp(self) }
    }
    #[inline(always)]
    fn exp_neg(self) -> Self {
        use super::fast_exp::{LN2_HI, LN2_LO, POLYNOMIAL, ROUND, SMALLEST};
        let x = if self < SMALLEST { SMALLEST } else { self };
        let shifted = x * std::f32::consts::LOG2_E + ROUND;
        let n = shifted - ROUND;
        let r = (x - n * LN2_HI) - n * LN2_LO;
        let y = POLYNOMIAL[1..].iter().fold(POLYNOMIAL[0], |p, c| p * r + c);
        // Only the low bits of `shifted` differ from those of ROUND, and those are n.
        f32::from_bits(y.to_bits().wrapping_add(shifted.to_bits() << 23))
    }
    #[inline(always)]
    fn vectorize<O: LaneOp<Self>>(op: O) -> O::Output {
        #[cfg(target_arch = "x86_64")]
        let op = match super::lanes::run_avx2(op) {
            Ok(output) => return output,
            Err(op) => op,
        };
        op.run(Plain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::stats::worst;

    #[test]
    fn fast_exponential_is_within_three_parts_in_ten_million() {
        let error = |i: u32| {
            let x = -(i as f32) * 1e-4;
            let exact = f64::from(x).exp();
            ((f64::from(x.exp_neg()) - exact) / exact).abs()
        };
        let worst = worst((0..=870_000).map(error));
        assert!(worst < 3e-7, "worst relative error {worst:e}");
        assert!((-1e30_f32).exp_neg() < 2e-38);
        assert_eq!(0.0_f32.exp_neg(), 1.0);
    }

    #[test]
    fn sigmoid_saturates_without_overflow() {
        for x in [-1e4, -80.0, 0.0, 80.0, 1e4] {
            assert!(Real::sigmoid(x as f32).is_finite());
            assert!((0.0..=1.0).contains(&Real::sigmoid(x)));
        }
    }

    /// Every operation of a type against the standard library in double precision.
    fn operations<R: Real>(near: f64) {
        let close = |found: R, expected: f64, what: &str| {
            assert!((found.f64() - expected).abs() <= near * expected.abs().max(1e-3), "{what}: {found:?} {expected}");
        };
        for x in [-3.25, -1.0, -0.125, 0.0, 0.5, 1.0, 2.75] {
            let r = R::of(x);
            close(r, x, "of");
            assert_eq!((r.f64(), r.f32()), (x, x as f32));
            close(r.exp(), x.exp(), "exp");
            close((-r.abs()).exp_neg(), (-x.abs()).exp(), "exp_neg");
            close(r.abs(), x.abs(), "abs");
            close(r.abs().sqrt(), x.abs().sqrt(), "sqrt");
            close((r.abs() + R::ONE).ln(), (x.abs() + 1.0).ln(), "ln");
            close(Real::sigmoid(r), 1.0 / (1.0 + (-x).exp()), "sigmoid");
            for y in [-2.0, 0.25] {
                close(r.min(R::of(y)), x.min(y), "min");
                close(r.max(R::of(y)), x.max(y), "max");
            }
            assert!(r.is_finite());
        }
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(!R::of(bad).is_finite());
        }
        // Over the range of the fast form, and under it.
        close(R::of(88.0).exp(), 88.0_f64.exp(), "exp");
        assert!(R::of(-100.0).exp().f64() < 1e-38 && R::of(-100.0).exp().f64() >= 0.0);
    }

    #[test]
    fn both_precisions_do_what_the_standard_library_does() {
        operations::<f32>(1e-6);
        operations::<f64>(1e-15);
        assert!(Real::exp(-1e4_f32) == 0.0, "what is too small for the fast form is nothing");
        assert_eq!(Real::exp(87.5_f32), f32::exp(87.5), "what is too large for it is the library's");
    }
}
