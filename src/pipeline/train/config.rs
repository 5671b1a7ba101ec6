//! Settings of a training run.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::io::trained::SCENE_FILE;
use crate::pipeline::semantics::lifting::tracker::TrackOptions;
use crate::render::{BackendChoice, RenderSettings};
use crate::scene::{AlphaUse, Camera, FittedParts, Limits, SplatRenderMode};

/// Weight of the normal loss for surfels (2DGS's).
const SURFEL_NORMALS: f64 = 0.05;
/// Weight of the distortion loss for surfels: of 0, 0.1 and 1 the one with the least error of median depth on the
/// demo scene, see [`crate::pipeline::depth`].
const SURFEL_DISTORTION: f64 = 0.1;

/// Settings of a training run. The schedule scales with `steps`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TrainConfig {
    /// Total number of training steps.
    pub steps: u64,
    /// Longest side of the training pictures in px; photos are never enlarged.
    pub max_side_px: u32,
    /// Interval of held-out photos: every n-th is held out; 0 = none.
    pub holdout_every: usize,
    /// Highest spherical-harmonics degree, 0 to 3.
    pub sh_degree: u8,
    /// True if all SH bands are active from the first step on, instead of one after the other.
    pub sh_at_once: bool,
    /// Fraction of the steps, from the first on, with half-size photos; 0 = none.
    pub coarse_share: f64,
    /// True if Gaussians are added and removed during training.
    pub densify: bool,
    /// Most Gaussians; `None` = from the size of the photos and the machine's memory.
    pub max_gaussians: Option<usize>,
    /// Initial Gaussians if the dataset has no sparse points.
    pub random_points: usize,
    /// Interpretation of transparent pixels; `None` = inferred from the photos.
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
    /// Renderer for training.
    pub backend: BackendChoice,
    /// True to train surfels (2D Gaussian Splatting) instead of Gaussians; on the CPU.
    pub surfels: bool,
    /// Weight of the normal-consistency loss, on the CPU; `None` = 0 for Gaussians, 2DGS's for surfels.
    pub normal_weight: Option<f64>,
    /// Weight of the distortion loss, which concentrates surfels along rays; `None` = the default.
    pub distortion_weight: Option<f64>,
    /// True if the poses of the training photos are refined; on the CPU.
    pub refine_poses: bool,
    /// True if every training photo has an exposure of its own; on the CPU.
    pub exposure: bool,
}

/// Stored settings that cannot be read: defaults in their place would train or render something else.
#[derive(Debug, thiserror::Error)]
#[error(
    "{path}: the settings of the training ('config') cannot be read: {cause}; fix them, or remove the entry to use the defaults"
)]
pub struct UnreadableConfig {
    path: String,
    cause: serde_json::Error,
}

impl TrainConfig {
    /// Reads the settings stored in the scene in `folder`. Missing entries are [`Self::unknown`]: defaults without the
    /// filter, because a scene records the filter if it was trained with it.
    pub(crate) fn stored(folder: &Path, config: serde_json::Value) -> Result<Self, UnreadableConfig> {
        let read = match config {
            serde_json::Value::Null => Ok(Self::unknown()),
            serde_json::Value::Object(mut named) => {
                named.entry("antialias").or_insert(false.into());
                serde_json::from_value(named.into())
            }
            // serde would accept a list as the settings in order.
            _ => Err(serde::de::Error::custom("they have no names")),
        };
        read.map_err(|cause| UnreadableConfig { path: folder.join(SCENE_FILE).display().to_string(), cause })
    }

    /// Settings for a scene without a record of its training.
    pub(crate) fn unknown() -> Self {
        Self { antialias: false, ..Self::default() }
    }

    /// Checks that these settings are valid.
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
            return bad(
                "surfels, the term for normals, --refine-poses and --exposure train on the CPU only: choose --backend cpu",
            );
        }
        Ok(())
    }

    /// Weights of the normal and the distortion loss.
    pub(crate) fn geometry_weights(&self) -> (f64, f64) {
        let or = |weight: Option<f64>, surfels: f64| weight.unwrap_or(if self.surfels { surfels } else { 0.0 });
        (or(self.normal_weight, SURFEL_NORMALS), or(self.distortion_weight, SURFEL_DISTORTION))
    }

    /// Limits in these settings from which a scene's plan starts.
    pub(crate) fn limits(&self) -> Limits {
        Limits {
            train_side_px: self.max_side_px,
            object_side_px: TrackOptions::default().max_side_px,
            sh_degree: self.sh_degree,
            holdout_every: self.holdout_every,
        }
    }

    /// Returns whether a run with these settings can resume one with the others: intervals of evaluations and
    /// checkpoints do not change the trajectory.
    pub(crate) fn is_same_run(&self, other: &Self) -> bool {
        let own = Self { eval_every: other.eval_every, checkpoint_secs: other.checkpoint_secs, ..self.clone() };
        // Surfels are never filtered.
        *other == Self { antialias: if self.surfels { other.antialias } else { self.antialias }, ..own }
    }

    /// Returns whether the settings differ from the others at most in the number of steps.
    pub(crate) fn is_same_but_for_steps(&self, other: &Self) -> bool {
        Self { steps: other.steps, ..self.clone() }.is_same_run(other)
    }

    /// True if only the CPU supports these settings.
    pub(crate) fn needs_cpu(&self) -> bool {
        self.surfels || self.geometry_weights().0 > 0.0 || self.held_out_fit().is_some()
    }

    /// The reason for training on the CPU, if photos are fitted, for a note.
    pub(super) fn why_cpu(&self) -> &'static str {
        match self.held_out_fit() {
            Some(_) => ": refined poses and exposures need it",
            None => "",
        }
    }

    /// Parts of a held-out photo that are fitted before it is scored a second time: as much as of the training photos.
    pub(crate) fn held_out_fit(&self) -> Option<FittedParts> {
        FittedParts { pose: self.refine_poses, exposure: self.exposure }.some()
    }

    /// Render settings of the trained scene in front of `background`, black if unknown, at this scene extent (see
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

    /// Render mode in files for other programs.
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
            refine_poses: false,
            exposure: false,
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
