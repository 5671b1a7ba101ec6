//! Fuzzing of numbers: random scenes, cameras, settings, embeddings and paths full of adversarial values, checked
//! against properties that hold for all of them.
//!
//! The promise is that nothing panics, nothing hangs, and what comes out is finite, or a refusal by name; where single
//! and double precision are both defined they agree as far as the input's own condition allows. Every input follows
//! from its seed alone; of one that breaks a promise, the values that are needed for that are found by replacing the
//! others by ordinary ones.

mod meaning;
mod scenes;
mod source;
mod ways;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use source::Numbers;

use super::{number, watch};

/// After this long an input counts as one that does not end.
const HANG: Duration = Duration::from_secs(120);
/// Inputs of an area in the usual run, and in the long one.
const ROUNDS: u64 = 150;
const MANY_ROUNDS: u64 = 20_000;

/// Verdict on an input.
#[derive(Clone, Debug, PartialEq)]
enum Verdict {
    /// All that was promised.
    Held,
    /// The input was refused with a named error.
    Refused,
    /// The result is finite, but single and double precision are not both defined, or not of the same
    /// Gaussians: there is nothing to compare it with.
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

/// Areas that are fuzzed.
const AREAS: [(&str, Trial); 7] = [
    ("drawing", scenes::drawing),
    ("gradients", scenes::gradients),
    ("training", scenes::training),
    ("relevancy", meaning::relevancy),
    ("codes", meaning::codes),
    ("localizing", meaning::localizing),
    ("moving", ways::moving),
];

/// Result of an area: verdicts on inputs, and broken promises.
#[derive(Debug, Default)]
struct Found {
    held: u64,
    refused: u64,
    not_compared: u64,
    broken: Vec<String>,
}

/// Judges an input. A panic is a broken promise.
fn judge(trial: Trial, numbers: &mut Numbers) -> Verdict {
    catch_unwind(AssertUnwindSafe(|| trial(numbers)))
        .unwrap_or_else(|_| Verdict::Broken(format!("it panicked: {}", watch::last_panic())))
}

/// Tries the inputs of so many seeds from `seed` upwards.
fn fuzz(name: &'static str, trial: Trial, seed: u64, rounds: u64) -> Found {
    let mut found = Found::default();
    for seed in seed..seed + rounds {
        watch::begin_for(name, &seed.to_le_bytes(), HANG);
        let numbers = &mut Numbers::new(seed, name);
        match judge(trial, numbers) {
            Verdict::Held => found.held += 1,
            Verdict::Refused => found.refused += 1,
            Verdict::NotCompared => found.not_compared += 1,
            Verdict::Broken(what) => {
                let needed = shrunk(trial, numbers.clone());
                found.broken.push(format!("{name}, seed {seed}: {what}; values that are needed for it: {needed:?}"));
            }
        }
        watch::end();
    }
    found
}

/// The adversarial values without which an input keeps its promise: every other is made ordinary.
fn shrunk(trial: Trial, numbers: Numbers) -> Vec<f64> {
    let mut least = numbers;
    for place in 0..least.adversarial() {
        let mut tamer = least.again();
        tamer.tame(place);
        if matches!(judge(trial, &mut tamer), Verdict::Broken(_)) {
            least = tamer;
        }
    }
    least.values()
}

/// Searches in all areas that are asked for; every promise has to hold.
fn search(rounds: u64) {
    let (seed, only) = (number("FMLGS_FUZZ_SEED", 1), std::env::var("FMLGS_FUZZ_ONLY").ok());
    let asked = |name: &str| only.as_ref().is_none_or(|o| o.split(',').any(|o| o == name));
    for (name, trial) in AREAS.into_iter().filter(|a| asked(a.0)) {
        let found = watch::quietly(|| fuzz(name, trial, seed, rounds));
        println!("{name}: {} held, {} refused, {} not compared", found.held, found.refused, found.not_compared);
        assert!(found.broken.is_empty(), "{}", found.broken.join("\n"));
        // An area that refuses everything, or compares nothing, would promise nothing.
        assert!(found.held * 10 > rounds, "{name}: {} of {rounds} held", found.held);
    }
}

#[test]
fn adversarial_numbers_break_no_promise() {
    search(ROUNDS);
}

#[test]
#[ignore = "an hour: the long run"]
fn long_run_of_numbers() {
    search(number("FMLGS_FUZZ_ROUNDS", MANY_ROUNDS));
}

#[test]
fn a_seed_makes_the_same_input_again() {
    let first = |seed, area| {
        let mut n = Numbers::new(seed, area);
        [0; 20].map(|_| n.around(0.0, 1.0).to_bits())
    };
    assert_eq!(first(7, "a"), first(7, "a"));
    assert!(first(7, "a") != first(8, "a") && first(7, "a") != first(7, "b"));
}

/// Control: a promise that is broken is seen, with its seed and the values that break it and no others.
#[test]
fn broken_promises_are_found_and_shrunk() {
    let trial: Trial = |n| {
        let values: [f32; 12] = n.several(0.0, 1.0);
        promise!(values[5] < 100.0, "a value is {}", values[5]);
        Verdict::Held
    };
    let found = watch::quietly(|| fuzz("control", trial, 1, 300));
    assert!(found.held > 100 && !found.broken.is_empty(), "{found:?}");
    assert!(found.broken.iter().all(|b| b.contains("seed") && b.contains(": a value is ")), "{found:?}");
    for broken in &found.broken {
        let needed = broken.rsplit_once('[').expect("values").1.trim_end_matches(']');
        assert!(needed.parse::<f64>().is_ok_and(|v| v >= 100.0), "{broken}");
    }
    let panics: Trial = |n| if n.chance(0.5) { panic!("at once") } else { Verdict::Held };
    let found = watch::quietly(|| fuzz("control", panics, 1, 20));
    assert!(found.broken.iter().any(|b| b.contains("at once")), "{found:?}");
}
