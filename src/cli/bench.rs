//! `fmlgs bench`: how long drawing and training take on this machine, stage by stage.

use std::path::{Path, PathBuf};
use std::process::Command as Process;
use std::sync::Arc;

use serde_json::json;

use super::progress::Console;
use super::{CliError, number, output, process, view};
use crate::io::{self, Opened};
use crate::jobs::{self, Folders};
use crate::measure::StudyError;
use crate::measure::bench::{self, Timings, cpu, gpu, query};
use crate::measure::plan::{self, OpenScene, PlanCost, PlanVariant, SIZE, Saving};
use crate::models;
use crate::pipeline::observer::{Observer, Severity, Signal, Silent};
use crate::pipeline::train::{TrainConfig, TrainView, load_views};
use crate::render::Device;
use crate::scene::Dataset;

/// Time drawing and training on this machine, stage by stage
///
/// Splats and trained scenes are drawn from three views at each size; posed photos are trained on
/// for a few steps. Products are pairs of a splat and a pixel that it may touch; their rate stands
/// beside what one core could do at most. Times are medians; compare those of one run only.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs bench splat.ply\n  \
    fmlgs bench --queries 100\n  \
    fmlgs bench --plan scene/ splat.ply\n  \
    fmlgs bench splats/*.ply photos/ --size 640x480 --size 1280x720 --max-side 504 --gpu --json")]
pub(crate) struct BenchArgs {
    /// Splats or trained scenes to draw, posed photos to train on
    #[arg(required_unless_present = "queries")]
    paths: Vec<PathBuf>,
    /// Size of the drawn images; may be given several times [default: 640x480 1280x720]
    #[arg(long, value_parser = view::parse_size)]
    size: Vec<[u32; 2]>,
    /// Longer side of the training images in px
    #[arg(long, default_value_t = TrainConfig::default().max_side_px, value_parser = clap::value_parser!(u32).range(16..=16384))]
    max_side: u32,
    /// Repeats of each measurement
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    repeats: u32,
    /// Time the GPU beside the CPU, even a software one
    #[arg(long)]
    gpu: bool,
    /// Time this many typed queries too, on a made-up view of 1008 x 567 px with 300 objects and parts
    #[arg(long, value_name = "COUNT", value_parser = number::within(1..=100_000_000_usize))]
    queries: Option<usize>,
    /// Compare each scene's plan with everything enabled, each in processes of its own
    #[arg(long, conflicts_with_all = ["queries", "gpu", "size"])]
    plan: bool,
    /// Processes for each of the two
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100), requires = "plan")]
    runs: u32,
    /// Measure one of the two in this process
    #[arg(long, value_enum, hide = true, conflicts_with = "plan")]
    variant: Option<PlanVariant>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Objects and parts of the view that is asked.
const QUERY_IDENTITIES: usize = 300;
/// Its size in px.
const QUERY_SIZE: [usize; 2] = [1_008, 567];

pub(crate) fn run(args: BenchArgs, quiet: bool) -> Result<(), CliError> {
    if let (Some(variant), Some(scene)) = (args.variant, args.paths.first()) {
        // As the window has it.
        process::settle();
        return output::print_json(&plan::cost(|| open(scene), variant, args.repeats as usize)?);
    }
    if args.plan {
        return savings(&args);
    }
    let mut console = Console::new(quiet);
    let sizes = if args.size.is_empty() { vec![[640, 480], [1280, 720]] } else { args.size };
    let repeats = args.repeats as usize;
    let device = args.gpu.then(Device::shared).transpose()?;
    let gpu_name = device.as_ref().map(Device::describe);
    let one_core_products_per_sec = bench::one_core_limit();
    let mut timings = Timings { gpu: gpu_name, one_core_products_per_sec, ..Timings::default() };
    if let Some(count) = args.queries {
        let mut encoder = models::encoder(models::DEMO)?;
        timings.queries = Some(query::time(encoder.as_mut(), QUERY_IDENTITIES, QUERY_SIZE, count)?);
    }
    for path in &args.paths {
        let name = bench::label(path);
        let cloud = match io::open(path)? {
            Opened::Dataset(dataset) => {
                let (config, views) = photos(&dataset, args.max_side, &mut console)?;
                timings.train.push(cpu::train_steps(&dataset, &views, &config, repeats)?);
                if let Some(context) = &device {
                    timings.gpu_train.push(gpu::train_steps(context, &dataset, &views, &config, repeats)?);
                }
                continue;
            }
            Opened::Cloud(cloud) => Arc::new(cloud),
            Opened::Trained(scene) => Arc::new(scene.cloud),
        };
        for &size in &sizes {
            if console.signal() == Signal::Cancel {
                return Err(CliError::Cancelled("nothing was printed".into()));
            }
            console.note(Severity::Info, format!("Drawing {name} at {} x {}", size[0], size[1]));
            timings.render.push(cpu::render(&name, &cloud, size, repeats)?);
            if let Some(context) = &device {
                timings.gpu_render.push(gpu::render(context, &name, &cloud, size, repeats)?);
            }
        }
    }
    drop(console);
    if args.json {
        return output::print_json(&json!(timings));
    }
    let part = |(rows, about): &(Vec<Vec<String>>, String)| match rows.is_empty() {
        true => about.clone(),
        false => format!("{}\n{about}", output::table(rows)).trim_end().to_owned(),
    };
    output::print(&timings.tables().iter().map(part).collect::<Vec<_>>().join("\n\n"))
}

/// The photos to train on, and how.
fn photos(
    dataset: &Dataset,
    max_side_px: u32,
    console: &mut Console,
) -> Result<(TrainConfig, Vec<TrainView>), CliError> {
    let config = TrainConfig { max_side_px, densify: false, ..TrainConfig::default() };
    let (indices, _) = dataset.split(config.holdout_every);
    let Some(views) = load_views(dataset, &indices, &config, "Loading photos", console)? else {
        return Err(CliError::Cancelled("nothing was printed".into()));
    };
    if views.is_empty() {
        return Err(CliError::failed(format!("{} has no photo to train on", dataset.root.display())));
    }
    console.note(Severity::Info, format!("Training on {}", dataset.name));
    Ok((config, views))
}

/// Measures each scene with its plan and with everything on, each in processes of its own.
fn savings(args: &BenchArgs) -> Result<(), CliError> {
    let mut scenes = Vec::new();
    for scene in &args.paths {
        // In turns, so that what else the machine does meets both alike.
        let mut costs = [Vec::new(), Vec::new()];
        for _ in 0..args.runs {
            for (costs, variant) in costs.iter_mut().zip(["plan", "everything"]) {
                costs.push(child(scene, variant, args.repeats)?);
            }
        }
        if let [Some(plan), Some(everything)] = costs.map(|c| PlanCost::median(&c)) {
            scenes.push(Saving::new(scene, plan, everything));
        }
    }
    let adapter = Device::shared().ok().map(|c| c.describe());
    if args.json {
        let document = json!({ "size_px": SIZE, "runs": args.runs, "adapter": adapter, "scenes": scenes });
        return output::print_json(&document);
    }
    let disks: Vec<String> = scenes.iter().map(Saving::on_disk).collect();
    output::print(&format!(
        "{}\n\n{}\n\nImages of {} x {} px; memory beyond the process before it read anything; buffers counted on: {}",
        output::table(&plan::table(&scenes)),
        disks.join("\n"),
        SIZE[0],
        SIZE[1],
        adapter.as_deref().unwrap_or("none, so no GPU memory is given")
    ))
}

/// What a process of its own has measured.
fn child(scene: &Path, variant: &str, repeats: u32) -> Result<PlanCost, CliError> {
    let program = std::env::current_exe().map_err(|e| CliError::failed(format!("the program's own path: {e}")))?;
    let mut process = Process::new(program);
    process.args(["bench", "--variant", variant, "--repeats", &repeats.to_string()]).arg(scene);
    let done = process.output();
    let done = done.map_err(|e| CliError::failed(format!("a process for {}: {e}", scene.display())))?;
    if !done.status.success() {
        let why = String::from_utf8_lossy(&done.stderr);
        return Err(CliError::failed(format!("{}: {}", scene.display(), why.trim())));
    }
    Ok(serde_json::from_slice(&done.stdout)?)
}

/// Opens a scene as the window does, with the window's first view.
fn open(path: &Path) -> Result<OpenScene, StudyError> {
    let opened = jobs::open::open(path, &Folders::of_user(), &jobs::plan::machine(), &mut Silent);
    let scene = opened.map_err(|e| StudyError(e.to_string()))?;
    let cloud = scene.cloud.clone().ok_or_else(|| StudyError("there is nothing to draw".into()))?;
    let first = scene.home.camera(SIZE).with_size(SIZE[0], SIZE[1]);
    let cameras = scene.dataset.as_ref().map(|d| d.cameras()).unwrap_or_default();
    let (settings, map) = (scene.render.clone(), scene.semantics.clone());
    Ok(OpenScene { cloud, settings, map, cameras, up: scene.home.up, first, facts: scene.facts.clone() })
}
