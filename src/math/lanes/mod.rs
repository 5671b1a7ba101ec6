//! Eight numbers at a time: explicit vectors where the machine has AVX2 and FMA (found out at run
//! time), plain arrays elsewhere and for `f64`.
//!
//! A kernel is a [`LaneOp`]; [`Real::vectorize`] runs it with the best [`Lanes`] for its type.

#[cfg(target_arch = "x86_64")]
mod avx2;

use super::Real;
use super::fast_exp::SMALLEST;
#[cfg(target_arch = "x86_64")]
pub(super) use avx2::run as run_avx2;

/// Numbers per vector.
pub(crate) const LANES: usize = 8;
/// The bits of all of them.
const ALL: u32 = (1 << LANES) - 1;

/// Eight numbers in memory.
pub type Lane<R> = [R; LANES];

/// A computation that can run on any vectors. Implementations must be `#[inline(always)]` down to
/// the arithmetic, so that all of it is compiled for the instructions of `L`.
pub trait LaneOp<R: Real> {
    type Output;
    fn run<L: Lanes<R>>(self, lanes: L) -> Self::Output;
}

/// Arithmetic on vectors of [`LANES`] numbers.
pub trait Lanes<R: Real>: Copy + Send + Sync {
    /// A vector.
    type V: Copy;
    /// A truth value per lane.
    type M: Copy;
    /// The same number in every lane.
    fn splat(self, x: R) -> Self::V;
    fn load(self, x: &Lane<R>) -> Self::V;
    fn store(self, v: Self::V) -> Lane<R>;
    fn add(self, a: Self::V, b: Self::V) -> Self::V;
    fn sub(self, a: Self::V, b: Self::V) -> Self::V;
    fn mul(self, a: Self::V, b: Self::V) -> Self::V;
    fn div(self, a: Self::V, b: Self::V) -> Self::V;
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    fn min(self, a: Self::V, b: Self::V) -> Self::V;
    fn max(self, a: Self::V, b: Self::V) -> Self::V;
    /// Square root; NaN below 0.
    fn sqrt(self, v: Self::V) -> Self::V;
    /// `a >= b`, false for NaN.
    fn ge(self, a: Self::V, b: Self::V) -> Self::M;
    /// `a > b`, false for NaN.
    fn gt(self, a: Self::V, b: Self::V) -> Self::M;
    fn both(self, a: Self::M, b: Self::M) -> Self::M;
    /// `a` where the mask holds, else `b`.
    fn select(self, mask: Self::M, a: Self::V, b: Self::V) -> Self::V;
    /// One bit per lane, lane 0 lowest.
    fn bits(self, mask: Self::M) -> u32;
    /// [`Real::exp_neg`].
    fn exp_neg(self, v: Self::V) -> Self::V;

    /// [`Real::exp`].
    #[inline(always)]
    fn exp(self, v: Self::V) -> Self::V {
        // The fast form holds for positive numbers too, up to where the exponent field ends.
        let (most, least) = (self.splat(R::of(f64::from(-SMALLEST))), self.splat(R::of(f64::from(SMALLEST))));
        if self.bits(self.both(self.ge(most, v), self.ge(v, least))) == ALL {
            return self.exp_neg(v);
        }
        let mut each = self.store(v);
        for x in &mut each {
            *x = Real::exp(*x);
        }
        self.load(&each)
    }

    /// Natural logarithm of positive numbers that are not subnormal, within 5e-7 in `f32`; of others, any number.
    #[inline(always)]
    fn ln(self, v: Self::V) -> Self::V {
        let mut each = self.store(v);
        for x in &mut each {
            *x = Real::ln(*x);
        }
        self.load(&each)
    }

    /// `a` where the mask holds, else 0.
    #[inline(always)]
    fn keep(self, mask: Self::M, a: Self::V) -> Self::V {
        self.select(mask, a, self.splat(R::ZERO))
    }

    /// Sum over the lanes, in a fixed order.
    #[inline(always)]
    fn sum(self, v: Self::V) -> R {
        let v = self.store(v);
        ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]))
    }

    /// The sums over the lanes of eight vectors, in a fixed order.
    #[inline(always)]
    fn sums(self, v: [Self::V; LANES]) -> Self::V {
        self.load(&v.map(|v| self.sum(v)))
    }
}

/// Arrays: the reference for every other implementation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plain;

#[inline(always)]
fn each<R: Real>(f: impl Fn(usize) -> R) -> Lane<R> {
    std::array::from_fn(f)
}

