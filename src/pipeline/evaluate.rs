//! Image quality on held-out views.

use super::metrics;
use super::observer::ViewScore;
use super::train::TrainView;
use crate::render::Frame;
use crate::scene::Camera;

/// PSNR and SSIM of each view, rendered by `draw`.
pub(crate) fn scores<E>(
    views: &[TrainView],
    mut draw: impl FnMut(&Camera) -> Result<Frame<f32>, E>,
) -> Result<Vec<ViewScore>, E> {
    let mut score = |view: &TrainView| {
        let (psnr, ssim) = metrics::score(&draw(&view.camera)?, &view.pixels);
        Ok(ViewScore { name: view.name.clone(), psnr, ssim })
    };
    views.iter().map(&mut score).collect()
}
