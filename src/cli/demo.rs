//! `fmlgs demo`: the whole way on the scene that ships with the program, with or without a window.

use std::path::PathBuf;

use super::progress::Console;
use super::train::TrainOverrides;
use super::{CliError, output};
use crate::jobs::demo_tour;

/// Show the program on the demo scene: make photos, train, look around
///
/// Opens the window and trains there. With --headless it needs no display: it renders the demo
/// scene's photos, trains on them, measures the result on held-out photos, asks for objects and
/// parts, flies around the scene, and leaves images and a report in the folder given by --out.
/// Run again, it resumes where it was and reuses the photos.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs demo\n  \
    fmlgs demo --headless\n  \
    fmlgs demo --headless --steps 300 --out quick/      a first look in a fraction of the time")]
pub(crate) struct DemoArgs {
    /// Do it without a window, and write images and a report
    #[arg(long)]
    pub(crate) headless: bool,
    /// Folder for everything the headless demo makes
    #[arg(long, default_value = "out/demo")]
    out: PathBuf,
    #[command(flatten)]
    settings: TrainOverrides,
    /// Print the report as one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: DemoArgs, quiet: bool) -> Result<(), CliError> {
    let config = args.settings.over(demo_tour::config());
    let report = demo_tour::run(&args.out, config, &mut Console::new(quiet))
        .map_err(|e| CliError::of_work(e, "what is done is kept; the same command resumes there"))?;
    if args.json {
        return output::print_json(&report);
    }
    output::print(&format!("{}\nSee {}", report.summary(), args.out.join("report.md").display()))
}
