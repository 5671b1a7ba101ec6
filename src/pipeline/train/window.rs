//! Measurements between two reports of a training.

/// Losses and PSNRs since the last report.
#[derive(Default)]
pub(super) struct Window {
    pub(super) losses: Vec<f64>,
    pub(super) psnrs: Vec<f64>,
}

impl Window {
    pub(super) fn add(&mut self, loss: f64, psnr: f64) {
        self.losses.push(loss);
        if psnr.is_finite() {
            self.psnrs.push(psnr);
        }
    }
}
