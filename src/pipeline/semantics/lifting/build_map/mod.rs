//! Pipeline from trained Gaussians and masks to a semantic map.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::add_photo::{joined, summary};
use super::codes;
use super::embed::embed;
use super::error::FindError;
use super::keep;
use super::mask_vectors::embed_by_masks;
use super::network_segmenter::NetworkMasks;
use super::regions::Regions;
use super::sam2_tracker::Sam2Tracker;
use super::segmenter::{FileMasks, Segmenter};
use super::tracker::{TrackOptions, Tracked, ViewReport, track};
use super::train_codes::{CodeTraining, CodeView, decode, train_codes};
use crate::io::labels::Labels;
use crate::models::Encoder;
use crate::pipeline::observer::{Observer, Severity};
use crate::render::RenderSettings;
use crate::scene::semantic_map::{BACKGROUND_CODE, CODE_CHANNELS};
use crate::scene::{GaussianCloud, IdentityId, Lifting, MaskGrid, PART_WEIGHT, Photo, Preparation, SemanticMap};

pub(crate) const CODE_STEPS: u64 = 1_000;
/// Seed of the order of training views.
const SEED: u64 = 0;

/// Ways to carry masks to the other photos.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
pub enum MaskPropagation {
    /// By the trained Gaussians; no network
    #[default]
    #[value(name = "geometry")]
    Gaussians,
    /// By SAM 2 from photo to photo, as in the paper; photos have to be in the order of a walk
    Sam2,
    /// By both, each correcting the other
    Both,
}

/// Name of the masks that need no model.
pub(crate) const REGIONS: &str = "regions";

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FindOptions {
    pub(crate) track: TrackOptions,
    pub(crate) lifting: Lifting,
    /// Training steps of the codes, if they are trained.
    pub(crate) code_steps: u64,
    /// Share of its own embedding that a part keeps in semantic deviation.
    pub(crate) part_weight: f32,
    /// Grid of prompt points, if a network finds the masks.
    pub(crate) grid: Option<MaskGrid>,
    /// Encoder of the vectors that came with the masks, if identities are embedded by these.
    pub(crate) encoder_of_masks: Option<&'static str>,
    /// Objects and parts edited by the user, which are kept beside the new ones.
    pub(crate) keep: Option<Arc<SemanticMap>>,
}

impl Default for FindOptions {
    fn default() -> Self {
        Self {
            track: TrackOptions::default(),
            lifting: Lifting::default(),
            code_steps: CODE_STEPS,
            part_weight: PART_WEIGHT,
            grid: None,
            encoder_of_masks: None,
            keep: None,
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Found {
    pub(crate) map: SemanticMap,
    /// Share of each photo that the masks of the seed photos explain.
    pub(crate) views: Vec<ViewReport>,
    /// Seconds of each stage, in order.
    pub(crate) secs: Vec<(&'static str, f64)>,
}

/// Returns the segmenter of the photos that `cloud` was trained on: label files if there are any, else the network of
/// this name, else regions of the photos. Masks of a network are kept in `cache`.
pub(crate) fn segmenter<'a>(
    files: Option<Labels>,
    cloud: &'a GaussianCloud,
    settings: &'a RenderSettings,
    network: Option<(&str, MaskGrid)>,
    cache: PathBuf,
) -> Result<Box<dyn Segmenter + 'a>, FindError> {
    Ok(match (files, network) {
        (Some(files), _) => Box::new(FileMasks(files)),
        (None, Some((network, grid))) => Box::new(NetworkMasks::open_cached(network, grid, cache)?),
        (None, None) => Box::new(Regions { trained: Some((cloud, settings)), ..Regions::default() }),
    })
}

/// Segmenter, follower and encoder of a search.
pub(crate) struct SearchModels<'a> {
    pub(crate) segmenter: &'a mut dyn Segmenter,
    /// Follows masks through the photos, in addition to the Gaussians.
    pub(crate) follower: Option<&'a mut Sam2Tracker>,
    /// Embeds the identities, so that they are found by their looks.
    pub(crate) encoder: Option<&'a mut (dyn Encoder + 'static)>,
}

