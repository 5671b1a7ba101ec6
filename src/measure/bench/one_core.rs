//! Speed limit of one core for blending, beside which measured speeds stand.

use std::time::Instant;

use super::{StageSample, StageValues};
use crate::math::Real;
use crate::math::lanes::{LANES, Lane, LaneOp, Lanes};

/// Splat-pixel products per second that one core of this machine can evaluate and blend when
/// nothing else is in the way: conic, exponential, transmittance and color on registers alone.
pub(crate) fn limit() -> Vec<StageSample> {
    const ROUNDS: usize = 2_000_000;
    let start = Instant::now();
    let sum = f32::vectorize(Limit { rounds: ROUNDS });
    let secs = start.elapsed().as_secs_f64();
    std::hint::black_box(sum);
    let mut values = StageValues::new("one core at most".into());
    values.add("products while blending", "1/s", [(ROUNDS * 2 * LANES) as f64 / secs]);
    values.samples()
}

/// The inner loop of blending without its memory.
struct Limit {
    rounds: usize,
}

impl LaneOp<f32> for Limit {
    type Output = f32;
    #[inline(always)]
    fn run<L: Lanes<f32>>(self, l: L) -> f32 {
        let ramp: Lane<f32> = std::array::from_fn(|i| i as f32);
        let ramp = l.load(&ramp);
        let one = l.splat(1.0);
        // Two independent groups hide the latency of each other.
        let mut left = [one; 2];
        let mut color = [[l.splat(0.0); 3]; 2];
        let mut dy = 0.0_f32;
        for _ in 0..self.rounds {
            dy = if dy > 8.0 { -8.0 } else { dy + 0.01 };
            for g in 0..2 {
                let dx = l.add(ramp, l.splat(dy - 8.0 * g as f32));
                let q = l.mul_add(l.mul_add(l.splat(0.05), dx, l.splat(0.01 * dy)), dx, l.splat(0.04 * dy * dy));
                let raw = l.mul(l.splat(0.01), l.exp_neg(l.mul(l.splat(-0.5), q)));
                let alpha = l.keep(l.ge(raw, l.splat(1e-4)), l.min(raw, l.splat(0.999)));
                let weight = l.mul(alpha, left[g]);
                left[g] = l.sub(left[g], l.mul(weight, l.splat(1e-3)));
                for (c, sum) in color[g].iter_mut().enumerate() {
                    *sum = l.mul_add(weight, l.splat(0.3 + c as f32), *sum);
                }
            }
        }
        l.sum(color[0][0]) + l.sum(color[1][2]) + l.sum(left[0])
    }
}
