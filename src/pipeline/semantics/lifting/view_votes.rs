//! Votes in one view: weights of each Gaussian in the pixels of each label.

use glam::DVec3;
use rayon::prelude::*;

use crate::math::lanes::{LANES, Lane};
use crate::render::{self, ContributionSink, RenderError, TILE_PX, ViewWeights};
use crate::scene::{Camera, GaussianCloud, IdentityId};

/// Weights of the Gaussians in a view.
#[derive(Debug)]
pub(crate) struct ViewVotes {
    /// By row of tiles: Gaussian, label of pixels, and its weight in them, px.
    rows: Vec<Vec<(u32, IdentityId, f32)>>,
    /// Weight of each Gaussian as an area in square units, so that near and far views compare.
    pub(crate) areas: Vec<f32>,
}

impl ViewVotes {
    /// Sums the weights in a view. `labels` holds a label for each pixel, row-major.
    pub(crate) fn of(view: &mut ViewWeights<'_>, labels: &[IdentityId]) -> Result<Self, RenderError> {
        let [width, height] = view.size_px();
        assert_eq!(labels.len(), width * height, "one label per pixel");
        let common = common(labels, width);
        let mut rows: Vec<VoteRow<'_>> =
            (0..height.div_ceil(TILE_PX)).map(|_| VoteRow::new(labels, &common, width)).collect();
        view.give(&mut rows)?;
        rows.iter_mut().for_each(VoteRow::finish);
        let rows: Vec<_> = rows.into_iter().map(|r| r.found).collect();
        Ok(Self { areas: areas(view.cloud, view.camera, &rows), rows })
    }

    /// Returns the area of each Gaussian in a view, square units.
    pub(crate) fn areas_of(view: &mut ViewWeights<'_>) -> Result<Vec<f32>, RenderError> {
        let [width, height] = view.size_px();
        Ok(Self::of(view, &vec![render::UNKNOWN; width * height])?.areas)
    }

    /// All weights: Gaussian, label of pixels, and its weight in them, px.
    pub(crate) fn all(&self) -> impl Iterator<Item = (u32, IdentityId, f32)> {
        self.rows.iter().flatten().copied()
    }
}

fn areas(cloud: &GaussianCloud, camera: &Camera, rows: &[Vec<(u32, IdentityId, f32)>]) -> Vec<f32> {
    let mut areas = vec![0.0; cloud.len()];
    rows.iter().flatten().for_each(|f| areas[f.0 as usize] += f.2);
    to_square_units(&mut areas, cloud, camera);
    areas
}

/// Makes the pixels that each Gaussian takes in a view an area at its depth, square units, so that near and far views
/// compare.
pub(crate) fn to_square_units(areas: &mut [f32], cloud: &GaussianCloud, camera: &Camera) {
    let axis = camera.world_from_camera * DVec3::Z;
    let focal = camera.focal_px.x * camera.focal_px.y;
    areas.par_iter_mut().enumerate().filter(|(_, a)| **a > 0.0).for_each(|(i, area)| {
        let depth = (cloud.world_position(i) - camera.center).dot(axis);
        *area *= (depth * depth / focal) as f32;
    });
}

/// Returns the label that all pixels of each vector of a row have, row after row; `None` for several.
fn common(labels: &[IdentityId], width: usize) -> Vec<Option<IdentityId>> {
    let of = |some: &[IdentityId]| some.iter().all(|label| *label == some[0]).then_some(some[0]);
    labels.chunks(width.max(1)).flat_map(|row| row.chunks(LANES).map(of)).collect()
}

/// Collects the weights of one row of tiles.
struct VoteRow<'a> {
    labels: &'a [IdentityId],
    common: &'a [Option<IdentityId>],
    width: usize,
    /// Gaussian whose weights are being summed.
    gaussian: u32,
    sums: Vec<(IdentityId, f32)>,
    found: Vec<(u32, IdentityId, f32)>,
}

impl<'a> VoteRow<'a> {
    fn new(labels: &'a [IdentityId], common: &'a [Option<IdentityId>], width: usize) -> Self {
        Self { labels, common, width, gaussian: u32::MAX, sums: Vec::new(), found: Vec::new() }
    }

    fn finish(&mut self) {
        let gaussian = self.gaussian;
        self.found.extend(self.sums.drain(..).map(|(id, weight)| (gaussian, id, weight)));
    }

    /// The sum of a label.
    #[inline(always)]
    fn sum_of(&mut self, label: IdentityId) -> &mut f32 {
        let place = self.sums.iter().position(|s| s.0 == label).unwrap_or_else(|| {
            self.sums.push((label, 0.0));
            self.sums.len() - 1
        });
        &mut self.sums[place].1
    }
}

