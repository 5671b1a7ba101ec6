//! Rules of cleaning, as typed and as applied.

use std::fmt;
use std::str::FromStr;

use super::{CloudMeasures, SplatMeasure};
use crate::math::format::capital;
use crate::math::srgb;

/// Opacity below which a Gaussian is hardly ever rendered.
const FAINT: f32 = 0.005;
/// Elongation from which a Gaussian is a needle.
const NEEDLE: f32 = 30.0;
/// Share of the scene's radius from which a Gaussian is oversized.
const OVERSIZED: f64 = 0.5;
/// Distance in red, green and blue, each 0 to 1, within which a color is near.
const NEAR_COLOR: f32 = 0.12;
/// Least share of a pixel, in any photo, of a supported Gaussian.
const SUPPORTED: f32 = 0.01;

/// Rules that select Gaussians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum CleanRule {
    /// Small pieces that hang in the air and that the photos do not need.
    Floaters,
    /// Nearly transparent Gaussians.
    Faint,
    /// Long and thin Gaussians.
    Needles,
    /// Gaussians that are large compared with the scene.
    Oversized,
    /// Gaussians that no photo shows.
    Unsupported,
    /// Gaussians of this color or a near one.
    Color([u8; 3]),
    /// Gaussians with a smaller measure.
    Below(SplatMeasure, f32),
    /// Gaussians with a larger measure.
    Above(SplatMeasure, f32),
    /// Gaussians with a measure between the two, both included.
    Range(SplatMeasure, f32, f32),
}

/// Errors in a rule.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RuleError {
    /// The text is no rule.
    #[error(
        "'{0}' is no rule: floaters, faint, needles, oversized, unsupported, a color such as 'color=#3050c0', or a measure with a limit such as 'size>0.5' or 'photos<2'"
    )]
    Unknown(String),
    /// The measure is unknown without photos.
    #[error("{0} is not known of this scene: its photos are not there")]
    NoPhotos(&'static str),
}

impl CleanRule {
    /// Rules without a number.
    pub(crate) const NAMED: [Self; 5] =
        [Self::Floaters, Self::Faint, Self::Needles, Self::Oversized, Self::Unsupported];

    /// Returns the name on screen.
    pub(crate) fn title(&self) -> String {
        match self {
            Self::Faint => "Nearly transparent".into(),
            Self::Unsupported => "Not seen in photos".into(),
            other => capital(&other.to_string()),
        }
    }

    /// Returns the meaning, for the user.
    pub(crate) fn meaning(&self) -> &'static str {
        match self {
            Self::Floaters => "small pieces in the air that the photos do without",
            Self::Faint => "opacity under 0.005",
            Self::Needles => "over 30 times as long as wide",
            Self::Oversized => "larger than half the scene's radius",
            Self::Unsupported => "under 1 % of every pixel of every photo",
            Self::Color(_) => "this color, or one that is near",
            Self::Below(measure, _) | Self::Above(measure, _) | Self::Range(measure, ..) => measure.meaning(),
        }
    }

    /// Returns whether each Gaussian is selected, `[n]`.
    pub(crate) fn choose(&self, of: &CloudMeasures) -> Result<Vec<bool>, RuleError> {
        let (measure, is): (_, &dyn Fn(f32) -> bool) = match *self {
            Self::Floaters => return Ok(of.floaters.clone()),
            Self::Color(color) => {
                let color = color.map(|v| f32::from(v) / 255.0);
                let distance = |c: &[f32; 3]| (0..3).map(|k| (c[k] - color[k]).powi(2)).sum::<f32>().sqrt();
                return Ok(of.colors.iter().map(|c| distance(c) < NEAR_COLOR).collect());
            }
            Self::Faint => (SplatMeasure::Opacity, &|v| v < FAINT),
            Self::Needles => (SplatMeasure::Elongation, &|v| v > NEEDLE),
            Self::Oversized => (SplatMeasure::Size, &|v| f64::from(v) > OVERSIZED * of.radius),
            Self::Unsupported => (SplatMeasure::Weight, &|v| v < SUPPORTED),
            Self::Below(measure, limit) => (measure, &move |v| v < limit),
            Self::Above(measure, limit) => (measure, &move |v| v > limit),
            Self::Range(measure, from, to) => (measure, &move |v| (from..=to).contains(&v)),
        };
        let values = of.get(measure).ok_or(RuleError::NoPhotos(measure.word()))?;
        Ok(values.iter().map(|v| is(*v)).collect())
    }
}

impl fmt::Display for CleanRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Floaters => f.write_str("floaters"),
            Self::Faint => f.write_str("faint"),
            Self::Needles => f.write_str("needles"),
            Self::Oversized => f.write_str("oversized"),
            Self::Unsupported => f.write_str("unsupported"),
            Self::Color([r, g, b]) => write!(f, "color=#{r:02x}{g:02x}{b:02x}"),
            Self::Below(measure, limit) => write!(f, "{}<{limit}", measure.word()),
            Self::Above(measure, limit) => write!(f, "{}>{limit}", measure.word()),
            Self::Range(measure, from, to) => write!(f, "{from}<{}<{to}", measure.word()),
        }
    }
}

impl FromStr for CleanRule {
    type Err = RuleError;

    fn from_str(text: &str) -> Result<Self, RuleError> {
        let text = text.trim();
        if let Some(named) = Self::NAMED.into_iter().find(|rule| rule.to_string() == text) {
            return Ok(named);
        }
        if let Some(color) = text.strip_prefix("color=#").and_then(srgb::from_hex) {
            return Ok(Self::Color(color));
        }
        let parsed = || {
            let (word, limit) = text.split_once(['<', '>'])?;
            let measure = SplatMeasure::from_str(word.trim()).ok()?;
            let limit: f32 = limit.trim().parse().ok().filter(|v: &f32| v.is_finite())?;
            Some(if text.contains('>') { Self::Above(measure, limit) } else { Self::Below(measure, limit) })
        };
        parsed().ok_or_else(|| RuleError::Unknown(text.into()))
    }
}
