//! Label of each pixel, and the weights of competing labels: sums of `alpha * transmittance` over the Gaussians that
//! carry them.

use super::CpuRenderer;
use crate::math::lanes::Lane;
use crate::render::{ContributionSink, RenderError, RenderSettings, TILE_PX};
use crate::scene::{Camera, GaussianCloud};

/// Labels that compete for one pixel at most; the least is dropped.
pub(crate) const COMPETITORS: usize = 8;
/// Unknown label, a group of its own.
pub(crate) const UNKNOWN: u32 = u32::MAX;

/// The label that wins a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LabelWinner {
    /// Heaviest label of the heaviest group; 0 where less than half of the light is blocked.
    pub label: u32,
    /// Share of the pixel's weight that belongs to its group.
    pub share: f32,
    /// Weight of all labels.
    pub alpha: f32,
}

/// Labels of a pixel with their accumulated weights. Unused places have weight 0.
pub type PixelWeights = [(u32, f32); COMPETITORS];

/// The weights of a view's pixels, row-major, by the label `of` each Gaussian of `cloud`.
pub(crate) fn label_weights(
    renderer: &mut CpuRenderer<f32>,
    cloud: &GaussianCloud,
    of: &[u32],
    camera: &Camera,
    settings: &RenderSettings,
) -> Result<Vec<PixelWeights>, RenderError> {
    let (width, height) = (camera.width_px as usize, camera.height_px as usize);
    let strip = |y: usize| TILE_PX.min(height - y * TILE_PX) * width;
    let mut rows: Vec<Row<'_>> = (0..height.div_ceil(TILE_PX))
        .map(|ty| Row { of, width, top: ty * TILE_PX, pixels: vec![[(0, 0.0); COMPETITORS]; strip(ty)] })
        .collect();
    renderer.contributions(cloud, camera, settings, &mut rows)?;
    Ok(rows.into_iter().flat_map(|r| r.pixels).collect())
}

/// Winner of a pixel. `groups` has the group of each label; a missing one is 0, unlabeled, but for [`UNKNOWN`], which
/// is a group of its own.
pub(crate) fn winner(places: &PixelWeights, groups: &[u32]) -> LabelWinner {
    let alpha: f32 = places.iter().map(|p| p.1).sum();
    if alpha < 0.5 {
        return LabelWinner { alpha, ..LabelWinner::default() };
    }
    let group_of =
        |label: u32| if label == UNKNOWN { UNKNOWN } else { groups.get(label as usize).copied().unwrap_or(0) };
    let together = |group: u32| places.iter().filter(|p| group_of(p.0) == group).map(|p| p.1).sum::<f32>();
    let (mut best, mut most) = (0, 0.0);
    for place in places.iter().filter(|p| p.1 > 0.0) {
        let group = group_of(place.0);
        let sum = together(group);
        if sum > most {
            (best, most) = (group, sum);
        }
    }
    let inner = places.iter().filter(|p| p.1 > 0.0 && group_of(p.0) == best);
    let label = inner.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |p| p.0);
    LabelWinner { label, share: most / alpha, alpha }
}

/// The competitors of the pixels of one row of tiles.
struct Row<'a> {
    of: &'a [u32],
    width: usize,
    /// First row of pixels.
    top: usize,
    pixels: Vec<PixelWeights>,
}

impl ContributionSink<f32> for Row<'_> {
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
        let label = self.of[gaussian as usize];
        let first = (y - self.top) * self.width + x;
        let end = weights.len().min(self.width - x);
        for (places, &weight) in self.pixels[first..first + end].iter_mut().zip(weights) {
            if weight <= 0.0 {
                continue;
            }
            // Free places have no weight.
            match places.iter_mut().find(|p| p.0 == label && p.1 > 0.0) {
                Some(place) => place.1 += weight,
                None => {
                    if let Some(least) = places.iter_mut().min_by(|a, b| a.1.total_cmp(&b.1)).filter(|p| p.1 < weight) {
                        *least = (label, weight);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pixel with these places taken.
    fn pixel(taken: &[(u32, f32)]) -> PixelWeights {
        std::array::from_fn(|k| taken.get(k).copied().unwrap_or_default())
    }

    #[test]
    fn the_group_wins_before_its_label() {
        let groups = [0, 1, 2, 1, 1];
        let three = winner(&pixel(&[(3, 0.25), (4, 0.2), (2, 0.4)]), &groups);
        assert_eq!(three.label, 3);
        assert!((three.share - 0.45 / 0.85).abs() < 1e-6 && (three.alpha - 0.85).abs() < 1e-6);
        assert_eq!(winner(&pixel(&[(3, 0.25), (4, 0.2), (UNKNOWN, 0.5)]), &groups).label, UNKNOWN);
        assert_eq!(winner(&[(1, 0.05); COMPETITORS], &groups).label, 0, "mostly see-through");
    }

    #[test]
    fn of_two_that_are_equal_the_first_wins() {
        let groups = [0, 1, 2];
        let half = winner(&pixel(&[(2, 0.25), (1, 0.25)]), &groups);
        assert_eq!(half, LabelWinner { label: 2, share: 0.5, alpha: 0.5 }, "half of the light is enough");
        assert_eq!(winner(&pixel(&[(2, 0.25), (1, 0.24)]), &groups).label, 0);
        let found = winner(&pixel(&[(99, 0.6), (1, 0.3)]), &groups);
        assert!(found.label == 99 && (found.share - 0.6 / 0.9).abs() < 1e-6, "a label without a group is nobody's");
        assert_eq!(winner(&pixel(&[]), &groups), LabelWinner::default());
    }

    #[test]
    fn a_pixel_keeps_the_heaviest_of_many() {
        let of: Vec<u32> = (1..=10).collect();
        let mut row = Row { of: &of, width: 12, top: 4, pixels: vec![[(0, 0.0); COMPETITORS]; 24] };
        let only = |lane: usize, w: f32| -> Lane<f32> { std::array::from_fn(|l| if l == lane { w } else { 0.0 }) };
        // Ten labels, ever heavier, for the pixel at column 9 of row 5; the first twice.
        (0..10).for_each(|g| row.add(g, 8, 5, &only(1, 0.01 * (g + 1) as f32)));
        row.add(9, 8, 5, &only(1, 0.5));
        row.add(0, 8, 5, &only(1, 0.005));
        let at = row.pixels[12 + 9];
        assert!(at.iter().any(|p| p.0 == 10 && (p.1 - 0.6).abs() < 1e-6), "{at:?}");
        let mut labels: Vec<u32> = at.iter().map(|p| p.0).collect();
        labels.sort_unstable();
        assert_eq!(labels, [3, 4, 5, 6, 7, 8, 9, 10], "the two lightest were dropped, and do not come back");
        assert!(row.pixels.iter().enumerate().all(|(i, p)| i == 21 || p.iter().all(|p| p.1 == 0.0)));
        // Weights beyond the right edge are not the next row's.
        row.add(0, 8, 4, &[1.0; 8]);
        let reached: Vec<usize> = (0..24).filter(|i| row.pixels[*i].iter().any(|p| p.0 == 1)).collect();
        assert_eq!(reached, [8, 9, 10, 11]);
    }
}
