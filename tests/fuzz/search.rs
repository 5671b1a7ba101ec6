//! The search for an input that breaks a promise, and its report.

use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use super::mutate::Mutator;
use super::targets::{Outcome, Target};
use super::{memory, watch};

/// Memory that any input may use, in bytes, and more per byte of the input.
const FREE_BYTES: usize = 48 << 20;
const BYTES_PER_BYTE: usize = 64;
/// Longest time for one input; generous, for slow machines under load.
const LONGEST: Duration = Duration::from_secs(5);
/// Inputs of a kind that are kept to mutate further, at most.
const MOST_KEPT: usize = 200;
/// Longest of them.
const LONGEST_KEPT: usize = 4096;
/// One input of so many is compared with the front door.
const SAMPLED: u64 = 16;
/// Different finds that are kept of a reader.
const MOST_FINDS: usize = 20;

/// An input that broke a promise.
pub struct Find {
    /// The broken promise.
    pub what: String,
    /// The input.
    pub input: Vec<u8>,
}

/// The search through the inputs of one reader.
pub struct Search {
    pub target: Target,
    mutator: Mutator,
    seeds: Vec<Vec<u8>>,
    /// Mutations that it accepted.
    good: Vec<Vec<u8>>,
    /// Mutations that it refused for a reason of their own.
    odd: Vec<Vec<u8>>,
    said: HashSet<u64>,
    pub finds: Vec<Find>,
    /// Mutated inputs so far.
    pub inputs: u64,
    accepted: u64,
    sampled: u64,
    let_in: u64,
    slowest: Duration,
    most_bytes: usize,
    secs: f64,
    /// Longest time for one input.
    pub longest: Duration,
}

impl Search {
    pub fn new(seeds: Vec<Vec<u8>>, target: Target, random: u64) -> Self {
        let hash = target.name.bytes().fold(random, |h, b| h.wrapping_mul(31).wrapping_add(u64::from(b)));
        Self {
            mutator: Mutator::new(hash),
            seeds,
            good: Vec::new(),
            odd: Vec::new(),
            target,
            said: HashSet::new(),
            finds: Vec::new(),
            inputs: 0,
            accepted: 0,
            sampled: 0,
            let_in: 0,
            slowest: Duration::ZERO,
            most_bytes: 0,
            secs: 0.0,
            longest: LONGEST,
        }
    }

    /// Tries the seeds unchanged.
    pub fn try_seeds(&mut self) {
        watch::quietly(|| {
            for i in 0..self.seeds.len() {
                let input = self.seeds[i].clone();
                self.try_one(&input);
            }
        });
    }

    /// Tries so many mutations of the seeds.
    pub fn run(&mut self, iterations: u64) {
        watch::quietly(|| {
            for _ in 0..iterations {
                let input = self.mutator.next([&self.seeds, &self.seeds, &self.good, &self.odd]);
                if self.inputs.is_multiple_of(SAMPLED) {
                    self.sampled += 1;
                    self.let_in += u64::from(self.target.door.lets_in(&input));
                }
                self.inputs += 1;
                let Some(outcome) = self.try_one(&input) else { continue };
                self.accepted += u64::from(outcome.is_ok());
                self.learn(&outcome, input);
            }
        });
    }

    /// Outcome of a reader for an input; `None` if it broke a promise.
    fn try_one(&mut self, input: &[u8]) -> Option<Outcome> {
        watch::begin(self.target.name, input);
        let before = memory::start();
        let start = Instant::now();
        let outcome = catch_unwind(AssertUnwindSafe(|| (self.target.read)(input)));
        let (took, used) = (start.elapsed(), memory::peak().saturating_sub(before));
        watch::end();
        self.slowest = self.slowest.max(took);
        self.most_bytes = self.most_bytes.max(used);
        self.secs += took.as_secs_f64();
        let limit = FREE_BYTES + BYTES_PER_BYTE * input.len();
        let what = match &outcome {
            Err(_) => format!("panics: {}", watch::last_panic()),
            _ if used > limit => format!("takes {used} bytes of memory, over {limit}"),
            _ if took > self.longest => format!("takes {took:?}"),
            _ => return outcome.ok(),
        };
        let is_new = !self.finds.iter().any(|f| shape(&f.what) == shape(&what));
        if is_new && self.finds.len() < MOST_FINDS {
            self.finds.push(Find { what, input: input.to_vec() });
        }
        None
    }

    /// Keeps inputs that are worth another mutation: some that the reader accepts, the latest, and those
    /// about which it says something new, which got further than others.
    fn learn(&mut self, outcome: &Outcome, input: Vec<u8>) {
        if input.len() > LONGEST_KEPT {
            return;
        }
        match outcome {
            Ok(()) if self.good.len() < MOST_KEPT => self.good.push(input),
            Ok(()) => self.good[self.accepted as usize % MOST_KEPT] = input,
            Err(e) if self.odd.len() < MOST_KEPT && self.said.insert(shape(e)) => self.odd.push(input),
            Err(_) => {}
        }
    }

    /// Summary of the search, in a line of [`table`].
    pub fn line(&self) -> String {
        let share = |n: u64, of: u64| 100.0 * n as f64 / of.max(1) as f64;
        format!(
            "{:<24} {:>9} {:>8.1} % {:>8.1} % {:>9.3} {:>9.1} {:>8.1} {:>6}",
            self.target.name,
            self.inputs,
            share(self.let_in, self.sampled),
            share(self.accepted, self.inputs),
            1e3 * self.secs / self.inputs.max(1) as f64,
            1e3 * self.slowest.as_secs_f64(),
            self.most_bytes as f64 / 1e6,
            self.finds.len(),
        )
    }
}

/// A message without numbers and punctuation, as a number.
fn shape(message: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    message.bytes().filter(u8::is_ascii_alphabetic).take(160).for_each(|b| b.hash(&mut hasher));
    hasher.finish()
}

/// Summary of the search in each reader, and in all.
pub fn table(searches: &[Search]) -> String {
    let mut lines = vec![format!(
        "{:<24} {:>9} {:>10} {:>10} {:>9} {:>9} {:>8} {:>6}",
        "reader", "inputs", "let in", "accepted", "mean ms", "most ms", "most MB", "finds"
    )];
    lines.extend(searches.iter().map(Search::line));
    let (inputs, finds): (u64, usize) =
        (searches.iter().map(|s| s.inputs).sum(), searches.iter().map(|s| s.finds.len()).sum());
    let secs: f64 = searches.iter().map(|s| s.secs).sum();
    lines.push(format!("all {} readers: {inputs} inputs, {secs:.0} s in them, {finds} finds", searches.len()));
    lines.join("\n")
}
