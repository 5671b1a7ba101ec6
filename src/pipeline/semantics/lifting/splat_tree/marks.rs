//! Clicks and strokes: pixels of a view, and the Gaussians seen there.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use crate::math::lanes::Lane;
use crate::render::{ContributionSink, RenderError, RenderSettings, Renderer, TILE_PX};
use crate::scene::{Camera, GaussianCloud, Mask};

/// Longer side of the view in which strokes are drawn, px.
const SIDE_PX: u32 = 512;

/// Least size of a stroke's target, as a multiple of the stroke's own area.
const CLICK: f64 = 16.0;

/// Least square of a line's length, in areas of the line; shorter strokes are clicks.
const LINE: f64 = 3.0;

/// Pixels around a stroke that are rendered with it.
const ROOM_PX: usize = 32;

/// Share of a pixel's weight that counts as the target, from its largest contributor on.
const POINTED_AT: f32 = 0.6;

/// Marked pixels of a view, as belonging to the target or not.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    pub(crate) camera: Camera,
    pub(crate) pixels: Mask,
    /// True if the pixels belong to the target.
    pub(crate) is_plus: bool,
}

impl Stroke {
    /// The view in which a stroke is drawn whose radius is `radius_px` in the view of a camera: a small one, but not so
    /// small that the stroke would have less than two pixels.
    pub(crate) fn view(camera: &Camera, radius_px: f32) -> Camera {
        let longer = camera.width_px.max(camera.height_px) as f32;
        camera.limited_to(SIDE_PX.max((longer / radius_px).ceil() as u32))
    }
}

/// Marks of a selection.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct StrokeMarks {
    pub(super) strokes: Vec<StrokeMark>,
}

/// Gaussians seen in a stroke, and the weight of each, px.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StrokeMark {
    pub(super) weights: BTreeMap<u32, f32>,
    pub(super) is_plus: bool,
    /// True if it is hardly longer than wide.
    pub(super) is_click: bool,
    /// Square of its length at the depth of its Gaussians, at least a multiple of its area: square units.
    pub(super) size: f64,
}

impl StrokeMarks {
    /// Number of strokes.
    pub(crate) fn len(&self) -> usize {
        self.strokes.len()
    }

    /// Removes the last stroke.
    pub(crate) fn remove_last(&mut self) {
        self.strokes.pop();
    }

    /// Adds a stroke.
    pub(crate) fn add(
        &mut self,
        renderer: &mut Renderer,
        cloud: &GaussianCloud,
        settings: &RenderSettings,
        stroke: &Stroke,
    ) -> Result<(), RenderError> {
        let Some(near) = stroke.pixels.bounds() else { return Ok(()) };
        // Far from the stroke, nothing need be rendered.
        let from = [near.x.start, near.y.start].map(|v| v.saturating_sub(ROOM_PX));
        let to = |end: usize, most: u32| (end + ROOM_PX).min(most as usize);
        let (right, bottom) = (to(near.x.end, stroke.camera.width_px), to(near.y.end, stroke.camera.height_px));
        let (width, height) = (right - from[0], bottom - from[1]);
        let camera = &Camera {
            width_px: width as u32,
            height_px: height as u32,
            principal_px: stroke.camera.principal_px - DVec2::new(from[0] as f64, from[1] as f64),
            ..stroke.camera.clone()
        };
        let row = || Row { pixels: &stroke.pixels, from, width, found: Vec::new() };
        let mut rows: Vec<Row<'_>> = (0..height.div_ceil(TILE_PX)).map(|_| row()).collect();
        renderer.contributions(cloud, camera, settings, &mut rows)?;
        let mut by_pixel: BTreeMap<u32, Vec<(f32, u32)>> = BTreeMap::new();
        for (pixel, gaussian, weight) in rows.into_iter().flat_map(|r| r.found) {
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
        let (length2, area) = (length_px2(&stroke.pixels), stroke.pixels.area() as f64);
        let is_click = length2 < LINE * area;
        let size = length2.max(CLICK * area) * units_per_px(cloud, &stroke.camera, &weights).powi(2);
        self.strokes.push(StrokeMark { weights, is_plus: stroke.is_plus, is_click, size });
        Ok(())
    }
}

/// Square of a stroke's length, square px.
fn length_px2(pixels: &Mask) -> f64 {
    let at = |i: usize| DVec2::new((i % pixels.width_px()) as f64, (i / pixels.width_px()) as f64);
    let area = pixels.area() as f64;
    let mean = pixels.pixels().map(at).sum::<DVec2>() / area;
    let variance = pixels.pixels().map(|i| at(i).distance_squared(mean)).sum::<f64>() / area;
    // A line of length l has a variance of l squared over 12.
    12.0 * variance
}

/// Size of a pixel at the median depth, by weight, of these Gaussians.
fn units_per_px(cloud: &GaussianCloud, camera: &Camera, weights: &BTreeMap<u32, f32>) -> f64 {
    let axis = camera.world_from_camera * DVec3::Z;
    let depth = |i: &u32| (cloud.world_position(*i as usize) - camera.center).dot(axis);
    let mut depths: Vec<(f64, f32)> = weights.iter().map(|(i, w)| (depth(i), *w)).collect();
    depths.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * depths.iter().map(|d| d.1).sum::<f32>();
    let mut sum = 0.0;
    let reached = depths.iter().find(|(_, w)| {
        sum += w;
        sum >= half
    });
    reached.map_or(1.0, |(depth, _)| depth / (camera.focal_px.x * camera.focal_px.y).sqrt())
}

/// Collects the contributors of the marked pixels in one row of tiles.
struct Row<'a> {
    pixels: &'a Mask,
    /// The corner of the rendered part in the view.
    from: [usize; 2],
    width: usize,
    found: Vec<(u32, u32, f32)>,
}

impl ContributionSink<f32> for Row<'_> {
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
        for (k, &weight) in weights.iter().enumerate().take(self.width - x).filter(|(_, w)| **w > 0.0) {
            let pixel = (y + self.from[1]) * self.pixels.width_px() + x + k + self.from[0];
            if self.pixels.contains(pixel) {
                self.found.push((pixel as u32, gaussian, weight));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::hierarchy::tests::cameras;
    use super::*;

    #[test]
    fn a_thin_stroke_is_drawn_in_a_larger_view_and_no_other() {
        let camera = cameras()[0].resized(2000, 1500);
        let side = |radius_px: f32| Stroke::view(&camera, radius_px).width_px;
        assert_eq!([5.0, 4.0, 32.0].map(side), [512; 3], "the usual width, and wider ones");
        assert_eq!([2.0, 1.0, 0.5].map(side), [1000, 2000, 2000], "as large as it is at most");
        assert_eq!(Stroke::view(&cameras()[0], 0.5), cameras()[0]);
    }
}
