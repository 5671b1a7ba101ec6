//! Preferred view of a target: side and distance, and the direction that follows from them.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantArray};

/// From which side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[derive(clap::ValueEnum, IntoStaticStr, VariantArray)]
pub enum Side {
    /// Whichever shows it best
    #[default]
    #[strum(serialize = "where it is seen best")]
    Best,
    /// As it is seen now
    #[strum(serialize = "from this side")]
    Same,
    /// The opposite
    #[strum(serialize = "from the other side")]
    Other,
    /// Its front: away from what it is a part of, or where most photos were taken
    #[strum(serialize = "from its front")]
    Front,
    /// Its left, seen from the start
    #[strum(serialize = "from its left")]
    Left,
    /// Its right, seen from the start
    #[strum(serialize = "from its right")]
    Right,
    /// From above
    #[strum(serialize = "from above")]
    Above,
    /// From below
    #[strum(serialize = "from below")]
    Below,
}

impl Side {
    pub(crate) fn text(self) -> &'static str {
        self.into()
    }
}

/// Preferences for a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ViewPreference {
    pub(crate) side: Side,
    /// Distance as a multiple of the usual one; under 1 is nearer.
    pub(crate) distance: f64,
}

impl Default for ViewPreference {
    fn default() -> Self {
        Self { side: Side::Best, distance: 1.0 }
    }
}

/// Preferred direction from the target to the camera; `None` for any.
pub(super) fn wanted(side: Side, now: DVec3, front: Option<DVec3>, up: DVec3) -> Option<DVec3> {
    let flat = (now - up * now.dot(up)).try_normalize();
    let flat = flat.unwrap_or_else(|| up.any_orthonormal_vector());
    let height = now.dot(up);
    let level = |d: DVec3| (d * (1.0 - height * height).max(0.0).sqrt() + up * height).try_normalize();
    match side {
        Side::Best => None,
        Side::Same => Some(now),
        Side::Other => level(-flat),
        Side::Front => front.or(Some(now)),
        // Seen from the eye, the target's left side is where the eye's left hand points.
        Side::Left => level(flat.cross(up)),
        Side::Right => level(up.cross(flat)),
        Side::Above => (up * 2.0 + flat).try_normalize(),
        Side::Below => (-up * 2.0 + flat).try_normalize(),
    }
}

/// Fit of a direction to the preference, 0 to 1; `None` if it is not that side at all.
pub(super) fn fit(side: Side, wanted: Option<DVec3>, now: DVec3, direction: DVec3) -> Option<f64> {
    match wanted {
        // A little for staying near: a view that is as good from here is better from here.
        None => Some(0.9 + 0.1 * now.dot(direction)),
        Some(wanted) => {
            let cosine = wanted.dot(direction);
            let least = match side {
                Side::Same => 0.85,
                _ => 0.5,
            };
            (cosine >= least).then(|| cosine.powi(4))
        }
    }
}
