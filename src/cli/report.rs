//! `fmlgs report`: error against run time.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::progress::Console;
use super::{CliError, opened, output};
use crate::io::{self, labels::Labels};
use crate::pipeline::observer::Silent;
use crate::pipeline::report::{self, FeatureStudy, Report};
use crate::pipeline::semantics::segmenter::{FileMasks, FoundMask, Segmenter};
use crate::pipeline::semantics::tracker::labels_of;
use crate::pipeline::semantics::train_codes::CodeView;
use crate::scene::{Identities, IdentityId, NOBODY, Photo};

/// Measure quality against run time of ways to do the same
///
/// Stage 'features': how Gaussians get their identities from the masks of all training photos: votes
/// in one pass, or codes trained by gradients as in the paper. Quality is the mean IoU of every
/// identity's mask in the held-out photos. Writes report.json, report.csv and report.svg.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs report scene/ --masks photos/ --out report/\n  \
    fmlgs report scene/ --masks photos/ --steps 300 --steps 1000 --max-side 256 --out report/")]
pub struct Args {
    /// Trained scene
    scene: PathBuf,
    /// Masks of its photos
    #[arg(long)]
    masks: PathBuf,
    /// Optimiser steps; may be given several times
    #[arg(long, default_values_t = [300, 1000, 4000])]
    steps: Vec<u64>,
    /// Longer side of the masks in px
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(16..=4096))]
    max_side: u32,
    /// Folder for the report
    #[arg(long, default_value = "out/report")]
    out: PathBuf,
}

pub fn run(args: Args, quiet: bool) -> Result<(), CliError> {
    let scene = opened::drawable(&args.scene)?;
    let dataset = match &scene.dataset_path {
        Some(path) => opened::dataset(path)?,
        None => return Err(CliError::failed(format!("{}: its photos are not known", args.scene.display()))),
    };
    let mut segmenter = FileMasks(Labels::open(&args.masks)?);
    let (training, held_out) = dataset.split(scene.config.holdout_every);
    let mut identities = Identities::default();
    let mut views = |indices: &[usize]| -> Result<Vec<CodeView>, CliError> {
        let photos = indices.iter().map(|&i| &dataset.photos[i]);
        let each = photos.map(|p| view(p, &mut segmenter, &mut identities, args.max_side));
        Ok(each.collect::<Result<Vec<_>, CliError>>()?.into_iter().flatten().collect())
    };
    let (training, held_out) = (views(&training)?, views(&held_out)?);
    if training.is_empty() || held_out.is_empty() {
        let path = args.masks.display();
        return Err(CliError::failed(format!("{path}: masks of training photos and of held-out photos are needed")));
    }
    let input = BTreeMap::from([
        ("scene".to_owned(), args.scene.display().to_string()),
        ("size".to_owned(), format!("{} px", args.max_side)),
        ("views".to_owned(), format!("{} + {} held out", training.len(), held_out.len())),
        ("identities".to_owned(), format!("{} identities", identities.len())),
    ]);
    let study = FeatureStudy {
        cloud: &scene.cloud,
        settings: &scene.settings,
        identities,
        training: &training,
        held_out: &held_out,
        steps: &args.steps,
    };
    let report = report::study_features(study, input, &mut Console::new(quiet))?;
    write(&args.out, &report)?;
    output::print(&output::table(&report.table()))
}

/// The labels of a photo, its regions matched with known identities by their names; `None` if it has
/// none.
fn view(
    photo: &Photo,
    segmenter: &mut FileMasks,
    identities: &mut Identities,
    max_side_px: u32,
) -> Result<Option<CodeView>, CliError> {
    if !segmenter.covers(photo) {
        return Ok(None);
    }
    let found: Vec<FoundMask> = segmenter.segment(photo, max_side_px, &mut Silent)?;
    let mut ids: Vec<IdentityId> = Vec::with_capacity(found.len());
    for mask in &found {
        let parent = mask.parent.map_or(NOBODY, |p| ids[p]);
        let names: Vec<String> = mask.name.iter().cloned().collect();
        let known = identities.iter().find(|(_, i)| i.level == mask.level && i.parent == parent && i.names == names);
        let known = known.map(|(id, _)| id);
        ids.push(known.unwrap_or_else(|| identities.add(mask.level, parent, names)));
    }
    let camera = photo.camera.limited_to(max_side_px);
    let labels = labels_of(&found, &ids, camera.width_px as usize * camera.height_px as usize);
    Ok(Some(CodeView { camera, labels }))
}

fn write(folder: &Path, report: &Report) -> Result<(), CliError> {
    output::make_folder(folder)?;
    let text = serde_json::to_string_pretty(report).map_err(|e| CliError::failed(e.to_string()))?;
    let picture = report::svg(report).map_err(CliError::failed)?;
    for (name, bytes) in [("report.json", text), ("report.csv", report.csv()), ("report.svg", picture)] {
        io::atomic::write(&folder.join(name), |w| w.write_all(bytes.as_bytes()))?;
    }
    Ok(())
}
