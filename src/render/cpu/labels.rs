//! Which labels have how much of a pixel: sums of the weights `alpha * transmittance` of the Gaussians that carry them.

use super::CpuRenderer;
use crate::math::lanes::Lane;
use crate::render::{ContributionSink, RenderError, RenderSettings, TILE_PX};
use crate::scene::{Camera, GaussianCloud};

/// Labels that compete for one pixel at most; the least is dropped. `COMPETITORS` in `shaders/labels.wgsl`.
pub const COMPETITORS: usize = 8;
/// What a pixel's light belongs to: labels with their accumulated weights. Free places weigh nothing.
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
        // What lies beyond the right edge is not the next row's.
        row.add(0, 8, 4, &[1.0; 8]);
        let reached: Vec<usize> = (0..24).filter(|i| row.pixels[*i].iter().any(|p| p.0 == 1)).collect();
        assert_eq!(reached, [8, 9, 10, 11]);
    }
}
