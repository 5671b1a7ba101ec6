//! The Gaussians of identities.

use super::JobError;
use crate::pipeline::semantics::query::answer::QueryAnswer;
use crate::pipeline::semantics::query::matching::{MatchMode, gaussians};
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::scene::{GaussianCloud, IdentityId, SemanticMap};

/// Returns the Gaussians of an answer, of at most `top` identities, or all others.
pub(crate) fn select(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    answered: &QueryAnswer,
    top: usize,
    rest: bool,
) -> Result<GaussianCloud, JobError> {
    let mut inside = vec![false; cloud.len()];
    let QueryConfig { masks, tolerance, .. } = answered.recipe;
    if masks == MatchMode::Relevancy {
        let relevant = answered.relevant(map.identity_of.iter().copied());
        let is = |id: &IdentityId| relevant.get(*id as usize).copied().unwrap_or(false);
        inside = map.identity_of.iter().map(is).collect();
    } else {
        for target in answered.chosen(top) {
            let found = gaussians(map, target, masks, tolerance);
            inside.iter_mut().zip(found).for_each(|(a, b)| *a |= b);
        }
    }
    let kept: Vec<usize> = (0..inside.len()).filter(|&i| inside[i] != rest).collect();
    if kept.is_empty() { Err(JobError::NoGaussians) } else { Ok(cloud.select(&kept)) }
}
