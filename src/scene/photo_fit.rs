//! Facts that a training found out about a photo beside the scene: how its pose was off, and its exposure.

use serde::{Deserialize, Serialize};

/// Exposure of a photo: `gain * color + bias` by channel, of the scene's colors, in sRGB from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhotoExposure {
    /// Factor by channel.
    pub gain: [f64; 3],
    /// Summand by channel.
    pub bias: [f64; 3],
}

impl Default for PhotoExposure {
    fn default() -> Self {
        Self { gain: [1.0; 3], bias: [0.0; 3] }
    }
}

/// Findings about one photo; its refined pose is that of the scene's camera.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PhotoFit {
    /// Name of the photo.
    pub name: String,
    /// Distance from the given pose in percent of the scene's radius, and turn in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moved: Option<[f64; 2]>,
    /// Exposure beside the other photos'.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure: Option<PhotoExposure>,
}
