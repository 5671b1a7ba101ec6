//! Deterministic mutations of seeds.

use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Longest input made.
const MAX_LEN: usize = 1 << 16;
/// Integers at the edges of their ranges, and counts no file can hold.
const EDGES: [u64; 12] =
    [0, 1, 2, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFF_FFFF, 0xFFFF_FFFF, 1 << 60, i64::MAX as u64, u64::MAX];
/// Words that take the place of numbers in text.
const WORDS: [&str; 10] =
    ["0", "-1", "1152921504606846976", "18446744073709551615", "4294967296", "NaN", "1e999", "0.5", "1e-320", "\"\""];

/// Makes inputs from seeds.
pub struct Mutator {
    random: Pcg64Mcg,
}

impl Mutator {
    /// The same number gives the same inputs.
    pub fn new(seed: u64) -> Self {
        Self { random: Pcg64Mcg::seed_from_u64(seed) }
    }

    /// One to six mutations of one of the seeds.
    pub fn next(&mut self, seeds: &[Vec<u8>]) -> Vec<u8> {
        let mut input = self.pick(seeds).clone();
        for _ in 0..self.random.random_range(1..=6) {
            self.mutate(&mut input, seeds);
        }
        input.truncate(MAX_LEN);
        input
    }

    fn pick<'a, T>(&mut self, from: &'a [T]) -> &'a T {
        &from[self.random.random_range(0..from.len())]
    }

    /// A position in `0..=len`, near the front (headers, counts) half of the time.
    fn position(&mut self, len: usize) -> usize {
        let end = if self.random.random() { len } else { len.min(64) };
        self.random.random_range(0..=end)
    }

    fn mutate(&mut self, input: &mut Vec<u8>, seeds: &[Vec<u8>]) {
        let at = self.position(input.len());
        match self.random.random_range(0..9) {
            0 => {
                if let Some(byte) = input.get_mut(at) {
                    *byte ^= 1 << self.random.random_range(0..8);
                }
            }
            1 => {
                if let Some(byte) = input.get_mut(at) {
                    *byte = self.random.next_u32() as u8;
                }
            }
            2 => input.truncate(at),
            3 => {
                let end = (at + self.random.random_range(0..32)).min(input.len());
                input.drain(at..end);
            }
            4 => {
                // The same stretch once more.
                let end = (at + self.random.random_range(0..64)).min(input.len());
                let again = input[at..end].to_vec();
                input.splice(at..at, again);
            }
            5 => {
                // The tail of another seed.
                let other = self.pick(seeds).clone();
                let from = self.position(other.len());
                input.truncate(at);
                input.extend_from_slice(&other[from..]);
            }
            6 | 7 => {
                let mut value = *self.pick(&EDGES);
                if self.random.random() {
                    value = value.swap_bytes();
                }
                let width = *self.pick(&[1, 2, 4, 8]);
                let end = (at + width).min(input.len());
                input[at..end].copy_from_slice(&value.to_le_bytes()[..end - at]);
            }
            _ => self.replace_number(input, at),
        }
    }

    /// The first run of digits at or after `at` becomes another word.
    fn replace_number(&mut self, input: &mut Vec<u8>, at: usize) {
        let digit = |b: &u8| b.is_ascii_digit();
        let Some(start) = input[at..].iter().position(digit).map(|p| p + at) else { return };
        let end = input[start..].iter().position(|b| !digit(b)).map_or(input.len(), |p| p + start);
        let word = *self.pick(&WORDS);
        input.splice(start..end, word.bytes());
    }
}
