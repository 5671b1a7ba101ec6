//! Nasty numbers from a seed.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Numbers that are special to somebody.
const SPECIAL: [f32; 12] =
    [0.0, -0.0, 1.0, -1.0, 0.5, 255.0, f32::EPSILON, f32::MIN_POSITIVE, 1e-45, f32::MAX, f32::MIN, 16_777_217.0];

/// A source of numbers, of which some share is nasty; how large that is differs from input to input.
pub struct Numbers {
    rng: Pcg64Mcg,
    /// Share of numbers that are nasty.
    nasty: f64,
    /// Whether some may be no numbers at all.
    poison: bool,
}

impl Numbers {
    /// Those of one input of one area.
    pub fn new(seed: u64, area: u64) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(area));
        let nasty = [0.0, 0.01, 0.05, 0.3, 0.9][rng.random_range(0..5)];
        let poison = rng.random_bool(0.1);
        Self { rng, nasty, poison }
    }

    /// Any finite number, or none at all where the input is a poisoned one: special, of any size, or a
    /// small whole one, which makes ties.
    pub fn any(&mut self) -> f32 {
        match self.rng.random_range(0..10) {
            0..3 => SPECIAL[self.rng.random_range(0..SPECIAL.len())],
            3 if self.poison => [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][self.rng.random_range(0..3)],
            3..5 => self.rng.random_range(-3_i32..=3) as f32,
            _ => {
                let size = 10.0_f64.powf(self.rng.random_range(-45.0..38.5)) as f32;
                if self.rng.random_bool(0.5) { size } else { -size }
            }
        }
    }

    /// An ordinary number between `lo` and `hi`, or a nasty one.
    pub fn around(&mut self, lo: f32, hi: f32) -> f32 {
        if self.rng.random_bool(self.nasty) { self.any() } else { self.rng.random_range(lo..hi) }
    }

    /// Several of these.
    pub fn several<const N: usize>(&mut self, lo: f32, hi: f32) -> [f32; N] {
        std::array::from_fn(|_| self.around(lo, hi))
    }

    /// As [`Self::around`], in double precision; nasty ones may be far larger.
    pub fn wide(&mut self, lo: f64, hi: f64) -> f64 {
        if !self.rng.random_bool(self.nasty) {
            return self.rng.random_range(lo..hi);
        }
        match self.rng.random_range(0..4) {
            0 => 10.0_f64.powf(self.rng.random_range(-320.0..308.0)),
            1 => -(10.0_f64.powf(self.rng.random_range(-320.0..308.0))),
            _ => f64::from(self.any()),
        }
    }

    /// An ordinary number between `lo` and `hi`; never nasty.
    pub fn plain(&mut self, lo: f64, hi: f64) -> f64 {
        self.rng.random_range(lo..hi)
    }

    /// A positive number whose logarithm is evenly spread.
    pub fn size(&mut self, lo: f64, hi: f64) -> f64 {
        self.rng.random_range(lo.ln()..hi.ln()).exp()
    }

    /// A whole number below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        self.rng.random_range(0..n.max(1))
    }

    /// One of these.
    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }

    /// True with this probability.
    pub fn chance(&mut self, p: f64) -> bool {
        self.rng.random_bool(p)
    }

    /// A generator of its own.
    pub fn rng(&mut self) -> Pcg64Mcg {
        Pcg64Mcg::seed_from_u64(self.rng.random_range(0..u64::MAX))
    }
}
