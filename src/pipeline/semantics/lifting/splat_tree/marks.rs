//! Clicks and strokes: pixels of a view, and the Gaussians seen there.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use super::band::LineBand;
use super::seen::{ViewPart, pointed_at};
use crate::render::{RenderError, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, Mask};

/// Longer side of the view in which strokes are drawn, px.
const SIDE_PX: u32 = 512;

/// Least size of a stroke's target, as a multiple of the stroke's own area.
const CLICK: f64 = 16.0;

/// Least square of a line's length, in areas of the line; shorter strokes are clicks.
const LINE: f64 = 3.0;

/// Pixels around a stroke that are rendered with it, and their number for a wide line, in widths of the line.
const ROOM_PX: usize = 32;
const ROOM: f64 = 3.0;

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
    /// Surroundings of a line, if there is room for them.
    pub(super) band: Option<LineBand>,
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
        let (length2, area) = (length_px2(&stroke.pixels), stroke.pixels.area() as f64);
        let is_click = length2 < LINE * area;
        // Far from the stroke, nothing need be rendered.
        let room_px = if is_click { ROOM_PX } else { ROOM_PX.max((ROOM * area / length2.sqrt()) as usize) };
        let part = ViewPart::around(&near, room_px, &stroke.camera);
        let is_in = part.cut(&stroke.pixels);
        let mut view = renderer.weights(cloud, &part.camera, settings);
        let weights = pointed_at(part.weights(&mut view, &|i| is_in[i])?.into_iter());
        let units_per_px = units_per_px(cloud, &stroke.camera, &weights);
        let size = length2.max(CLICK * area) * units_per_px.powi(2);
        let band = match median_radius(cloud, &weights).filter(|_| !is_click) {
            Some(radius) => {
                let (place, reach) = ((&part, is_in.as_slice()), (radius / units_per_px, room_px));
                LineBand::new(&mut view, place, reach)?
            }
            None => None,
        };
        self.strokes.push(StrokeMark { weights, is_plus: stroke.is_plus, is_click, size, band });
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
    let depth = |i: usize| (cloud.world_position(i) - camera.center).dot(axis);
    median(weights, depth).map_or(1.0, |depth| depth / (camera.focal_px.x * camera.focal_px.y).sqrt())
}

/// Median, by weight, of the radii of these Gaussians: of a disk its radius, of a needle its thickness.
fn median_radius(cloud: &GaussianCloud, weights: &BTreeMap<u32, f32>) -> Option<f64> {
    let radius = |i: usize| {
        let mut scales = cloud.log_scales[i];
        scales.sort_by(f32::total_cmp);
        f64::from(scales[1]).exp()
    };
    median(weights, radius)
}

/// Median, by weight, of a value of these Gaussians.
fn median(weights: &BTreeMap<u32, f32>, value: impl Fn(usize) -> f64) -> Option<f64> {
    let mut values: Vec<(f64, f32)> = weights.iter().map(|(i, w)| (value(*i as usize), *w)).collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * values.iter().map(|v| v.1).sum::<f32>();
    let mut sum = 0.0;
    let reached = values.iter().find(|(_, w)| {
        sum += w;
        sum >= half
    });
    reached.map(|(value, _)| *value)
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

    #[test]
    fn half_of_the_weight_is_at_most_the_median() {
        let weights: BTreeMap<u32, f32> = [(0, 1.0), (1, 1.0), (2, 5.0)].into();
        assert_eq!(median(&weights, |i| [1.0, 9.0, 4.0][i]), Some(4.0));
        assert_eq!(median(&BTreeMap::new(), |_| 1.0), None);
    }
}
