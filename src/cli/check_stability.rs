//! `fmlgs check-stability`: the catalog of extreme cases, run here and now.

use serde_json::json;

use super::{CliError, output};
use crate::measure::stability::{self, Checked, Verdict, catalog};

/// Run the catalog of extreme cases
///
/// Each case says what happened, how far it is from double precision (or from what it should be), and
/// whether the promise holds: finite numbers in, finite numbers out, or a clear refusal. What no precision
/// knows better is "not compared", and counted. Exit code 1 if a promise is broken.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs check-stability\n  \
    fmlgs check-stability --only drawing --json")]
pub(crate) struct CheckStabilityArgs {
    /// Only cases whose area or name contains this
    #[arg(long)]
    only: Option<String>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: CheckStabilityArgs) -> Result<(), CliError> {
    let all = catalog();
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
        let table = output::table(&stability::table(&checked));
        let (all, share) = (checked.len(), 100.0 * not_compared as f64 / checked.len() as f64);
        output::print(&format!("{table}\n{all} cases, {broken} broken, {not_compared} not compared ({share:.1} %)"))?;
    }
    if broken > 0 { Err(CliError::failed(format!("{broken} promises are broken"))) } else { Ok(()) }
}
