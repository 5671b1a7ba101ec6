//! What a training run is asked to do.

use serde::{Deserialize, Serialize};

use crate::render::BackendChoice;

/// Settings of a run. Everything that a schedule depends on scales with `steps`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainConfig {
    /// Optimiser steps in all.
    pub steps: u64,
    /// Longest side of the training pictures in px; photos are never enlarged.
    pub max_side_px: u32,
    /// Every how-manieth photo is held out; 0 = none.
    pub holdout_every: usize,
    /// Highest spherical-harmonics degree, 0 to 3.
    pub sh_degree: u8,
    /// Whether Gaussians are added and removed on the way.
    pub densify: bool,
    /// Upper limit of Gaussians; `None` = from the machine's memory.
    pub max_gaussians: Option<usize>,
    /// Gaussians to start from where the dataset has no sparse points.
    pub random_points: usize,
    /// Mip-Splatting's 2-D filter.
    pub antialias: bool,
    /// Seed of every random choice.
    pub seed: u64,
    /// Steps between held-out evaluations; 0 = only at the end.
    pub eval_every: u64,
    /// Seconds between checkpoints; 0 = only at the end.
    pub checkpoint_secs: f64,
    /// Which renderer trains.
    pub backend: BackendChoice,
}

impl Default for TrainConfig {
    fn default() -> Self {
        Self {
            steps: 7_000,
            max_side_px: 512,
            holdout_every: 8,
            sh_degree: 3,
            densify: true,
            max_gaussians: None,
            random_points: 20_000,
            antialias: false,
            seed: 0,
            eval_every: 500,
            checkpoint_secs: 60.0,
            backend: BackendChoice::Auto,
        }
    }
}
