//! `fmlgs preprocess`: objects and parts of a trained scene.

use std::path::PathBuf;
use std::time::Instant;

use serde_json::json;

use super::plan::PlanArgs;
use super::progress::Console;
use super::{CliError, number, opened, output};
use crate::io::{self, SceneFolder};
use crate::models;
use crate::models::catalogue::{self, Role};
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::semantics::find::{FindOptions, Found, Lifting, REGIONS, Tools, find_objects, segmenter};
use crate::pipeline::semantics::follow::Follower;
use crate::pipeline::semantics::tracker::TrackOptions;
use crate::scene::{Level, Photo};

/// Find the objects and parts of a trained scene
///
/// Masks of a first photo vote for the Gaussians that they show; the votes carry them to all other
/// photos. Photos of which too much is unknown are segmented too, and their masks linked to what is
/// known. Held-out photos are never used. The result is stored with the scene: identities in
/// semantic_map.safetensors, each Gaussian's in point_cloud.ply.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs preprocess scene/ --masks photos/               masks that came with the photos\n  \
    fmlgs preprocess scene/ --masks labels/ --max-seeds 1  one labelled photo is enough to begin\n  \
    fmlgs preprocess scene/ --segmenter regions           no masks: regions of the photos, unnamed and rough")]
pub struct Args {
    /// Trained scene
    scene: PathBuf,
    /// Where the masks are: id maps of 'fmlgs synth', ISAT files as in lerf_ovs, the folders of SPIn-NeRF,
    /// 3D-OVS or LERF-Mask, or masklets as in SA-V
    #[arg(long)]
    masks: Option<PathBuf>,
    /// Where masks come from: 'files', 'regions' (built in, no weights: rough and unnamed), a model of
    /// 'fmlgs models', or the path of a model's .json [default: files where --masks is given, else the
    /// best model that is here, else regions]
    #[arg(long)]
    segmenter: Option<String>,
    /// How masks are carried to the other photos
    #[arg(long, value_enum, default_value_t = TrackerKind::Geometry)]
    tracker: TrackerKind,
    /// The SAM 2 that follows masks: a model of 'fmlgs models', or the path of a model's .json
    #[arg(long, default_value = catalogue::SAM2)]
    tracker_model: String,
    /// Dataset with the photos [default: where the scene's photos are]
    #[arg(long)]
    photos: Option<PathBuf>,
    /// Photo to begin with, by name [default: the first with masks]
    #[arg(long)]
    seed: Option<String>,
    /// Most photos whose masks are used
    #[arg(long, default_value_t = TrackOptions::default().max_seeds, value_parser = number::within(1..=100_000_usize))]
    max_seeds: usize,
    /// Share of a photo that may stay unknown before its masks are used too, in percent
    #[arg(long, default_value_t = 100.0 * TrackOptions::default().reseed_share, value_parser = number::within(0.0..=100.0))]
    unknown: f64,
    /// How Gaussians get their codes
    #[arg(long, value_enum, default_value_t = LiftingArg::Votes)]
    lifting: LiftingArg,
    /// Steps of training codes
    #[arg(long, default_value_t = 1_000, value_parser = number::within(0..=10_000_000_u64))]
    code_steps: u64,
    /// What looks at the objects, so that they are found by what they look like: 'demo', a model of
    /// 'fmlgs models', the path of a model's .json, or 'none' [default: the best that is here]
    #[arg(long)]
    encoder: Option<String>,
    #[command(flatten)]
    plan: PlanArgs,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum LiftingArg {
    /// Those of the identities they voted for
    Votes,
    /// The same, refined by training
    Refined,
    /// By training alone, as in the paper
    Paper,
}

/// How masks are carried to the other photos.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum TrackerKind {
    /// By the trained Gaussians; no network
    Geometry,
    /// By SAM 2 from photo to photo, as in the paper; photos have to be in the order of a walk
    Sam2,
    /// By both, each correcting the other
    Both,
}

/// Whether the arguments agree on where masks come from.
fn check_segmenter(args: &Args) -> Result<(), CliError> {
    match (&args.masks, args.segmenter.as_deref()) {
        (None, Some("files")) => Err(CliError::Usage("--segmenter files needs --masks".into())),
        (Some(_), Some(other)) if other != "files" => {
            Err(CliError::Usage(format!("--segmenter {other} finds its own masks; leave --masks out")))
        }
        _ => Ok(()),
    }
}

