//! Settings of a synthetic data set.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::SynthError;
use crate::scene::Camera;

/// Placement of the cameras.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Rig {
    /// Spread evenly over the upper dome around the scene's focus.
    #[default]
    Dome,
    /// Three rings around the focus, one above the other.
    Orbit,
    /// One smooth walk around the focus with the sway of a hand.
    Handheld,
    /// Half of the views from the dome, half close-ups of each object in turn.
    Survey,
}

/// Assignment of the nodes of a glTF tree to objects and parts; see [`super::levels`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Levels {
    /// Top-level nodes are objects, named nodes with meshes below them are their parts.
    #[default]
    Nodes,
    /// The whole file is one object, its named nodes with meshes are the parts.
    File,
}

/// Settings of a synthetic data set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SynthOptions {
    /// Number of photos.
    pub views: usize,
    /// Number of photos that are held out for testing, spread over all.
    pub held_out: usize,
    /// Width of a photo in px.
    pub width_px: u32,
    /// Height of a photo in px.
    pub height_px: u32,
    /// Samples along each side of a pixel; their square is averaged.
    pub samples: u32,
    /// Vertical field of view in degrees.
    pub fov_y_deg: f64,
    /// Placement of the cameras.
    pub rig: Rig,
    /// Point that the cameras look at, in scene units; `None` = found from the objects.
    pub focus: Option<DVec3>,
    /// Radius around the focus that fills the picture, in scene units; `None` = found.
    pub radius: Option<f64>,
    /// Objects and parts.
    pub levels: Levels,
    /// sRGB color where there is no surface.
    pub background: [u8; 3],
    /// Strength of the highlights, 0 (purely diffuse, the same from everywhere) to 1.
    pub specular: f32,
    /// Sparse points, as from structure from motion; 0 = none.
    pub points: usize,
    /// Standard deviation of a sparse point's error, in pixels of the photo that it was seen in.
    pub point_noise_px: f64,
    /// Seed of every random choice.
    pub seed: u64,
    /// Object or part, by its name or path, that is left out once the cameras are placed, as ground truth for its
    /// removal. Only the held-out views are rendered then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub without: Option<String>,
    /// True if the left-out object or part still shades the rest.
    #[serde(default)]
    pub keep_shadows: bool,
}

impl Default for SynthOptions {
    fn default() -> Self {
        Self {
            views: 60,
            held_out: 8,
            width_px: 800,
            height_px: 600,
            samples: 3,
            fov_y_deg: 45.0,
            rig: Rig::Dome,
            focus: None,
            radius: None,
            levels: Levels::Nodes,
            background: [214, 222, 230],
            specular: 0.3,
            points: 20_000,
            point_noise_px: 0.7,
            seed: 0,
            without: None,
            keep_shadows: false,
        }
    }
}

impl SynthOptions {
    pub(crate) fn validate(&self) -> Result<(), SynthError> {
        let bad = |what: &str| Err(SynthError::Options(what.into()));
        if self.without.is_some() && self.held_out == 0 {
            return bad("only held-out views are rendered without a thing: hold some out");
        }
        let side = 1..=Camera::MAX_SIDE_PX;
        if !(1..=100_000).contains(&self.views) {
            return bad("views must be 1 to 100000");
        }
        if self.held_out >= self.views {
            return bad("at least one view must be left for training: held-out < views");
        }
        if !side.contains(&self.width_px) || !side.contains(&self.height_px) {
            return Err(SynthError::Options(format!("width and height must be 1 to {} px", Camera::MAX_SIDE_PX)));
        }
        if !(1..=16).contains(&self.samples) {
            return bad("samples along a pixel's side must be 1 to 16");
        }
        if !(1.0..=150.0).contains(&self.fov_y_deg) {
            return bad("the field of view must be 1 to 150 degrees");
        }
        if !(0.0..=1.0).contains(&self.specular) {
            return bad("specular must be 0 to 1");
        }
        if self.points > 10_000_000 || !(0.0..=100.0).contains(&self.point_noise_px) {
            return bad("points must be at most 10 million and their noise 0 to 100 px");
        }
        if self.radius.is_some_and(|r| !(r.is_finite() && r > 0.0)) || self.focus.is_some_and(|f| !f.is_finite()) {
            return bad("focus must be finite and radius positive");
        }
        Ok(())
    }
}
