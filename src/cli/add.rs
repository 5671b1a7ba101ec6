//! `fmlgs add`: a trained scene made better by more photos of it.

use std::path::PathBuf;

use super::progress::Console;
use super::scene_args::open_scene;
use super::{CliError, number, output};
use crate::jobs::add::{self, AddOptions, AddedScene};
use crate::math::format::{count, things};
use crate::render::BackendChoice;

/// Add close-ups or other new photos to a trained scene
///
/// Makes a new scene; the old one stays as it is. Training goes on only where the new photos show more than the old
/// ones: finer, or something else. All other Gaussians keep every bit. Posed photos are in the scene's frame, or are
/// brought into it by photos that both have; pictures without poses are located, as 'fmlgs locate' does. Objects and
/// parts are kept, and masks of the new photos name the parts that only they show. The same command run again resumes
/// where it stopped.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs add scene/ close-ups/ --out closer/\n  \
    fmlgs add scene/ a.jpg b.jpg --out closer/           without poses: they are located\n  \
    fmlgs add scene/ close-ups/ --masks labels/ --out closer/   labels name the small parts\n  \
    fmlgs add scene/ close-ups/ --segmenter regions --out closer/")]
pub(crate) struct AddArgs {
    /// Trained scene
    scene: PathBuf,
    /// Photos to add: a folder or list of posed photos, or pictures
    #[arg(required = true)]
    photos: Vec<PathBuf>,
    /// Folder of the new scene
    #[arg(long)]
    out: PathBuf,
    /// Training steps [default: 150 for each new photo, at least 300, at most a tenth of the scene's]
    #[arg(long, value_parser = number::within(1..=1_000_000_000_u64))]
    steps: Option<u64>,
    /// Focal length of pictures without poses at full size, px
    #[arg(long, value_parser = number::within(1.0..=1e6))]
    focal_px: Option<f64>,
    /// Masks of the new photos, of any kind that 'fmlgs preprocess' reads [default: those in the folder of posed photos]
    #[arg(long)]
    masks: Option<PathBuf>,
    /// Segmenter of the new photos: 'regions', a model of 'fmlgs models', or the path of a model's .json
    #[arg(long, conflicts_with = "masks")]
    segmenter: Option<String>,
    /// Dataset with the scene's own photos [default: where the scene's photos are]
    #[arg(long, value_name = "PHOTOS")]
    own_photos: Option<PathBuf>,
    /// Renderer that trains [default: that of the scene's training]
    #[arg(long, value_enum)]
    backend: Option<BackendChoice>,
    /// Print one JSON document at the end
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: AddArgs, quiet: bool) -> Result<(), CliError> {
    let scene = open_scene(&args.scene)?;
    let options = AddOptions {
        steps: args.steps,
        focal_px: args.focal_px,
        dataset: args.own_photos,
        masks: args.masks,
        segmenter: args.segmenter,
        backend: args.backend,
    };
    let mut console = Console::new(quiet || args.json);
    let done = add::run(&scene, &args.photos, &options, &args.out, &mut console)
        .map_err(|e| CliError::of_work(e, "the scene is as it was; the same command goes on"))?;
    drop(console);
    if args.json {
        output::print_json(&done)?;
    } else if done.finished {
        output::print(&summary(&done))?;
    }
    if done.finished {
        return Ok(());
    }
    Err(CliError::Cancelled(format!("what is done is saved in {}; the same command goes on", done.out.display())))
}

/// The result in words.
fn summary(done: &AddedScene) -> String {
    let mut lines = Vec::new();
    let mut added = format!("{} added", things(done.trained, "photo"));
    for (n, what) in [(done.held_out, "held out"), (done.located, "located"), (done.refused.len(), "refused")] {
        if n > 0 {
            added += &format!(", {n} {what}");
        }
    }
    lines.push(added);
    let kept = if done.unchanged { "bit for bit" } else { "not bit for bit: they have drifted" };
    let [frozen, before, now] = [done.refined.frozen, done.refined.gaussians, done.gaussians].map(|n| count(n as u64));
    lines.push(format!("{frozen} of {before} Gaussians are as they were, {kept}; {now} now"));
    if let Some(held) = &done.held_out_scores {
        let photos = things(held.photos, "held-out photo");
        lines.push(format!("{photos} of the scene before: {:.2} dB then, {:.2} dB now", held.before, held.now));
    }
    if done.new_identities > 0 {
        lines.push(format!("{} named by the new photos", things(done.new_identities, "object or part")));
    }
    lines.push(format!("new scene: {} (in {:.0} s)", done.out.display(), done.secs));
    lines.join("\n")
}
