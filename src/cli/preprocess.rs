//! `fmlgs preprocess`: objects and parts of a trained scene.

use std::path::PathBuf;
use std::sync::Arc;

use serde_json::{Value, json};

use super::progress::Console;
use super::scene_args::open_scene;
use super::{CliError, number, output, table_args};
use crate::jobs::find_objects::{self, FindRequest, FindSettings, FoundObjects};
use crate::jobs::models::SAM2;
use crate::jobs::{JobError, open, plan};
use crate::math::format::things;
use crate::pipeline::semantics::lifting::build_map::{CODE_STEPS, Found, MaskPropagation};
use crate::pipeline::semantics::lifting::tracker::TrackOptions;
use crate::pipeline::semantics::query::recipe::RecipeName;
use crate::scene::findings::MaskConflict;
use crate::scene::{Identity, IdentityId, Lifting, MaskGrid, MaskPrompt, Preparation, SegmentationReport, SemanticMap};

/// Find the objects and parts of a trained scene
///
/// Masks of a first photo vote for the Gaussians that they show; the votes carry them to all other
/// photos. Photos of which too much is unknown are segmented too, and their masks linked to what is
/// known. Held-out photos are never used. The result is stored with the scene: identities in
/// semantic_map.safetensors, each Gaussian's in point_cloud.ply.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs preprocess scene/ --masks photos/               masks that came with the photos\n  \
    fmlgs preprocess scene/ --masks labels/ --max-seeds 1  one labeled photo is enough to begin\n  \
    fmlgs preprocess scene/ --masks language_features/     masks and vectors of LangSplat; no network\n  \
    fmlgs preprocess scene/ --segmenter regions           no masks: regions of the photos, unnamed and rough\n  \
    fmlgs preprocess scene/ --add DSC_12                  what this photo shows that is nobody's yet")]
pub(crate) struct PreprocessArgs {
    /// Trained scene
    scene: PathBuf,
    /// Path of the masks: id maps of 'fmlgs synth', label files of ISAT (as in lerf_ovs), LabelMe, COCO or YOLO, the
    /// folders of SPIn-NeRF, 3D-OVS, LERF-Mask or Ref-LERF, masklets as in SA-V, or LangSplat's language_features,
    /// whose vectors become the embeddings
    #[arg(long)]
    masks: Option<PathBuf>,
    /// Source of the masks: 'files', 'regions' (built in, no weights: rough and unnamed), a model of
    /// 'fmlgs models', or the path of a model's .json [default: files where --masks is given, else the
    /// best model that is here, else regions]
    #[arg(long)]
    segmenter: Option<String>,
    /// Recipe of lifting, tracker and prompt at once; options given beside it differ from it
    #[arg(long, value_enum, default_value_t = RecipeName::Default)]
    recipe: RecipeName,
    /// Tracker that carries masks to the other photos [default: geometry; recipe paper: sam2]
    #[arg(long, value_enum)]
    tracker: Option<MaskPropagation>,
    /// Prompt that SAM 2 gets of a mask to track [default: mask; recipe paper: points]
    #[arg(long, value_enum)]
    prompt: Option<MaskPrompt>,
    /// Points of its grid at which a network is asked for masks [default: adaptive; recipe paper: all]
    #[arg(long, value_enum)]
    mask_grid: Option<MaskGrid>,
    /// Share of its own embedding that a part keeps in semantic deviation, the paper's w [default: 0.7]
    #[arg(long, value_parser = number::within(0.0..=1.0_f32))]
    part_weight: Option<f32>,
    /// The SAM 2 that follows masks: a model of 'fmlgs models', or the path of a model's .json
    #[arg(long, default_value = SAM2)]
    tracker_model: String,
    /// Dataset with the photos [default: where the scene's photos are]
    #[arg(long)]
    photos: Option<PathBuf>,
    /// Photo to begin with, by name [default: the first with masks]
    #[arg(long)]
    seed: Option<String>,
    /// Add the unlabeled objects and parts that this photo, by name, shows; those that are there stay as they are
    #[arg(long, value_name = "PHOTO", conflicts_with_all = ["seed", "max_seeds", "unknown", "recipe", "tracker", "prompt",
        "mask_grid", "part_weight", "lifting", "code_steps", "encoder"])]
    add: Option<String>,
    /// Replace labels, selections and corrections made by hand, too; without it, they stay as they are
    #[arg(long, conflicts_with = "add")]
    replace_all: bool,
    /// Most photos whose masks are used
    #[arg(long, default_value_t = TrackOptions::default().max_seeds, value_parser = number::within(1..=100_000_usize))]
    max_seeds: usize,
    /// Share of a photo that may stay unknown before its masks are used too, in percent
    #[arg(long, default_value_t = 100.0 * TrackOptions::default().reseed_share, value_parser = number::within(0.0..=100.0))]
    unknown: f64,
    /// Lifting that gives Gaussians their codes [default: votes; recipe paper: paper]
    #[arg(long, value_enum)]
    lifting: Option<Lifting>,
    /// Steps of training codes
    #[arg(long, default_value_t = CODE_STEPS, value_parser = number::within(0..=10_000_000_u64))]
    code_steps: u64,
    /// Encoder for open-vocabulary queries: 'demo', a model of 'fmlgs models', the path of a model's .json, or
    /// 'none' [default: the best that is here]
    #[arg(long)]
    encoder: Option<String>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// The table `[objects]` of a batch.
pub(super) fn of_table(table: &toml::Table) -> Result<FindSettings, String> {
    let args: PreprocessArgs =
        table_args::parse("preprocess", table, &["scene"], &["masks", "photos", "add", "replace-all", "json"])?;
    match args.segmenter.as_deref() {
        Some("files") => Err("'segmenter': leave it out: the masks of a scene are used where it has some".into()),
        _ => Ok(args.settings()),
    }
}

