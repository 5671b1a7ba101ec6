//! The Gaussians of identities.

use super::JobError;
use crate::pipeline::semantics::matching::{MatchMode, gaussians};
use crate::scene::{GaussianCloud, IdentityId, SemanticMap};

/// The Gaussians of `targets`, or all others, `tolerance` being the largest difference per channel of a match.
pub(crate) fn select(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    targets: &[IdentityId],
    mode: MatchMode,
    tolerance: f32,
    rest: bool,
) -> Result<GaussianCloud, JobError> {
    let mut inside = vec![false; cloud.len()];
    for target in targets {
        let found = gaussians(map, *target, mode, tolerance);
        inside.iter_mut().zip(found).for_each(|(a, b)| *a |= b);
    }
    let kept: Vec<usize> = (0..inside.len()).filter(|&i| inside[i] != rest).collect();
    if kept.is_empty() { Err(JobError::NoGaussians) } else { Ok(cloud.select(&kept)) }
}
