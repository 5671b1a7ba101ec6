//! Quality on held-out photos after a fit of each: of its pose to the trained scene, of its exposure to the rendering.
//!
//! Refined poses may have moved the scene, and exposures are that of no photo; a held-out photo has a part in neither.
//! The fit looks at the photo that is scored, so its figures stand beside those without a fit, never in their place.

use std::sync::Arc;

use super::evaluate::scores;
use super::locate::{LocateError, PoseAligner};
use super::observer::{Observer, Ticker, ViewScore};
use super::train::TrainView;
use crate::render::{Features, Frame, RenderSettings, Renderer};
use crate::scene::{FittedParts, FittedScore, GaussianCloud, PhotoExposure, PhotoPixels};

/// Renderings whose values are spread less than this, by standard deviation, say nothing about a gain.
const LEAST_SPREAD: f64 = 1e-4;

/// Scores of the views after the fit of these parts; `None` without parts, without views, and where the observer stops.
pub(crate) fn fitted(
    cloud: Arc<GaussianCloud>,
    settings: &RenderSettings,
    views: &[TrainView],
    parts: Option<FittedParts>,
    observer: &mut dyn Observer,
) -> Result<Option<FittedScore>, LocateError> {
    let Some(parts) = parts.filter(|_| !views.is_empty()) else { return Ok(None) };
    let mut fit = HeldOutFit::new(cloud, settings, parts)?;
    let mut ticker = Ticker::new("Fitting held-out photos", views.len());
    let mut all = Vec::with_capacity(views.len());
    for (done, view) in views.iter().enumerate() {
        all.extend(fit.score(view)?);
        if ticker.tick(done + 1, observer).is_err() {
            return Ok(None);
        }
    }
    Ok(Some(FittedScore::of(parts, all)))
}

/// A scene to which held-out photos are fitted.
pub(crate) struct HeldOutFit {
    cloud: Arc<GaussianCloud>,
    settings: RenderSettings,
    parts: FittedParts,
    aligner: PoseAligner,
    renderer: Renderer,
}

impl HeldOutFit {
    pub(crate) fn new(
        cloud: Arc<GaussianCloud>,
        settings: &RenderSettings,
        parts: FittedParts,
    ) -> Result<Self, LocateError> {
        let aligner = PoseAligner::new(Arc::clone(&cloud), settings)?;
        Ok(Self { cloud, settings: settings.clone(), parts, aligner, renderer: Renderer::new() })
    }

    /// Score of a photo after the fit.
    pub(crate) fn score(&mut self, view: &TrainView) -> Result<Vec<ViewScore>, LocateError> {
        let camera = match self.parts.pose {
            true => self.aligner.aligned(&view.pixels, &view.camera)?,
            false => view.camera.clone(),
        };
        let mut frame = self.renderer.render(&self.cloud, Features::NONE, &camera, &self.settings)?;
        if self.parts.exposure {
            let by = best_exposure(&frame, &view.pixels);
            for (c, plane) in frame.color.iter_mut().enumerate() {
                plane.iter_mut().for_each(|v| *v = (by.gain[c] * f64::from(*v) + by.bias[c]) as f32);
            }
        }
        scores(std::slice::from_ref(view), |_| Ok(frame.clone()))
    }
}

/// The gain and bias of each channel with the least squared error, over what the photo covers.
fn best_exposure(frame: &Frame<f32>, photo: &PhotoPixels) -> PhotoExposure {
    let mut found = PhotoExposure::default();
    for c in 0..3 {
        let covered = |i: usize| photo.coverage.as_ref().is_none_or(|coverage| coverage[i] > 0);
        let pairs = || {
            let all = frame.color[c].iter().zip(&photo.rgb).enumerate().filter(|(i, _)| covered(*i));
            all.map(|(_, (drawn, rgb))| (f64::from(drawn.clamp(0.0, 1.0)), f64::from(rgb[c]) / 255.0))
        };
        let n = pairs().count().max(1) as f64;
        let (mean, want) = pairs().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
        let (square, product) = pairs()
            .fold((0.0, 0.0), |(a, b), (x, y)| (a + (x - mean) * (x - mean) / n, b + (x - mean) * (y - want) / n));
        let gain = if square > LEAST_SPREAD * LEAST_SPREAD { product / square } else { 1.0 };
        (found.gain[c], found.bias[c]) = (gain, want - gain * mean);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_exposure_is_that_of_the_covered_pixels() {
        let value = |i: usize| 0.2 + 0.005 * i as f32;
        let frame = Frame {
            width_px: 10,
            height_px: 10,
            color: std::array::from_fn(|_| (0..100).map(value).collect()),
            ..Frame::default()
        };
        let byte = |v: f32| (v * 255.0).round() as u8;
        let rgb = (0..100).map(|i| if i < 20 { [255; 3] } else { [byte(1.2 * value(i) - 0.1), byte(value(i)), 77] });
        let coverage = Some((0..100).map(|i| if i < 20 { 0 } else { 255 }).collect());
        let photo = PhotoPixels { width_px: 10, height_px: 10, rgb: rgb.collect(), coverage, alpha: None };
        let found = best_exposure(&frame, &photo);
        assert!((found.gain[0] - 1.2).abs() < 0.01 && (found.bias[0] + 0.1).abs() < 0.01, "{found:?}");
        assert!((found.gain[1] - 1.0).abs() < 0.01 && found.gain[2].abs() < 0.01, "{found:?}");
        // The control: with the box that is not covered it is another.
        let other = best_exposure(&frame, &PhotoPixels { coverage: None, ..photo });
        assert!((other.gain[0] - 1.2).abs() > 0.1, "{other:?}");
    }
}
