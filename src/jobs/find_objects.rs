//! Finding the objects and parts of a trained scene, and storing them with it.

pub(crate) mod forecast;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use self::forecast::LookTime;
use super::{JobError, evaluate};
use crate::io::trained::{self, CLOUD_FILE};
use crate::io::{IoError, SceneFolder, splat_ply};
use crate::models;
use crate::models::catalog::{self, ModelRole, SAM2};
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::semantics::build_map::{
    CODE_STEPS, Carry, FindOptions, Found, REGIONS, Tools, find_objects, segmenter,
};
use crate::pipeline::semantics::sam2_tracker::Sam2Tracker;
use crate::pipeline::semantics::tracker::TrackOptions;
use crate::render::RenderSettings;
use crate::scene::{Dataset, GaussianCloud, Photo, Preparation};

/// Name of the encoder that is none.
pub(crate) const NO_ENCODER: &str = "none";

/// How objects are found. Models that are not named are the best that are here.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct FindSettings {
    /// What finds masks where none came with the photos.
    pub segmenter: Option<String>,
    /// What carries them to the other photos.
    pub carry: Carry,
    /// The SAM 2 that follows masks.
    pub tracker: String,
    /// The encoder for open-vocabulary queries, or [`NO_ENCODER`].
    pub encoder: Option<String>,
    /// How Gaussians get their codes, how far parts are deviated, and what SAM 2 is prompted by.
    pub preparation: Preparation,
    /// Steps of training codes.
    pub code_steps: u64,
    /// Photo to begin with, by name; `None` = the first with masks.
    pub seed: Option<String>,
    /// Most photos whose masks are used.
    pub max_seeds: usize,
    /// Share of a photo that may stay unknown before its masks are used too.
    pub unknown_share: f64,
}

impl Default for FindSettings {
    fn default() -> Self {
        let TrackOptions { max_seeds, reseed_share, .. } = TrackOptions::default();
        Self {
            segmenter: None,
            carry: Carry::default(),
            tracker: SAM2.into(),
            encoder: None,
            preparation: Preparation::default(),
            code_steps: CODE_STEPS,
            seed: None,
            max_seeds,
            unknown_share: reseed_share,
        }
    }
}

/// A scene whose objects are to be found.
#[derive(Clone, Debug)]
pub struct FindRequest {
    /// Folder of the trained scene.
    pub folder: PathBuf,
    /// Its Gaussians.
    pub cloud: Arc<GaussianCloud>,
    /// How they are drawn.
    pub settings: RenderSettings,
    /// The photos.
    pub dataset: Arc<Dataset>,
    /// Every how-manieth photo is held out, if the scene does not say which.
    pub holdout_every: usize,
    /// Where masks are; `None` = they are found.
    pub masks: Option<PathBuf>,
    /// Longer side of the pictures that are looked at, px.
    pub side_px: u32,
    /// How.
    pub with: FindSettings,
}

/// Objects and parts that were found and stored.
#[derive(Clone, Debug)]
pub(crate) struct FoundObjects {
    pub(crate) found: Found,
    /// The photos that were looked at; what was found counts them.
    pub(crate) photos: Vec<Photo>,
    pub(crate) state: String,
    pub(crate) secs: f64,
}

/// Finds objects and parts of the scene in the state `known`, and stores them. Held-out photos are never used.
pub(crate) fn run(
    request: &FindRequest,
    known: Option<&str>,
    observer: &mut dyn Observer,
) -> Result<FoundObjects, JobError> {
    let FindRequest { folder, cloud, settings, dataset, with, .. } = request;
    let masks = request.masks.as_deref();
    if !trained::is_scene(folder) {
        return Err(JobError::NoScene(folder.into()));
    }
    // Held from the beginning: nobody waits for objects that cannot be stored.
    let scene = SceneFolder::hold(folder, "finding objects")?;
    if splat_ply::state(&folder.join(CLOUD_FILE))?.as_deref() != known {
        return Err(IoError::Changed { folder: folder.into() }.into());
    }
    let cameras = trained::load_info(folder)?.cameras;
    let held = evaluate::held_out(dataset, &cameras, None, request.holdout_every);
    let all = dataset.photos.iter().enumerate();
    let photos: Vec<Photo> = all.filter(|(i, _)| !held.contains(i)).map(|(_, p)| p.clone()).collect();
    let unknown = |name: &String| JobError::UnknownPhoto(name.clone());
    let place = |name: &String| photos.iter().position(|p| p.name.contains(name.as_str())).ok_or_else(|| unknown(name));
    let options = FindOptions {
        track: TrackOptions {
            seed: with.seed.as_ref().map(place).transpose()?,
            max_seeds: with.max_seeds.max(1),
            reseed_share: with.unknown_share,
            veto: with.carry == Carry::Both,
            max_side_px: request.side_px,
            prompt: with.preparation.prompt.unwrap_or_default(),
            ..TrackOptions::default()
        },
        lifting: with.preparation.lifting,
        code_steps: with.code_steps,
        part_weight: with.preparation.part_weight,
    };
    let mut warn = |text: String| observer.note(Severity::Warning, text);
    let network = match (masks, with.segmenter.as_deref()) {
        (Some(_), _) | (None, Some(REGIONS)) => None,
        (None, Some(name)) => Some(name.to_owned()),
        (None, None) => catalog::usable(ModelRole::Segmenter, &mut warn)?.into_iter().next(),
    };
    let mut segmenter = segmenter(masks, cloud, settings, network.as_deref(), folder.join("cache"))?;
    let mut encoder = match with.encoder.as_deref() {
        Some(NO_ENCODER) => None,
        Some(name) => Some(models::encoder(name)?),
        // Without an encoder, names alone are understood.
        None => models::best_encoder(&mut warn)
            .inspect_err(|e| warn(format!("Objects are found without embeddings: {e}")))
            .ok(),
    };
    if let Some(look) = network.as_deref().and_then(LookTime::of_installed) {
        let most = photos.len().min(options.track.max_seeds);
        observer.note(Severity::Info, forecast::sentence(look, most));
    }
    let mut follower = match with.carry {
        Carry::Gaussians => None,
        _ => Some(Sam2Tracker::open(&with.tracker, Some(folder.join("cache")))?),
    };
    let start = Instant::now();
    let tools = Tools { segmenter: &mut *segmenter, follower: follower.as_mut(), encoder: encoder.as_deref_mut() };
    let found = find_objects(cloud, &photos, settings, tools, &options, observer)?;
    let (kept, state) = scene.replace_map(known, &found.map, cloud)?;
    if let Some(kept) = kept {
        observer.note(Severity::Info, format!("The previous objects and parts are kept in {}", kept.display()));
    }
    Ok(FoundObjects { found, photos, state, secs: start.elapsed().as_secs_f64() })
}
