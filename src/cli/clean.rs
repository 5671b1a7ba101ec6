//! `fmlgs clean`: floaters, needles and haze are found and left out.

use std::path::PathBuf;

use serde_json::json;

use super::progress::Console;
use super::scene_args::open_scene;
use super::{CliError, output};
use crate::jobs::clean::{self, CleanRule};
use crate::jobs::derived;
use crate::math::format;

/// Find floaters, needles and haze, and write the scene without them
///
/// Without --out it only counts the Gaussians of each rule. A rule is 'floaters' (small pieces in the air that the
/// photos do without), 'faint', 'needles', 'oversized', 'unsupported' (no photo shows them), 'color=#RRGGBB' (and near
/// colors), or a measure with a limit: size (scene units), elongation, opacity, spacing (1 is usual), piece (Gaussians
/// that hang together), weight (largest share of a pixel in any photo), photos (that show it), error (difference from
/// the photos, 0 to 1).
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs clean scene/                                     count what every rule means\n  \
    fmlgs clean scene/ --out cleaned/                      without floaters and what is faint\n  \
    fmlgs clean scene/ needles 'size>0.8' --out cleaned/   without these\n  \
    fmlgs clean downloaded.ply 'piece<20' --out cleaned.ply")]
pub(crate) struct CleanArgs {
    /// Trained scene or splat file
    scene: PathBuf,
    /// Rules; a Gaussian is left out if it meets any of them [default: floaters faint]
    rules: Vec<CleanRule>,
    /// Folder for the new scene, or a file of splats (.ply, .sog, .spz, ...)
    #[arg(long)]
    out: Option<PathBuf>,
    /// Folder of the scene's photos, if it is not where the scene says
    #[arg(long)]
    photos: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: CleanArgs, quiet: bool) -> Result<(), CliError> {
    let scene = open_scene(&args.scene)?;
    if let Some(out) = &args.out {
        derived::check_place(&scene, out)?;
    }
    if args.photos.is_some() && scene.cameras.is_empty() {
        let text = "--photos has no effect here: a file of splats does not say from which cameras it was trained";
        return Err(CliError::Usage(text.into()));
    }
    let measures = clean::measure(&scene, args.photos.as_deref(), &mut Console::new(quiet))
        .map_err(|e| CliError::of_work(e, "nothing was written"))?;
    let rules = match (args.rules.is_empty(), &args.out) {
        (false, _) => args.rules,
        (true, Some(_)) => vec![CleanRule::Floaters, CleanRule::Faint],
        // What nothing is known for means nothing.
        (true, None) => CleanRule::NAMED.into_iter().filter(|rule| rule.choose(&measures).is_ok()).collect(),
    };
    let count = |chosen: &[bool]| chosen.iter().filter(|c| **c).count();
    let mut counts = Vec::new();
    for rule in &rules {
        counts.push((rule, count(&clean::choose(&[*rule], &measures)?)));
    }
    let gone = clean::choose(&rules, &measures)?;
    let chosen = count(&gone);
    let store = |out| clean::store(&scene, gone, out, &mut Console::new(quiet));
    let left = args.out.as_deref().map(store).transpose()?;
    if args.json {
        let rules: Vec<_> = counts.iter().map(|(r, n)| json!({ "rule": r.to_string(), "gaussians": n })).collect();
        return output::print_json(&json!({
            "gaussians": scene.cloud.len(), "chosen": chosen, "rules": rules, "scene": args.out, "left": left,
        }));
    }
    for (rule, n) in counts {
        let share = format::percent(n as f64 / scene.cloud.len().max(1) as f64);
        let n = format::count(n as u64);
        output::print(&format!("{:<14}{n:>11}  {share:>8}  {}", rule.to_string(), rule.meaning()))?;
    }
    match (&args.out, left) {
        (Some(out), Some(left)) => output::print(&format!("{}: {}", out.display(), format::things(left, "Gaussian"))),
        _ => output::print("Nothing was written; --out NEW writes the scene without what the rules mean."),
    }
}
