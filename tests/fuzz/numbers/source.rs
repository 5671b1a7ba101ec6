//! Adversarial values from a seed.

use std::collections::HashSet;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Numbers that are special to some code.
const SPECIAL: [f32; 12] =
    [0.0, -0.0, 1.0, -1.0, 0.5, 255.0, f32::EPSILON, f32::MIN_POSITIVE, 1e-45, f32::MAX, f32::MIN, 16_777_217.0];

/// A source of numbers, of which some share is adversarial; how large that is differs from input to input.
#[derive(Clone)]
pub struct Numbers {
    start: Pcg64Mcg,
    rng: Pcg64Mcg,
    /// Share of numbers that are adversarial.
    share: f64,
    /// True if some may be NaN or infinite.
    poison: bool,
    /// Adversarial values so far, and the places among them that are made ordinary.
    given: Vec<f64>,
    tamed: HashSet<usize>,
}

impl Numbers {
    /// Numbers of one input of one area.
    pub fn new(seed: u64, area: &str) -> Self {
        let area = area.bytes().fold(0_u64, |h, b| h.wrapping_mul(31).wrapping_add(u64::from(b)));
        let mut rng = Pcg64Mcg::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(area));
        let share = [0.0, 0.01, 0.05, 0.3, 0.9][rng.random_range(0..5)];
        let poison = rng.random_bool(0.1);
        Self { start: rng.clone(), rng, share, poison, given: Vec::new(), tamed: HashSet::new() }
    }

    /// The same from the beginning.
    pub fn again(&self) -> Self {
        Self { rng: self.start.clone(), given: Vec::new(), ..self.clone() }
    }

    /// Makes an adversarial value ordinary.
    pub fn tame(&mut self, place: usize) {
        self.tamed.insert(place);
    }

    /// Number of adversarial values so far, tamed ones included.
    pub fn adversarial(&self) -> usize {
        self.given.len()
    }

    /// The adversarial values, without tamed ones.
    pub fn values(&self) -> Vec<f64> {
        (0..self.given.len()).filter(|k| !self.tamed.contains(k)).map(|k| self.given[k]).collect()
    }

    /// An ordinary number, or an adversarial one. Each draws from a generator of its own, so that all others stay as
    /// they are when one is tamed.
    fn one_of(&mut self, ordinary: impl Fn(&mut Pcg64Mcg) -> f64, any: impl Fn(&mut Pcg64Mcg, bool) -> f64) -> f64 {
        let adversarial = self.rng.random_bool(self.share);
        let mut own = self.rng();
        if !adversarial {
            return ordinary(&mut own);
        }
        let place = self.given.len();
        let value = if self.tamed.contains(&place) { ordinary(&mut own) } else { any(&mut own, self.poison) };
        self.given.push(value);
        value
    }

    /// An ordinary number between `lo` and `hi`, or an adversarial one.
    pub fn around(&mut self, lo: f32, hi: f32) -> f32 {
        self.one_of(|rng| f64::from(rng.random_range(lo..hi)), |rng, poison| f64::from(any(rng, poison))) as f32
    }

    /// Several of these.
    pub fn several<const N: usize>(&mut self, lo: f32, hi: f32) -> [f32; N] {
        std::array::from_fn(|_| self.around(lo, hi))
    }

    /// As [`Self::around`], in double precision; adversarial ones may be far larger.
    pub fn wide(&mut self, lo: f64, hi: f64) -> f64 {
        self.one_of(
            |rng| rng.random_range(lo..hi),
            |rng, poison| match rng.random_range(0..4) {
                0 => 10.0_f64.powf(rng.random_range(-320.0..308.0)),
                1 => -(10.0_f64.powf(rng.random_range(-320.0..308.0))),
                _ => f64::from(any(rng, poison)),
            },
        )
    }

    /// An ordinary number between `lo` and `hi`; never adversarial.
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

/// Any finite number, or NaN or infinity where the input is a poisoned one: special, of any size, or a small whole one,
/// which makes ties.
fn any(rng: &mut Pcg64Mcg, poison: bool) -> f32 {
    match rng.random_range(0..10) {
        0..3 => SPECIAL[rng.random_range(0..SPECIAL.len())],
        3 if poison => [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][rng.random_range(0..3)],
        3..5 => rng.random_range(-3_i32..=3) as f32,
        _ => {
            let size = 10.0_f64.powf(rng.random_range(-45.0..38.5)) as f32;
            if rng.random_bool(0.5) { size } else { -size }
        }
    }
}
