//! Finds the objects and parts of a trained scene, and stores them with it.

pub(crate) mod forecast;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use serde::{Deserialize, Serialize};
use strum::VariantArray;

use self::forecast::InferenceEstimate;
use super::JobError;
use super::held_out::held_out;
use super::refined::at_refined_poses;
use crate::io::labels::Labels;
use crate::io::trained::{self, CLOUD_FILE};
use crate::io::{IoError, SceneFolder, semantic_map, splat_ply};
use crate::math::format::things;
use crate::models;
use crate::models::catalog::{self, ModelRole, SAM2};
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::semantics::lifting::build_map::{
    CODE_STEPS, FindOptions, Found, MaskPropagation, REGIONS, SearchModels, find_objects, segmenter,
};
use crate::pipeline::semantics::lifting::keep;
use crate::pipeline::semantics::lifting::sam2_tracker::Sam2Tracker;
use crate::pipeline::semantics::lifting::tracker::TrackOptions;
use crate::pipeline::semantics::query::recipe::RecipeName;
use crate::render::RenderSettings;
use crate::scene::{Dataset, GaussianCloud, Photo, Preparation, SemanticMap};

/// Name for no encoder.
pub(crate) const NO_ENCODER: &str = "none";

/// Settings of finding objects. Models without a name default to the best installed ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct FindSettings {
    /// Segmenter of photos that came without masks.
    pub segmenter: Option<String>,
    /// Method that carries masks to the other photos.
    pub carry: MaskPropagation,
    /// Name of the SAM 2 that tracks masks.
    pub tracker: String,
    /// The encoder for open-vocabulary queries, or [`NO_ENCODER`].
    pub encoder: Option<String>,
    /// Lifting of codes to Gaussians, weight of parts' deviation, and prompts of SAM 2.
    pub preparation: Preparation,
    /// Steps of training codes.
    pub code_steps: u64,
    /// Photo to begin with, by name; `None` = the first with masks.
    pub seed: Option<String>,
    /// Most photos whose masks are used.
    pub max_seeds: usize,
    /// Share of a photo that may stay unknown before its masks are used too.
    pub unknown_share: f64,
    /// True if objects and parts that the user has edited are found anew, too; else they are kept.
    #[serde(skip)]
    pub replace_all: bool,
    /// True if vectors that came with the masks go before `encoder`.
    #[serde(skip)]
    pub vectors_first: bool,
}

impl Default for FindSettings {
    fn default() -> Self {
        let TrackOptions { max_seeds, reseed_share, .. } = TrackOptions::default();
        Self {
            segmenter: None,
            carry: MaskPropagation::default(),
            tracker: SAM2.into(),
            encoder: None,
            preparation: Preparation::default(),
            code_steps: CODE_STEPS,
            seed: None,
            max_seeds,
            unknown_share: reseed_share,
            replace_all: false,
            vectors_first: false,
        }
    }
}

/// A scene to find objects in.
#[derive(Clone, Debug)]
pub struct FindRequest {
    /// Folder of the trained scene.
    pub folder: PathBuf,
    /// Its Gaussians.
    pub cloud: Arc<GaussianCloud>,
    /// Its render settings.
    pub settings: RenderSettings,
    /// The photos.
    pub dataset: Arc<Dataset>,
    /// Every n-th photo is held out, if the scene does not say which.
    pub holdout_every: usize,
    /// Folder of masks; `None` = they are found.
    pub masks: Option<PathBuf>,
    /// Objects and parts that are kept: unlabeled things that the first photo shows are added.
    pub known: Option<Arc<SemanticMap>>,
    /// Longer side in px of the pictures for networks.
    pub side_px: u32,
    /// Settings of the search.
    pub with: FindSettings,
}

/// Objects and parts that were found and stored.
#[derive(Clone, Debug)]
pub(crate) struct FoundObjects {
    pub(crate) found: Found,
    /// The photos in use; `found` refers to them by index.
    pub(crate) photos: Vec<Photo>,
    /// Names of kept identities, which the user had edited before.
    pub(crate) kept: Vec<String>,
    pub(crate) state: String,
    pub(crate) secs: f64,
    /// Labels that were skipped, unused or joined.
    pub(crate) warnings: Vec<String>,
}

