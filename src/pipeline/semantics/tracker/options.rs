//! How identities are carried from photo to photo.

use std::sync::Arc;

use super::super::votes::LEAST_SEEN;
use crate::scene::{GaussianCloud, MaskPrompt, SemanticMap};

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TrackOptions {
    /// Photo to begin with; `None` = the segmenter's choice.
    pub(crate) seed: Option<usize>,
    /// Longer side of the masks that vote, px.
    pub(crate) max_side_px: u32,
    /// Share of a view that may stay unknown before it is segmented too.
    pub(crate) reseed_share: f64,
    /// Most photos that are segmented.
    pub(crate) max_seeds: usize,
    /// Whether a mask that was followed counts only where the Gaussians do not contradict it.
    pub(crate) veto: bool,
    /// Whether all photos that have masks are segmented, up to `max_seeds`, be they explained or not: codes are to be
    /// trained on them.
    pub(crate) keep_masks: bool,
    /// What of a mask SAM 2 is given to follow.
    pub(crate) prompt: MaskPrompt,
    /// Whether what masks say grows over the other photos, up to their edges.
    pub(crate) by_photos: bool,
    /// Whether Gaussians that look alike and lie side by side share what is said of some of them.
    pub(crate) by_tree: bool,
    /// Steps between Gaussians over which what no photo shows (the inside of things) belongs to what is around it.
    pub(crate) hidden_steps: f64,
    /// Share of its area in the photo that shows it best that a Gaussian shows where a photo says whose it is.
    pub(crate) least_seen: f32,
    /// Objects and parts that are there and stay as they are: masks only tell of what is nobody's yet.
    pub(crate) known: Option<Arc<SemanticMap>>,
    /// Gaussians that are no more there, though photos show them.
    pub(crate) removed: Option<Arc<GaussianCloud>>,
    /// Names of what is no more there, where its Gaussians were not kept.
    pub(crate) removed_names: Vec<String>,
}

impl Default for TrackOptions {
    fn default() -> Self {
        Self {
            seed: None,
            max_side_px: 1_024,
            reseed_share: 0.005,
            max_seeds: 12,
            veto: true,
            keep_masks: false,
            prompt: MaskPrompt::Mask,
            by_photos: true,
            by_tree: true,
            hidden_steps: 4.0,
            least_seen: LEAST_SEEN,
            known: None,
            removed: None,
            removed_names: Vec::new(),
        }
    }
}
