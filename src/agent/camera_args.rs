//! Arguments of camera commands as plain data: directions, distances, closeness. The [`World`](super::world::World)
//! converts them to scene units.

use glam::DVec3;
use serde::{Deserialize, Deserializer, Serialize};

use crate::navigate::target::Side;

/// Direction of a movement or turn, relative to the current view.
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
    /// All directions.
    pub const ALL: [Self; 6] = [Self::Left, Self::Right, Self::Up, Self::Down, Self::Forward, Self::Back];
    /// Directions of a turn.
    pub const TURNS: &[Self] = Self::ALL.split_at(4).0;

    /// Axis in the camera frame: x to the right, y down, z forward.
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

    /// Name of the direction, in lower case.
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

/// Length of a movement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Distance {
    /// Length in meters; needs a scene of known scale.
    Meters(f64),
    /// Number of steps; the length of a step depends on the scene.
    Relative(f64),
    /// One step.
    #[default]
    Default,
}

/// Longest single movement, in meters or steps.
pub const FARTHEST: f64 = 1000.0;

impl Distance {
    /// Returns whether the length is finite, above 0 and at most [`FARTHEST`].
    pub(crate) fn is_sound(self) -> bool {
        match self {
            Self::Meters(d) | Self::Relative(d) => d > 0.0 && d <= FARTHEST,
            Self::Default => true,
        }
    }
}

/// Closeness of the usual distance from a target.
pub(crate) const NORMAL: f64 = 1.0;
/// Closeness of half the usual distance.
pub(crate) const CLOSER: f64 = 2.0;
/// Closeness of twice the usual distance.
pub(crate) const FARTHER: f64 = 0.5;
/// Permitted range of closeness.
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

/// Default closeness.
pub(super) fn normal() -> f64 {
    NORMAL
}

/// Default side: as seen now.
pub(super) fn same() -> Side {
    Side::Same
}
