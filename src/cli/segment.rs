//! `fmlgs segment`: the Gaussians of what is asked for, or of everything, with its masks.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::export::MeasureArgs;
use super::progress::Console;
use super::recipe::RecipeArgs;
use super::scene_args::open_scene;
use super::segment_click::{self, ClickArgs};
use super::{CliError, number, output, view};
use crate::io::splat_format::SplatFormat;
use crate::jobs::export_all::{self, ExportAllRequest, ExportedAll, MaskFormat};
use crate::jobs::{Scene, export, export_splat, query, render, segment};
use crate::math::format::{self, things};
use crate::pipeline::semantics::query::answer::Basis;
use crate::scene::{Camera, LevelFilter, SemanticMap};

/// Write the Gaussians of an object or a part, or of all of them, with masks of the photos
///
/// The same match as that of the mask, in space: by identities, or with --match codes by the codes of the
/// Gaussians. The ending of --out chooses the format, as for 'fmlgs export'. Exit code 1 if nothing fits. With --all, a
/// folder is written: a file for each object and part, and their masks in the photos as files that --masks of other
/// commands, and other programs, read. A folder that holds anything but an earlier export, or an export that was
/// changed since, is refused.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs segment scene/ \"the kettle\" --out kettle.ply\n  \
    fmlgs segment scene/ \"lid of the kettle\" --out lid.ply\n  \
    fmlgs segment scene/ \"the kettle\" --rest --out without_kettle.ply\n  \
    fmlgs segment scene/ \"the kettle\" --out kettle.spz\n  \
    fmlgs segment scene/ --all --out everything/ --masks isat,coco --views 0,12\n  \
    fmlgs segment scene/ --all --out everything/ --format sog --views none\n  \
    fmlgs segment scene/ --click 320,200 --view 0003.png --keep \"kettle\"\n  \
    fmlgs segment scene/ --click 350,190 --width 8 --view 0003.png --correct \"kettle\"")]
pub(crate) struct SegmentArgs {
    /// Trained scene with objects and parts ('fmlgs preprocess')
    scene: PathBuf,
    /// Text of the object or part to find
    #[arg(required_unless_present_any = ["all", "click"])]
    text: Option<String>,
    /// Write every object and part, and their masks in the photos, into the folder --out
    #[arg(long, conflicts_with_all = ["text", "rest", "top", "kind", "RecipeArgs"])]
    all: bool,
    /// Write to this file, or folder for --all
    #[arg(long, required_unless_present_any = ["keep", "correct"])]
    out: Option<PathBuf>,
    /// Format of the files of --all
    #[arg(long, requires = "all", value_enum, default_value = "ply")]
    format: SplatFormat,
    /// Masks of --all, with commas between
    #[arg(long, requires = "all", value_enum, value_delimiter = ',', default_values_t = MaskFormat::ALL)]
    masks: Vec<MaskFormat>,
    /// Photos whose masks --all writes: 'all', 'none', or some by index or name, with commas between
    #[arg(long, requires = "all", default_value = "all")]
    views: String,
    /// Shrink the masks of --all to at most this many px along their longer side [default: as the photos]
    #[arg(long, requires = "all", value_parser = clap::value_parser!(u32).range(16..=16384))]
    max_side: Option<u32>,
    /// Write everything else instead
    #[arg(long)]
    rest: bool,
    /// Answers that are written at most
    #[arg(long, default_value_t = 1, value_parser = number::within(1..=100_000_usize))]
    top: usize,
    /// Level of the answer: an object or a part
    #[arg(long, value_enum, default_value_t = LevelFilter::Auto)]
    kind: LevelFilter,
    #[command(flatten)]
    measure: MeasureArgs,
    #[command(flatten)]
    clicks: ClickArgs,
    #[command(flatten)]
    recipe: RecipeArgs,
}

