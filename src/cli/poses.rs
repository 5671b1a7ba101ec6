//! `fmlgs poses`: camera poses of photos that have none.

use std::path::PathBuf;

use serde_json::json;

use super::progress::Console;
use super::{CliError, number, output};
use crate::io::OpenError;
use crate::io::unposed::Unposed;
use crate::jobs::open::{self, Contents};
use crate::jobs::poses::front_door::{self, PoseRequest};
use crate::jobs::poses::{FoundPoses, MakerKind, compare, manual};
use crate::jobs::{Folders, JobError};
use crate::scene::Dataset;

/// Find the camera poses of photos, or of the frames of a video
///
/// The best maker that is here is taken: COLMAP, pycolmap in the active Python, or the one that is built in. From a
/// video, the sharpest frames become photos in a folder beside it. Photos and video are not changed. The same command
/// again goes on where it stopped; once all is found, it says so again.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs poses photos/\n  \
    fmlgs poses walk.mp4 --out walk/          100 to 300 of its frames, in walk-photos/\n  \
    fmlgs poses photos/ --install             gets pycolmap (about 135 MB, BSD license) where nothing else is here\n  \
    fmlgs poses photos/ --maker built-in --json\n  \
    fmlgs poses photos/ --compare posed/      how far they are from poses that are known\n  \
    fmlgs poses photos/ --by-hand             COLMAP's commands, to copy\n  \
    fmlgs train walk.mp4 --out scene/         poses and training in one")]
pub(crate) struct PosesArgs {
    /// Folder of photos, or a video; with --compare also posed photos
    photos: PathBuf,
    /// Folder for the result, 'images' and 'sparse/0' [default: one that the program keeps]
    #[arg(long)]
    out: Option<PathBuf>,
    /// Maker of the poses [default: the first that is here]
    #[arg(long, value_enum)]
    maker: Option<MakerKind>,
    /// Number of photos from a video [default: 100 to 300, by how much the picture changes]
    #[arg(long, value_parser = number::within(3..=10_000_usize))]
    frames: Option<usize>,
    /// Get pycolmap, where no maker is here, into an environment of this program
    #[arg(long)]
    install: bool,
    /// Posed photos of the same names to compare with, after the best similarity
    #[arg(long, value_name = "GIVEN")]
    compare: Option<PathBuf>,
    /// Find nothing; print commands for COLMAP
    #[arg(long)]
    by_hand: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &PosesArgs, quiet: bool) -> Result<(), CliError> {
    let given = args.compare.as_deref().map(open::dataset).transpose()?;
    let photos = match open::contents(&args.photos, None) {
        Err(JobError::Open(OpenError::NoPoses(photos))) => *photos,
        Err(e) => return Err(e.into()),
        Ok(contents) => return compare_only(args, contents, given.as_ref()),
    };
    if args.by_hand {
        return by_hand(args, &photos);
    }
    if args.frames.is_some() && photos.video.is_none() {
        return Err(CliError::Usage(format!(
            "--frames has no effect here: {} is a folder of photos, all of which are taken",
            args.photos.display()
        )));
    }
    let request =
        PoseRequest { photos, maker: args.maker, out: args.out.clone(), frames: args.frames, install: args.install };
    let mut console = Console::new(quiet || args.json);
    let saved = "what was finished is kept; the same command goes on from there";
    let found = front_door::find_here(&request, &Folders::of_user(), &mut console)
        .map_err(|e| if e.is_cancelled() { CliError::Cancelled(saved.into()) } else { e.into() })?;
    drop(console);
    let comparison = given.as_ref().map(|given| compare::compare(&open::dataset(&found.out)?, given)).transpose()?;
    if args.json {
        return output::print_json(&json!({ "found": found, "comparison": comparison }));
    }
    output::print(&text(args, &found))?;
    comparison.map_or(Ok(()), |comparison| output::print(&said(&comparison)))
}

/// Compares posed photos, of which nothing is to be found.
fn compare_only(args: &PosesArgs, contents: Contents, given: Option<&Dataset>) -> Result<(), CliError> {
    let Contents::Photos(found) = contents else {
        return Err(CliError::failed(format!("{} is a scene, not photos without poses", args.photos.display())));
    };
    let Some(given) = given else {
        let photos = args.photos.display();
        return Err(CliError::failed(format!(
            "the photos in {photos} have poses already: train with 'fmlgs train {photos}', or compare them (--compare)"
        )));
    };
    let comparison = compare::compare(&found, given)?;
    if args.json { output::print_json(&json!({ "comparison": comparison })) } else { output::print(&said(&comparison)) }
}

fn by_hand(args: &PosesArgs, photos: &Unposed) -> Result<(), CliError> {
    if photos.video.is_some() {
        let video = args.photos.display();
        return Err(CliError::failed(format!(
            "{video} is a video: 'fmlgs poses {video}' takes photos from it, in a folder beside it"
        )));
    }
    output::print(&manual::commands(photos).join("\n"))
}

fn text(args: &PosesArgs, found: &FoundPoses) -> String {
    let mut lines = vec![found.summary()];
    lines.extend(found.remarks());
    lines.push(format!("poses: {}", found.out.display()));
    let to_train = if args.out.is_some() { &found.out } else { &args.photos };
    lines.push(format!("train with: fmlgs train {} --out scene/", to_train.display()));
    lines.join("\n")
}

/// A comparison in words.
fn said(comparison: &compare::PoseComparison) -> String {
    let compare::PoseComparison { photos, given, center, rotation_deg, focal_ratio } = comparison;
    format!(
        "{photos} of {given} given poses compared: centers off by {:.3} % of the radius in the median, {:.3} % at most; \
         rotations by {:.3} degrees, {:.3} at most; focal length {:.2} % {}",
        100.0 * center[0],
        100.0 * center[1],
        rotation_deg[0],
        rotation_deg[1],
        100.0 * (focal_ratio - 1.0).abs(),
        if *focal_ratio < 1.0 { "shorter" } else { "longer" }
    )
}