/// Checks that the arguments agree on the source of the masks.
fn check_segmenter(args: &PreprocessArgs) -> Result<(), CliError> {
    match (&args.masks, args.segmenter.as_deref()) {
        (None, Some("files")) => Err(CliError::Usage("--segmenter files needs --masks".into())),
        (Some(_), Some(other)) if other != "files" => {
            Err(CliError::Usage(format!("--segmenter {other} finds its own masks; leave --masks out")))
        }
        _ => Ok(()),
    }
}

impl PreprocessArgs {
    fn settings(&self) -> FindSettings {
        let base = self.recipe.recipe().preparation;
        let by_recipe = if base.prompt.is_some() { MaskPropagation::Sam2 } else { MaskPropagation::Gaussians };
        let carry = self.tracker.unwrap_or(by_recipe);
        FindSettings {
            segmenter: self.segmenter.clone().filter(|s| s != "files"),
            carry,
            tracker: self.tracker_model.clone(),
            encoder: self.encoder.clone(),
            preparation: Preparation {
                lifting: self.lifting.unwrap_or(base.lifting),
                part_weight: self.part_weight.unwrap_or(base.part_weight),
                prompt: self.prompt.or(base.prompt).filter(|_| carry != MaskPropagation::Gaussians),
                grid: self.mask_grid.or(base.grid),
            },
            code_steps: self.code_steps,
            seed: self.add.clone().or_else(|| self.seed.clone()),
            max_seeds: self.max_seeds,
            unknown_share: self.unknown / 100.0,
            replace_all: self.replace_all,
            vectors_first: false,
        }
    }
}

pub(crate) fn run(args: PreprocessArgs, quiet: bool) -> Result<(), CliError> {
    let mut observer = Console::new(quiet);
    check_segmenter(&args)?;
    let scene = open_scene(&args.scene)?;
    let folder = scene.folder.clone().ok_or_else(|| JobError::NoScene(args.scene.clone()))?;
    let known = args.add.as_ref().map(|_| scene.semantics()).transpose()?.map(Arc::new);
    let dataset = open::dataset(&scene.photos(args.photos.as_deref())?)?;
    let request = FindRequest {
        folder,
        cloud: scene.cloud.clone(),
        settings: scene.settings.clone(),
        dataset: Arc::new(dataset),
        holdout_every: scene.config.holdout_every,
        masks: args.masks.clone(),
        known,
        side_px: plan::of_scene(&scene).object_side_px,
        with: args.settings(),
    };
    let done = find_objects::run(&request, scene.state.as_deref(), &mut observer);
    let FoundObjects { found, photos, kept, secs, warnings, .. } =
        done.map_err(|e| CliError::of_work(e, "nothing was stored"))?;
    let Found { map, views, secs: stages } = found;
    let unknown = map.findings.as_ref().and_then(SegmentationReport::unknown);
    let next = map.findings.as_ref().and_then(SegmentationReport::next_to_label);
    if args.json {
        return output::print_json(&json!({
            "scene": args.scene,
            "seeds": map.seeds,
            "warnings": warnings,
            "secs": secs,
            "prepared": map.prepared,
            "kept": kept,
            "stages": stages.iter().map(|(stage, secs)| json!({ "stage": stage, "secs": secs })).collect::<Vec<_>>(),
            "identities": identities(&map),
            "unknown": unknown,
            "next_to_label": next.map(|(photo, inferred)| json!({ "photo": photo, "inferred": inferred })),
            "views": views.iter().map(|v| json!({
                "photo": photos[v.photo].name, "unknown": v.unknown, "seen": v.seen,
            })).collect::<Vec<_>>(),
            "disagreements": disagreements(&map),
        }));
    }
    let conflicts = map.findings.as_ref().map_or(0, |f| f.conflicts().len());
    let kept = match kept.as_slice() {
        [] => String::new(),
        names => format!("\nkept by hand: {}; --replace-all finds them anew", names.join(", ")),
    };
    let next = next.map_or_else(String::new, |(photo, inferred)| {
        format!("\nmost would be learned from labels of {photo}: {:.0} % of it is inferred", 100.0 * inferred)
    });
    output::print(&format!(
        "{} from {} in {secs:.1} s, {:.1} % of the photos unknown, {}; ask with 'fmlgs query {} \"...\"'{kept}{next}",
        map.identities.counted(),
        things(map.seeds.len(), "photo"),
        100.0 * unknown.unwrap_or(0.0),
        things(conflicts, "doubt"),
        args.scene.display()
    ))
}

/// Objects and parts with what was noticed of each as they were found, for `preprocess` and `info`.
pub(super) fn identities(map: &SemanticMap) -> Vec<Value> {
    let (facts, found) = (map.facts(), disagreements(map));
    let row = |(id, i): (IdentityId, &Identity)| {
        let fact = &facts[id as usize];
        json!({
            "id": id,
            "level": i.level,
            "parent": i.parent,
            "names": i.names,
            "gaussians": fact.gaussians,
            "photos": fact.photos,
            "confidence": fact.confidence,
            "guessed": fact.guessed,
            "doubts": fact.conflicts.iter().map(|k| &found[*k]).collect::<Vec<_>>(),
        })
    };
    map.identities.iter().map(row).collect()
}

/// Disagreements of photos, in the order in which they were noticed.
fn disagreements(map: &SemanticMap) -> Vec<Value> {
    let Some(found) = &map.findings else { return Vec::new() };
    let text = |d: &MaskConflict| d.what.text(|id| map.identities.full_name(id));
    let told = |d: &MaskConflict| json!({ "photo": found.photo(d), "what": d.what, "text": text(d) });
    found.conflicts().iter().map(told).collect()
}
