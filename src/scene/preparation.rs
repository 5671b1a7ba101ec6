//! Choices made when the objects and parts of a scene were found; queries cannot change them.

use serde::{Deserialize, Serialize};

/// Source of the codes of Gaussians.
#[derive(clap::ValueEnum, strum::Display, strum::VariantArray)]
#[strum(serialize_all = "kebab-case")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Lifting {
    /// Codes of the identities they voted for
    #[default]
    Votes,
    /// The same, refined by training
    Refined,
    /// By training alone, as in the paper; identities are read off the trained codes
    Paper,
}

/// Prompt with which SAM 2 tracks a mask.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum, strum::Display)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "kebab-case")]
pub enum MaskPrompt {
    /// All of it
    #[default]
    Mask,
    /// Points drawn from it, as in the paper (Algorithm 1)
    Points,
}

/// Grid points at which a network is prompted for all masks of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[derive(clap::ValueEnum, strum::Display, strum::VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum MaskGrid {
    /// Every second one, and of the others those between which something changes
    #[default]
    // The word in scenes of earlier builds.
    #[serde(alias = "sparing")]
    Adaptive,
    /// All of them, as the official generators (and the paper)
    All,
}

impl MaskGrid {
    /// In words: "all" points.
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Adaptive => "half-spaced, then needed,",
            Self::All => "all",
        }
    }
}

/// Share of its own embedding that a part keeps in semantic deviation, the paper's `w`.
pub const PART_WEIGHT: f32 = 0.7;

/// The choices of a recipe that are made when objects and parts are found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Preparation {
    /// Source of the codes.
    pub lifting: Lifting,
    /// Share of its own embedding that a part kept in semantic deviation.
    pub part_weight: f32,
    /// Prompt with which SAM 2 tracked masks; `None` if the Gaussians alone carried masks on.
    pub prompt: Option<MaskPrompt>,
    /// Grid points at which a network was prompted; `None` if none was.
    pub grid: Option<MaskGrid>,
}

impl Default for Preparation {
    fn default() -> Self {
        Self { lifting: Lifting::default(), part_weight: PART_WEIGHT, prompt: None, grid: None }
    }
}
