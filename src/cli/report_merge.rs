//! `fmlgs report merge`: the results of all units of a batch as one page.

use std::path::PathBuf;

use super::progress::Console;
use super::{CliError, output};
use crate::jobs::batch::{self, MergedRow};
use crate::math::format::things;

/// Merge the results of 'fmlgs batch' into one page
///
/// Reads the units in the folders, wherever in them they are, and writes merged.html (one page that needs nothing else),
/// merged.csv (a line for each unit) and merged.json. Results that do not go together, such as two settings of one
/// name, are refused.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs report merge runs/\n  \
    fmlgs report merge here/ there/ --out merged/ --json")]
pub(crate) struct MergeArgs {
    /// Folders of results
    #[arg(required = true)]
    folders: Vec<PathBuf>,
    /// Folder for the page
    #[arg(long, default_value = "out/merged")]
    out: PathBuf,
    /// Print one JSON document, what merged.json holds
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: MergeArgs, quiet: bool) -> Result<(), CliError> {
    let merged = batch::merge(&args.folders, &args.out, &mut Console::new(quiet))?;
    if args.json {
        return output::print_json(&merged);
    }
    let mut rows = vec![MergedRow::HEAD.map(str::to_owned).to_vec()];
    rows.extend(merged.rows.iter().map(|row| row.cells().to_vec()));
    let (done, failed, unfinished) = (things(merged.units.len(), "unit"), merged.failed.len(), merged.unfinished.len());
    let page = args.out.join("merged.html");
    output::print(&format!(
        "{}\n{done} done, {failed} failed, {unfinished} unfinished; page: {}",
        output::table(&rows),
        page.display()
    ))
}
