//! `fmlgs remove`: things are taken out of a scene, and the surfaces that they hid are closed.

use std::path::PathBuf;

use serde_json::json;

use super::progress::Console;
use super::scene_args::open_scene;
use super::{CliError, number, output};
use crate::jobs::query;
use crate::jobs::remove::{self, Paint, RemovalOptions};
use crate::math::format;
use crate::scene::LevelFilter;

/// Take an object or a part out of a scene and close the surface that it hid
///
/// Gaussians behind it that other photos have seen are there already; what no photo saw is invented: the plane of the
/// surface goes on below it, painted from what is seen around. Its shadow on flat surfaces goes, as far as what stands
/// in the way of the light explains it; reflections stay. The scene is left as it is; the result is a scene of its own,
/// in which what is invented has the property 'fmlgs_invented'.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs remove scene/ \"the teddy bear\" --out without_bear/\n  \
    fmlgs remove scene/ \"the mug\" \"the kettle\" --out cleared/\n  \
    fmlgs remove scene/ \"the teddy bear\" --seed 2 --out another_fill/\n  \
    fmlgs remove scene/ \"the teddy bear\" --fill photos --out trained_without_bear/\n  \
    fmlgs remove scene/ \"lid of the kettle\" --fill none --out open_kettle/")]
pub(crate) struct RemoveArgs {
    /// Trained scene with objects and parts ('fmlgs preprocess')
    scene: PathBuf,
    /// Text of the object or part to remove; several go into one scene without all of them
    #[arg(required = true)]
    texts: Vec<String>,
    /// Folder for the new scene
    #[arg(long)]
    out: PathBuf,
    /// Method that closes hidden surfaces
    #[arg(long, value_enum, default_value_t = Fill::Plane)]
    fill: Fill,
    /// Paint of a closed surface
    #[arg(long, value_enum, default_value_t = Paint::Patches)]
    paint: Paint,
    /// Remove exactly what is known to belong to it, without the unsure fringes within it
    #[arg(long)]
    tight: bool,
    /// Leave its shadow where it is
    #[arg(long)]
    keep_shadow: bool,
    /// Seed of the fill; another number gives another fill
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Things that are removed at most, where several are meant
    #[arg(long, default_value_t = 1, value_parser = number::within(1..=1_000_usize))]
    top: usize,
    /// Level of the answers: an object or a part
    #[arg(long, value_enum, default_value_t = LevelFilter::Auto)]
    kind: LevelFilter,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Fill {
    /// Planes beside it go on where it hid them
    Plane,
    /// The same, and then the scene is trained anew on its photos, which have that in them instead; takes as long as it
    /// took, and goes on where it was stopped
    Photos,
    /// They stay open
    None,
}

pub(crate) fn run(args: RemoveArgs, quiet: bool) -> Result<(), CliError> {
    let scene = open_scene(&args.scene)?;
    let map = scene.semantics()?;
    let mut ids = Vec::new();
    for text in &args.texts {
        ids.extend(query::named(&map, &query::seen_from(&scene, None), text, args.kind, args.top)?);
    }
    ids.sort_unstable();
    ids.dedup();
    let names: Vec<String> = ids.iter().map(|id| map.identities.full_name(*id)).collect();
    let paint = (args.fill != Fill::None).then_some(args.paint);
    let options = RemovalOptions { ids, halo: !args.tight, lift_shadow: !args.keep_shadow, paint, seed: args.seed };
    let retrain = args.fill == Fill::Photos;
    let kept = match retrain {
        true => "the photos and the training so far are kept; do the same again to go on",
        false => "nothing was written",
    };
    let console = &mut Console::new(quiet);
    let done = remove::into_new_scene(&scene, &options, retrain, Some(&args.out), console)
        .map_err(|e| CliError::of_work(e, kept))?;
    if args.json {
        return output::print_json(&json!({
            "scene": args.out, "names": names, "gaussians": done.gaussians, "report": done.report,
        }));
    }
    let told = remove::summary(&done.name, &done.report);
    output::print(&format!("{told}\n{}: {}", args.out.display(), format::things(done.gaussians, "Gaussian")))
}
