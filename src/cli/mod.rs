//! The command line: one file per subcommand, each of which checks its raw arguments once and then
//! works on what it checked.
//!
//! Results go to standard output (as one JSON document with `--json`), everything else to standard
//! error. Exit codes are listed in `EXIT_CODES`.

mod add;
mod agent;
mod agent_scene;
mod agent_work;
mod batch;
mod bench;
mod check_stability;
mod clean;
mod compare;
mod connect;
mod demo;
mod edit;
mod error;
mod eval;
mod eval_depth;
mod eval_language;
mod eval_masks;
mod eval_removal;
mod eval_results;
mod export;
mod features;
mod generate;
mod idle;
mod import;
mod info;
mod interrupt;
mod locate;
mod mcp;
mod models;
mod number;
mod output;
mod path;
mod plan;
mod poses;
mod preprocess;
mod process;
mod progress;
mod query;
mod recipe;
mod remove;
mod render;
mod report;
mod report_merge;
mod reproduce;
mod result_args;
mod scene_args;
mod segment;
mod segment_click;
mod serve;
mod synth;
mod table_args;
mod train;
mod view;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

pub(crate) use error::CliError;

use self::plan::PlanArgs;
use crate::scene::plan::PlanOverride;
use crate::scene::{resource_log, text};
use crate::worker::Start;

/// Exit code of a batch that was stopped and goes on with the same command. Grid Engine queues a job again that ends
/// with it; the script for Slurm does so itself.
const STOPPED: u8 = 99;

/// Meanings of the exit codes; part of `--help`.
const EXIT_CODES: &str = "\
Exit codes:
  0    done
  1    failed; the message names the file, the place in it and what can be done
  2    invalid arguments
  99   batch: stopped by Ctrl-C, SIGTERM, SIGUSR1 or SIGHUP with a checkpoint; the same command goes on
  130  canceled (Ctrl-C, SIGTERM, SIGUSR1, SIGHUP); what was done so far is saved where the command saves anything";

const EXAMPLES: &str = "\
Examples:
  fmlgs                                 open the window
  fmlgs photos/                         open the window with a folder of posed photos
  fmlgs demo                            open the window with the trained demo
  fmlgs info photos/                    say what a folder or file is
  fmlgs poses walk.mp4                  camera poses of photos, or of a video's frames
  fmlgs train photos/ --out scene/      train; the same command again resumes where it stopped
  fmlgs eval scene/ --pictures cmp/     PSNR and SSIM on held-out photos, pictures side by side
  fmlgs render scene/ --camera 12 --out view.png
  fmlgs preprocess scene/ --masks photos/   find objects and parts
  fmlgs query scene/ \"the lid of the kettle\" --mask lid.png
  fmlgs compare langsplat/ scene/ --phrases words.txt --views 0,12 --out side_by_side/
  fmlgs remove scene/ \"the kettle\" --out without_kettle/
  fmlgs locate scene/ photo.jpg         where was this photo taken?
  fmlgs add scene/ close-ups/ --out closer/   a better scene, where new photos show more
  fmlgs path scene/ --to \"the lid of the kettle\" --out path.json
  fmlgs render scene/ --path path.json --out video.mp4
  fmlgs agent scene/ \"what is on the table?\"
  fmlgs mcp scene/                      let an AI assistant look around in it (Model Context Protocol)
  fmlgs export scene/ --out scene.ply   for any other splat viewer
  fmlgs import RESULT --out scene/      a result of another method becomes a scene
  fmlgs batch jobs.toml --shard 1/4     many scenes, settings and seeds, on many machines
  fmlgs serve scene/                    show it to a window on another computer (fmlgs connect)
  fmlgs models                          neural networks: what is here, what each adds";

