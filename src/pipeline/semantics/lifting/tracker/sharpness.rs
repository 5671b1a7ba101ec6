//! Blur with which the identities are drawn: the one that fits the labels of the segmented photos best.
//!
//! A color is the mean over a pixel, so splats have a blur; a label is that of the pixel's center. How much less blur is
//! best depends on the Gaussians: large ones lie over borders, and small ones leave gaps (docs/notes/lifting.md).

use super::{Tracker, undrawn};
use crate::math::stats::mean;
use crate::pipeline::semantics::lifting::error::FindError;
use crate::pipeline::semantics::lifting::votes::UNKNOWN;
use crate::pipeline::semantics::view_map::{LEAST_BLUR_PX2, ViewMap};
use crate::scene::{Identities, IdentityId, NO_IDENTITY};

/// Variances that are tried beside the one of pictures, px².
const TRIED: [f64; 4] = [0.25, 0.2, 0.15, LEAST_BLUR_PX2];
/// Most photos that are compared.
const MOST: usize = 8;
/// Least number of pixels of a label that counts.
const LEAST_PX: usize = 10;
/// Least gain in mean IoU.
const GAIN: f64 = 0.001;

impl Tracker<'_> {
    /// Keeps the labels of a segmented photo for [`Self::best_blur`].
    pub(super) fn tell(&mut self, photo: usize, labels: Vec<IdentityId>) {
        if self.told.len() < MOST {
            self.told.push((photo, labels));
        }
    }

    /// Returns the blur with which the identities `of` the Gaussians fit the labels of the segmented photos best, px²;
    /// `None` if none is better than that of pictures.
    pub(super) fn best_blur(&mut self, of: &[IdentityId]) -> Result<Option<f32>, FindError> {
        let plain = self.fit(of, self.settings.blur_px2)?;
        let (mut best, mut most) = (None, plain + GAIN);
        for blur in TRIED.into_iter().filter(|blur| *blur < self.settings.blur_px2) {
            let fit = self.fit(of, blur)?;
            if fit > most {
                (best, most) = (Some(blur as f32), fit);
            }
        }
        Ok(best)
    }

    /// Mean IoU of labels and identities drawn with a blur; 0 without labels.
    fn fit(&mut self, of: &[IdentityId], blur_px2: f64) -> Result<f64, FindError> {
        let settings = self.settings.blurred_by(blur_px2);
        let mut all = Vec::new();
        for (photo, labels) in &self.told {
            let photo = &self.photos[*photo];
            let camera = photo.camera.limited_to(self.options.max_side_px);
            let mut view = self.renderers.one().weights(self.cloud, &camera, &settings);
            let map = ViewMap::of(&mut view, of, &self.identities).map_err(|e| undrawn(photo, e))?;
            all.extend(overlaps(labels, &map.identity, &self.identities));
        }
        Ok(if all.is_empty() { 0.0 } else { mean(&all) })
    }
}

/// IoU of each label with its pieces, if it is large enough; pixels without a label do not count.
fn overlaps(labels: &[IdentityId], drawn: &[IdentityId], all: &Identities) -> impl Iterator<Item = f64> {
    let chain = |id| all.ancestors(id).map(|id| id as usize).collect();
    let chains: Vec<Vec<usize>> = (0..=all.len() as IdentityId).map(chain).collect();
    let wholes = |id: IdentityId| chains.get(id as usize).into_iter().flatten().copied();
    // By identity: pixels of the label, of what is drawn, and of both.
    let mut counts = vec![[0_usize; 3]; all.len() + 1];
    for (&label, &own) in labels.iter().zip(drawn).filter(|(label, _)| **label != UNKNOWN) {
        wholes(label).for_each(|k| counts[k][0] += 1);
        for k in wholes(own) {
            counts[k][1] += 1;
            counts[k][2] += usize::from(wholes(label).any(|whole| whole == k));
        }
    }
    let large = counts.into_iter().skip(NO_IDENTITY as usize + 1).filter(|c| c[0] >= LEAST_PX);
    large.map(|[a, b, both]| both as f64 / (a + b - both) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Level;

    #[test]
    fn labels_that_are_large_enough_are_compared_where_they_speak() {
        let all = Identities::objects(2);
        let labels: Vec<IdentityId> = (0..40).map(|i| [1, 2, UNKNOWN, NO_IDENTITY][i / 10]).collect();
        let found = |drawn: &[IdentityId]| overlaps(&labels, drawn, &all).collect::<Vec<_>>();
        let mut drawn = labels.clone();
        drawn[20..30].fill(1);
        assert_eq!(found(&drawn), [1.0, 1.0], "unknown pixels say nothing");
        drawn[5..15].fill(2);
        assert_eq!(found(&drawn), [0.5, 10.0 / 15.0]);
        drawn[30..40].fill(2);
        assert_eq!(found(&drawn), [0.5, 10.0 / 25.0], "what nobody should have");
        assert_eq!(overlaps(&labels[..9], &drawn, &all).count(), 0, "too small");
        // A whole has the pixels of its pieces.
        let mut all = Identities::objects(1);
        let part = all.add(Level::Part, 1, vec![]);
        let labels: Vec<IdentityId> = (0..40).map(|i| if i < 20 { 1 } else { part }).collect();
        assert_eq!(overlaps(&labels, &[1; 40], &all).collect::<Vec<_>>(), [1.0, 0.0]);
    }
}