/// Describes the search: the recipe's name, if it has one, and its choices.
fn summary(with: &FindSettings, preparation: Preparation, masks: &str, encoder: Option<&str>) -> String {
    let Preparation { lifting, part_weight, prompt, .. } = preparation;
    let named = |name: &&RecipeName| name.recipe().preparation == preparation;
    let name = RecipeName::VARIANTS.iter().find(named).map_or_else(|| "own".to_owned(), RecipeName::to_string);
    let prompt = prompt.unwrap_or_default();
    let carried = match with.carry {
        MaskPropagation::Gaussians => "the Gaussians".to_owned(),
        MaskPropagation::Sam2 => format!("{} (prompted by {prompt}) and the Gaussians", with.tracker),
        MaskPropagation::Both => {
            format!("{} (prompted by {prompt}) and the Gaussians, each correcting the other", with.tracker)
        }
    };
    format!(
        "recipe {name}: masks by {masks}, carried to the other photos by {carried}, lifting {lifting}, embeddings by {} \
         (part weight {part_weight})",
        encoder.unwrap_or("no encoder")
    )
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
    // Held from the beginning: objects must not be found and then fail to be stored.
    let scene = SceneFolder::hold(folder, "finding objects")?;
    if splat_ply::state(&folder.join(CLOUD_FILE))?.as_deref() != known {
        return Err(IoError::Changed { folder: folder.into() }.into());
    }
    let before = before(folder, observer);
    let keep = before.as_ref().filter(|_| request.known.is_none() && !with.replace_all).and_then(keep::worked_on);
    let kept = keep.as_ref().map_or_else(Vec::new, by_hand);
    if !kept.is_empty() {
        observer.note(Severity::Info, kept_text(&kept));
    }
    let (removed, removed_names) = gone(before.as_ref(), observer);
    let info = trained::load_info(folder)?;
    let held = held_out(dataset, &info.cameras, None, request.holdout_every);
    let all = dataset.photos.iter().enumerate();
    let mut photos: Vec<Photo> = all.filter(|(i, _)| !held.contains(i)).map(|(_, p)| p.clone()).collect();
    at_refined_poses(&mut photos, &info);
    let place = |name: &String| {
        if held.iter().any(|i| dataset.photos[*i].name == *name) {
            return Err(JobError::HeldOut(name.clone()));
        }
        let exact = photos.iter().position(|p| p.name == *name);
        let place = exact.or_else(|| photos.iter().position(|p| p.name.contains(name.as_str())));
        place.ok_or_else(|| JobError::UnknownPhoto(name.clone()))
    };
    // Additions are prepared as the rest was.
    let preparation = request.known.as_ref().and_then(|map| map.prepared).unwrap_or(with.preparation);
    let options = FindOptions {
        track: TrackOptions {
            seed: with.seed.as_ref().map(place).transpose()?,
            max_seeds: if request.known.is_some() { 1 } else { with.max_seeds.max(1) },
            reseed_share: with.unknown_share,
            veto: with.carry == MaskPropagation::Both,
            max_side_px: request.side_px,
            prompt: preparation.prompt.unwrap_or_default(),
            known: request.known.clone(),
            removed: removed.clone(),
            removed_names,
            ..TrackOptions::default()
        },
        lifting: preparation.lifting,
        code_steps: with.code_steps,
        part_weight: preparation.part_weight,
        grid: None,
        encoder_of_masks: None,
        keep: keep.map(Arc::new),
    };
    let labels = masks.map(|path| Labels::of_photos(path, &dataset.photos)).transpose()?;
    let mut warnings = labels.as_ref().map_or_else(Vec::new, |labels| labels.notes().to_vec());
    let labels_of_held = |labels: &Labels| held.iter().filter(|i| labels.has(&dataset.photos[**i])).count();
    match labels.as_ref().map_or(0, labels_of_held) {
        0 => {}
        _ if labels.as_ref().is_some_and(|labels| photos.iter().any(|p| labels.has(p))) => {}
        n => warnings.push(format!(
            "All labels are of {}, whose labels are not used; label others, or train with other photos held out",
            things(n, "held-out photo")
        )),
    }
    warnings.iter().for_each(|text| observer.note(Severity::Warning, text.clone()));
    let labels = match (labels, &request.known, options.track.seed) {
        (Some(labels), Some(_), Some(seed)) if !labels.has(&photos[seed]) => {
            let path = masks.unwrap_or(folder);
            let text = format!("{} has no labels of {}: it is segmented instead", path.display(), photos[seed].name);
            observer.note(Severity::Info, text);
            None
        }
        (labels, ..) => labels,
    };
    let mut warn = |text: String| observer.note(Severity::Warning, text);
    let network = match (&labels, with.segmenter.as_deref()) {
        (Some(_), _) | (None, Some(REGIONS)) => None,
        (None, Some(name)) => Some(name.to_owned()),
        (None, None) => catalog::usable(ModelRole::Segmenter, &mut warn)?.into_iter().next(),
    };
    let network = network.map(|name| (name, preparation.grid.unwrap_or_default()));
    let options = FindOptions { grid: network.as_ref().map(|(_, grid)| *grid), ..options };
    let network = network.as_ref().map(|(name, grid)| (name.as_str(), *grid));
    let by_files = labels.as_ref().map(|_| "files");
    let of_masks = labels.as_ref().and_then(Labels::encoder);
    let mut segmenter = segmenter(labels, cloud, settings, network, folder.join("cache"))?;
    // Additions use the encoder of the rest.
    let looked = |map: &Arc<SemanticMap>| map.language.as_ref().map_or(NO_ENCODER.to_owned(), |l| l.encoder.clone());
    let encoder = request.known.as_ref().map(looked).or_else(|| with.encoder.clone());
    // Vectors that came with the masks need no network, unless an encoder is asked for.
    let of_masks = of_masks.filter(|own| match &request.known {
        Some(_) => encoder.as_deref() == Some(*own),
        None => encoder.is_none() || with.vectors_first,
    });
    let options = FindOptions { encoder_of_masks: of_masks, ..options };
    let mut encoder = match encoder.as_deref() {
        Some(NO_ENCODER) => None,
        _ if of_masks.is_some() => None,
        Some(name) => Some(models::encoder(name)?),
        // Without an encoder, names alone are understood.
        None => models::best_encoder(&mut warn)
            .inspect_err(|e| warn(format!("Objects are found without embeddings: {e}")))
            .ok(),
    };
    let by = network.map(|(name, _)| name).or(by_files).unwrap_or(REGIONS);
    let looks = encoder.as_ref().map(|e| e.name().to_owned());
    let looks = looks.or_else(|| of_masks.map(|name| format!("the vectors of the masks ({name})")));
    observer.note(Severity::Info, summary(with, preparation, by, looks.as_deref()));
    if let Some(look) = network.and_then(|(name, _)| InferenceEstimate::of_installed(name)) {
        let most = photos.len().min(options.track.max_seeds);
        observer.note(Severity::Info, forecast::sentence(look, most));
    }
    if with.carry != MaskPropagation::Gaussians && request.known.is_none() {
        let text = forecast::tracking(&with.tracker, photos.len());
        text.into_iter().for_each(|text| observer.note(Severity::Info, text));
    }
    let mut follower = match with.carry {
        _ if request.known.is_some() => None,
        MaskPropagation::Gaussians => None,
        _ => Some(Sam2Tracker::open(&with.tracker, Some(folder.join("cache")))?),
    };
    let start = Instant::now();
    let models =
        SearchModels { segmenter: &mut *segmenter, follower: follower.as_mut(), encoder: encoder.as_deref_mut() };
    let mut found = find_objects(cloud, &photos, settings, models, &options, observer)?;
    let names = before.map(|map| map.identities.removed).unwrap_or_default();
    found.map.identities.add_removed(names);
    found.map.removed = removed;
    let (earlier, state) = scene.replace_map(known, &found.map, cloud)?;
    if let Some(earlier) = earlier {
        observer.note(Severity::Info, format!("The previous objects and parts are kept in {}", earlier.display()));
    }
    Ok(FoundObjects { found, photos, kept, state, secs: start.elapsed().as_secs_f64(), warnings })
}