macro_rules! by_lane {
    ($($name:ident $op:tt),*) => {$(
        #[inline(always)]
        fn $name(self, a: Lane<R>, b: Lane<R>) -> Lane<R> {
            each(|l| a[l] $op b[l])
        }
    )*};
}

impl<R: Real> Lanes<R> for Plain {
    type V = Lane<R>;
    type M = [bool; LANES];
    #[inline(always)]
    fn splat(self, x: R) -> Lane<R> {
        [x; LANES]
    }
    #[inline(always)]
    fn load(self, x: &Lane<R>) -> Lane<R> {
        *x
    }
    #[inline(always)]
    fn store(self, v: Lane<R>) -> Lane<R> {
        v
    }
    by_lane! { add +, sub -, mul *, div / }
    #[inline(always)]
    fn mul_add(self, a: Lane<R>, b: Lane<R>, c: Lane<R>) -> Lane<R> {
        each(|l| a[l] * b[l] + c[l])
    }
    #[inline(always)]
    fn min(self, a: Lane<R>, b: Lane<R>) -> Lane<R> {
        each(|l| if a[l] < b[l] { a[l] } else { b[l] })
    }
    #[inline(always)]
    fn max(self, a: Lane<R>, b: Lane<R>) -> Lane<R> {
        each(|l| if a[l] > b[l] { a[l] } else { b[l] })
    }
    #[inline(always)]
    fn ge(self, a: Lane<R>, b: Lane<R>) -> [bool; LANES] {
        std::array::from_fn(|l| a[l] >= b[l])
    }
    #[inline(always)]
    fn gt(self, a: Lane<R>, b: Lane<R>) -> [bool; LANES] {
        std::array::from_fn(|l| a[l] > b[l])
    }
    #[inline(always)]
    fn both(self, a: [bool; LANES], b: [bool; LANES]) -> [bool; LANES] {
        std::array::from_fn(|l| a[l] & b[l])
    }
    #[inline(always)]
    fn select(self, mask: [bool; LANES], a: Lane<R>, b: Lane<R>) -> Lane<R> {
        each(|l| if mask[l] { a[l] } else { b[l] })
    }
    #[inline(always)]
    fn sqrt(self, v: Lane<R>) -> Lane<R> {
        each(|l| v[l].sqrt())
    }
    #[inline(always)]
    fn bits(self, mask: [bool; LANES]) -> u32 {
        mask.iter().enumerate().map(|(l, &m)| u32::from(m) << l).sum()
    }
    #[inline(always)]
    fn exp_neg(self, v: Lane<R>) -> Lane<R> {
        each(|l| v[l].exp_neg())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Evaluates a chain of every operation.
    struct Chain(Lane<f32>, Lane<f32>);

    impl LaneOp<f32> for Chain {
        type Output = (Lane<f32>, f32);
        #[inline(always)]
        fn run<L: Lanes<f32>>(self, l: L) -> Self::Output {
            let (a, b) = (l.load(&self.0), l.load(&self.1));
            let e = l.exp_neg(a);
            let m = l.both(l.ge(a, b), l.ge(b, l.splat(-40.0)));
            let other = l.div(l.sub(l.max(a, e), l.min(a, b)), l.splat(3.0));
            let v = l.select(l.both(m, l.gt(e, b)), l.mul_add(a, b, e), other);
            let root = l.sqrt(l.mul(a, l.splat(-1.0)));
            let v = l.add(v, l.keep(m, l.mul(e, root)));
            let totals = l.store(l.sums(std::array::from_fn(|k| l.mul(v, l.splat(k as f32)))));
            let total = l.sum(v);
            for (k, t) in totals.iter().enumerate() {
                let size: f32 = l.store(v).iter().map(|v| v.abs()).sum();
                assert!((t - total * k as f32).abs() <= 1e-5 * size * 8.0 + 1e-30, "{t} {total} {k}");
            }
            assert_eq!(
                l.bits(l.ge(a, b)).count_ones() as usize,
                (0..LANES).filter(|&i| self.0[i] >= self.1[i]).count()
            );
            (l.store(v), l.sum(v))
        }
    }

    #[test]
    fn vectors_do_what_arrays_do() {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            -((state >> 8) as f32) / (1 << 24) as f32 * 60.0
        };
        for _ in 0..1_000 {
            let (a, b) = (std::array::from_fn(|_| next()), std::array::from_fn(|_| next()));
            let (plain, _) = Chain(a, b).run(Plain);
            let (fast, _) = f32::vectorize(Chain(a, b));
            for (x, y) in plain.iter().zip(&fast) {
                assert!((x - y).abs() <= 1e-5 * x.abs().max(1e-6), "{x} {y}");
            }
        }
    }