/// Train 3D Gaussians from posed photos while you watch, and look around in them.
#[derive(Debug, Parser)]
#[command(name = "fmlgs", version, about, max_term_width = 100)]
#[command(after_help = format!("{EXAMPLES}\n\n{EXIT_CODES}"))]
struct Cli {
    /// Path to open in the window: a dataset's folder, a splat file or a trained scene
    path: Option<PathBuf>,
    #[command(flatten)]
    plan: PlanArgs,
    /// Print what the window loads and builds, when and why
    #[arg(long)]
    trace: bool,
    /// Report to show in the window: a folder that 'fmlgs report' wrote, or its report.json; a second
    /// one is compared with it
    #[arg(long)]
    report: Vec<PathBuf>,
    /// Show warnings and results only
    #[arg(short, long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    Info(info::InfoArgs),
    Poses(poses::PosesArgs),
    Train(train::TrainArgs),
    Render(render::RenderArgs),
    Eval(eval::EvalArgs),
    Preprocess(preprocess::PreprocessArgs),
    Query(query::QueryArgs),
    Compare(compare::CompareArgs),
    Models(models::ModelsArgs),
    Segment(segment::SegmentArgs),
    Remove(remove::RemoveArgs),
    Clean(clean::CleanArgs),
    Edit(edit::EditArgs),
    Locate(locate::LocateArgs),
    Add(add::AddArgs),
    Path(path::PathArgs),
    Agent(agent::AgentArgs),
    Mcp(mcp::McpArgs),
    Serve(serve::ServeArgs),
    Connect(connect::ConnectArgs),
    Synth(synth::SynthArgs),
    Demo(demo::DemoArgs),
    Export(export::ExportArgs),
    Import(import::ImportArgs),
    Features(features::FeaturesArgs),
    Batch(batch::BatchArgs),
    Bench(bench::BenchArgs),
    Report(report::ReportArgs),
    Reproduce(reproduce::ReproduceArgs),
    CheckStability(check_stability::CheckStabilityArgs),
    #[command(hide = true)]
    Generate(generate::GenerateArgs),
}

/// Opens the window with what is wanted of plans, does these things first, and returns when the window is closed.
pub(crate) type OpenWindow = fn(Vec<Start>, Vec<PlanOverride>) -> Result<(), Box<dyn std::error::Error>>;

/// Runs the command line of this process and returns its exit code. `version` is what `--version` says; `open_window`
/// stands above this module, so the caller hands it in.
pub fn main(version: &'static str, open_window: OpenWindow) -> ExitCode {
    process::quiet_libraries();
    let command = Cli::command().version(version);
    let parsed = command.clone().try_get_matches();
    let idle = parsed.as_ref().map_or(Ok(()), |matches| idle::check_all(&command, matches));
    let cli = match parsed.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(_) if let Err(text) = idle => return CliError::Usage(text).report(),
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are "errors" for clap, with exit code 0. A closed pipe is no failure.
            let plain = error.render().to_string();
            if text::lines(&plain) == plain {
                let _ = error.print();
            } else {
                // What it quotes may be a file's name.
                output::note(&plain);
            }
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    match process::start_threads().map_err(CliError::failed).and_then(|()| run(cli, open_window)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => error.report(),
    }
}

fn run(cli: Cli, open_window: OpenWindow) -> Result<(), CliError> {
    let quiet = cli.quiet;
    let overrides = cli.plan.overrides;
    let Some(command) = cli.command else {
        if cli.trace {
            resource_log::listen(|load| output::note(&load.line()));
        }
        if cli.report.len() > 2 {
            return Err(CliError::Usage("--report: at most two reports are compared".into()));
        }
        let reports = cli.report.into_iter().zip([Start::Report, Start::SecondReport]);
        let first = cli.path.map(Start::Scene).into_iter().chain(reports.map(|(path, start)| start(path)));
        return window(first.collect(), overrides, open_window);
    };
    if cli.trace {
        return Err(CliError::Usage("--trace is for the window; a command has no use for it".into()));
    }
    if !cli.report.is_empty() {
        return Err(CliError::Usage("--report is for the window; a command has no use for it".into()));
    }
    if let Some(path) = cli.path {
        return Err(CliError::Usage(format!("'{}' before a command means nothing; put it after it", path.display())));
    }
    if !overrides.is_empty() && !matches!(command, Command::Demo(_)) {
        return Err(CliError::Usage("--plan before a command means nothing; put it after it".into()));
    }
    interrupt::listen(matches!(command, Command::Batch(_)));
    match command {
        Command::Info(args) => info::run(args),
        Command::Poses(args) => poses::run(&args, quiet),
        Command::Models(args) => models::run(args, quiet),
        Command::Train(args) => train::run(args, quiet),
        Command::Render(args) => render::run(args, quiet),
        Command::Eval(args) => eval::run(args, quiet),
        Command::Preprocess(args) => preprocess::run(args, quiet),
        Command::Query(args) => query::run(args, quiet),
        Command::Compare(args) => compare::run(&args, quiet),
        Command::Segment(args) => segment::run(args, quiet),
        Command::Remove(args) => remove::run(args, quiet),
        Command::Clean(args) => clean::run(args, quiet),
        Command::Edit(args) => edit::run(args, quiet),
        Command::Locate(args) => locate::run(&args, quiet),
        Command::Add(args) => add::run(args, quiet),
        Command::Path(args) => path::run(args),
        Command::Agent(args) => agent::run(args),
        Command::Mcp(args) => mcp::run(args, quiet),
        Command::Serve(args) => serve::run(args, quiet),
        Command::Connect(args) if args.headless => connect::run(args, quiet),
        Command::Connect(args) => window(vec![Start::Remote(args.url_for_window()?)], overrides, open_window),
        Command::Synth(args) => synth::run(args, quiet),
        Command::Demo(args) if args.headless || args.make.is_some() => demo::run(args, quiet),
        Command::Demo(_) => window(vec![Start::Demo], overrides, open_window),
        Command::Export(args) => export::run(args, quiet),
        Command::Import(args) => import::run(args, quiet),
        Command::Features(args) => features::run(args, quiet),
        Command::Batch(args) => batch::run(args, quiet),
        Command::Bench(args) => bench::run(args, quiet),
        Command::Report(args) => report::run(args, quiet),
        Command::Reproduce(args) => reproduce::run(args, quiet),
        Command::CheckStability(args) => check_stability::run(args),
        Command::Generate(args) => generate::run(&args, Cli::command()),
    }
}

