//! Fuzzing on stable Rust: of numbers (see `numbers`), and of every reader: small seeds, deterministic mutations, and
//! three promises that each input must keep: no panic, bounded memory, bounded time.
//!
//! `cargo test --test fuzz` tries some thousands of inputs a reader. The long run tries
//! `FMLGS_FUZZ_TOTAL` (ten million if not set) over all readers and prints a table of them:
//! `cargo test --test fuzz -- --ignored --nocapture --exact long_run`; two runs with different
//! `FMLGS_FUZZ_SEED` go side by side. `FMLGS_FUZZ_ONLY=sog,photo` tries these readers alone,
//! `FMLGS_FUZZ_FILE` names a file to try with them. An input that breaks a promise is written to
//! `target/fuzz/` and named; once mended it belongs into `tests/corpus/<reader>/`, whose files are
//! all tried unchanged as well. `cargo test --test fuzz -- --ignored write_seeds` writes the seeds anew.
//! Numbers have a long run of their own: `cargo test --test fuzz -- --ignored long_run_of_numbers`, with
//! `FMLGS_FUZZ_ROUNDS` inputs an area.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod memory;
mod mutate;
mod numbers;
mod repair;
mod search;
mod seeds;
mod seeds_data_sets;
mod seeds_more;
mod targets;
mod targets_more;
mod watch;

use std::path::{Path, PathBuf};
use std::time::Duration;

use search::{Find, Search};
use targets::{Door, Target};

/// Mutated inputs of a quick reader in the usual run.
const ITERATIONS: u64 = 4000;
/// Mutated inputs of all readers in the long run, unless the environment says otherwise.
const TOTAL: u64 = 10_000_000;
/// Number of rounds of the long run over all readers.
const ROUNDS: u64 = 20;

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

fn corpus(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(name)
}

/// The seeds of a reader, in the order of their names.
fn load_seeds(target: &Target) -> Vec<Vec<u8>> {
    let list = |name: &&str| {
        let entries = std::fs::read_dir(corpus(name)).expect(name);
        entries.map(|e| e.expect("entry").path()).collect::<Vec<_>>()
    };
    let mut files: Vec<PathBuf> = target.corpora.iter().flat_map(list).collect();
    files.sort();
    let seeds: Vec<Vec<u8>> = files.iter().map(|f| std::fs::read(f).expect("seed")).collect();
    assert!(!seeds.is_empty(), "no seeds for {}", target.name);
    seeds
}

/// The readers that are asked for.
fn chosen() -> Vec<Target> {
    let only = std::env::var("FMLGS_FUZZ_ONLY").ok();
    let is_chosen = |t: &Target| only.as_ref().is_none_or(|o| o.split(',').any(|name| name == t.name));
    targets::all().into_iter().filter(is_chosen).collect()
}

/// Writes an input that breaks a promise, and prints the promise.
fn report(target: &str, find: &Find) -> String {
    let file = watch::save(target, &find.input);
    format!("{target}: an input of {} bytes {}; see {}", find.input.len(), find.what, file.display())
}

#[test]
fn every_reader_keeps_its_promises() {
    let iterations = number("FMLGS_FUZZ_ITERS", ITERATIONS);
    let mut searches: Vec<Search> =
        chosen().into_iter().map(|t| Search::new(load_seeds(&t), t, number("FMLGS_FUZZ_SEED", 1))).collect();
    for search in &mut searches {
        search.try_seeds();
        search.run(iterations / search.target.cost);
        println!("{}", search.line());
        let complaints: Vec<String> = search.finds.iter().map(|f| report(search.target.name, f)).collect();
        assert!(complaints.is_empty(), "{}", complaints.join("\n"));
    }
}

/// Seeds that no reader accepts would leave the mutations at its front door.
#[test]
fn every_reader_accepts_at_least_one_of_its_seeds() {
    for target in targets::all() {
        let seeds = load_seeds(&target);
        let outcomes: Vec<_> = watch::quietly(|| seeds.iter().map(|s| (target.read)(s)).collect());
        assert!(outcomes.iter().any(Result::is_ok), "{}: {outcomes:?}", target.name);
        assert!(seeds.iter().any(|s| target.door.lets_in(s)), "{}", target.name);
    }
}

/// Control: the search finds a reader that trusts what it reads.
#[test]
fn the_search_finds_what_it_looks_for() {
    let seeds = vec![b"count=0000 data".to_vec()];
    let finds = |read: fn(&[u8]), iterations| {
        let target = Target::new("control", Door::Any, move |input: &[u8]| {
            read(input);
            Ok::<_, String>(())
        });
        let mut search = Search::new(seeds.clone(), target, 1);
        search.longest = Duration::from_millis(20);
        search.run(iterations);
        search.finds.iter().map(|f| f.what.clone()).collect::<Vec<_>>().join("\n")
    };
    let panics = |input: &[u8]| assert!(!input.starts_with(b"count=9") && !input.is_empty());
    assert!(finds(panics, 20_000).contains("panics"));
    let trusts = |input: &[u8]| {
        let count: usize = String::from_utf8_lossy(input.get(6..10).unwrap_or_default()).parse().unwrap_or(0);
        std::hint::black_box(Vec::<[u8; 1 << 20]>::with_capacity(count.min(200)));
    };
    assert!(finds(trusts, 20_000).contains("memory"));
    let idles = |input: &[u8]| {
        if !input.starts_with(b"count") {
            std::thread::sleep(Duration::from_millis(30));
        }
    };
    assert!(finds(idles, 100).contains("takes"));
    assert_eq!(finds(|_| {}, 1000), "");
}

#[test]
#[ignore = "an hour: the long run"]
fn long_run() {
    if let Ok(file) = std::env::var("FMLGS_FUZZ_FILE") {
        let input = std::fs::read(file).expect("file");
        chosen().into_iter().for_each(|t| println!("{}: {:?}", t.name, (t.read)(&input)));
        return;
    }
    let (total, seed) = (number("FMLGS_FUZZ_TOTAL", TOTAL), number("FMLGS_FUZZ_SEED", 1));
    let mut searches: Vec<Search> = chosen().into_iter().map(|t| Search::new(load_seeds(&t), t, seed)).collect();
    searches.iter_mut().for_each(Search::try_seeds);
    let shares: f64 = searches.iter().map(|s| 1.0 / s.target.cost as f64).sum();
    for round in 1..=ROUNDS {
        for search in &mut searches {
            let own = total as f64 / shares / search.target.cost as f64;
            let upto = (own * round as f64 / ROUNDS as f64).ceil() as u64;
            let known = search.finds.len();
            search.run(upto.saturating_sub(search.inputs));
            search.finds[known..].iter().for_each(|f| println!("{}", report(search.target.name, f)));
        }
        println!("round {round} of {ROUNDS}\n{}", search::table(&searches));
    }
    assert_eq!(searches.iter().map(|s| s.finds.len()).sum::<usize>(), 0, "promises were broken: see above");
}

#[test]
#[ignore = "writes the seeds into tests/corpus"]
fn write_seeds() {
    for (target, name, bytes) in seeds::all().into_iter().chain(seeds_more::all()) {
        std::fs::create_dir_all(corpus(target)).expect("create");
        std::fs::write(corpus(target).join(name), bytes).expect("write");
    }
}