pub(crate) fn run(args: SegmentArgs, quiet: bool) -> Result<(), CliError> {
    let scene = open_scene(&args.scene)?;
    match (&args.text, &args.out) {
        (Some(text), Some(out)) => one(&args, text, out, &scene, quiet),
        (None, Some(out)) if args.all => {
            export::check_folder(out, &scene.reads())?;
            let map = scene.semantics()?;
            all(&args, out, &scene, map, quiet)
        }
        (_, out) => {
            out.iter().try_for_each(|out| export_splat::check(out, &scene.reads()).map(drop))?;
            segment_click::run(&scene, &args.clicks, &args.measure, out.as_ref(), quiet)
        }
    }
}

fn one(args: &SegmentArgs, text: &str, out: &Path, scene: &Scene, quiet: bool) -> Result<(), CliError> {
    export_splat::check(out, &scene.reads())?;
    let map = scene.semantics()?;
    let answered = query::answered(&map, &query::seen_from(scene, None), text, args.kind, &args.recipe.recipe())?;
    let kept = segment::select(&scene.cloud, &map, &answered, args.top, args.rest)?;
    let count = kept.len();
    let done = args.measure.write(kept, out, scene, quiet)?;
    let names: Vec<String> = answered.chosen(args.top).iter().map(|id| map.identities.full_name(*id)).collect();
    let what = if args.rest { format!("all but {}", names.join(", ")) } else { names.join(", ") };
    let how = if answered.basis == Basis::Embedding { ", found by embedding, not by name" } else { "" };
    let [count, all] = [count, scene.cloud.len()].map(|n| format::count(n as u64));
    let written = format!("{what}: {count} of {all} Gaussians{how}");
    output::print(
        &args.recipe.lines(&map).into_iter().chain([written]).chain(done.lines()).collect::<Vec<_>>().join("\n"),
    )
}

fn all(args: &SegmentArgs, out: &Path, scene: &Scene, map: SemanticMap, quiet: bool) -> Result<(), CliError> {
    let request = ExportAllRequest {
        cloud: Arc::clone(&scene.cloud),
        map: Arc::new(map),
        settings: scene.settings.clone(),
        views: photos(args, scene)?,
        format: args.format,
        masks: args.masks.clone(),
        folder: out.into(),
    };
    let done = export_all::run(&request, &mut Console::new(quiet));
    let kept = "what was written by then stays; the same command goes over it";
    output::print(&summary(&done.map_err(|e| CliError::of_work(e, kept))?, args.format, out))
}

fn summary(done: &ExportedAll, format: SplatFormat, folder: &Path) -> String {
    let mut text = format!("{} objects and parts as {}", done.written, format.ending());
    if done.left_out > 0 {
        text += &format!(", {} without Gaussians left out", done.left_out);
    }
    text += &match done.photos {
        0 => ", no masks".to_owned(),
        n => format!(", masks of {}", things(n, "photo")),
    };
    format!("{text} in {}", folder.display())
}

/// The photos that are asked for, by name.
fn photos(args: &SegmentArgs, scene: &Scene) -> Result<Vec<(String, Camera)>, CliError> {
    let limited = |camera: &Camera| args.max_side.map_or_else(|| camera.clone(), |side| camera.limited_to(side));
    let all = || scene.cameras.iter().map(|c| (c.name.clone(), limited(&c.camera)));
    let views: Vec<(String, Camera)> = match args.views.as_str() {
        "all" => all().collect(),
        "none" => Vec::new(),
        list => {
            let wanted = list.split(',').map(str::trim).filter(|name| !name.is_empty());
            let cameras = wanted.map(|name| view::choose(Some(name), scene)).collect::<Result<Vec<_>, _>>()?;
            let is_wanted = |(k, _): &(usize, (String, Camera))| cameras.contains(&scene.cameras[*k].camera);
            all().enumerate().filter(is_wanted).map(|(_, view)| view).collect()
        }
    };
    views.iter().try_for_each(|(_, c)| render::check_room(c.width_px, c.height_px))?;
    Ok(views)
}
