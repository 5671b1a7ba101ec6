//! `fmlgs segment`: the Gaussians of what is asked for.

use std::path::PathBuf;

use super::{CliError, number, output};
use crate::jobs::{export, open, query, segment};
use crate::pipeline::semantics::codes::TOLERANCE;
use crate::pipeline::semantics::matching::MatchMode;
use crate::scene::LevelFilter;

/// Write the Gaussians of an object or a part as a .ply
///
/// The same match as that of the mask, in space: by identities, or with --blend by the codes of the
/// Gaussians. Exit code 1 if nothing fits.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs segment scene/ \"the kettle\" --out kettle.ply\n  \
    fmlgs segment scene/ \"lid of the kettle\" --out lid.ply\n  \
    fmlgs segment scene/ \"the kettle\" --rest --out without_kettle.ply")]
pub(crate) struct SegmentArgs {
    /// Trained scene with objects and parts ('fmlgs preprocess')
    scene: PathBuf,
    /// What to look for
    text: String,
    /// Write to this file
    #[arg(long)]
    out: PathBuf,
    /// Write everything else instead
    #[arg(long)]
    rest: bool,
    /// Answers that are written at most
    #[arg(long, default_value_t = 1, value_parser = number::within(1..=100_000_usize))]
    top: usize,
    /// Whether an object or a part is meant
    #[arg(long, value_enum, default_value_t = LevelFilter::Auto)]
    kind: LevelFilter,
    /// Match the codes of the Gaussians instead of their identities
    #[arg(long)]
    blend: bool,
    /// Largest difference per channel of a match, in 255ths
    #[arg(long, default_value_t = 255.0 * TOLERANCE, value_parser = number::within(0.0..=255.0_f32))]
    tolerance: f32,
}

pub(crate) fn run(args: SegmentArgs) -> Result<(), CliError> {
    let scene = open::scene(&args.scene)?;
    export::check(&args.out, &[".ply"], &scene.reads())?;
    let map = scene.semantics()?;
    let targets = query::identities(&map, &args.text, args.kind, args.top)?;
    let mode = if args.blend { MatchMode::Blend } else { MatchMode::Exact };
    let kept = segment::select(&scene.cloud, &map, &targets, mode, args.tolerance / 255.0, args.rest)?;
    export::ply(&args.out, &kept)?;
    let names: Vec<String> = targets.iter().map(|id| map.identities.full_name(*id)).collect();
    let what = if args.rest { format!("all but {}", names.join(", ")) } else { names.join(", ") };
    output::print(&format!("{what}: {} of {} Gaussians in {}", kept.len(), scene.cloud.len(), args.out.display()))
}
