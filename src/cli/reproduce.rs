//! `fmlgs reproduce`: the paper's tables, and ReferSplat's, on their data sets.

use std::path::PathBuf;

use super::progress::Console;
use super::{CliError, number, output};
use crate::jobs::reproduce::{self, PAPERS_ENCODER, PaperTable, ReproduceRequest, ReproduceSettings};
use crate::pipeline::train::TrainConfig;

/// Steps of the paper's trainings.
const STEPS: u64 = 30_000;
/// Longer side of the photos, px: those of LERF-OVS and the labels of SPIn-NeRF as they are.
const MAX_SIDE_PX: u32 = 1_008;

/// Make a table of the paper from its data set
///
/// Trains every scene, finds its objects, asks for what is labeled, and writes table.md and table.json: this
/// program's rows beside the paper's as printed, and baselines that its own pieces can stand for. Each scene
/// is kept in a folder of its own; the same command run again resumes after what is done. How data sets
/// must be laid out is in docs/REPRODUCE.md. The table ref-lerf is ReferSplat's; its layout was learned from
/// code, and the real data set was never tried.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs reproduce lerf-ovs lerf_ovs/ --out out/lerf\n  \
    fmlgs reproduce lerf-ovs lerf_ovs/ --result figurines=langsplat/output --out out/lerf\n  \
    fmlgs reproduce spin-nerf spin/ --query fork=\"a fork\" --out out/spin\n  \
    fmlgs reproduce 3d-ovs 3dovs/ --scene bed --masks regions --out out/bed\n  \
    fmlgs reproduce part-ablation scenes/ --masks labels --encoder demo --steps 2000 --out out/parts\n  \
    fmlgs reproduce ref-lerf ref_lerf/ --out out/ref")]
pub(crate) struct ReproduceArgs {
    /// Table of the paper or of ReferSplat
    #[arg(value_enum)]
    table: PaperTable,
    /// The data set's folder
    data: PathBuf,
    /// Folder for the results; those of other settings are never overwritten
    #[arg(long)]
    out: PathBuf,
    /// A scene by the name of its folder; may be given several times [default: all]
    #[arg(long = "scene")]
    scenes: Vec<String>,
    /// Source of the masks: a model of 'fmlgs models', 'regions' (built in, rough), or 'labels' (those of
    /// labeled photos that are not compared) [default: the best model that is here]
    #[arg(long)]
    masks: Option<String>,
    /// Encoder of photos and phrases
    #[arg(long, default_value = PAPERS_ENCODER)]
    encoder: String,
    /// Train on labeled photos too, as the literature does
    #[arg(long)]
    labeled_in_training: bool,
    /// Query to ask in a scene, as SCENE=TEXT, where labels have no names (spin-nerf) [default: the
    /// scene's name]
    #[arg(long = "query", value_parser = scene_and_text)]
    queries: Vec<(String, String)>,
    /// Result of another method for a scene, as SCENE=RESULT: rows by its own rule, LangSplat's and a common one; may be
    /// given several times (lerf-ovs, 3d-ovs, part-ablation)
    #[arg(long = "result", value_name = "SCENE=RESULT", value_parser = scene_and_result)]
    results: Vec<(String, PathBuf)>,
    /// Optimizer steps of each training
    #[arg(long, default_value_t = STEPS, value_parser = number::within(1..=1_000_000_000_u64))]
    steps: u64,
    /// Longer side of the photos and of the compared views in px
    #[arg(long, default_value_t = MAX_SIDE_PX, value_parser = clap::value_parser!(u32).range(16..=16384))]
    max_side: u32,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

fn scene_and_text(given: &str) -> Result<(String, String), String> {
    match given.split_once('=') {
        Some((scene, text)) if !scene.is_empty() && !text.trim().is_empty() => Ok((scene.into(), text.into())),
        _ => Err("expected SCENE=TEXT".into()),
    }
}

fn scene_and_result(given: &str) -> Result<(String, PathBuf), String> {
    match given.split_once('=') {
        Some((scene, path)) if !scene.is_empty() && !path.is_empty() => Ok((scene.into(), path.into())),
        _ => Err("expected SCENE=RESULT".into()),
    }
}

pub(crate) fn run(args: ReproduceArgs, quiet: bool) -> Result<(), CliError> {
    let mut console = Console::new(quiet);
    let masks = match args.masks {
        Some(masks) => masks,
        None => reproduce::usual_masks(&mut console)?,
    };
    let train = TrainConfig {
        steps: args.steps,
        max_side_px: args.max_side,
        // Which photos are held out is decided by which are labeled.
        holdout_every: 0,
        eval_every: 0,
        ..TrainConfig::default()
    };
    let settings = ReproduceSettings {
        table: args.table,
        masks,
        encoder: args.encoder,
        labeled_in_training: args.labeled_in_training,
        train,
        queries: args.queries.into_iter().collect(),
    };
    let ReproduceArgs { data, out, scenes, results, .. } = args;
    let request = ReproduceRequest { data, out, scenes, settings, results };
    let kept = "what was done is kept; the same command resumes";
    let document = reproduce::run(&request, &mut console).map_err(|e| match e.is_cancelled() {
        true => CliError::Cancelled(kept.into()),
        false => CliError::from(e),
    })?;
    drop(console);
    if args.json { output::print_json(&document) } else { output::print(document.markdown().trim_end()) }
}
