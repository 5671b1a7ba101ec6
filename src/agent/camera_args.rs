//! Arguments of camera commands as plain data: directions, distances, closeness. Whoever moves the camera
//! decides what they come to in the scene.

use glam::DVec3;
use serde::{Deserialize, Deserializer, Serialize};

use crate::navigate::target::Side;

/// Where to move or turn, as the viewer sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    Forward,
    Back,
    Left,
    Right,
    Up,
    Down,
}

impl Direction {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Left, Self::Right, Self::Up, Self::Down, Self::Forward, Self::Back];
    /// Those that one can turn to.
    pub const TURNS: &[Self] = Self::ALL.split_at(4).0;

    /// Its axis in the eye's own frame.
    pub(crate) fn axis(self) -> DVec3 {
        match self {
            Self::Forward => DVec3::Z,
            Self::Back => DVec3::NEG_Z,
            Self::Left => DVec3::NEG_X,
            Self::Right => DVec3::X,
            Self::Up => DVec3::NEG_Y,
            Self::Down => DVec3::Y,
        }
    }

    /// Its word.
    pub fn text(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Back => "back",
            Self::Left => "left",
            Self::Right => "right",
            Self::Up => "up",
            Self::Down => "down",
        }
    }
}

/// How far to move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Distance {
    /// So many meters, which needs a scene whose scale is known.
    #[serde(alias = "metres")]
    Meters(f64),
    /// So many steps; a step is what suits the scene.
    Relative(f64),
    /// One step.
    #[default]
    Default,
}

/// Longest way that is walked at once, in meters or steps.
pub const FARTHEST: f64 = 1000.0;

impl Distance {
    /// Whether it can be walked: finite, above 0 and at most [`FARTHEST`].
    pub(crate) fn is_sound(self) -> bool {
        match self {
            Self::Meters(d) | Self::Relative(d) => d > 0.0 && d <= FARTHEST,
            Self::Default => true,
        }
    }
}

/// The usual distance from a target.
pub(crate) const NORMAL: f64 = 1.0;
/// Twice as close as usual.
pub(crate) const CLOSER: f64 = 2.0;
/// Half as close as usual.
pub(crate) const FARTHER: f64 = 0.5;
/// How close and how far a target can be looked at.
pub const CLOSENESS: std::ops::RangeInclusive<f64> = 0.1..=10.0;

/// Reads a closeness: a number, or "normal", "closer", "farther".
pub(super) fn closeness<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Given {
        Number(f64),
        Word(String),
    }
    let number = match Given::deserialize(from)? {
        Given::Number(n) => n,
        Given::Word(w) => match w.as_str() {
            "normal" => NORMAL,
            "closer" => CLOSER,
            "farther" => FARTHER,
            _ => return Err(serde::de::Error::custom("closeness is normal, closer, farther or a number")),
        },
    };
    if CLOSENESS.contains(&number) {
        return Ok(number);
    }
    Err(serde::de::Error::custom("closeness must be between 0.1 and 10"))
}

/// The closeness that is meant if none is given.
pub(super) fn normal() -> f64 {
    NORMAL
}

/// The side that is meant if none is given: as it is seen now.
pub(super) fn same() -> Side {
    Side::Same
}