/// Finds the objects and parts of `cloud`, which was trained on `photos`, gives them codes, and embeds them if there
/// is an encoder.
pub(crate) fn find_objects(
    cloud: &GaussianCloud,
    photos: &[Photo],
    settings: &RenderSettings,
    models: SearchModels<'_>,
    options: &FindOptions,
    observer: &mut dyn Observer,
) -> Result<Found, FindError> {
    let SearchModels { segmenter, follower, encoder } = models;
    let prompt = follower.is_some().then_some(options.track.prompt);
    let keep_masks = options.lifting != Lifting::Votes;
    let how = TrackOptions { keep_masks, ..options.track.clone() };
    let tracked = track(cloud, photos, settings, segmenter, follower, &how, observer)?;
    if let Some(text) = unknown(&tracked.views, photos, options.track.reseed_share) {
        observer.note(Severity::Info, text);
    }
    if let Some(known) = &options.track.known {
        let mut map = joined(known, &tracked, photos);
        observer.note(Severity::Info, summary(known, &map));
        let start = Instant::now();
        embedded(&mut map, cloud, photos, settings, (segmenter, encoder), options, observer)?;
        map.look_at(cloud);
        let Tracked { views, mut secs, .. } = tracked;
        secs.push(("look at identities", start.elapsed().as_secs_f64()));
        return Ok(Found { map, views, secs });
    }
    let mut identities = tracked.identities.clone();
    let of: Vec<IdentityId> = tracked.assignments.iter().map(|b| b.identity).collect();
    let centers = codes::centers(cloud, &of, &identities);
    codes::assign(&mut identities, &centers);
    let margin = tracked.assignments.iter().map(|b| b.margin).collect();
    let seeds = tracked.seeds.iter().map(|&i| photos[i].name.clone()).collect();
    let mut map = SemanticMap::from_identities(identities, of, margin, seeds);
    map.findings = Some(tracked.findings(photos));
    map.prepared =
        Some(Preparation { lifting: options.lifting, part_weight: options.part_weight, prompt, grid: options.grid });
    let Tracked { views, masks, mut secs, .. } = tracked;
    let mut timed = |stage: &'static str, start: Instant| secs.push((stage, start.elapsed().as_secs_f64()));
    let start = Instant::now();
    if options.lifting != Lifting::Votes {
        let text = format!("Codes are trained on the masks of {} of {} photos", masks.len(), photos.len());
        observer.note(Severity::Info, text);
        lift(&mut map, cloud, &masks, settings, options, observer)?;
    }
    timed("train codes", start);
    if let Some(kept) = &options.keep {
        map = keep::joined(&map, kept);
    }
    let start = Instant::now();
    if embedded(&mut map, cloud, photos, settings, (segmenter, encoder), options, observer)? {
        timed("look at identities", start);
    }
    map.look_at(cloud);
    Ok(Found { map, views, secs })
}

/// Embeds the identities, by an encoder or by the vectors of the masks; returns whether there is either.
fn embedded(
    map: &mut SemanticMap,
    cloud: &GaussianCloud,
    photos: &[Photo],
    settings: &RenderSettings,
    (segmenter, encoder): (&dyn Segmenter, Option<&mut (dyn Encoder + 'static)>),
    options: &FindOptions,
    observer: &mut dyn Observer,
) -> Result<bool, FindError> {
    let part_weight = options.part_weight;
    let language = match (encoder, options.encoder_of_masks) {
        (Some(encoder), _) => embed(cloud, map, photos, settings, part_weight, encoder, observer)?,
        (None, Some(name)) => embed_by_masks(cloud, map, photos, settings, part_weight, (name, segmenter), observer)?,
        (None, None) => return Ok(false),
    };
    map.language = Some(language);
    Ok(true)
}

/// Trains the codes of the Gaussians on the masks that were found and followed, never on the result of the votes.
fn lift(
    map: &mut SemanticMap,
    cloud: &GaussianCloud,
    views: &[CodeView],
    settings: &RenderSettings,
    options: &FindOptions,
    observer: &mut dyn Observer,
) -> Result<(), FindError> {
    if options.lifting == Lifting::Paper {
        let nothing: [f32; CODE_CHANNELS] = std::array::from_fn(|c| BACKGROUND_CODE[c % 3]);
        map.codes.fill(nothing);
    }
    let training = CodeTraining { steps: options.code_steps, seed: SEED };
    train_codes(cloud, &mut map.codes, views, &map.identities, settings, training, observer)?;
    observer.proceed()?;
    if options.lifting == Lifting::Paper {
        map.identity_of = decode(&map.codes, &map.identities);
    }
    Ok(())
}

/// Reports views that the masks do not explain; `None` if there are none.
fn unknown(views: &[ViewReport], photos: &[Photo], share: f64) -> Option<String> {
    let many: Vec<&ViewReport> = views.iter().filter(|v| v.unknown > share).collect();
    let worst = many.iter().max_by(|a, b| a.unknown.total_cmp(&b.unknown))?;
    Some(format!(
        "{} of {} photos have over {} unknown pixels (worst: {}, {:.0} %): no mask, and nothing that looks like what \
         masks show; label one of them to name what is there",
        many.len(),
        photos.len(),
        format_args!("{:.1} %", 100.0 * share),
        photos[worst.photo].name,
        100.0 * worst.unknown
    ))
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod vector_tests;