impl ContributionSink<f32> for VoteRow<'_> {
    #[inline(always)]
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
        if gaussian != self.gaussian {
            self.finish();
            self.gaussian = gaussian;
        }
        // Without a branch for zeros, which change no sum.
        if let Some(label) = self.common[y * self.width.div_ceil(LANES) + x / LANES] {
            let sum = self.sum_of(label);
            weights.iter().for_each(|weight| *sum += weight);
            return;
        }
        let labels = self.labels;
        let end = (x + weights.len()).min(self.width);
        for (&label, &weight) in labels[y * self.width + x..y * self.width + end].iter().zip(weights) {
            if weight > 0.0 {
                *self.sum_of(label) += weight;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{RenderSettings, Renderer};

    const UNKNOWN: IdentityId = render::UNKNOWN;

    /// Sums the weights of each Gaussian and label pixel by pixel.
    struct Reference<'a> {
        labels: &'a [IdentityId],
        width: usize,
        gaussian: u32,
        /// Place of its first sum.
        first: usize,
        found: Vec<(u32, IdentityId, f32)>,
    }

    impl ContributionSink<f32> for Reference<'_> {
        fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
            if gaussian != self.gaussian {
                (self.gaussian, self.first) = (gaussian, self.found.len());
            }
            for k in (0..LANES.min(self.width - x)).filter(|k| weights[*k] > 0.0) {
                let label = self.labels[y * self.width + x + k];
                match self.found[self.first..].iter_mut().find(|f| f.1 == label) {
                    Some(found) => found.2 += weights[k],
                    None => self.found.push((gaussian, label, weights[k])),
                }
            }
        }
    }

    #[test]
    fn weights_are_summed_as_pixel_by_pixel() {
        let mut random = 9_u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / (1 << 24) as f32
        };
        let cloud =
            GaussianCloud::isotropic((0..300).map(|_| [next() - 0.5, next() - 0.5, next()]).collect(), -2.8, 1.0);
        let from = |x: f64| {
            let camera = Camera::look_at(DVec3::new(x, 0.2, -3.0), DVec3::ZERO, DVec3::NEG_Y, 0.5, 43, 37);
            camera.expect("valid")
        };
        let (settings, mut renderer) = (RenderSettings::default(), Renderer::new());
        // Labels of whole vectors, of some pixels, and of none.
        let label = |i: usize| match (i % 43, i / 43) {
            (x, y) if x < 20 => 1 + (x + y) as IdentityId % 3,
            (x, _) if x < 33 => 7,
            _ => UNKNOWN,
        };
        let labels: Vec<IdentityId> = (0..43 * 37).map(label).collect();
        let row = || Reference { labels: &labels, width: 43, gaussian: u32::MAX, first: 0, found: Vec::new() };
        let mut rows: Vec<Reference<'_>> = (0..37_usize.div_ceil(TILE_PX)).map(|_| row()).collect();
        renderer.contributions(&cloud, &from(0.0), &settings, &mut rows).expect("drawn");
        let expected: Vec<_> = rows.into_iter().flat_map(|r| r.found).collect();
        let found = |renderer: &mut Renderer, x: f64| {
            ViewVotes::of(&mut renderer.weights(&cloud, &from(x), &settings), &labels).expect("drawn")
        };
        let view = found(&mut renderer, 0.0);
        assert!(expected.len() > 600, "{}", expected.len());
        assert!(view.all().eq(expected), "bit by bit");
        let other = found(&mut renderer, 0.1);
        assert!(!other.all().eq(view.all()) && other.areas != view.areas, "the control, of another camera");
    }

    #[test]
    fn a_row_that_ends_within_a_vector_ignores_the_overhang() {
        let labels = [1, 1, 2, UNKNOWN];
        let common = common(&labels, 4);
        let mut row = VoteRow::new(&labels, &common, 4);
        row.add(7, 2, 0, &[0.5; 8]);
        row.add(7, 0, 0, &[0.25, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        row.add(8, 0, 0, &[1.0; 8]);
        row.finish();
        row.found.retain(|f| f.2 > 0.0);
        let all = [(7, 2, 0.5), (7, UNKNOWN, 0.5), (7, 1, 0.25), (8, 1, 2.0), (8, 2, 1.0), (8, UNKNOWN, 1.0)];
        assert_eq!(row.found, all);
        assert_eq!(super::common(&[3, 3, 3, 4, 5, 5], 3), [Some(3), None]);
        assert_eq!(super::common(&[2; 20], 10), [Some(2); 4]);
    }
}
