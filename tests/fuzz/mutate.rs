//! Deterministic mutations of seeds.

use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde_json::{Map, Value, json};

use super::repair::repaired;

/// Longest input made.
const MAX_LEN: usize = 1 << 16;
/// Integers at the edges of their ranges, and counts no file can hold.
const EDGES: [u64; 12] =
    [0, 1, 2, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFF_FFFF, 0xFFFF_FFFF, 1 << 60, i64::MAX as u64, u64::MAX];
/// Words that take the place of numbers in text.
const WORDS: [&str; 10] =
    ["0", "-1", "1152921504606846976", "18446744073709551615", "4294967296", "NaN", "1e999", "0.5", "1e-320", "\"\""];

/// Numbers that JSON can hold and readers had better look at.
const NUMBERS: [f64; 12] = [0.0, -1.0, 0.5, -0.0, 1e-320, 1e-30, 1e30, 1e308, -1e308, 16_385.0, 4294967296.0, 1e19];
/// Texts that name files, numbers and nothing.
const TEXTS: [&str; 10] =
    ["", "../../etc/passwd", "a.png", "NaN", "-1", "data:,", "\u{202e}\u{7}\u{1b}[2J", "/", "\u{0}", "人形"];

/// Makes inputs from seeds.
pub struct Mutator {
    random: Pcg64Mcg,
}

impl Mutator {
    /// The same number gives the same inputs.
    pub fn new(seed: u64) -> Self {
        Self { random: Pcg64Mcg::seed_from_u64(seed) }
    }

    /// One to six mutations, mostly few, of a seed out of one of these heaps: of its bytes or, where it
    /// is JSON, mostly of its values. Where there are checksums, they are mostly put right afterwards.
    pub fn next(&mut self, heaps: [&Vec<Vec<u8>>; 4]) -> Vec<u8> {
        let chosen = *self.pick(&heaps);
        let seeds = if chosen.is_empty() { heaps[0] } else { chosen };
        let mut input = self.pick(seeds).clone();
        let times = 1 + self.random.next_u32().trailing_zeros().min(5);
        match serde_json::from_slice::<Value>(&input) {
            Ok(mut value) if !self.random.random_ratio(1, 3) => {
                (0..times).for_each(|_| self.mutate_json(&mut value));
                input = value.to_string().into_bytes();
            }
            _ => (0..times).for_each(|_| self.mutate(&mut input, seeds)),
        }
        input.truncate(MAX_LEN);
        if self.random.random_ratio(3, 4) { repaired(input) } else { input }
    }

    /// Another value somewhere, one less, or one more.
    fn mutate_json(&mut self, whole: &mut Value) {
        let word = *self.pick(&TEXTS);
        let size = self.random.random_range(1..300);
        let value = match self.random.random_range(0..9) {
            0 | 1 => self.spot(whole).clone(),
            2 => Value::Null,
            3 => json!([]),
            4 => json!({}),
            5 => json!(true),
            6 => json!("a".repeat(7 * size)),
            7 if size < 50 => (0..6 * size).fold(json!(0), |inner, _| Value::Array(vec![inner])),
            _ => json!(word),
        };
        let kind = self.random.random_range(0..12);
        let at = self.random.next_u32() as usize;
        let number = json!(*self.pick(&NUMBERS));
        let whole_number = json!(*self.pick(&EDGES));
        let place = self.spot(whole);
        match (kind, place) {
            (0..4, place) => *place = value,
            (4 | 5, place) => *place = number,
            (6, place) => *place = whole_number,
            (7 | 8, Value::Array(items)) if !items.is_empty() => drop(items.remove(at % items.len())),
            (9.., Value::Array(items)) if !items.is_empty() => {
                let copy = items[at % items.len()].clone();
                items.push(copy);
            }
            (7 | 8, Value::Object(map)) => drop(key_at(map, at).map(|key| map.remove(&key))),
            (9.., Value::Object(map)) => {
                // The value of another key.
                if let (Some(from), Some(to)) = (key_at(map, at), key_at(map, at / 7)) {
                    map.insert(to, map[&from].clone());
                }
            }
            (_, Value::Number(n)) => {
                let turned = n.as_f64().map(|v| [v + 1.0, -v, v * 1e6, v * 1e-6, v + 0.5][at % 5]);
                *n = turned.and_then(serde_json::Number::from_f64).unwrap_or_else(|| 0.into());
            }
            (_, place) => *place = json!(word),
        }
    }

    /// Somewhere in a value, at any depth.
    fn spot<'a>(&mut self, value: &'a mut Value) -> &'a mut Value {
        let n = match value {
            Value::Array(items) => items.len(),
            Value::Object(map) => map.len(),
            _ => 0,
        };
        if n == 0 || self.random.random_ratio(1, 5) {
            return value;
        }
        let at = self.random.random_range(0..n);
        let inner = match value {
            Value::Array(items) => items.get_mut(at),
            Value::Object(map) => map.values_mut().nth(at),
            _ => None,
        };
        self.spot(inner.expect("counted"))
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

/// A key of an object.
fn key_at(map: &Map<String, Value>, at: usize) -> Option<String> {
    map.keys().nth(at % map.len().max(1)).cloned()
}