/// Loads the objects and parts stored with the scene in a folder; `None` if there are none, or they are broken.
fn before(folder: &Path, observer: &mut dyn Observer) -> Option<SemanticMap> {
    // Not those of the request: its Gaussians may have lost their identities by now.
    let map = trained::load(folder).and_then(|scene| semantic_map::load(folder, scene.state.as_deref(), &scene.cloud));
    map.inspect_err(|e| observer.note(Severity::Warning, format!("Nothing is kept of the objects before: {e}"))).ok()?
}

/// Returns the removed Gaussians of a scene, and names of removed things whose Gaussians were not kept.
fn gone(before: Option<&SemanticMap>, observer: &mut dyn Observer) -> (Option<Arc<GaussianCloud>>, Vec<String>) {
    let is_whole = |map: &&SemanticMap| map.identities.removed.is_empty() && map.removed.is_none();
    let Some(map) = before.filter(|map| !is_whole(map)) else { return (None, Vec::new()) };
    let names = removed_names(&map.identities.removed);
    if map.removed.is_some() {
        let text =
            format!("What was removed ({names}) is not looked for: where photos still show it, they are left out");
        observer.note(Severity::Info, text);
        return (map.removed.clone(), Vec::new());
    }
    let text = format!(
        "{names} was removed by a version that did not keep where it was: masks of that name are left out, others may find \
         it again"
    );
    observer.note(Severity::Warning, text);
    let is_left = |name: &String| map.identities.iter().any(|(_, i)| i.names.contains(name));
    (None, map.identities.removed.iter().filter(|name| !is_left(name)).cloned().collect())
}

/// Lists the removed things in words, also if none has a name.
pub(crate) fn removed_names(names: &[String]) -> String {
    if names.is_empty() { "a thing without a name".to_owned() } else { listed(names) }
}

/// Returns full names of identities that the user has edited.
pub(crate) fn by_hand(map: &SemanticMap) -> Vec<String> {
    map.by_hand().into_iter().map(|id| map.identities.full_name(id)).collect()
}

/// Most names that are listed in a sentence.
const LISTED: usize = 6;

/// Joins some of these names, and the number of the others: "lamp, mug and 3 more".
pub(crate) fn listed(names: &[String]) -> String {
    match names.len().checked_sub(LISTED).filter(|more| *more > 0) {
        Some(more) => format!("{} and {more} more", names[..LISTED].join(", ")),
        None => names.join(", "),
    }
}

fn kept_text(names: &[String]) -> String {
    format!(
        "Kept as it was, with its parts and its whole: what was named, selected or corrected by hand ({} in all: {})",
        names.len(),
        listed(names)
    )
}
