//! Depth errors over pixels.

use serde::Serialize;

use crate::math::stats::{mean, median};

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct DepthErrors {
    /// Pixels with a true depth.
    pub(crate) pixels: usize,
    /// Share of them without a rendered depth. The means below are over the other pixels.
    pub(crate) missing: f64,
    /// Mean of the absolute errors, scene units.
    pub(crate) mean_abs: f64,
    /// Median of the absolute errors, scene units.
    pub(crate) median_abs: f64,
    /// Root of the mean squared error, scene units.
    pub(crate) rmse: f64,
    pub(crate) mean_rel: f64,
    /// Share of all pixels whose depth is within 1 % of the truth.
    pub(crate) within_1: f64,
    pub(crate) within_2: f64,
    pub(crate) within_5: f64,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Samples {
    abs: Vec<f64>,
    /// Errors over true depth, in the same order.
    rel: Vec<f64>,
    missing: usize,
}

impl Samples {
    /// Adds a pixel; those without a true depth (0) do not count.
    pub(crate) fn add(&mut self, drawn: f32, truth: f32) {
        if truth <= 0.0 {
            return;
        }
        if !(drawn > 0.0 && drawn.is_finite()) {
            self.missing += 1;
            return;
        }
        let error = (f64::from(drawn) - f64::from(truth)).abs();
        self.abs.push(error);
        self.rel.push(error / f64::from(truth));
    }

    /// Errors over all added pixels; NaN without any.
    pub(crate) fn errors(&self) -> DepthErrors {
        let pixels = self.abs.len() + self.missing;
        let share = |n: usize| n as f64 / pixels as f64;
        let within = |limit: f64| share(self.rel.iter().filter(|r| **r <= limit).count());
        DepthErrors {
            pixels,
            missing: share(self.missing),
            mean_abs: mean(&self.abs),
            median_abs: median(&self.abs),
            rmse: mean(&self.abs.iter().map(|e| e * e).collect::<Vec<_>>()).sqrt(),
            mean_rel: mean(&self.rel),
            within_1: within(0.01),
            within_2: within(0.02),
            within_5: within(0.05),
        }
    }
}
