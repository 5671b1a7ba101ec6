//! Views that scenes are compared in: photos of a data set or of the first scene that has cameras, with their labels.

use std::path::{Path, PathBuf};

use super::subject::CompareSubject;
use crate::io::labels::{Labels, stem};
use crate::jobs::{JobError, open, render};
use crate::pipeline::observer::Silent;
use crate::pipeline::semantics::evaluation::{Category, categories};
use crate::pipeline::semantics::lifting::segmenter::{FileMasks, Segmenter};
use crate::scene::identity::whole_names::BETWEEN;
use crate::scene::{Camera, Photo};

/// Names of missing labels that an error lists.
const LISTED: usize = 4;

/// Choice of views.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum WantedViews {
    /// Photos by index or name, with commas between; 'all' for all.
    Listed(String),
    /// Photos of these names.
    Named(Vec<String>),
    /// All photos with labels.
    Labeled,
}

/// Request for views.
#[derive(Clone, Debug)]
pub(crate) struct ViewChoice {
    pub(crate) wanted: WantedViews,
    /// Data set with the photos; else that of the first scene that has one, or its cameras.
    pub(crate) photos: Option<PathBuf>,
    /// Labels of the photos.
    pub(crate) truth: Option<PathBuf>,
    /// Longer side of the views at most, px.
    pub(crate) max_side_px: u32,
}

/// A view that scenes are compared in.
#[derive(Clone, Debug)]
pub(crate) struct ComparedView {
    /// Name of its photo.
    pub(crate) name: String,
    /// One camera for each scene, all of one size: that of its own photo of this name, else the view's.
    pub(crate) cameras: Vec<Camera>,
    /// Labels, if the photo has any.
    pub(crate) truth: Option<Vec<Category>>,
}

impl ComparedView {
    /// The label that a phrase names; a part by its full name, or as "X of the Y".
    pub(crate) fn category(&self, phrase: &str) -> Option<&Category> {
        let wanted = phrase.trim().to_lowercase();
        let is = |name: &str| name.to_lowercase() == wanted;
        self.truth.as_ref()?.iter().find(|category| is(&category.name) || is(&as_phrase(&category.name)))
    }
}

/// A full name as people say it: "X of the Y".
pub(crate) fn as_phrase(name: &str) -> String {
    name.split(BETWEEN).collect::<Vec<_>>().join(" of the ")
}

/// Chooses the views. Also returns notes on labels, a sentence each.
///
/// # Errors
/// If there are no cameras, a photo is not found, or labels cannot be read or belong to none of the views.
pub(crate) fn choose(
    scenes: &[CompareSubject],
    request: &ViewChoice,
) -> Result<(Vec<ComparedView>, Vec<String>), JobError> {
    let photos = photos_of(scenes, request.photos.as_deref())?;
    let mut notes = Vec::new();
    let mut labels = None;
    if let Some(path) = &request.truth {
        let known = Labels::of_photos(path, &photos)?;
        notes.extend(known.notes().iter().cloned());
        labels = Some((path, FileMasks(known)));
    }
    let has_labels = |photo: &Photo| labels.as_ref().is_some_and(|(_, masks)| masks.covers(photo));
    let chosen: Vec<&Photo> = match &request.wanted {
        WantedViews::Labeled => photos.iter().filter(|photo| has_labels(photo)).collect(),
        WantedViews::Named(names) => names.iter().map(|name| named(name, &photos)).collect::<Result<_, _>>()?,
        WantedViews::Listed(list) if list.trim() == "all" => photos.iter().collect(),
        WantedViews::Listed(list) => {
            let names = list.split(',').map(str::trim).filter(|name| !name.is_empty());
            names.map(|name| named(name, &photos)).collect::<Result<_, _>>()?
        }
    };
    if let Some((path, _)) = &labels {
        let without: Vec<&str> = chosen.iter().filter(|p| !has_labels(p)).map(|p| p.name.as_str()).collect();
        if without.len() == chosen.len() {
            let all = if chosen.is_empty() { photos.iter().map(|p| p.name.as_str()).collect() } else { without };
            let names = all.iter().take(LISTED).map(|name| format!("'{name}'")).collect::<Vec<_>>().join(", ");
            let path = path.display();
            return Err(JobError::Protocol(format!(
                "{path}: no labels of any of the views; wanted are those of {names}"
            )));
        }
        notes.extend(without.iter().map(|name| format!("{}: no labels of the view '{name}'", path.display())));
    }
    let mut views = Vec::with_capacity(chosen.len());
    for photo in chosen {
        let camera = photo.camera.limited_to(request.max_side_px);
        render::check_room(camera.width_px, camera.height_px)?;
        let truth = match &mut labels {
            Some((_, masks)) if masks.covers(photo) => {
                Some(categories(&masks.segment(photo, request.max_side_px, &mut Silent)?))
            }
            _ => None,
        };
        let cameras = scenes.iter().map(|scene| camera_of(scene, &photo.name, &camera)).collect();
        views.push(ComparedView { name: photo.name.clone(), cameras, truth });
    }
    if views.is_empty() {
        return Err(JobError::Phrases("no view is named".into()));
    }
    Ok((views, notes))
}

/// Photos of the data set, or those that the first scene with cameras knows.
fn photos_of(scenes: &[CompareSubject], given: Option<&Path>) -> Result<Vec<Photo>, JobError> {
    if let Some(path) = given.or_else(|| scenes.iter().find_map(|s| s.photos.as_deref())) {
        return Ok(open::dataset(path)?.photos);
    }
    let Some(first) = scenes.iter().find(|scene| !scene.cameras.is_empty()) else {
        let text = "none of these has cameras to look from; give the photos' data set with --photos";
        return Err(JobError::Phrases(text.into()));
    };
    Ok(first.cameras.iter().map(|c| Photo::new(&*c.name, PathBuf::new(), c.camera.clone())).collect())
}

/// The photo of this name or index.
fn named<'a>(wanted: &str, photos: &'a [Photo]) -> Result<&'a Photo, JobError> {
    let by_index = || wanted.parse::<usize>().ok().and_then(|k| photos.get(k));
    let mut by_stem = photos.iter().filter(|photo| stem(&photo.name) == stem(wanted));
    let by_stem = by_stem.next().filter(|_| by_stem.next().is_none());
    let found = photos.iter().find(|photo| photo.name == wanted).or_else(by_index).or(by_stem);
    found.ok_or_else(|| {
        let last = photos.len().saturating_sub(1);
        let names = photos.first().zip(photos.last()).map(|(a, b)| format!(" or '{}' to '{}'", a.name, b.name));
        let names = names.unwrap_or_default();
        JobError::Phrases(format!("--views: no photo is called '{wanted}'; photos are 0 to {last}{names}"))
    })
}

/// The scene's own camera of a photo, in the size of the view's, so that scenes in coordinates of their own show the
/// same; else the view's camera.
fn camera_of(scene: &CompareSubject, name: &str, view: &Camera) -> Camera {
    let mut same = scene.cameras.iter().filter(|c| stem(&c.name) == stem(name));
    let alike = same.next().filter(|_| same.next().is_none());
    let own = scene.cameras.iter().find(|c| c.name == name).or(alike).map(|c| &c.camera);
    let shape = |camera: &Camera| f64::from(camera.width_px) / f64::from(camera.height_px);
    let is_like = |camera: &&Camera| (shape(camera) / shape(view) - 1.0).abs() < 0.02;
    own.filter(is_like).map_or_else(|| view.clone(), |camera| camera.resized(view.width_px, view.height_px))
}
