//! `fmlgs segment`: the Gaussians of what is asked for.

use std::path::PathBuf;

use super::recipe::RecipeArgs;
use super::{CliError, number, output};
use crate::jobs::{export, open, query, segment};
use crate::scene::LevelFilter;

/// Write the Gaussians of an object or a part as a .ply
///
/// The same match as that of the mask, in space: by identities, or with --match codes by the codes of the
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
    #[command(flatten)]
    recipe: RecipeArgs,
}

pub(crate) fn run(args: SegmentArgs) -> Result<(), CliError> {
    let scene = open::scene(&args.scene)?;
    export::check(&args.out, &[".ply"], &scene.reads())?;
    let map = scene.semantics()?;
    let answered = query::answered(&map, &args.text, args.kind, &args.recipe.recipe())?;
    let kept = segment::select(&scene.cloud, &map, &answered, args.top, args.rest)?;
    export::ply(&args.out, &kept)?;
    let names: Vec<String> = answered.chosen(args.top).iter().map(|id| map.identities.full_name(*id)).collect();
    let what = if args.rest { format!("all but {}", names.join(", ")) } else { names.join(", ") };
    let written = format!("{what}: {} of {} Gaussians in {}", kept.len(), scene.cloud.len(), args.out.display());
    output::print(&args.recipe.lines(&map).into_iter().chain([written]).collect::<Vec<_>>().join("\n"))
}
