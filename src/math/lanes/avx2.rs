//! `f32` through AVX2 and FMA.

use pulp::x86::V3;
use pulp::{f32x8, i32x8, m32x8, u32x8};

use super::{LANES, Lane, LaneOp, Lanes};

macro_rules! instructions {
    ($($name:ident $instruction:ident),*) => {$(
        #[inline(always)]
        fn $name(self, a: f32x8, b: f32x8) -> f32x8 {
            self.$instruction(a, b)
        }
    )*};
}

impl Lanes<f32> for V3 {
    type V = f32x8;
    type M = m32x8;
    #[inline(always)]
    fn splat(self, x: f32) -> f32x8 {
        self.splat_f32x8(x)
    }
    #[inline(always)]
    fn load(self, x: &Lane<f32>) -> f32x8 {
        bytemuck::cast(*x)
    }
    #[inline(always)]
    fn store(self, v: f32x8) -> Lane<f32> {
        bytemuck::cast(v)
    }
    instructions! { add add_f32x8, sub sub_f32x8, mul mul_f32x8, div div_f32x8, min min_f32x8, max max_f32x8 }
    #[inline(always)]
    fn mul_add(self, a: f32x8, b: f32x8, c: f32x8) -> f32x8 {
        self.mul_add_f32x8(a, b, c)
    }
    #[inline(always)]
    fn ge(self, a: f32x8, b: f32x8) -> m32x8 {
        self.cmp_ge_f32x8(a, b)
    }
    #[inline(always)]
    fn gt(self, a: f32x8, b: f32x8) -> m32x8 {
        self.cmp_gt_f32x8(a, b)
    }
    #[inline(always)]
    fn both(self, a: m32x8, b: m32x8) -> m32x8 {
        self.and_m32x8(a, b)
    }
    #[inline(always)]
    fn select(self, mask: m32x8, a: f32x8, b: f32x8) -> f32x8 {
        self.select_f32x8(mask, a, b)
    }
    #[inline(always)]
    fn sqrt(self, v: f32x8) -> f32x8 {
        self.sqrt_f32x8(v)
    }
    #[inline(always)]
    fn bits(self, mask: m32x8) -> u32 {
        let all: u32x8 = self.select_u32x8(mask, self.splat_u32x8(!0), self.splat_u32x8(0));
        self.avx._mm256_movemask_ps(bytemuck::cast(all)) as u32
    }
    #[inline(always)]
    fn sums(self, v: [f32x8; LANES]) -> f32x8 {
        // Neighbors are added twice; two halves are left.
        let pairs = |a: f32x8, b: f32x8| -> f32x8 {
            bytemuck::cast(self.avx._mm256_hadd_ps(bytemuck::cast(a), bytemuck::cast(b)))
        };
        let first = pairs(pairs(v[0], v[1]), pairs(v[2], v[3]));
        let second = pairs(pairs(v[4], v[5]), pairs(v[6], v[7]));
        let [a, b]: [[f32; 4]; 2] = bytemuck::cast(first);
        let [c, d]: [[f32; 4]; 2] = bytemuck::cast(second);
        self.add_f32x8(bytemuck::cast([a, c]), bytemuck::cast([b, d]))
    }
    #[inline(always)]
    fn exp_neg(self, v: f32x8) -> f32x8 {
        // The polynomial of `Real::exp_neg` for f32; see there.
        use crate::math::fast_exp::{LN2_HI, LN2_LO, POLYNOMIAL, ROUND, SMALLEST};
        let x = self.max_f32x8(v, self.splat_f32x8(SMALLEST));
        let round = self.splat_f32x8(ROUND);
        let shifted = self.mul_add_f32x8(x, self.splat_f32x8(std::f32::consts::LOG2_E), round);
        let n = self.sub_f32x8(shifted, round);
        let r = self.negate_mul_add_f32x8(n, self.splat_f32x8(LN2_HI), x);
        let r = self.negate_mul_add_f32x8(n, self.splat_f32x8(LN2_LO), r);
        // Estrin's scheme: the same polynomial with half the latency.
        let pair =
            |k: usize| self.mul_add_f32x8(self.splat_f32x8(POLYNOMIAL[k]), r, self.splat_f32x8(POLYNOMIAL[k + 1]));
        let r2 = self.mul_f32x8(r, r);
        let high = self.mul_add_f32x8(pair(0), r2, pair(2));
        let low = self.mul_add_f32x8(pair(4), r2, pair(6));
        let p = self.mul_add_f32x8(high, self.mul_f32x8(r2, r2), low);
        let bits: u32x8 = bytemuck::cast(shifted);
        let exponent = self.shl_const_u32x8::<23>(bits);
        bytemuck::cast(self.wrapping_add_u32x8(bytemuck::cast(p), exponent))
    }
    #[inline(always)]
    fn ln(self, v: f32x8) -> f32x8 {
        use crate::math::fast_exp::{LN2_HI, LN2_LO};
        use crate::math::fast_ln::{LEAST, POLYNOMIAL};
        let bits: u32x8 = bytemuck::cast(v);
        let above = self.wrapping_sub_u32x8(bits, self.splat_u32x8(LEAST));
        let exponent: i32x8 = self.shr_const_i32x8::<23>(bytemuck::cast(above));
        let power = self.shl_const_u32x8::<23>(bytemuck::cast(exponent));
        let m: f32x8 = bytemuck::cast(self.wrapping_sub_u32x8(bits, power));
        let f = self.sub_f32x8(m, self.splat_f32x8(1.0));
        let mut p = self.splat_f32x8(POLYNOMIAL[0]);
        for c in &POLYNOMIAL[1..] {
            p = self.mul_add_f32x8(p, f, self.splat_f32x8(*c));
        }
        let (n, f2) = (self.convert_i32x8_to_f32x8(exponent), self.mul_f32x8(f, f));
        let small = self.mul_add_f32x8(n, self.splat_f32x8(LN2_LO), self.mul_f32x8(self.mul_f32x8(p, f), f2));
        let small = self.negate_mul_add_f32x8(f2, self.splat_f32x8(0.5), small);
        self.mul_add_f32x8(n, self.splat_f32x8(LN2_HI), self.add_f32x8(f, small))
    }
}

struct Simd<O>(V3, O);

impl<O: LaneOp<f32>> pulp::NullaryFnOnce for Simd<O> {
    type Output = O::Output;
    #[inline(always)]
    fn call(self) -> O::Output {
        self.1.run(self.0)
    }
}

/// Runs `op` compiled for AVX2 and FMA, or gives it back where the machine lacks them.
#[inline(always)]
pub(crate) fn run<O: LaneOp<f32>>(op: O) -> Result<O::Output, O> {
    match V3::try_new() {
        Some(v3) => Ok(v3.vectorize(Simd(v3, op))),
        None => Err(op),
    }
}
