//! `fmlgs check-stability`: the catalogue of extreme cases, or a search for new ones, run here and now.

use serde_json::json;

use super::{CliError, number, output};
use crate::stability::fuzz::{Found, Limit, fuzz};
use crate::stability::{Checked, Verdict, catalogue};

/// Broken promises of random inputs that are printed.
const SHOWN: usize = 30;

/// Run the catalogue of extreme cases
///
/// Each case says what happened, how far it is from double precision (or from what it should be), and
/// whether the promise holds: finite numbers in, finite numbers out, or a clear refusal. What no precision
/// knows better is "not compared", and counted. Exit code 1 if a promise is broken.
///
/// With --fuzz, random scenes, cameras, settings, embeddings and paths full of nasty numbers are tried
/// instead, and each broken promise is told with the seed that makes its input again.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs check-stability\n  \
    fmlgs check-stability --only drawing --json\n  \
    fmlgs check-stability --fuzz 60 --seed 7")]
pub struct Args {
    /// Only cases whose area or name contains this
    #[arg(long)]
    only: Option<String>,
    /// Try random inputs for so many seconds; 0 = one of each kind
    #[arg(long, value_name = "SECS", value_parser = number::within(0.0..=1e7))]
    fuzz: Option<f64>,
    /// First seed of the random inputs; each next one is one higher
    #[arg(long, requires = "fuzz", default_value_t = 0)]
    seed: u64,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub fn run(args: Args) -> Result<(), CliError> {
    if let Some(secs) = args.fuzz {
        return search(&args, secs);
    }
    let all = catalogue();
    let wanted = |area: &str, name: &str| args.only.as_ref().is_none_or(|o| area.contains(o) || name.contains(o));
    let checked: Vec<Checked> = all.iter().filter(|c| wanted(c.area, &c.name)).map(|c| c.check()).collect();
    if checked.is_empty() {
        return Err(CliError::Usage("no case is called so".into()));
    }
    let count = |verdict: Verdict| checked.iter().filter(|c| c.finding.verdict == verdict).count();
    let (broken, not_compared) = (count(Verdict::Broken), count(Verdict::NotCompared));
    if args.json {
        output::print_json(&json!({ "cases": checked, "broken": broken, "not_compared": not_compared }))?;
    } else {
        let number = |v: f64| if v.is_nan() { String::new() } else { format!("{v:.1e}") };
        let mut rows = vec![["area", "case", "what happened", "error", "bound", "holds"].map(str::to_owned).to_vec()];
        rows.extend(checked.iter().map(|c| {
            let f = &c.finding;
            let holds = f.verdict.text().to_owned();
            vec![c.area.into(), c.name.clone(), f.outcome.clone(), number(f.error), number(f.bound), holds]
        }));
        let (table, all) = (output::table(&rows), checked.len());
        output::print(&format!("{table}\n{all} cases, {broken} broken, {}", share(not_compared as u64, all as u64)))?;
    }
    if broken > 0 { Err(CliError::failed(format!("{broken} promises are broken"))) } else { Ok(()) }
}

/// How many were not held against anything, and their share.
fn share(not_compared: u64, all: u64) -> String {
    format!("{not_compared} not compared ({:.1} %)", 100.0 * not_compared as f64 / all.max(1) as f64)
}

/// Tries random inputs and tells what was found.
fn search(args: &Args, secs: f64) -> Result<(), CliError> {
    let rounds = if secs > 0.0 { u64::MAX } else { 1 };
    let found = fuzz(args.seed, Limit { secs, rounds }, args.only.as_deref());
    if found.is_empty() {
        return Err(CliError::Usage("no kind of input is called so".into()));
    }
    let broken: usize = found.iter().map(|f| f.broken.len()).sum();
    if args.json {
        output::print_json(&json!({ "seed": args.seed, "areas": found, "broken": broken }))?;
    } else {
        let columns = ["area", "inputs", "refused", "not compared", "broken"];
        let mut rows = vec![columns.map(str::to_owned).to_vec()];
        let row = |f: &Found| {
            let counts = [f.inputs, f.refused, f.not_compared, f.broken.len() as u64].map(|n| n.to_string());
            [vec![f.area.to_owned()], counts.to_vec()].concat()
        };
        rows.extend(found.iter().map(row));
        let sum = |of: fn(&Found) -> u64| found.iter().map(of).sum::<u64>();
        let not_compared = share(sum(|f| f.not_compared), sum(|f| f.inputs));
        let mut text = format!("{}\nseeds from {}, {broken} broken, {not_compared}", output::table(&rows), args.seed);
        for (area, b) in found.iter().flat_map(|f| f.broken.iter().map(|b| (f.area, b))).take(SHOWN) {
            text += &format!("\n{area}: {}; again: --fuzz 0 --seed {} --only {area}", b.what, b.seed);
        }
        output::print(&text)?;
    }
    if broken > 0 { Err(CliError::failed(format!("{broken} promises are broken"))) } else { Ok(()) }
}