pub fn run(args: Args, quiet: bool) -> Result<(), CliError> {
    let mut observer = Console::new(quiet);
    check_segmenter(&args)?;
    if !io::trained::is_scene(&args.scene) {
        // What it is instead is told by opening it.
        opened::drawable(&args.scene)?;
        let path = args.scene.display();
        return Err(CliError::failed(format!("{path} is no trained scene; the result is stored in its folder")));
    }
    // Held from the beginning: nobody waits for objects that cannot be stored.
    let folder = SceneFolder::hold(&args.scene, "finding objects")?;
    let scene = opened::drawable(&args.scene)?;
    let photos_path = args.photos.clone().or_else(|| scene.dataset_path.clone()).ok_or_else(|| {
        let path = args.scene.display();
        CliError::failed(format!("{path}: its photos are not known or no longer there; give them with --photos"))
    })?;
    let dataset = opened::dataset(&photos_path)?;
    let held = |name: &str| scene.cameras.iter().any(|c| c.held_out && c.name == name);
    let photos: Vec<Photo> = dataset.photos.iter().filter(|p| !held(&p.name)).cloned().collect();
    let seed = match &args.seed {
        None => None,
        Some(name) => {
            let ends = |p: &Photo| p.name.contains(name.as_str());
            Some(photos.iter().position(ends).ok_or_else(|| {
                CliError::failed(format!("no photo that was trained on is called '{name}'; see 'fmlgs info'"))
            })?)
        }
    };
    let network = match args.segmenter.as_deref() {
        Some("files" | REGIONS) => None,
        Some(name) => Some(name.to_owned()),
        None => {
            catalogue::usable(Role::Segmenter, &mut |text| observer.note(Severity::Warning, text))?.into_iter().next()
        }
    };
    let mut segmenter = segmenter(args.masks.as_deref(), &scene.cloud, &scene.settings, network.as_deref())?;
    let track = TrackOptions {
        seed,
        max_seeds: args.max_seeds.max(1),
        reseed_share: args.unknown / 100.0,
        veto: args.tracker == TrackerKind::Both,
        max_side_px: args.plan.of_scene(&scene).object_side_px,
    };
    let lifting = match args.lifting {
        LiftingArg::Votes => Lifting::Votes,
        LiftingArg::Refined => Lifting::Refined(args.code_steps),
        LiftingArg::Paper => Lifting::Paper(args.code_steps),
    };
    let mut encoder = match args.encoder.as_deref() {
        Some("none") => None,
        Some(name) => Some(models::encoder(name)?),
        None => Some(models::best_encoder(&mut |text| observer.note(Severity::Warning, text))?),
    };
    let mut follower = match args.tracker {
        TrackerKind::Geometry => None,
        _ => Some(Follower::open(&args.tracker_model, Some(args.scene.join("cache")))?),
    };
    let start = Instant::now();
    let options = FindOptions { track, lifting };
    let (cloud, settings) = (&scene.cloud, &scene.settings);
    let tools = Tools { segmenter: &mut *segmenter, follower: follower.as_mut(), encoder: encoder.as_deref_mut() };
    let found = find_objects(cloud, &photos, settings, tools, &options, &mut observer);
    let Found { map, views, disagreements, secs: stages } =
        found.map_err(|e| CliError::of_work(e, "nothing was stored"))?;
    let (kept, _) = folder.replace_map(scene.state.as_deref(), &map, &scene.cloud)?;
    if let Some(kept) = kept {
        observer.note(Severity::Info, format!("The objects and parts before are kept in {}", kept.display()));
    }
    let secs = start.elapsed().as_secs_f64();
    let count = |level: Level| map.identities.iter().filter(|(_, i)| i.level == level).count();
    if args.json {
        let sizes = map.sizes();
        let list = map.identities.iter().map(|(id, i)| {
            json!({ "id": id, "level": i.level, "parent": i.parent, "names": i.names, "gaussians": sizes[id as usize] })
        });
        return output::print_json(&json!({
            "scene": args.scene,
            "seeds": map.seeds,
            "secs": secs,
            "stages": stages.iter().map(|(stage, secs)| json!({ "stage": stage, "secs": secs })).collect::<Vec<_>>(),
            "identities": list.collect::<Vec<_>>(),
            "views": views.iter().map(|v| json!({
                "photo": photos[v.photo].name, "unknown": v.unknown, "seen": v.seen,
            })).collect::<Vec<_>>(),
            "disagreements": disagreements.iter().map(|(photo, what)| json!({
                "photo": photos[*photo].name, "what": what,
            })).collect::<Vec<_>>(),
        }));
    }
    output::print(&format!(
        "{} objects and {} parts from {} photos in {secs:.1} s; ask with 'fmlgs query {} \"...\"'",
        count(Level::Object),
        count(Level::Part),
        map.seeds.len(),
        args.scene.display()
    ))
}
