//! The whole way from trained Gaussians and masks to a semantic map.

use glam::DVec3;

use super::codes;
use super::segmenter::Segmenter;
use super::tracker::{TrackError, TrackOptions, ViewReport, track};
use crate::pipeline::observer::{Level, Observer};
use crate::render::RenderSettings;
use crate::scene::{GaussianCloud, Identities, IdentityId, Photo, SemanticMap};

/// Finds the objects and parts of `cloud`, which was trained on `photos`, and gives them codes.
pub fn find_objects(
    cloud: &GaussianCloud,
    photos: &[Photo],
    settings: &RenderSettings,
    segmenter: &mut dyn Segmenter,
    options: &TrackOptions,
    observer: &mut dyn Observer,
) -> Result<SemanticMap, TrackError> {
    let tracked = track(cloud, photos, settings, segmenter, options, observer)?;
    if let Some(text) = unknown(&tracked.views, photos, options.reseed_share) {
        observer.note(Level::Info, text);
    }
    let mut identities = tracked.identities;
    let of: Vec<IdentityId> = tracked.belongings.iter().map(|b| b.identity).collect();
    let centers = centers(cloud, &of, &identities);
    codes::assign(&mut identities, &centers);
    let margin = tracked.belongings.iter().map(|b| b.margin).collect();
    let seeds = tracked.seeds.iter().map(|&i| photos[i].name.clone()).collect();
    Ok(SemanticMap::of_identities(identities, of, margin, seeds))
}

/// What to say about views that masks did not explain; `None` if there is no need.
fn unknown(views: &[ViewReport], photos: &[Photo], share: f64) -> Option<String> {
    let many: Vec<&ViewReport> = views.iter().filter(|v| v.unknown > share).collect();
    let worst = many.iter().max_by(|a, b| a.unknown.total_cmp(&b.unknown))?;
    Some(format!(
        "{} of {} photos show more than {:.0}% that no mask has reached (most: {}, {:.0}%); what is there goes to what \
         it hangs together with",
        many.len(),
        photos.len(),
        100.0 * share,
        photos[worst.photo].name,
        100.0 * worst.unknown
    ))
}

/// Mean position of each identity's Gaussians, pieces included, by number less one.
pub fn centers(cloud: &GaussianCloud, of: &[IdentityId], identities: &Identities) -> Vec<DVec3> {
    let mut sums = vec![(DVec3::ZERO, 0.0); identities.len()];
    for (i, &id) in of.iter().enumerate() {
        for id in identities.line(id) {
            let sum = &mut sums[id as usize - 1];
            *sum = (sum.0 + cloud.world_position(i), sum.1 + 1.0);
        }
    }
    sums.iter().map(|(sum, n)| if *n > 0.0 { *sum / *n } else { DVec3::ZERO }).collect()
}
