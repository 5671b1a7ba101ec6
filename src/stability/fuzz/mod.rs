//! Fuzzing of numbers: random scenes, cameras, settings, embeddings and paths full of nasty numbers, held
//! against what must be true of any of them.
//!
//! The promise is that nothing panics, nothing hangs, and what comes out is finite, or a refusal by name;
//! where single and double precision are both defined they agree as far as the input's own condition
//! allows. Every input follows from its seed alone.

mod meaning;
mod numbers;
mod scenes;
mod ways;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use serde::Serialize;

use self::numbers::Numbers;

/// Seconds after which an input counts as one that does not end.
const HANG_SECS: u64 = 120;

/// How an input fared.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// All that was promised.
    Held,
    /// It was refused by name.
    Refused,
    /// What came out is finite, but single and double precision are not both defined, or not of the same
    /// Gaussians: there is nothing to hold it against.
    NotCompared,
    /// A promise was broken.
    Broken(String),
}

/// Breaks off with a broken promise unless something holds.
macro_rules! promise {
    ($holds:expr, $($what:tt)*) => {
        if !$holds {
            return Verdict::Broken(format!($($what)*));
        }
    };
}
use promise;

/// Makes an input and judges it.
type Trial = fn(&mut Numbers) -> Verdict;

/// What is fuzzed.
const AREAS: [(&str, Trial); 7] = [
    ("drawing", scenes::drawing),
    ("gradients", scenes::gradients),
    ("training", scenes::training),
    ("relevancy", meaning::relevancy),
    ("codes", meaning::codes),
    ("localising", meaning::localising),
    ("moving", ways::moving),
];

/// A broken promise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Broken {
    /// The seed that makes this input.
    pub seed: u64,
    /// What was broken.
    pub what: String,
}

/// What was found in an area.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// The area.
    pub area: &'static str,
    /// Inputs tried.
    pub inputs: u64,
    /// Of these, refused by name.
    pub refused: u64,
    /// Of these, held against nothing.
    pub not_compared: u64,
    /// Promises that were broken.
    pub broken: Vec<Broken>,
}

impl Found {
    /// Nothing yet.
    fn of(area: &'static str) -> Self {
        Self { area, inputs: 0, refused: 0, not_compared: 0, broken: Vec::new() }
    }
}

/// When to stop: after so many seconds, after so many rounds, whichever comes first; not before one round.
#[derive(Clone, Copy, Debug)]
pub struct Limit {
    /// Seconds.
    pub secs: f64,
    /// Rounds; in each, every area has one input.
    pub rounds: u64,
}

/// Tries inputs from `seed` upwards in the areas whose name contains `only`. An input that does not end
/// is told, and ends the search.
pub fn fuzz(seed: u64, limit: Limit, only: Option<&str>) -> Vec<Found> {
    let areas: Vec<usize> = (0..AREAS.len()).filter(|a| only.is_none_or(|o| AREAS[*a].0.contains(o))).collect();
    let mut found: Vec<Found> = areas.iter().map(|a| Found::of(AREAS[*a].0)).collect();
    let (sender, results) = channel();
    let worker = areas.clone();
    // A thread of its own, so that one that hangs can be left behind.
    let thread = std::thread::Builder::new().name("fuzz".into());
    if let Err(e) = thread.spawn(move || work(seed, limit, &worker, &sender)) {
        let failed = |f: &mut Found| f.broken.push(Broken { seed, what: e.to_string() });
        found.first_mut().into_iter().for_each(failed);
    }
    collect(&results, &mut found, seed, areas.len().max(1) as u64);
    found
}

/// Tries inputs and sends each verdict with the place of its area.
fn work(seed: u64, limit: Limit, areas: &[usize], results: &Sender<(usize, u64, Verdict)>) {
    let start = Instant::now();
    for round in 0..limit.rounds.max(1) {
        let seed = seed.wrapping_add(round);
        for (place, area) in areas.iter().enumerate() {
            if results.send((place, seed, judge(*area, seed))).is_err() {
                return;
            }
        }
        if start.elapsed().as_secs_f64() >= limit.secs {
            return;
        }
    }
}

/// Judges the input of an area that follows from a seed. A panic is a broken promise.
fn judge(area: usize, seed: u64) -> Verdict {
    let mut numbers = Numbers::new(seed, area as u64);
    match catch_unwind(AssertUnwindSafe(|| AREAS[area].1(&mut numbers))) {
        Ok(verdict) => verdict,
        Err(cause) => {
            let text = cause.downcast_ref::<String>().cloned();
            let text = text.or_else(|| cause.downcast_ref::<&str>().map(|t| (*t).to_owned()));
            Verdict::Broken(format!("it panicked: {}", text.unwrap_or_default()))
        }
    }
}

fn collect(results: &Receiver<(usize, u64, Verdict)>, found: &mut [Found], seed: u64, areas: u64) {
    let mut done = 0_u64;
    loop {
        match results.recv_timeout(Duration::from_secs(HANG_SECS)) {
            Ok((place, seed, verdict)) => {
                done += 1;
                let Some(found) = found.get_mut(place) else { continue };
                found.inputs += 1;
                match verdict {
                    Verdict::Held => {}
                    Verdict::Refused => found.refused += 1,
                    Verdict::NotCompared => found.not_compared += 1,
                    Verdict::Broken(what) => found.broken.push(Broken { seed, what }),
                }
            }
            Err(RecvTimeoutError::Disconnected) => return,
            Err(RecvTimeoutError::Timeout) => {
                let (place, seed) = ((done % areas) as usize, seed.wrapping_add(done / areas));
                let what = format!("it does not end within {HANG_SECS} s");
                found.iter_mut().skip(place).take(1).for_each(|f| {
                    f.broken.push(Broken { seed, what: what.clone() });
                });
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_search_breaks_nothing() {
        let found = fuzz(1, Limit { secs: f64::INFINITY, rounds: 150 }, None);
        assert_eq!(found.len(), AREAS.len());
        for area in &found {
            assert_eq!(area.inputs, 150, "{}", area.area);
            assert!(area.broken.is_empty(), "{}: {:?}", area.area, area.broken.first());
            // An area that refuses everything, or compares nothing, would promise nothing.
            println!("{}: {} refused, {} not compared of {}", area.area, area.refused, area.not_compared, area.inputs);
            let held = area.inputs - area.refused - area.not_compared;
            assert!(held * 10 > area.inputs, "{}: {held} of {} held", area.area, area.inputs);
        }
    }

    #[test]
    fn a_seed_makes_the_same_input_again() {
        let first = |seed, area| {
            let mut n = Numbers::new(seed, area);
            [0; 20].map(|_| n.any().to_bits())
        };
        assert_eq!(first(7, 0), first(7, 0));
        assert!(first(7, 0) != first(8, 0) && first(7, 0) != first(7, 1));
    }

    #[test]
    fn broken_promises_are_told_with_their_seed() {
        let mut found = vec![Found::of("x")];
        let (sender, results) = channel();
        let verdicts = [Verdict::Held, Verdict::Broken("NaN".into()), Verdict::Refused, Verdict::NotCompared];
        for (i, verdict) in verdicts.into_iter().enumerate() {
            sender.send((0, 10 + i as u64, verdict)).expect("open");
        }
        drop(sender);
        collect(&results, &mut found, 10, 1);
        assert_eq!((found[0].inputs, found[0].refused, found[0].not_compared), (4, 1, 1));
        assert_eq!(found[0].broken, [Broken { seed: 11, what: "NaN".into() }]);
    }
}
