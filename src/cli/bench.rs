//! `fmlgs bench`: how long drawing and training take on this machine, stage by stage.

use std::path::PathBuf;

use super::progress::Console;
use super::{CliError, number, output, view};
use crate::jobs::bench::{self, BenchRequest};
use crate::pipeline::train::TrainConfig;
use crate::scene::MaskGrid;

/// Time drawing and training on this machine, stage by stage
///
/// Splats and trained scenes are drawn from three views at each size; posed photos are trained on
/// for a few steps. Products are pairs of a splat and a pixel that it may touch; their rate stands
/// beside what one core could do at most. A row is one stage: the number of its values, their median
/// and 95th percentile. Compare those of one run only.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs bench splat.ply\n  \
    fmlgs bench --queries 100\n  \
    fmlgs bench --results 60\n  \
    fmlgs bench --masks mobile-sam --photo photo.jpg\n  \
    fmlgs bench --strokes 60 scene/ splat.ply\n  \
    fmlgs bench --moving splat.ply\n  \
    fmlgs bench splats/*.ply photos/ --size 640x480 --size 1280x720 --max-side 504 --gpu --json")]
pub(crate) struct BenchArgs {
    /// Splats or trained scenes to draw, posed photos to train on; with --results, results of other methods to ask
    #[arg(required_unless_present_any = ["queries", "masks", "results"])]
    paths: Vec<PathBuf>,
    /// Size of the drawn images; may be given several times [default: 640x480 1280x720]
    #[arg(long, value_parser = view::parse_size)]
    size: Vec<[u32; 2]>,
    /// Longer side of the training images in px [default: 512]
    #[arg(long, value_parser = clap::value_parser!(u32).range(16..=16384))]
    max_side: Option<u32>,
    /// Repeats of each measurement
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    repeats: u32,
    /// Time the GPU beside the CPU, even a software one
    #[arg(long)]
    gpu: bool,
    /// Time this many typed queries too, on a made-up view of 1008 x 567 px
    #[arg(long, value_name = "COUNT", value_parser = number::within(1..=100_000_000_usize))]
    queries: Option<usize>,
    /// Objects and parts of that view
    #[arg(long, value_name = "COUNT", default_value_t = 300, requires = "queries", value_parser = number::within(1..=100_000_usize))]
    identities: usize,
    /// Time this many phrases asked of results of other methods too: of made-up ones of LangSplatV2 and LangSplat at
    /// 1008 x 567 px, and of PATHS that are results; those with a network for each pixel are asked once in each view
    #[arg(long, value_name = "COUNT", value_parser = number::within(1..=100_000_usize))]
    results: Option<usize>,
    /// Gaussians of the made-up results
    #[arg(long, value_name = "COUNT", default_value_t = 300_000, requires = "results", value_parser = number::within(1..=10_000_000_usize))]
    gaussians: usize,
    /// Time this network on the masks of everything in a photo: a model's name, or the path of its description
    #[arg(long, value_name = "MODEL")]
    masks: Option<String>,
    /// Points of the grid at which it is asked
    #[arg(long, value_enum, default_value_t, requires = "masks")]
    mask_grid: MaskGrid,
    /// Photo for --masks [default: one is made up]
    #[arg(long, value_name = "FILE", requires = "masks")]
    photo: Option<PathBuf>,
    /// Time this many strokes that select Gaussians, three for each selection
    #[arg(long, value_name = "COUNT", value_parser = number::within(1..=1_000_000_usize))]
    strokes: Option<usize>,
    /// Time moving by levels of detail, at 1008 x 567 px, and compare its pictures with those of all Gaussians
    #[arg(long, conflicts_with_all = ["gpu", "size"])]
    moving: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: BenchArgs, quiet: bool) -> Result<(), CliError> {
    if args.max_side.is_some() && !args.paths.iter().any(|path| bench::may_be_photos(path)) {
        let text =
            "--max-side has no effect here: splats and trained scenes are drawn (--size), posed photos trained on";
        return Err(CliError::Usage(text.into()));
    }
    let mut console = Console::new(quiet);
    let request = BenchRequest {
        paths: args.paths,
        sizes: if args.size.is_empty() { vec![[640, 480], [1280, 720]] } else { args.size },
        max_side_px: args.max_side.unwrap_or(TrainConfig::default().max_side_px),
        repeats: args.repeats as usize,
        gpu: args.gpu,
        queries: args.queries.map(|count| (count, args.identities)),
        results: args.results.map(|count| (count, args.gaussians)),
        masks: args.masks.map(|model| (model, args.mask_grid, args.photo)),
        strokes: args.strokes,
        moving: args.moving,
    };
    let timings = bench::run(&request, &mut console).map_err(|e| CliError::of_work(e, "nothing was printed"))?;
    drop(console);
    if args.json {
        return output::print_json(&timings);
    }
    let gpu = timings.gpu.as_ref().map(|gpu| format!("\n\nGPU: {gpu}")).unwrap_or_default();
    output::print(&format!("{}{gpu}", output::table(&timings.table())))
}
