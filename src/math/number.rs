//! Arithmetic without branches, written once for a number and for eight side by side.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::Real;
use super::lanes::{LANES, Lane, Lanes};

/// A number, or several that are computed at once.
#[allow(missing_docs, reason = "each name says what it is")]
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Its scalar.
    type Of: Real;
    /// `x`, as many times as this has numbers.
    fn like(self, x: Self::Of) -> Self;
    fn sqrt(self) -> Self;
    fn exp(self) -> Self;
    fn abs(self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
}

impl<R: Real> Number for R {
    type Of = R;
    #[inline(always)]
    fn like(self, x: R) -> R {
        x
    }
    #[inline(always)]
    fn sqrt(self) -> R {
        Real::sqrt(self)
    }
    #[inline(always)]
    fn exp(self) -> R {
        Real::exp(self)
    }
    #[inline(always)]
    fn abs(self) -> R {
        Real::abs(self)
    }
    #[inline(always)]
    fn min(self, other: R) -> R {
        Real::min(self, other)
    }
    #[inline(always)]
    fn max(self, other: R) -> R {
        Real::max(self, other)
    }
}

/// Eight numbers, with the instructions for them.
#[derive(Clone, Copy)]
pub(crate) struct Eight<R: Real, L: Lanes<R>> {
    lanes: L,
    pub(crate) v: L::V,
}

impl<R: Real, L: Lanes<R>> Eight<R, L> {
    #[inline(always)]
    pub(crate) fn new(lanes: L, v: L::V) -> Self {
        Self { lanes, v }
    }

    /// One of each place.
    #[inline(always)]
    pub(crate) fn of(lanes: L, one: impl Fn(usize) -> R) -> Self {
        let mut lane: Lane<R> = [R::ZERO; LANES];
        for (i, x) in lane.iter_mut().enumerate() {
            *x = one(i);
        }
        Self { lanes, v: lanes.load(&lane) }
    }

    #[inline(always)]
    pub(crate) fn lane(self) -> Lane<R> {
        self.lanes.store(self.v)
    }
}

macro_rules! operators {
    ($($trait:ident $method:ident),*) => {$(
        impl<R: Real, L: Lanes<R>> $trait for Eight<R, L> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self { v: self.lanes.$method(self.v, other.v), ..self }
            }
        }
    )*};
}

operators! { Add add, Sub sub, Mul mul, Div div }

impl<R: Real, L: Lanes<R>> Neg for Eight<R, L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.like(R::ZERO) - self
    }
}

impl<R: Real, L: Lanes<R>> Number for Eight<R, L> {
    type Of = R;
    #[inline(always)]
    fn like(self, x: R) -> Self {
        Self { v: self.lanes.splat(x), ..self }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self { v: self.lanes.sqrt(self.v), ..self }
    }
    #[inline(always)]
    fn exp(self) -> Self {
        Self { v: self.lanes.exp(self.v), ..self }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.max(-self)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self { v: self.lanes.min(self.v, other.v), ..self }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self { v: self.lanes.max(self.v, other.v), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::super::lanes::LaneOp;
    use super::*;

    /// Something of every operation.
    fn all<N: Number>(a: N, b: N) -> N {
        let c = (a.abs().sqrt() + b) * -a / (b.abs() + b.like(N::Of::HALF));
        c.min(a).max(b) - (a - b).exp()
    }

    struct Both(Lane<f32>, Lane<f32>);

    impl LaneOp<f32> for Both {
        type Output = Lane<f32>;
        #[inline(always)]
        fn run<L: Lanes<f32>>(self, l: L) -> Lane<f32> {
            all(Eight::of(l, |i| self.0[i]), Eight::new(l, l.load(&self.1))).lane()
        }
    }

    #[test]
    fn eight_are_what_each_is() {
        let a = [0.0, 1.5, -2.25, 4.0, 87.0, -100.0, 1e-20, 60.0];
        for b in [[1.0; 8], [-3.0, 0.5, 0.0, 90.0, -20.0, 7.0, 1e-3, -60.0]] {
            let found = f32::vectorize(Both(a, b));
            for i in 0..LANES {
                let one = all(a[i], b[i]);
                assert!(found[i] == one || (found[i] - one).abs() <= 1e-6 * one.abs(), "{i}: {} {one}", found[i]);
            }
        }
    }
}
