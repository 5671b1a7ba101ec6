//! Result of carrying identities over all views, and the seconds of its stages.

use std::time::Instant;

use super::super::mirror::GUESSED;
use super::super::train_codes::CodeView;
use super::super::votes::Assignment;
use super::views::ViewReport;
use crate::scene::findings::{ConflictKind, MaskConflict, PhotoFinding, Seen, SegmentationReport};
use crate::scene::{Identities, Photo};

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tracked {
    pub(crate) identities: Identities,
    pub(crate) assignments: Vec<Assignment>,
    /// The photos that were segmented, in order.
    pub(crate) seeds: Vec<usize>,
    /// Report of every photo, without the identities that hidden Gaussians inherit from those around them.
    pub(crate) views: Vec<ViewReport>,
    /// Share of the pixels of each of these photos that no mask speaks for.
    pub(crate) inferred: Vec<f64>,
    /// Disagreements of masks with the identities known before, with the photo.
    pub(crate) conflicts: Vec<(usize, ConflictKind)>,
    /// The masks of the photos that were segmented and of those to which they were followed.
    pub(crate) masks: Vec<CodeView>,
    /// Seconds that each stage took, in order.
    pub(crate) secs: Vec<(&'static str, f64)>,
}

impl Tracked {
    /// Returns the findings about identities and photos, which are kept with the map.
    pub(crate) fn findings(&self, photos: &[Photo]) -> SegmentationReport {
        let mut seen = vec![Seen::default(); self.identities.len()];
        for (k, view) in self.views.iter().enumerate() {
            for s in &view.seen {
                seen[s.identity as usize - 1].add(k, s.pixels as u64, s.confidence);
            }
        }
        for guess in self.assignments.iter().filter(|a| a.margin == GUESSED) {
            let place = (guess.identity as usize).checked_sub(1);
            place.and_then(|k| seen.get_mut(k)).into_iter().for_each(|seen| seen.guessed += 1);
        }
        let place = |photo: usize| self.views.iter().position(|v| v.photo == photo);
        let conflict = |(photo, what): &(usize, ConflictKind)| {
            place(*photo).map(|k| MaskConflict { photo: k as u32, what: what.clone() })
        };
        let finding = |(v, inferred): (&ViewReport, &f64)| PhotoFinding {
            name: photos[v.photo].name.clone(),
            unknown: v.unknown,
            inferred: *inferred,
        };
        SegmentationReport::new(
            self.views.iter().zip(&self.inferred).map(finding).collect(),
            seen,
            self.conflicts.iter().filter_map(conflict).collect(),
        )
    }
}

/// Stage of carrying identities by Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CarryStage {
    /// Areas of all Gaussians in all photos.
    See,
    /// Id maps and reports of photos.
    Look,
    /// Photos, their edges, and what is known of them.
    Read,
    /// Growth of labels in photos, and its votes.
    Grow,
    /// The surface of the Gaussians, and the labels by their tree, which is made beside the two stages before.
    Group,
}

/// Seconds of each [`CarryStage`], added up over its parts.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CarrySeconds([f64; 5]);

impl CarrySeconds {
    /// Adds the time since `start` to a stage.
    pub(super) fn add(&mut self, stage: CarryStage, start: Instant) {
        self.0[stage as usize] += start.elapsed().as_secs_f64();
    }

    pub(super) fn total(&self) -> f64 {
        self.0.iter().sum()
    }

    /// Stages by name, in their order.
    pub(super) fn named(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let names = ["measure visibility", "check labels", "read photos", "grow labels", "group Gaussians"];
        names.into_iter().zip(self.0)
    }
}
