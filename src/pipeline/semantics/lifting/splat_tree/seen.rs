//! Gaussians seen in marked pixels of a view, of which only the part around them is rendered.

use std::collections::BTreeMap;

use glam::DVec2;

use crate::math::lanes::Lane;
use crate::render::{ContributionSink, RenderError, TILE_PX, ViewWeights};
use crate::scene::{Camera, Mask, PixelBox};

/// Share of a pixel's weight that counts as the target, from its largest contributor on.
const POINTED_AT: f32 = 0.6;

/// Weight of a Gaussian in a pixel of a part of a view.
pub(super) struct SeenWeight {
    pub(super) pixel: u32,
    pub(super) gaussian: u32,
    pub(super) weight: f32,
}

/// A part of a view.
pub(super) struct ViewPart {
    pub(super) camera: Camera,
    /// Its corner in the view.
    from: [usize; 2],
    pub(super) width_px: usize,
    pub(super) height_px: usize,
}

impl ViewPart {
    /// The part of a view with these pixels and `room_px` around them.
    pub(super) fn around(near: &PixelBox, room_px: usize, camera: &Camera) -> Self {
        let from = [near.x.start, near.y.start].map(|v| v.saturating_sub(room_px));
        let to = |end: usize, most: u32| (end + room_px).min(most as usize);
        let (right, bottom) = (to(near.x.end, camera.width_px), to(near.y.end, camera.height_px));
        let (width_px, height_px) = (right - from[0], bottom - from[1]);
        let camera = Camera {
            width_px: width_px as u32,
            height_px: height_px as u32,
            principal_px: camera.principal_px - DVec2::new(from[0] as f64, from[1] as f64),
            ..camera.clone()
        };
        Self { camera, from, width_px, height_px }
    }

    /// Returns, for each pixel of the part, whether a mask of the view has it.
    pub(super) fn cut(&self, mask: &Mask) -> Vec<bool> {
        let at = |i: usize| (i / self.width_px + self.from[1]) * mask.width_px() + i % self.width_px + self.from[0];
        (0..self.width_px * self.height_px).map(|i| mask.contains(at(i))).collect()
    }

    /// Returns the weights of all Gaussians in the pixels for which `is_marked` holds, of this part's `view`.
    pub(super) fn weights(
        &self,
        view: &mut ViewWeights<'_>,
        is_marked: &(dyn Fn(usize) -> bool + Sync),
    ) -> Result<Vec<SeenWeight>, RenderError> {
        let row = || Row { is_marked, width_px: self.width_px, found: Vec::new() };
        let mut rows: Vec<Row<'_>> = (0..self.height_px.div_ceil(TILE_PX)).map(|_| row()).collect();
        view.give(&mut rows)?;
        Ok(rows.into_iter().flat_map(|row| row.found).collect())
    }
}

/// Returns the Gaussians that make up most of some pixels, and the sum of the weights of each, px.
pub(super) fn pointed_at(seen: impl Iterator<Item = SeenWeight>) -> BTreeMap<u32, f32> {
    let mut by_pixel: BTreeMap<u32, Vec<(f32, u32)>> = BTreeMap::new();
    for SeenWeight { pixel, gaussian, weight } in seen {
        by_pixel.entry(pixel).or_default().push((weight, gaussian));
    }
    let mut weights: BTreeMap<u32, f32> = BTreeMap::new();
    for mut found in by_pixel.into_values() {
        found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let enough = POINTED_AT * found.iter().map(|f| f.0).sum::<f32>();
        let mut sum = 0.0;
        for (weight, gaussian) in found {
            *weights.entry(gaussian).or_default() += weight;
            sum += weight;
            if sum >= enough {
                break;
            }
        }
    }
    weights
}

/// Collects the contributors of the marked pixels in one row of tiles.
struct Row<'a> {
    is_marked: &'a (dyn Fn(usize) -> bool + Sync),
    width_px: usize,
    found: Vec<SeenWeight>,
}

impl ContributionSink<f32> for Row<'_> {
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
        for (k, &weight) in weights.iter().enumerate().take(self.width_px - x).filter(|(_, w)| **w > 0.0) {
            let pixel = y * self.width_px + x + k;
            if (self.is_marked)(pixel) {
                self.found.push(SeenWeight { pixel: pixel as u32, gaussian, weight });
            }
        }
    }
}
