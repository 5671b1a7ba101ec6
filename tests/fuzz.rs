//! Fuzzing of every parser on stable Rust: small seeds, deterministic mutations, and three
//! promises held against each input: no panic, bounded memory, bounded time.
//!
//! `FMLGS_FUZZ_ITERS=100000 cargo test --test fuzz` searches longer than the default,
//! `FMLGS_FUZZ_SEED` starts elsewhere, `FMLGS_FUZZ_ONLY=sog` tries one parser. An input that
//! breaks a promise is written to `target/fuzz/` and named; once mended it belongs into
//! `tests/corpus/<parser>/`, whose files are all tried unchanged as well. `cargo test --test fuzz
//! -- --ignored` writes the seeds anew.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "fuzz/memory.rs"]
mod memory;
#[path = "fuzz/mutate.rs"]
mod mutate;
#[path = "fuzz/seeds.rs"]
mod seeds;
#[path = "fuzz/targets.rs"]
mod targets;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use mutate::Mutator;
use targets::Target;

/// Mutated inputs per parser, unless the environment says otherwise.
const ITERATIONS: u64 = 300;
/// Memory that any input may use, in bytes, and more per byte of the input.
const FREE_BYTES: usize = 48 << 20;
const BYTES_PER_BYTE: usize = 64;
/// Longest time for one input; generous, for slow machines under load.
const LONGEST: Duration = Duration::from_secs(5);

fn corpus(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(name)
}

/// The seeds of a parser, in the order of their names.
fn load_seeds(name: &str) -> Vec<Vec<u8>> {
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(corpus(name)).expect(name).map(|e| e.expect("entry").path()).collect();
    files.sort();
    files.iter().map(|f| std::fs::read(f).expect("seed")).collect()
}

/// What an input did that it must not.
fn broken_promise(parse: &dyn Fn(&[u8]), input: &[u8]) -> Option<String> {
    let before = memory::start();
    let start = Instant::now();
    let outcome = catch_unwind(AssertUnwindSafe(|| parse(input)));
    let (took, used) = (start.elapsed(), memory::peak().saturating_sub(before));
    if outcome.is_err() {
        return Some("panics".into());
    }
    let limit = FREE_BYTES + BYTES_PER_BYTE * input.len();
    if used > limit {
        return Some(format!("takes {used} bytes of memory, over {limit}"));
    }
    (took > LONGEST).then(|| format!("takes {took:?}"))
}

/// Tries the seeds and `iterations` mutations of them; the first input that breaks a promise.
fn search(parse: &dyn Fn(&[u8]), seeds: &[Vec<u8>], iterations: u64, random: u64) -> Option<(String, Vec<u8>)> {
    // Memory is counted for the whole process, so only one search runs at a time.
    static ONE: Mutex<()> = Mutex::new(());
    let _one = ONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let mut mutator = Mutator::new(random);
    let inputs = seeds.iter().cloned().chain((0..iterations).map(|_| mutator.next(seeds)));
    let found = inputs.into_iter().find_map(|input| broken_promise(parse, &input).map(|what| (what, input)));
    std::panic::set_hook(hook);
    found
}

fn fuzz(target: &Target) {
    let number = |name: &str, default| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default);
    let seeds = load_seeds(target.name);
    assert!(!seeds.is_empty(), "no seeds for {}", target.name);
    let iterations = number("FMLGS_FUZZ_ITERS", ITERATIONS);
    if let Some((what, input)) = search(&*target.parse, &seeds, iterations, number("FMLGS_FUZZ_SEED", 1)) {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/fuzz");
        std::fs::create_dir_all(&folder).expect("create");
        let file = folder.join(format!("{}-{}.bin", target.name, input.len()));
        std::fs::write(&file, &input).expect("write");
        panic!("{}: an input of {} bytes {what}; see {}", target.name, input.len(), file.display());
    }
}

#[test]
fn every_parser_keeps_its_promises() {
    let only = std::env::var("FMLGS_FUZZ_ONLY").ok();
    for target in targets::all().into_iter().filter(|t| only.as_ref().is_none_or(|o| o == t.name)) {
        let start = Instant::now();
        fuzz(&target);
        println!("{}: {:.1} s", target.name, start.elapsed().as_secs_f64());
    }
}

/// Seeds that no reader accepts would leave the mutations at its front door.
#[test]
fn every_parser_accepts_at_least_one_of_its_seeds() {
    for target in targets::all() {
        assert!(load_seeds(target.name).iter().any(|s| (target.accepts)(s)), "{}", target.name);
    }
}

/// Control: the search finds a parser that trusts what it reads.
#[test]
fn the_search_finds_what_it_looks_for() {
    let seeds = vec![b"count=0000 data".to_vec()];
    let panics = |input: &[u8]| assert!(!input.starts_with(b"count=9") && !input.is_empty());
    assert_eq!(search(&panics, &seeds, 20_000, 1).expect("found").0, "panics");
    let trusts = |input: &[u8]| {
        let count: usize = String::from_utf8_lossy(input.get(6..10).unwrap_or_default()).parse().unwrap_or(0);
        std::hint::black_box(Vec::<[u8; 1 << 20]>::with_capacity(count.min(200)));
    };
    assert!(search(&trusts, &seeds, 20_000, 1).expect("found").0.contains("memory"));
    assert!(search(&|_| {}, &seeds, 1000, 1).is_none());
}

#[test]
#[ignore = "writes the seeds into tests/corpus"]
fn write_seeds() {
    for (target, name, bytes) in seeds::all() {
        std::fs::create_dir_all(corpus(target)).expect("create");
        std::fs::write(corpus(target).join(name), bytes).expect("write");
    }
}
