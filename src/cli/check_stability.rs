//! `fmlgs check-stability`: the catalogue of extreme cases, run here and now.

use serde_json::json;

use super::{CliError, output};
use crate::stability::{Checked, catalogue};

/// Run the catalogue of extreme cases
///
/// Each case says what happened, how far it is from double precision (or from what it should be), and
/// whether the promise holds: finite numbers in, finite numbers out, or a clear refusal. Exit code 1 if
/// one is broken.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs check-stability\n  \
    fmlgs check-stability --only drawing --json")]
pub struct Args {
    /// Only cases whose area or name contains this
    #[arg(long)]
    only: Option<String>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub fn run(args: Args) -> Result<(), CliError> {
    let all = catalogue();
    let wanted = |area: &str, name: &str| args.only.as_ref().is_none_or(|o| area.contains(o) || name.contains(o));
    let checked: Vec<Checked> = all.iter().filter(|c| wanted(c.area, &c.name)).map(|c| c.check()).collect();
    if checked.is_empty() {
        return Err(CliError::Usage("no case is called so".into()));
    }
    let broken = checked.iter().filter(|c| !c.finding.holds).count();
    if args.json {
        output::print_json(&json!({ "cases": checked, "broken": broken }))?;
    } else {
        let number = |v: f64| if v.is_nan() { String::new() } else { format!("{v:.1e}") };
        let mut rows = vec![["area", "case", "what happened", "error", "bound", "holds"].map(str::to_owned).to_vec()];
        rows.extend(checked.iter().map(|c| {
            let f = &c.finding;
            let holds = if f.holds { "yes" } else { "NO" };
            vec![c.area.into(), c.name.clone(), f.outcome.clone(), number(f.error), number(f.bound), holds.into()]
        }));
        output::print(&format!("{}\n{} cases, {broken} broken", output::table(&rows), checked.len()))?;
    }
    if broken > 0 { Err(CliError::failed(format!("{broken} promises are broken"))) } else { Ok(()) }
}
