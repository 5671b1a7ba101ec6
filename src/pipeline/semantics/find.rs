//! The whole way from trained Gaussians and masks to a semantic map.

use std::path::Path;
use std::time::Instant;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::codes;
use super::embed::{EmbedError, embed};
use super::everything::NetworkMasks;
use super::follow::Follower;
use super::link::Disagreement;
use super::regions::Regions;
use super::segmenter::{FileMasks, SegmentError, Segmenter};
use super::tracker::{TrackError, TrackOptions, Tracked, ViewReport, track};
use super::train_codes::{CodeTraining, CodeView, decode, train_codes};
use super::view_map::ViewMap;
use crate::io::labels::Labels;
use crate::models::Encoder;
use crate::pipeline::observer::{Level, Observer, Signal};
use crate::render::cpu::Renderer;
use crate::render::{RenderError, RenderSettings};
use crate::scene::semantic_map::{BACKGROUND_CODE, CODE_CHANNELS};
use crate::scene::{GaussianCloud, Identities, IdentityId, Photo, SemanticMap};

/// Longer side of the masks that codes are trained on, px.
const CODE_SIDE_PX: u32 = 256;
/// Seed of the order in which views are trained on.
const SEED: u64 = 0;

/// How Gaussians get their codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lifting {
    /// Those of the identities they voted for.
    #[default]
    Votes,
    /// The same, refined by this many steps of training.
    Refined(u64),
    /// By training alone, as in the paper; identities are read off the trained codes.
    Paper(u64),
}

/// How masks are carried to the other photos.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Carry {
    /// By the trained Gaussians; no network.
    #[default]
    Gaussians,
    /// By SAM 2 from photo to photo besides, as in the paper; photos have to be in the order of a walk.
    Sam2,
    /// By both, and where SAM 2 contradicts the Gaussians it is not believed.
    Both,
}

/// Name of the masks that need no model.
pub const REGIONS: &str = "regions";

/// Which models find objects; `None` = the best that is here.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Finding {
    /// Finds masks where none came with the photos.
    pub segmenter: Option<String>,
    /// Carries them to the other photos.
    pub carry: Carry,
    /// Looks at what was found.
    pub encoder: Option<String>,
}

/// Settings of the whole way.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FindOptions {
    /// How masks become identities.
    pub track: TrackOptions,
    /// How identities become codes of Gaussians.
    pub lifting: Lifting,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Objects and parts of the scene.
    pub map: SemanticMap,
    /// What masks of the first photos explain of each photo.
    pub views: Vec<ViewReport>,
    /// Photos whose masks disagreed with what was known before, and how.
    pub disagreements: Vec<(usize, Disagreement)>,
    /// Seconds that each stage took, in order.
    pub secs: Vec<(&'static str, f64)>,
}

/// Why objects could not be found.
#[derive(Debug, thiserror::Error)]
pub enum FindError {
    /// In making identities of masks.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// In training codes.
    #[error("training codes: {0}")]
    Lift(#[from] RenderError),
    /// In looking at the identities.
    #[error(transparent)]
    Embed(#[from] EmbedError),
}

impl FindError {
    /// Whether the observer asked to stop.
    pub fn is_cancelled(&self) -> bool {
        matches!(self, Self::Track(TrackError::Cancelled) | Self::Embed(EmbedError::Cancelled))
    }
}

/// What finds the masks of photos that `cloud` was trained on: files, where there are any, else the
/// network of this name, else regions of the photos.
///
/// # Errors
/// If there are no masks at `files`, or the network cannot be used.
pub fn segmenter<'a>(
    files: Option<&Path>,
    cloud: &'a GaussianCloud,
    settings: &'a RenderSettings,
    network: Option<&str>,
) -> Result<Box<dyn Segmenter + 'a>, SegmentError> {
    Ok(match (files, network) {
        (Some(files), _) => Box::new(FileMasks(Labels::open(files)?)),
        (None, Some(network)) => Box::new(NetworkMasks::open(network)?),
        (None, None) => Box::new(Regions { trained: Some((cloud, settings)), ..Regions::default() }),
    })
}

/// What finds masks, carries them on, and looks at what they are of.
pub struct Tools<'a> {
    /// Finds masks.
    pub segmenter: &'a mut dyn Segmenter,
    /// Follows them through the photos, besides what the Gaussians carry.
    pub follower: Option<&'a mut Follower>,
    /// Looks at the identities, so that they are found by their looks.
    pub encoder: Option<&'a mut (dyn Encoder + 'static)>,
}

