//! What a training run is asked to do.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::io::trained::SCENE_FILE;
use crate::pipeline::semantics::tracker::TrackOptions;
use crate::render::{BackendChoice, RenderSettings};
use crate::scene::{AlphaUse, Camera, Limits, SplatRenderMode};

/// Weight of the normals' term where surfels are trained (2DGS's).
const SURFEL_NORMALS: f64 = 0.05;
/// Weight of the distortion term where surfels are trained: of 0, 0.1 and 1 the one with the least
/// error of median depth on the demo scene, see [`crate::pipeline::depth`].
const SURFEL_DISTORTION: f64 = 0.1;

/// Settings of a run. Everything that a schedule depends on scales with `steps`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TrainConfig {
    /// Optimizer steps in all.
    pub steps: u64,
    /// Longest side of the training pictures in px; photos are never enlarged.
    pub max_side_px: u32,
    /// Every how-manieth photo is held out; 0 = none.
    pub holdout_every: usize,
    /// Highest spherical-harmonics degree, 0 to 3.
    pub sh_degree: u8,
    /// Open all bands of color from the first step on instead of one after the other.
    pub sh_at_once: bool,
    /// Share of the steps, from the first on, that see the photos at half their size; 0 = none.
    pub coarse_share: f64,
    /// Whether Gaussians are added and removed on the way.
    pub densify: bool,
    /// Upper limit of Gaussians; `None` = from the size of the photos and the machine's memory.
    pub max_gaussians: Option<usize>,
    /// Gaussians to start from where the dataset has no sparse points.
    pub random_points: usize,
    /// What transparent pixels are taken for; `None` = what the photos make likely.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha: Option<AlphaUse>,
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
    /// Train surfels (2D Gaussian Splatting) instead of Gaussians; on the CPU.
    pub surfels: bool,
    /// Weight of the term that holds normals and depth together, on the CPU; `None` = 0 for
    /// Gaussians, 2DGS's for surfels.
    pub normal_weight: Option<f64>,
    /// Weight of the term that pulls surfels together along rays; `None` = the default.
    pub distortion_weight: Option<f64>,
}

/// Stored settings that cannot be read: defaults in their place would train or draw something else.
#[derive(Debug, thiserror::Error)]
#[error(
    "{path}: the settings of the training ('config') cannot be read: {cause}; fix them, or remove the entry to use the defaults"
)]
pub struct UnreadableConfig {
    path: String,
    cause: serde_json::Error,
}

impl TrainConfig {
    /// The settings that the scene in `folder` stores; the defaults for what it does not say, or if it says
    /// nothing, but for the filter, which scenes say they were trained with.
    pub(crate) fn stored(folder: &Path, config: serde_json::Value) -> Result<Self, UnreadableConfig> {
        let read = match config {
            serde_json::Value::Null => Ok(Self::unknown()),
            serde_json::Value::Object(mut named) => {
                named.entry("antialias").or_insert(false.into());
                serde_json::from_value(named.into())
            }
            // A list would be taken for the settings in their order.
            _ => Err(serde::de::Error::custom("they have no names")),
        };
        read.map_err(|cause| UnreadableConfig { path: folder.join(SCENE_FILE).display().to_string(), cause })
    }

    /// For a scene that does not say how it was trained.
    pub(crate) fn unknown() -> Self {
        Self { antialias: false, ..Self::default() }
    }

    /// Whether these settings make sense.
    pub(super) fn check(&self) -> Result<(), String> {
        let bad = |text: &str| Err(text.to_owned());
        if self.steps == 0 {
            return bad("the number of steps must be at least 1");
        }
        if self.max_side_px < 16 {
            return bad("the longest side of the training images must be at least 16 px");
        }
        if !(0.0..=1.0).contains(&self.coarse_share) {
            return bad("the share of steps at half the size must be 0 to 1");
        }
        if self.sh_degree > 3 {
            return bad("the spherical-harmonics degree must be 0 to 3");
        }
        let (normals, distortion) = self.geometry_weights();
        if ![normals, distortion].iter().all(|w| w.is_finite() && *w >= 0.0) {
            return bad("the weights of normals and distortion must be numbers, 0 or more");
        }
        if self.needs_cpu() && self.backend == BackendChoice::Gpu {
            return bad("surfels and the term for normals train on the CPU only: choose --backend cpu");
        }
        Ok(())
    }

