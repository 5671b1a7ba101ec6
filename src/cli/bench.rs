//! `fmlgs bench`: how long drawing and training take on this machine, stage by stage.

use std::path::PathBuf;

use serde::Serialize;
use serde_json::json;

use super::bench_plan::{self, Variant};
use super::progress::Console;
use super::{CliError, number, output, view};
use crate::io::{self, Opened};
use crate::models;
use crate::pipeline::bench::{self, RenderTiming, StepTiming};
use crate::pipeline::bench_gpu::{self, GpuTiming};
use crate::pipeline::bench_query::{self, QueryTiming};
use crate::pipeline::observer::{Level, Observer, Signal};
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
pub struct Args {
    /// Splats or trained scenes to draw, posed photos to train on
    #[arg(required_unless_present = "queries")]
    paths: Vec<PathBuf>,
    /// Size of the drawn pictures; may be given several times [default: 640x480 1280x720]
    #[arg(long, value_parser = view::parse_size)]
    size: Vec<[u32; 2]>,
    /// Longer side of the training pictures in px
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
    /// Hold what each scene's plan leaves out against everything on, each in processes of its own
    #[arg(long, conflicts_with_all = ["queries", "gpu", "size"])]
    plan: bool,
    /// Processes for each of the two
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100), requires = "plan")]
    runs: u32,
    /// Measure one of the two in this process
    #[arg(long, value_enum, hide = true, conflicts_with = "plan")]
    variant: Option<Variant>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Everything that was measured.
#[derive(Debug, Serialize)]
struct Timings {
    render: Vec<RenderTiming>,
    train: Vec<StepTiming>,
    /// Name and features of the GPU, if it was asked for.
    gpu: Option<String>,
    gpu_render: Vec<GpuTiming>,
    gpu_train: Vec<GpuTiming>,
    one_core_products_per_sec: f64,
    queries: Option<QueryTiming>,
}

/// Objects and parts of the view that is asked.
const QUERY_IDENTITIES: usize = 300;
/// Its size in px.
const QUERY_SIZE: [usize; 2] = [1_008, 567];

pub fn run(args: Args, quiet: bool) -> Result<(), CliError> {
    if let (Some(variant), Some(scene)) = (args.variant, args.paths.first()) {
        return bench_plan::run_child(scene, variant, args.repeats as usize);
    }
    if args.plan {
        return bench_plan::run(&args.paths, args.runs, args.repeats, args.json);
    }
    let mut console = Console::new(quiet);
    let sizes = if args.size.is_empty() { vec![[640, 480], [1280, 720]] } else { args.size };
    let repeats = args.repeats as usize;
    let gpu = args.gpu.then(Device::shared).transpose()?;
    let mut timings = Timings {
        render: Vec::new(),
        train: Vec::new(),
        gpu: gpu.as_ref().map(Device::describe),
        gpu_render: Vec::new(),
        gpu_train: Vec::new(),
        one_core_products_per_sec: bench::one_core_limit(),
        queries: None,
    };
    if let Some(count) = args.queries {
        let mut encoder = models::encoder(models::DEMO)?;
        timings.queries = Some(bench_query::time(encoder.as_mut(), QUERY_IDENTITIES, QUERY_SIZE, count)?);
    }
    for path in &args.paths {
        let name = bench::label(path);
        let cloud = match io::open(path)? {
            Opened::Dataset(dataset) => {
                let (config, views) = photos(&dataset, args.max_side, &mut console)?;
                timings.train.push(bench::train_steps(&dataset, &views, &config, repeats)?);
                if let Some(device) = &gpu {
                    timings.gpu_train.push(bench_gpu::train_steps(device, &dataset, &views, &config, repeats)?);
                }
                continue;
            }
            Opened::Cloud(cloud) => cloud,
            Opened::Trained(scene) => scene.cloud,
        };
        for &size in &sizes {
            if console.signal() == Signal::Cancel {
                return Err(CliError::Cancelled("nothing was printed".into()));
            }
            console.note(Level::Info, format!("Drawing {name} at {} x {}", size[0], size[1]));
            timings.render.push(bench::render(&name, &cloud, size, repeats)?);
            if let Some(device) = &gpu {
                timings.gpu_render.push(bench_gpu::render(device, &name, &cloud, size, repeats)?);
            }
        }
    }
    drop(console);
    if args.json {
        return output::print_json(&json!(timings));
    }
    output::print(&text(&timings))
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
    console.note(Level::Info, format!("Training on {}", dataset.name));
    Ok((config, views))
}

fn text(t: &Timings) -> String {
    let mut parts = Vec::new();
    if let Some(q) = &t.queries {
        let mut rows = vec![["query stage", "p50 ms", "p95 ms"].map(str::to_owned).to_vec()];
        let stages = [
            ("text encoding", q.stages.encode),
            ("relevancy", q.stages.relevancy),
            ("localisation", q.stages.localise),
            ("mask", q.stages.mask),
            ("heat map", q.stages.draw),
            ("without text encoding", q.without_encoding),
            ("whole", q.whole),
        ];
        rows.extend(stages.map(|(name, p)| vec![name.into(), format!("{:.3}", p.p50_ms), format!("{:.3}", p.p95_ms)]));
        let what = format!(
            "{} queries, {} identities, {} x {} px, encoder '{}'",
            q.queries, q.identities, q.size[0], q.size[1], q.encoder
        );
        parts.push(format!("{}\n{what}", output::table(&rows)));
    }
    if !t.render.is_empty() {
        let head = ["drawing, CPU", "Gaussians", "size", "ms", "project", "sort", "bin", "blend", "products", "per s"];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        rows.extend(t.render.iter().map(|r| {
            let mut row = vec![r.name.clone(), r.gaussians.to_string(), format!("{}x{}", r.size[0], r.size[1])];
            row.push(format!("{:.1}", r.total_ms));
            row.extend(r.stages_ms.iter().map(|ms| format!("{ms:.1}")));
            row.extend([format!("{:.1e}", r.products), format!("{:.2e}", r.products_per_sec)]);
            row
        }));
        parts.push(output::table(&rows));
    }
    if !t.train.is_empty() {
        let head = ["training step, CPU", "Gaussians", "size", "ms", "steps per s"];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        rows.extend(t.train.iter().map(|s| {
            let size = format!("{}x{}", s.size[0], s.size[1]);
            let ms = format!("{:.1}", s.step_ms);
            vec![s.name.clone(), s.gaussians.to_string(), size, ms, format!("{:.2}", s.steps_per_sec)]
        }));
        parts.push(output::table(&rows));
    }
    if let Some(gpu) = &t.gpu {
        parts.push(format!("GPU: {gpu}"));
        parts.extend(
            [("drawing", &t.gpu_render), ("training step", &t.gpu_train)].map(|(what, rows)| gpu_text(what, rows)),
        );
    }
    parts.push(format!("one core at most: {:.2e} products per s", t.one_core_products_per_sec));
    parts.retain(|p| !p.is_empty());
    parts.join("\n\n")
}

/// One line per measurement, its stages on the device behind it.
fn gpu_text(what: &str, timings: &[GpuTiming]) -> String {
    let line = |t: &GpuTiming| {
        let stages: Vec<String> = t.stages_ms.iter().map(|(name, ms)| format!("{name} {ms:.2}")).collect();
        let (size, ms) = (format!("{}x{}", t.size[0], t.size[1]), t.total_ms);
        format!("{what} {}, {} Gaussians, {size}: {ms:.2} ms ({})", t.name, t.gaussians, stages.join(", "))
    };
    timings.iter().map(line).collect::<Vec<_>>().join("\n")
}