/// Finds the objects and parts of `cloud`, which was trained on `photos`, gives them codes, and lets
/// an encoder look at them, if there is one.
///
/// # Errors
/// If masks or photos cannot be read, a view cannot be drawn, the encoder fails, or the observer asks
/// to stop.
pub fn find_objects(
    cloud: &GaussianCloud,
    photos: &[Photo],
    settings: &RenderSettings,
    tools: Tools<'_>,
    options: &FindOptions,
    observer: &mut dyn Observer,
) -> Result<Found, FindError> {
    let Tools { segmenter, follower, encoder } = tools;
    let tracked = track(cloud, photos, settings, segmenter, follower, &options.track, observer)?;
    if let Some(text) = unknown(&tracked.views, photos, options.track.reseed_share) {
        observer.note(Level::Info, text);
    }
    let mut identities = tracked.identities.clone();
    let of: Vec<IdentityId> = tracked.belongings.iter().map(|b| b.identity).collect();
    let centers = centers(cloud, &of, &identities);
    codes::assign(&mut identities, &centers);
    let margin = tracked.belongings.iter().map(|b| b.margin).collect();
    let seeds = tracked.seeds.iter().map(|&i| photos[i].name.clone()).collect();
    let mut map = SemanticMap::of_identities(identities, of, margin, seeds);
    let Tracked { views, disagreements, mut secs, .. } = tracked;
    let mut timed = |stage: &'static str, start: Instant| secs.push((stage, start.elapsed().as_secs_f64()));
    let start = Instant::now();
    lift(&mut map, cloud, photos, settings, options.lifting, observer)?;
    timed("train codes", start);
    if let Some(encoder) = encoder {
        let start = Instant::now();
        map.language = Some(embed(cloud, &map, photos, settings, encoder, observer)?);
        timed("look at identities", start);
    }
    Ok(Found { map, views, disagreements, secs })
}

/// Trains the codes of the Gaussians, where that is wanted, on the masks as they were tracked.
fn lift(
    map: &mut SemanticMap,
    cloud: &GaussianCloud,
    photos: &[Photo],
    settings: &RenderSettings,
    lifting: Lifting,
    observer: &mut dyn Observer,
) -> Result<(), FindError> {
    let steps = match lifting {
        Lifting::Votes => return Ok(()),
        Lifting::Refined(steps) | Lifting::Paper(steps) => steps,
    };
    let mut renderer = Renderer::new();
    let mut views = Vec::with_capacity(photos.len());
    for photo in photos {
        let camera = photo.camera.limited_to(CODE_SIDE_PX);
        let seen = ViewMap::render(&mut renderer, cloud, &map.of, &map.identities, &camera, settings)?;
        views.push(CodeView { camera, labels: seen.identity });
    }
    if matches!(lifting, Lifting::Paper(_)) {
        let nothing: [f32; CODE_CHANNELS] = std::array::from_fn(|c| BACKGROUND_CODE[c % 3]);
        map.codes.fill(nothing);
    }
    let training = CodeTraining { steps, seed: SEED };
    train_codes(cloud, &mut map.codes, &views, &map.identities, settings, training, observer)?;
    if observer.signal() == Signal::Cancel {
        return Err(TrackError::Cancelled.into());
    }
    if matches!(lifting, Lifting::Paper(_)) {
        map.of = decode(&map.codes, &map.identities);
    }
    Ok(())
}

/// What to say about views that masks did not explain; `None` if there is no need.
fn unknown(views: &[ViewReport], photos: &[Photo], share: f64) -> Option<String> {
    let many: Vec<&ViewReport> = views.iter().filter(|v| v.unknown > share).collect();
    let worst = many.iter().max_by(|a, b| a.unknown.total_cmp(&b.unknown))?;
    Some(format!(
        "{} of {} photos show more than {:.0}% that no mask has reached (most: {}, {:.0}%); what is there goes to what \
         it hangs together with",
        many.len(),
        photos.len(),
        100.0 * share,
        photos[worst.photo].name,
        100.0 * worst.unknown
    ))
}

/// Mean position of each identity's Gaussians, pieces included, by number less one.
pub fn centers(cloud: &GaussianCloud, of: &[IdentityId], identities: &Identities) -> Vec<DVec3> {
    let mut sums = vec![(DVec3::ZERO, 0.0); identities.len()];
    for (i, &id) in of.iter().enumerate() {
        for id in identities.line(id) {
            let sum = &mut sums[id as usize - 1];
            *sum = (sum.0 + cloud.world_position(i), sum.1 + 1.0);
        }
    }
    sums.iter().map(|(sum, n)| if *n > 0.0 { *sum / *n } else { DVec3::ZERO }).collect()
}