fn window(first: Vec<Start>, overrides: Vec<PlanOverride>, open_window: OpenWindow) -> Result<(), CliError> {
    for start in &first {
        match start {
            Start::Scene(path) if !path.exists() => {
                let name = path.display();
                return Err(CliError::Usage(format!("'{name}' is no file, no folder and no subcommand")));
            }
            Start::Report(path) | Start::SecondReport(path) if !path.exists() => {
                return Err(CliError::Usage(format!("--report: '{}' is no file and no folder", path.display())));
            }
            _ => {}
        }
    }
    let has_display = ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|v| std::env::var_os(v).is_some_and(|d| !d.is_empty()));
    if cfg!(all(unix, not(target_os = "macos"))) && !has_display {
        return Err(CliError::failed(
            "no display was found (neither DISPLAY nor WAYLAND_DISPLAY is set), so the window cannot open. \
             'fmlgs demo --headless' shows what the program does; 'fmlgs --help' lists what works without a window",
        ));
    }
    process::settle();
    open_window(first, overrides).map_err(|error| {
        CliError::failed(format!("the window could not be opened: {error}. 'fmlgs demo --headless' works without one"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_subcommand_explains_itself() {
        for command in Cli::command().get_subcommands() {
            let name = command.get_name();
            assert!(command.get_about().is_some(), "{name} has no description");
            let help = command.clone().render_long_help().to_string();
            assert!(help.contains(&format!("fmlgs {name}")), "{name} shows no example");
            for argument in command.get_arguments() {
                assert!(argument.get_help().is_some(), "{name} {} is not explained", argument.get_id());
            }
        }
    }

    #[test]
    fn a_path_and_a_subcommand_are_told_apart() {
        let cli = Cli::try_parse_from(["fmlgs", "photos"]).expect("a path");
        assert_eq!(cli.path, Some(PathBuf::from("photos")));
        let cli = Cli::try_parse_from(["fmlgs", "info", "photos"]).expect("a subcommand");
        assert!(cli.path.is_none() && matches!(cli.command, Some(Command::Info(_))));
        let cli = Cli::try_parse_from(["fmlgs", "photos", "info", "more"]).expect("words in an order");
        assert!(matches!(run(cli, |_, _| Ok(())), Err(CliError::Usage(_))));
        let cli = Cli::try_parse_from(["fmlgs", "-q", "info", "photos"]).expect("quiet comes before or after");
        assert!(cli.quiet && cli.path.is_none());
        let cli = Cli::try_parse_from(["fmlgs", "--report", "a", "--report", "b"]).expect("reports alone");
        assert_eq!(cli.report.len(), 2);
        assert!(matches!(run(cli, |_, _| Ok(())), Err(CliError::Usage(e)) if e.contains("--report: 'a'")));
        let cli = Cli::try_parse_from(["fmlgs", "--report", "a", "info", "b"]).expect("words in an order");
        assert!(matches!(run(cli, |_, _| Ok(())), Err(CliError::Usage(_))));
    }
}
