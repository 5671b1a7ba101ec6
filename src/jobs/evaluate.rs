//! Measures a scene on held-out photos: colors and depth.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::ColorType;

use super::changed::ChangedScene;
use super::held_out::{held_out, naming, refuse_holdout};
use super::{JobError, Scene, export, open};
use crate::io::{self, IoError};
use crate::math::format::things;
use crate::math::stats::median;
use crate::pipeline::depth::{self, DepthCounter, DepthScores};
use crate::pipeline::evaluate::scores;
use crate::pipeline::evaluate_fitted::HeldOutFit;
use crate::pipeline::observer::{Evaluation, Observer, Severity, Ticker, ViewScore};
use crate::pipeline::train::TrainView;
use crate::pipeline::train::border::Borders;
use crate::render::{Features, RenderSettings, Renderer};
use crate::scene::{Camera, Dataset, FittedParts, FittedScore, GaussianCloud};

/// The difference picture shows errors this many times larger.
const DIFFERENCE_GAIN: i32 = 4;

/// Options of a comparison; the defaults are those of training.
#[derive(Clone, Debug, Default)]
pub(crate) struct EvaluateOptions {
    /// Longer side of the compared pictures in px.
    pub(crate) max_side_px: Option<u32>,
    /// Every n-th photo is held out; 0 = all photos.
    pub(crate) holdout_every: Option<usize>,
    /// True if the black borders of photos that were undistorted elsewhere are compared, too.
    pub(crate) keep_borders: bool,
    /// Folder for pictures: photo, render and difference side by side.
    pub(crate) pictures: Option<PathBuf>,
    /// Parts of each photo that are fitted for a second score, beside what training learned of its own photos.
    pub(crate) fit: FittedParts,
}

/// A scene beside the photos that it is compared with.
pub(crate) struct PhotoComparison {
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) settings: RenderSettings,
    pub(crate) dataset: Arc<Dataset>,
    pub(crate) views: Vec<usize>,
    /// For each of `views`, whether the scene was trained on it, by its own record.
    pub(crate) trained_on: Vec<bool>,
    pub(crate) max_side_px: u32,
    /// Borders of the photos, which are left out.
    pub(crate) borders: Option<Borders>,
    pub(crate) pictures: Option<PathBuf>,
    /// Id of the save that the scene's files belong to.
    pub(crate) state: Option<String>,
    /// Differences between the scene and its photos.
    pub(crate) changed: ChangedScene,
    /// Parts of each photo that are fitted for a second score.
    pub(crate) fit: Option<FittedParts>,
}

impl PhotoComparison {
    /// Prepares the comparison of `scene` with the data set at `photos`.
    pub(crate) fn new(scene: &Scene, photos: &Path, options: EvaluateOptions) -> Result<Self, JobError> {
        Self::of(scene, Arc::new(open::dataset(photos)?), options)
    }

    /// Prepares the comparison of `scene` with the photos of `dataset`.
    pub(crate) fn of(scene: &Scene, dataset: Arc<Dataset>, options: EvaluateOptions) -> Result<Self, JobError> {
        let EvaluateOptions { max_side_px, holdout_every, keep_borders, pictures, fit } = options;
        let dataset = match dataset.with_alpha(scene.config.alpha) {
            Cow::Borrowed(_) => dataset,
            Cow::Owned(other) => Arc::new(other),
        };
        let default_every = scene.config.holdout_every;
        if let Some(1..) = holdout_every {
            refuse_holdout(&dataset)?;
        }
        let views = match holdout_every {
            Some(0) => (0..dataset.photos.len()).collect(),
            every => held_out(&dataset, &scene.cameras, every, default_every),
        };
        if views.is_empty() {
            return Err(JobError::NothingHeldOut(dataset.root.clone()));
        }
        let max_side_px = max_side_px.unwrap_or(scene.config.max_side_px);
        let (training, _) = dataset.split(holdout_every.unwrap_or(default_every));
        let borders = if keep_borders { None } else { Some(Borders::of(&dataset, &training, max_side_px)?) };
        let (cloud, settings) = (Arc::clone(&scene.cloud), scene.settings_beside(&dataset));
        let is_of = naming(&dataset, &scene.cameras);
        let seen = |i: &usize| {
            let name = &dataset.photos[*i].name;
            scene.cameras.iter().any(|c| !c.held_out && is_of(&c.name, name))
        };
        let trained_on = views.iter().map(seen).collect();
        let (state, changed) = (scene.state.clone(), ChangedScene::of(scene, &dataset));
        let learned = scene.config.held_out_fit().unwrap_or_default();
        let fit = FittedParts { pose: fit.pose || learned.pose, exposure: fit.exposure || learned.exposure }.some();
        Ok(Self { cloud, settings, dataset, views, trained_on, max_side_px, borders, pictures, state, changed, fit })
    }

    pub(crate) fn view(&self, index: usize) -> Result<TrainView, JobError> {
        let photo = &self.dataset.photos[index];
        let mut pixels = match &self.borders {
            Some(borders) => borders.load(photo)?,
            None => io::photo::load(photo, self.max_side_px)?,
        };
        let camera = photo.camera.resized(pixels.width_px, pixels.height_px);
        self.changed.leave_out(&mut pixels, &camera, &self.settings)?;
        Ok(TrainView { name: photo.name.clone(), camera, pixels })
    }