    #[test]
    fn logarithms_and_exponentials_are_those_of_each() {
        struct Both(Lane<f32>);
        impl LaneOp<f32> for Both {
            type Output = [Lane<f32>; 2];
            #[inline(always)]
            fn run<L: Lanes<f32>>(self, l: L) -> Self::Output {
                let v = l.load(&self.0);
                [l.store(l.ln(v)), l.store(l.exp(v))]
            }
        }
        for k in 0..1_000 {
            // Small ones, those around 1, and large ones; beyond what the fast exponential takes, too.
            let x: Lane<f32> = std::array::from_fn(|i| (k as f32 * 0.17 - 85.0 + i as f32 * 0.37).exp());
            let near: Lane<f32> = x.map(|x| 1.0 + x.min(1.0) * 0.5);
            for x in [x, near] {
                let [ln, exp] = f32::vectorize(Both(x));
                for i in 0..LANES {
                    let exact = f64::from(x[i]).ln();
                    assert!((f64::from(ln[i]) - exact).abs() <= 5e-7 * exact.abs().max(1.0), "ln {}: {}", x[i], ln[i]);
                    let exact = f64::from(x[i]).exp() as f32;
                    assert!(exp[i] == exact || (exp[i] - exact).abs() <= 3e-7 * exact, "exp {}: {}", x[i], exp[i]);
                }
            }
        }
        let [_, exp] = f32::vectorize(Both([-200.0, 0.0, f32::INFINITY, f32::NEG_INFINITY, 88.0, f32::NAN, 1.0, -1.0]));
        assert!(exp[2] == f32::INFINITY && exp[3] == 0.0 && exp[5].is_nan() && exp[1] == 1.0 && exp[0] < 1e-38);
    }

    #[test]
    fn arrays_do_what_each_number_does() {
        let a: Lane<f32> = [-2.0, -0.5, 0.0, 1.0, 1.5, 4.0, f32::NAN, 9.0];
        let b: Lane<f32> = [1.0, -0.5, 2.0, 0.25, 3.0, -4.0, 1.0, 9.0];
        let p = Plain;
        let same = |found: Lane<f32>, one: &dyn Fn(f32, f32) -> f32| {
            for l in 0..LANES {
                let expected = one(a[l], b[l]);
                assert!(found[l] == expected || found[l].is_nan() && expected.is_nan(), "lane {l}: {found:?}");
            }
        };
        same(p.add(a, b), &|a, b| a + b);
        same(p.sub(a, b), &|a, b| a - b);
        same(p.mul(a, b), &|a, b| a * b);
        same(p.div(a, b), &|a, b| a / b);
        same(p.mul_add(a, b, p.splat(0.5)), &|a, b| a * b + 0.5);
        // The second of the two where they cannot be compared, as the instructions have it.
        same(p.min(a, b), &|a, b| if a.is_nan() { b } else { a.min(b) });
        same(p.max(a, b), &|a, b| if a.is_nan() { b } else { a.max(b) });
        same(p.sqrt(b), &|_, b| b.sqrt());
        assert_eq!(p.ge(a, b), [false, true, false, true, false, true, false, true]);
        assert_eq!(p.gt(a, b), [false, false, false, true, false, true, false, false]);
        let bits = |mask| <Plain as Lanes<f32>>::bits(p, mask);
        assert_eq!(bits(p.ge(a, b)), 0b1010_1010);
        let some = <Plain as Lanes<f32>>::both(p, p.ge(a, b), p.gt(b, p.splat(0.0)));
        assert_eq!(bits(some), 0b1000_1000);
        assert_eq!(p.keep(some, b), [0.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 9.0]);
        assert_eq!(p.select(some, b, p.splat(7.0)), [7.0, 7.0, 7.0, 0.25, 7.0, 7.0, 7.0, 9.0]);
        assert_eq!(p.sum([1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0]), 255.0);
        assert_eq!(p.exp_neg(p.splat(-1.0)), [Real::exp_neg(-1.0_f32); LANES]);
        // Vectors choose the same where a number is equal or none.
        struct Compared(Lane<f32>, Lane<f32>);
        impl LaneOp<f32> for Compared {
            type Output = [u32; 2];
            #[inline(always)]
            fn run<L: Lanes<f32>>(self, l: L) -> [u32; 2] {
                let (a, b) = (l.load(&self.0), l.load(&self.1));
                [l.bits(l.ge(a, b)), l.bits(l.gt(a, b))]
            }
        }
        assert_eq!(f32::vectorize(Compared(a, b)), [0b1010_1010, 0b0010_1000]);
    }
}
