//! Options of carrying identities from photo to photo.

use std::sync::Arc;

use super::super::votes::LEAST_SEEN;
use crate::scene::{GaussianCloud, MaskPrompt, SemanticMap};

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TrackOptions {
    /// First photo to be segmented; `None` = the segmenter's choice.
    pub(crate) seed: Option<usize>,
    /// Longer side of the masks that vote, px.
    pub(crate) max_side_px: u32,
    /// Share of unknown pixels above which a view is segmented too.
    pub(crate) reseed_share: f64,
    /// Most photos to segment.
    pub(crate) max_seeds: usize,
    /// True if a followed mask counts only if the Gaussians do not contradict it.
    pub(crate) veto: bool,
    /// True if all photos with masks are segmented, up to `max_seeds`, even explained ones: codes are trained on
    /// them.
    pub(crate) keep_masks: bool,
    /// Kind of prompt by which SAM 2 gets a mask to follow.
    pub(crate) prompt: MaskPrompt,
    /// True if the labels of masks grow over the other photos, up to their edges.
    pub(crate) by_photos: bool,
    /// True if Gaussians that look alike and lie side by side share the votes for some of them.
    pub(crate) by_tree: bool,
    /// True if sides that no mask shows are guessed from the mirror image of those that one does.
    pub(crate) by_mirror: bool,
    /// Steps between Gaussians over which unseen ones (the inside of things) inherit from those around them.
    pub(crate) hidden_steps: f64,
    /// Least share of its area in its best photo for a Gaussian to be voted on in a photo.
    pub(crate) least_seen: f32,
    /// Objects and parts that stay as they are: masks only label Gaussians without a label.
    pub(crate) known: Option<Arc<SemanticMap>>,
    /// Removed Gaussians that the photos still show.
    pub(crate) removed: Option<Arc<GaussianCloud>>,
    /// Names of removed things whose Gaussians were not kept.
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
            by_mirror: true,
            hidden_steps: 4.0,
            least_seen: LEAST_SEEN,
            known: None,
            removed: None,
            removed_names: Vec::new(),
        }
    }
}