    /// Weights of the terms for normals and distortion.
    pub(crate) fn geometry_weights(&self) -> (f64, f64) {
        let or = |weight: Option<f64>, surfels: f64| weight.unwrap_or(if self.surfels { surfels } else { 0.0 });
        (or(self.normal_weight, SURFEL_NORMALS), or(self.distortion_weight, SURFEL_DISTORTION))
    }

    /// What of these settings a scene's plan starts from.
    pub(crate) fn limits(&self) -> Limits {
        Limits {
            train_side_px: self.max_side_px,
            object_side_px: TrackOptions::default().max_side_px,
            sh_degree: self.sh_degree,
            holdout_every: self.holdout_every,
        }
    }

    /// Whether a training with these settings goes on where one with the others stopped: how often to look and save
    /// does not change the trajectory.
    pub(crate) fn is_same_run(&self, other: &Self) -> bool {
        let own = Self { eval_every: other.eval_every, checkpoint_secs: other.checkpoint_secs, ..self.clone() };
        // Surfels are never filtered.
        *other == Self { antialias: if self.surfels { other.antialias } else { self.antialias }, ..own }
    }

    /// Whether a training with these settings is that with the others, for another number of steps.
    pub(crate) fn is_same_but_for_steps(&self, other: &Self) -> bool {
        Self { steps: other.steps, ..self.clone() }.is_same_run(other)
    }

    /// Whether only the CPU can do what is asked.
    pub(crate) fn needs_cpu(&self) -> bool {
        self.surfels || self.geometry_weights().0 > 0.0
    }

    /// How what was trained is drawn in front of `background`, black if unknown, in a scene of this extent (see
    /// [`Camera::extent_of`]).
    pub(crate) fn render_settings(&self, background: Option<[f32; 3]>, extent: f64) -> RenderSettings {
        RenderSettings {
            background: background.unwrap_or_default(),
            near: Camera::near_plane(extent),
            antialias: self.antialias && !self.surfels,
            surfels: self.surfels,
            ..RenderSettings::default()
        }
    }

    /// What is told of it in files for other programs.
    pub(crate) fn render_mode(&self) -> SplatRenderMode {
        match (self.surfels, self.antialias) {
            (true, _) => SplatRenderMode::Surfels,
            (false, true) => SplatRenderMode::Mip,
            (false, false) => SplatRenderMode::Plain,
        }
    }
}

impl Default for TrainConfig {
    fn default() -> Self {
        Self {
            steps: 7_000,
            max_side_px: 512,
            holdout_every: 8,
            sh_degree: 3,
            sh_at_once: false,
            coarse_share: 0.0,
            densify: true,
            max_gaussians: None,
            random_points: 20_000,
            alpha: None,
            antialias: true,
            seed: 0,
            eval_every: 500,
            checkpoint_secs: 60.0,
            backend: BackendChoice::Auto,
            surfels: false,
            normal_weight: None,
            distortion_weight: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    #[test]
    fn stored_settings_are_read_or_refused_but_never_guessed() {
        let stored = |config: Value| TrainConfig::stored(Path::new("desk"), config);
        assert_eq!(stored(Value::Null).expect("none"), TrainConfig::unknown());
        let own = TrainConfig { steps: 77, antialias: false, normal_weight: Some(0.5), ..TrainConfig::default() };
        assert_eq!(stored(serde_json::to_value(&own).expect("JSON")).expect("its own"), own);
        // Of an earlier version, and of a later one.
        let partial = stored(json!({ "steps": 9, "surfels": true, "new": {} })).expect("what it knows");
        assert_eq!(partial, TrainConfig { steps: 9, surfels: true, ..TrainConfig::unknown() });
        for broken in [json!({ "steps": "many" }), json!({ "antialias": 3 }), json!([1, 2]), json!("x")] {
            let text = stored(broken.clone()).expect_err("unreadable").to_string();
            assert!(text.contains("desk/scene.json") && text.contains("'config'"), "{broken}: {text}");
        }
    }
}
