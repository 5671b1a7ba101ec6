//! `fmlgs report`: error against run time.

use std::path::PathBuf;

use super::progress::Console;
use super::recipe::RecipeArgs;
use super::report_merge::{self, MergeArgs};
use super::{CliError, number, output};
use crate::jobs::export;
use crate::jobs::report::{self, Measured, ReportRequest};
use crate::measure::subject::StudyOptions;
use crate::measure::{End, FILE, Report, Stage, StageName, defaults, table};
use crate::pipeline::observer::{Observer, Severity};

/// Measure error against run time, knob by knob
///
/// Goes through the settings of each stage, repeats them, and writes report.json, report.csv,
/// report.html (one page that needs nothing else) and a plot of each stage as SVG. The window's pane
/// 'Report' shows the same report.json.
///
/// Every setting is measured once before any is measured twice, and everything measured is kept: after
/// Ctrl-C, a kill or the end of the budget the same command resumes.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true, disable_help_subcommand = true)]
#[command(after_help = "Examples:\n  \
    fmlgs report scene/ --out report/                          all stages that the scene allows\n  \
    fmlgs report scene/ --masks photos/ --budget 600\n  \
    fmlgs report scene/ --stages render,path --repeats 5\n  \
    fmlgs report --defaults defaults.md --from report/ --from other/\n  \
    fmlgs report merge runs/ --out merged/                     one page of all results of a batch")]
pub(crate) struct ReportArgs {
    #[command(subcommand)]
    command: Option<ReportCommand>,
    /// Trained scene
    #[arg(required_unless_present = "defaults")]
    scene: Option<PathBuf>,
    /// Stages to measure [default: all that the scene allows]
    #[arg(long, value_enum, value_delimiter = ',')]
    stages: Vec<StageName>,
    /// Seconds for everything; what is not measured by then is left out
    #[arg(long, value_parser = number::within(1e-3..=1e9))]
    budget: Option<f64>,
    /// Number of times that every setting is measured; trainings take another seed each time
    #[arg(long, default_value_t = StudyOptions::default().repeats, value_parser = clap::value_parser!(u32).range(1..=100))]
    repeats: u32,
    /// Labels of the photos, for the stages 'features' and 'query'
    #[arg(long)]
    masks: Option<PathBuf>,
    /// Optimizer steps of the stage 'features'; may be given several times
    #[arg(long, default_values_t = [300, 1000], value_parser = number::within(1..=100_000_000_u64))]
    steps: Vec<u64>,
    /// Optimizer steps of the default of the stage 'train'
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u64).range(20..=1_000_000))]
    train_steps: u64,
    /// Longer side of the compared images in px
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(16..=4096))]
    max_side: u32,
    /// Most views that are compared
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=1000))]
    view_count: u32,
    /// Folder for the report
    #[arg(long, default_value = "out/report")]
    out: PathBuf,
    /// Forget what is in the folder
    #[arg(long)]
    fresh: bool,
    /// Write the table of defaults and their evidence into this Markdown file
    #[arg(long, requires = "from", conflicts_with = "scene")]
    defaults: Option<PathBuf>,
    /// Report (folder or JSON) that the table of defaults is made of; may be given several times
    #[arg(long)]
    from: Vec<PathBuf>,
    #[command(flatten)]
    recipe: RecipeArgs,
}

#[derive(Debug, clap::Subcommand)]
enum ReportCommand {
    Merge(MergeArgs),
}

pub(crate) fn run(args: ReportArgs, quiet: bool) -> Result<(), CliError> {
    if let Some(ReportCommand::Merge(args)) = args.command {
        return report_merge::run(args, quiet);
    }
    if let Some(path) = &args.defaults {
        let reports = args.from.iter().map(|p| Report::read(p)).collect::<Result<Vec<_>, _>>();
        let text = defaults::markdown(&reports?);
        return Ok(export::text(path, &text)?);
    }
    let Some(scene) = &args.scene else { return Err(CliError::Usage("a scene is needed".into())) };
    let console = &mut Console::new(quiet);
    let options = StudyOptions {
        masks: args.masks,
        steps: args.steps,
        train_steps: args.train_steps,
        max_side_px: args.max_side,
        views: args.view_count as usize,
        repeats: args.repeats,
        recipe: args.recipe.recipe(),
    };
    let subject = report::subject(scene, options)?;
    let ReportArgs { stages, out, fresh, budget, .. } = args;
    let (budget_secs, command) = (budget.unwrap_or(f64::INFINITY), output::command_line());
    let request = ReportRequest { subject, stages, out, fresh, budget_secs, command };
    let Measured { report, stages, end } = report::run(&request, console)?;
    let tables = report.stages.iter().filter(|s| stages.contains(&s.name)).map(printed);
    output::print(&tables.collect::<Vec<_>>().join("\n"))?;
    match end {
        End::Cancelled => {
            Err(CliError::Cancelled(format!("{} holds what was measured", request.out.join(FILE).display())))
        }
        End::OutOfTime => {
            console.note(Severity::Info, "The budget is used up; the same command resumes with the rest".into());
            Ok(())
        }
        End::Finished => Ok(()),
    }
}

fn printed(stage: &Stage) -> String {
    let head = format!("{}: seconds of {}; {}", stage.name.title(), stage.secs_of, stage.runs());
    let orders = stage.orders.iter().map(|o| {
        let agrees = if o.agrees { "agrees" } else { "does NOT agree" };
        format!("{}: order {:.2} seen, {} expected: {agrees}\n", o.what, o.observed, o.expected)
    });
    let left_out = stage.left_out.iter().map(|text| format!("left out: {text}\n"));
    format!("{head}\n{}\n{}", output::table(&table::of_stage(stage)), orders.chain(left_out).collect::<String>())
}
