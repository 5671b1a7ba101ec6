//! The pose that features of a photo agree on with those of rendered views. An ordinary photo is matched with the views
//! most like it, as fine as the cameras took them. A close-up shows a small part of a view: it is matched with finer
//! renderings, of which more are tried, as views at another scale are hardly told by how alike they look.

use glam::DVec2;

use super::LocateError;
use super::consensus::{Consensus, PointMatch, consensus};
use super::descriptor::PictureFeature;
use super::gallery::{AlikeView, Gallery, ViewFineness};
use super::matching::{WorldFeature, pairs};
use crate::pipeline::observer::Observer;
use crate::scene::Camera;

/// Views whose features are matched at once.
const GROUP: usize = 3;
/// Places of the photo that agree on a pose, from which it is no chance: of a thousand wrong matches, one agrees with
/// a wrong pose within [`WITHIN`].
pub(super) const SUPPORTED: usize = 12;
/// Largest reprojection error of a match that agrees, in longer sides of the photo.
const WITHIN: f64 = 0.006;
/// Largest distance of matches with a rendering from about the right pose, in longer sides.
const NEAR: f64 = 0.06;
/// Ratios to the found focal length that are tried where it is not known.
const SPREAD: [f64; 3] = [1.0, 0.94, 1.06];

/// Choice of the views that a photo is matched with.
pub(super) struct ViewSearch {
    fineness: ViewFineness,
    /// Groups of views at most.
    groups: usize,
    /// Places of the photo that agree on a pose, from which no more views are looked at.
    enough: usize,
}

/// For photos taken about like the training photos.
pub(super) const ORDINARY: ViewSearch = ViewSearch { fineness: ViewFineness::Own, groups: 6, enough: 40 };
/// For photos taken much nearer.
pub(super) const CLOSE_UPS: ViewSearch = ViewSearch { fineness: ViewFineness::Finer, groups: 16, enough: 24 };

/// Features of a photo, its lens, and the focal lengths that are tried.
pub(super) struct SeenPhoto<'a> {
    pub(super) features: Vec<PictureFeature>,
    pub(super) lens: &'a Camera,
    /// Ratios to that of the lens.
    pub(super) focals: &'a [f64],
}

/// The pose that most matches agree on, and the number of places of the photo that do.
#[derive(Default)]
pub(super) struct MatchedPose {
    pub(super) pose: Option<Consensus>,
    pub(super) agreeing: usize,
}

impl MatchedPose {
    /// True if the agreement is no chance.
    pub(super) fn is_supported(&self) -> bool {
        self.agreeing >= SUPPORTED
    }

    /// Keeps the pose on which more places of the photo agree.
    fn keep_better(&mut self, found: Option<Consensus>, matches: &[PointMatch]) {
        let Some(found) = found else { return };
        // A place that matches points of several views counts once.
        let mut places: Vec<[u64; 2]> =
            found.inliers.iter().map(|&i| matches[i].pixel.to_array().map(f64::to_bits)).collect();
        places.sort_unstable();
        places.dedup();
        if places.len() > self.agreeing {
            *self = Self { pose: Some(found), agreeing: places.len() };
        }
    }
}

/// Matches a photo with the views of a gallery, in the order given.
pub(super) fn matched(
    gallery: &mut Gallery,
    photo: &SeenPhoto,
    views: &[AlikeView],
    search: &ViewSearch,
    observer: &dyn Observer,
) -> Result<MatchedPose, LocateError> {
    let longer_px = f64::from(photo.lens.width_px.max(photo.lens.height_px));
    let within_px = WITHIN * longer_px;
    let mut best = MatchedPose::default();
    for group in views.chunks(GROUP).take(search.groups) {
        let mut matches = Vec::new();
        for view in group {
            observer.proceed()?;
            let known = gallery.features(view.view, search.fineness)?;
            matches.extend(matches_of(photo, &known, |_, _| true));
        }
        best.keep_better(consensus(&matches, photo.lens, photo.focals, within_px), &matches);
        if best.agreeing >= search.enough {
            break;
        }
    }
    // From about the right place nearly everything looks alike, and nearly nothing else is near.
    if let (Some(found), true) = (&best.pose, best.is_supported()) {
        observer.proceed()?;
        let near_px = NEAR * longer_px;
        let known = gallery.features_from(&found.camera)?;
        let matches = matches_of(photo, &known, |a, b| a.distance_squared(b) < near_px * near_px);
        let focals = if photo.focals.len() > 1 { &SPREAD[..] } else { &SPREAD[..1] };
        let lens = Camera { focal_px: found.camera.focal_px, ..photo.lens.clone() };
        best.keep_better(consensus(&matches, &lens, focals, within_px), &matches);
    }
    Ok(best)
}

/// Points of the scene and their places in the photo.
fn matches_of(
    photo: &SeenPhoto,
    known: &[WorldFeature],
    allowed: impl Fn(DVec2, DVec2) -> bool + Sync,
) -> Vec<PointMatch> {
    let found = pairs(&photo.features, known, allowed);
    found.into_iter().map(|(i, j)| PointMatch { pixel: photo.features[i].at, world: known[j].world }).collect()
}
