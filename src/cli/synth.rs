//! `fmlgs synth`: posed photos with ground truth from any glTF scene.

use std::path::PathBuf;

use glam::DVec3;
use serde_json::json;

use super::edit::vector;
use super::progress::Console;
use super::{CliError, number, output, view};
use crate::jobs::synth::{self, Levels, Rig, SynthOptions, SynthReport};

/// Render a glTF scene into posed photos with object and part ids
///
/// Writes a dataset that 'fmlgs train' opens: photos, cameras, depth, sparse points, and for every
/// pixel which object and which part it shows (16-bit PNG, named in identities.json). The images
/// come from ray casting, which shares no code with the splat renderer.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs synth table.glb --out photos/\n  \
    fmlgs synth table.glb --view-count 200 --held-out 25 --size 1280x960 --rig survey --out photos/\n  \
    fmlgs synth table.glb --view-count 8 --focus 0.2,0.9,0 --radius 0.1 --out close-ups/\n  \
    fmlgs synth table.glb --without \"teddy bear\" --out behind-the-bear/")]
pub(crate) struct SynthArgs {
    /// The scene: .glb or .gltf with named nodes
    scene: PathBuf,
    /// Folder for the dataset
    #[arg(long)]
    out: PathBuf,
    /// Photos in all
    #[arg(long, default_value_t = SynthOptions::default().views)]
    view_count: usize,
    /// Photos marked as held out, spread over all [default: every eighth]
    #[arg(long)]
    held_out: Option<usize>,
    /// Size of a photo, for example 800x600
    #[arg(long, value_parser = view::parse_size)]
    size: Option<[u32; 2]>,
    /// Samples along each side of a pixel
    #[arg(long, default_value_t = SynthOptions::default().samples)]
    samples: u32,
    /// Vertical field of view in degrees
    #[arg(long, default_value_t = SynthOptions::default().fov_y_deg)]
    fov: f64,
    /// Placement of the cameras
    #[arg(long, value_enum, default_value_t = SynthOptions::default().rig)]
    rig: Rig,
    /// Point that the cameras look at, scene units [default: the middle of the objects]
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    focus: Option<DVec3>,
    /// Radius around the focus that fills a photo, scene units [default: that of the objects]
    #[arg(long, value_parser = number::within(1e-6..=1e6))]
    radius: Option<f64>,
    /// Rule that makes nodes objects or parts
    #[arg(long, value_enum, default_value_t = SynthOptions::default().levels)]
    levels: Levels,
    /// Sparse points, as from structure from motion, 0 = none
    #[arg(long, default_value_t = SynthOptions::default().points)]
    points: usize,
    /// Seed of every random choice
    #[arg(long, default_value_t = SynthOptions::default().seed)]
    seed: u64,
    /// Leave out an object or part once the cameras are placed, and render the held-out views only: what is
    /// really behind it, to judge its removal by
    #[arg(long, value_name = "NAME")]
    without: Option<String>,
    /// Keep the shadow of the object or part that is left out
    #[arg(long, requires = "without")]
    keep_shadow: bool,
    /// Print one JSON document at the end
    #[arg(long)]
    json: bool,
}

impl SynthArgs {
    fn check(&self) -> Result<SynthOptions, CliError> {
        let base = SynthOptions::default();
        let [width_px, height_px] = self.size.unwrap_or([base.width_px, base.height_px]);
        let options = SynthOptions {
            views: self.view_count,
            held_out: self.held_out.unwrap_or(self.view_count / 8),
            width_px,
            height_px,
            samples: self.samples,
            fov_y_deg: self.fov,
            rig: self.rig,
            focus: self.focus,
            radius: self.radius,
            levels: self.levels,
            points: self.points,
            seed: self.seed,
            without: self.without.clone(),
            keep_shadows: self.keep_shadow,
            ..base
        };
        options.validate().map_err(|error| CliError::Usage(error.to_string()))?;
        Ok(options)
    }
}

pub(crate) fn run(args: SynthArgs, quiet: bool) -> Result<(), CliError> {
    let options = args.check()?;
    let mut console = Console::new(quiet);
    let report = synth::run(&args.scene, &options, &args.out, &mut console)
        .map_err(|e| CliError::of_work(e, "the dataset is not complete; run the same command again"))?;
    drop(console);
    if args.json { output::print_json(&as_json(&report)) } else { output::print(&report.summary()) }
}

fn as_json(r: &SynthReport) -> serde_json::Value {
    json!({
        "out": r.out,
        "train_views": r.train_views,
        "held_out_views": r.held_out_views,
        "identities": r.identities.len(),
        "points": r.points,
        "triangles": r.triangles,
        "secs": r.secs,
        "warnings": r.warnings,
    })
}