    /// Calls `each` with every photo, and reports progress.
    fn walk(
        &self,
        stage: &str,
        observer: &mut dyn Observer,
        mut each: impl FnMut(usize) -> Result<(), JobError>,
    ) -> Result<(), JobError> {
        let mut ticker = Ticker::new(stage, self.views.len());
        for (done, &index) in self.views.iter().enumerate() {
            ticker.proceed(observer)?;
            each(index)?;
            ticker.report(done as u64 + 1, observer);
        }
        Ok(())
    }
}

/// Measures PSNR and SSIM of every view, one at a time so that memory holds one photo. Writes the pictures.
pub(crate) fn photometric(comparison: &PhotoComparison, observer: &mut dyn Observer) -> Result<Evaluation, JobError> {
    for warning in &comparison.dataset.warnings {
        observer.note(Severity::Warning, warning.clone());
    }
    if let Some((severity, text)) = comparison.changed.notice() {
        observer.note(severity, text);
    }
    let PhotoComparison { cloud, settings, .. } = comparison;
    let mut renderer = Renderer::new();
    let mut views: Vec<ViewScore> = Vec::with_capacity(comparison.views.len());
    let mut fit = match comparison.fit {
        Some(parts) => Some((parts, HeldOutFit::new(Arc::clone(cloud), settings, parts)?, Vec::new())),
        None => None,
    };
    let mut left_out = None;
    comparison.walk("Measuring", observer, |index| {
        let view = match comparison.view(index) {
            Err(nothing @ JobError::Io(IoError::NothingShown { .. })) => {
                left_out = Some(nothing);
                return Ok(());
            }
            view => view?,
        };
        let draw = |camera: &Camera| renderer.render(cloud, Features::NONE, camera, settings);
        views.extend(scores(std::slice::from_ref(&view), draw)?);
        if let Some((_, fit, fitted)) = &mut fit {
            fitted.extend(fit.score(&view)?);
        }
        if let Some(folder) = &comparison.pictures {
            export::make_folder(folder)?;
            side_by_side(cloud, settings, &view, &folder.join(picture_name(index, &view.name)))?;
        }
        Ok(())
    })?;
    if let Some(last) = left_out {
        let n = comparison.views.len() - views.len();
        if views.is_empty() {
            return Err(last);
        }
        observer.note(Severity::Warning, format!("{} left out: {last}", things(n, "photo")));
    }
    let fitted = fit.map(|(parts, _, views)| FittedScore::of(parts, views));
    Ok(Evaluation { fitted, ..Evaluation::of(views, cloud.len(), 0, 0.0) })
}

/// Compares drawn depth with the true depth of synthetic photos; returns the median milliseconds of drawing it, too.
pub(crate) fn depth(comparison: &PhotoComparison, observer: &mut dyn Observer) -> Result<(DepthScores, f64), JobError> {
    let mut renderer = Renderer::new();
    let mut counter = DepthCounter::default();
    let mut millis = Vec::with_capacity(comparison.views.len());
    comparison.walk("Measuring depth", observer, |index| {
        let photo = &comparison.dataset.photos[index];
        let truth = depth::of_photo(&comparison.dataset.root, photo)?;
        let camera = photo.camera.limited_to(comparison.max_side_px);
        counter.draw(&mut renderer, &comparison.cloud, &camera, &comparison.settings, &truth)?;
        millis.push(renderer.stats().stage_secs.iter().sum::<f64>() * 1e3);
        Ok(())
    })?;
    Ok((counter.scores(), median(&millis)))
}

/// Returns `012_images_0012.png` for photo 12, `images/0012.jpg`: sorted, and safe as a file name.
fn picture_name(index: usize, photo: &str) -> String {
    let stem = photo.rsplit_once('.').map_or(photo, |(stem, _)| stem);
    let safe: String = stem.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect();
    format!("{index:03}_{safe}.png")
}

/// Writes photo, render and amplified difference side by side.
fn side_by_side(
    cloud: &GaussianCloud,
    settings: &RenderSettings,
    view: &TrainView,
    path: &Path,
) -> Result<(), JobError> {
    let frame = Renderer::new().render(cloud, Features::NONE, &view.camera, settings)?;
    let mut render = frame.to_rgb8();
    let width = frame.width_px;
    let difference = |(a, b): (&[u8; 3], &[u8; 3])| {
        std::array::from_fn(|c| ((i32::from(a[c]) - i32::from(b[c])).abs() * DIFFERENCE_GAIN).min(255) as u8)
    };
    let mut pixels: Vec<[u8; 3]> = Vec::with_capacity(3 * render.len());
    if let Some(coverage) = &view.pixels.coverage {
        render.iter_mut().zip(coverage).filter(|(_, c)| **c == 0).for_each(|(rgb, _)| *rgb = [0; 3]);
    }
    for (photo_row, render_row) in view.pixels.rgb.chunks_exact(width).zip(render.chunks_exact(width)) {
        pixels.extend_from_slice(photo_row);
        pixels.extend_from_slice(render_row);
        pixels.extend(photo_row.iter().zip(render_row).map(difference));
    }
    let size = [3 * frame.width_px as u32, frame.height_px as u32];
    Ok(export::png(path, pixels.as_flattened(), size, ColorType::Rgb8)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn picture_names_are_safe() {
        assert_eq!(picture_name(7, "images/../a b.JPG"), "007_images____a_b.png");
        assert_eq!(picture_name(1234, "x"), "1234_x.png");
    }
}
