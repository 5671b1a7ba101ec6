//! Quality on photos that training did not see.

use super::metrics;
use super::observer::{Evaluation, ViewScore};
use super::train::TrainView;
use crate::math::stats::mean;
use crate::render::{Features, RenderError, RenderSettings, Renderer};
use crate::scene::GaussianCloud;

/// PSNR and SSIM of each view. `step` and `secs` are copied into the result.
pub(crate) fn evaluate(
    cloud: &GaussianCloud,
    views: &[TrainView],
    settings: &RenderSettings,
    step: u64,
    secs: f64,
) -> Result<Evaluation, RenderError> {
    let mut renderer = Renderer::new();
    let mut scores = Vec::with_capacity(views.len());
    for view in views {
        let frame = renderer.render(cloud, Features::NONE, &view.camera, settings)?;
        let (psnr, ssim) = metrics::score(&frame, &view.pixels);
        scores.push(ViewScore { name: view.name.clone(), psnr, ssim });
    }
    let of = |f: fn(&ViewScore) -> f64| mean(&scores.iter().map(f).collect::<Vec<_>>());
    Ok(Evaluation { step, secs, psnr: of(|s| s.psnr), ssim: of(|s| s.ssim), gaussians: cloud.len(), views: scores })
}
