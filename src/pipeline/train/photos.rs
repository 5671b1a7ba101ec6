//! Loading of training photos: undistorted, scaled, without borders.

use std::borrow::Cow;

use rayon::prelude::*;

use super::border::{Borders, unless_blank};
use super::sweep_view::common_backdrop;
use super::{TrainConfig, TrainError, TrainView, init};
use crate::io::IoError;
use crate::pipeline::observer::{Observer, Severity, Ticker};
use crate::scene::Dataset;

/// Most photo names in a warning.
const NAMED: usize = 5;

/// Reports that the data set's own held-out photos replace those of the settings.
pub(super) fn tell_marks(dataset: &Dataset, config: &TrainConfig, observer: &mut dyn Observer) {
    let (marked, every) = (dataset.test_photos(), config.holdout_every);
    if marked > 0 && every > 0 && every != TrainConfig::default().holdout_every {
        let text =
            format!("{marked} photos are marked as test and held out; that every {every}th is does not count here");
        observer.note(Severity::Warning, text);
    }
}

/// Reports the interpretation of transparent pixels and masks.
pub(super) fn tell_of_pixels(dataset: &Dataset, config: &TrainConfig, observer: &mut dyn Observer) {
    for note in dataset.pixel_notes() {
        observer.note(Severity::Info, note);
    }
    if config.alpha.is_some() && dataset.alpha.is_none() {
        let text = "--alpha changes nothing: the photos that were looked at have no transparent pixels";
        observer.note(Severity::Warning, text.into());
    }
}

/// Returns the dataset with the common edge color of its photos as background, if it states none and has no points:
/// synthetic scenes are rendered so. Otherwise training would build fog of that color around the object.
pub(super) fn before_backdrop<'a>(
    dataset: &'a Dataset,
    views: &[TrainView],
    observer: &mut dyn Observer,
) -> Cow<'a, Dataset> {
    let unknown = dataset.background.is_none() && init::lacks_points(dataset);
    let Some(color) = unknown.then(|| common_backdrop(views)).flatten() else { return Cow::Borrowed(dataset) };
    let [r, g, b] = color;
    let text = format!("The photos end in one color (#{r:02x}{g:02x}{b:02x}), which is taken for an empty background");
    observer.note(Severity::Info, text);
    let background = Some(color.map(|c| f32::from(c) / 255.0));
    Cow::Owned(Dataset { background, ..dataset.clone() })
}

/// Loads the training photos by [`load_views`]; an error if all are blank.
pub(super) fn load_training(
    dataset: &Dataset,
    indices: &[usize],
    config: &TrainConfig,
    observer: &mut dyn Observer,
) -> Result<Option<Vec<TrainView>>, TrainError> {
    let Some(mut views) = load_views(dataset, indices, config, "Loading photos", observer)? else { return Ok(None) };
    if let (true, Some(&first)) = (views.is_empty(), indices.first()) {
        let path = dataset.photos[first].path.clone();
        return Err(TrainError::Photo(IoError::NothingShown { path }));
    }
    views.shrink_to_fit();
    Ok(Some(views))
}

/// Loads and scales photos, several at a time; `None` if the observer cancels. Blank photos are left out, with a
/// warning that names them.
pub(crate) fn load_views(
    dataset: &Dataset,
    indices: &[usize],
    config: &TrainConfig,
    stage: &str,
    observer: &mut dyn Observer,
) -> Result<Option<Vec<TrainView>>, TrainError> {
    let mut ticker = Ticker::new(stage, indices.len());
    // Borders come from the training photos alone, also those of held-out photos.
    let (training, _) = dataset.split(config.holdout_every);
    let borders = Borders::of(dataset, &training, config.max_side_px).map_err(TrainError::Photo)?;
    if borders.share() > 0.0 {
        let percent = 100.0 * borders.share();
        observer.note(Severity::Info, format!("{stage}: a black border ({percent:.1} % of the image) is left out"));
    }
    let (mut views, mut blank) = (Vec::with_capacity(indices.len()), Vec::new());
    if observer.proceed().is_err() {
        return Ok(None);
    }
    for batch in indices.chunks(8) {
        let loaded: Result<Vec<Option<TrainView>>, IoError> = batch
            .par_iter()
            .map(|&i| {
                let photo = &dataset.photos[i];
                let Some(pixels) = unless_blank(borders.load(photo))? else { return Ok(None) };
                let camera = photo.camera.resized(pixels.width_px, pixels.height_px);
                Ok(Some(TrainView { name: photo.name.clone(), camera, pixels }))
            })
            .collect();
        for (&i, view) in batch.iter().zip(loaded.map_err(TrainError::Photo)?) {
            match view {
                Some(view) => views.push(view),
                None => blank.push(dataset.photos[i].name.as_str()),
            }
        }
        if ticker.tick(views.len() + blank.len(), observer).is_err() {
            return Ok(None);
        }
    }
    if !blank.is_empty() {
        let names = blank.iter().take(NAMED).copied().collect::<Vec<_>>().join(", ");
        let more = if blank.len() > NAMED { ", ..." } else { "" };
        let text = format!(
            "{stage}: {} of {} photos show nothing and are left out: every pixel is transparent, outside of its lens or \
             black in its mask ({names}{more})",
            blank.len(),
            indices.len()
        );
        observer.note(Severity::Warning, text);
    }
    Ok(Some(views))
}
