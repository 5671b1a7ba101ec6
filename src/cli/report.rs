//! `fmlgs report`: error against run time.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::progress::Console;
use super::{CliError, number, output};
use crate::io;
use crate::jobs::{export, open};
use crate::measure::subject::{Options, Subject};
use crate::measure::{BeginError, End, FILE, Report, Stage, StageName, computer, defaults, page, plot};
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
#[command(after_help = "Examples:\n  \
    fmlgs report scene/ --out report/                          all stages that the scene allows\n  \
    fmlgs report scene/ --masks photos/ --budget 600\n  \
    fmlgs report scene/ --stages render,path --repeats 5\n  \
    fmlgs report --defaults DEFAULTS.md --from report/ --from other/")]
pub(crate) struct Args {
    /// Trained scene
    #[arg(required_unless_present = "defaults")]
    scene: Option<PathBuf>,
    /// Stages to measure [default: all that the scene allows]
    #[arg(long, value_enum, value_delimiter = ',')]
    stages: Vec<StageName>,
    /// Seconds for everything; what is not measured by then is left out
    #[arg(long, value_parser = number::within(1e-3..=1e9))]
    budget: Option<f64>,
    /// How often every setting is measured; trainings take another seed each time
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
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
    views: u32,
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
}

pub(crate) fn run(args: Args, quiet: bool) -> Result<(), CliError> {
    if let Some(path) = &args.defaults {
        let reports = args.from.iter().map(|p| Report::read(p)).collect::<Result<Vec<_>, _>>();
        let text = defaults::markdown(&reports?);
        return Ok(io::atomic::write(path, |w| w.write_all(text.as_bytes()))?);
    }
    let Some(scene) = args.scene.clone() else { return Err(CliError::Usage("a scene is needed".into())) };
    let console = &mut Console::new(quiet);
    let (name, computer) = (scene.display().to_string(), computer::look());
    let mut report = match args.fresh {
        true => Report::empty(&name, &computer),
        false => Report::begin(&args.out, &name, &computer).map_err(|e| match e {
            BeginError::Other(..) => CliError::failed(format!("{e} (--out); --fresh forgets it")),
            other => other.into(),
        })?,
    };
    let options = Options {
        masks: args.masks.clone(),
        steps: args.steps.clone(),
        train_steps: args.train_steps,
        max_side_px: args.max_side,
        views: args.views as usize,
        repeats: args.repeats,
    };
    let subject = subject(&scene, options)?;
    let (stages, missing) = subject.stages(&args.stages)?;
    missing.iter().for_each(|m| console.note(Severity::Info, m.clone()));
    export::make_folder(&args.out)?;
    let start = Instant::now();
    let mut stopped = None;
    for (k, name) in stages.iter().enumerate() {
        let left = args.budget.map_or(f64::INFINITY, |b| (b - start.elapsed().as_secs_f64()).max(0.0));
        let share = left / (stages.len() - k) as f64;
        let study = subject.study(*name);
        let end = match study.and_then(|mut study| report.measure(&mut study, &args.out, share, console)) {
            // A stage that nobody named may turn out impossible; the others go on.
            Err(why) if args.stages.is_empty() => {
                console.note(Severity::Warning, format!("Stage '{}' left out: {why}", name.name()));
                continue;
            }
            other => other?,
        };
        write(&args.out, &report)?;
        if end != End::Finished {
            stopped = Some(end);
        }
        if end == End::Cancelled {
            break;
        }
    }
    let tables = report.stages.iter().filter(|s| stages.contains(&s.name)).map(printed);
    output::print(&tables.collect::<Vec<_>>().join("\n"))?;
    match stopped {
        Some(End::Cancelled) => {
            Err(CliError::Cancelled(format!("{} holds what was measured", args.out.join(FILE).display())))
        }
        Some(_) => {
            console.note(Severity::Info, "The budget is used up; the same command resumes with the rest".into());
            Ok(())
        }
        None => Ok(()),
    }
}

/// A trained scene with its photos, if they are there.
fn subject(path: &Path, options: Options) -> Result<Subject, CliError> {
    let scene = open::scene(path)?;
    let dataset = scene.dataset_path.as_ref().filter(|p| p.exists()).map(|p| open::dataset(p)).transpose()?;
    let map = if path.is_dir() { io::semantic_map::load(path, scene.state.as_deref(), &scene.cloud)? } else { None };
    Ok(Subject {
        name: path.display().to_string(),
        cloud: scene.cloud,
        settings: scene.settings,
        cameras: scene.cameras.into_iter().map(|c| (c.camera, c.held_out)).collect(),
        holdout_every: scene.config.holdout_every,
        dataset,
        map,
        options,
    })
}

fn printed(stage: &Stage) -> String {
    let head = format!("{}: seconds of {}", stage.name.title(), stage.secs_of);
    let orders = stage.orders.iter().map(|o| {
        let agrees = if o.agrees { "agrees" } else { "does NOT agree" };
        format!("{}: order {:.2} seen, {} expected: {agrees}\n", o.what, o.observed, o.expected)
    });
    let left_out = stage.left_out.iter().map(|text| format!("left out: {text}\n"));
    format!("{head}\n{}\n{}", output::table(&stage.table()), orders.chain(left_out).collect::<String>())
}

/// Everything but the JSON, which is there already.
fn write(folder: &Path, report: &Report) -> Result<(), CliError> {
    let mut files = vec![("report.csv".to_owned(), report.csv()), ("report.html".to_owned(), page::html(report))];
    for stage in &report.stages {
        let plot = stage.measures.first().and_then(|m| plot::svg(stage, m).ok());
        files.extend(plot.map(|p| (format!("{}.svg", stage.name.name()), p)));
    }
    for (name, text) in files {
        io::atomic::write(&folder.join(name), |w| w.write_all(text.as_bytes()))?;
    }
    Ok(())
}
