//! Surroundings of a line: the Gaussians along it, and those around it, which tell how wide the surface is there.

use std::collections::BTreeMap;

use super::seen::ViewPart;
use crate::math::grid::distances;
use crate::render::{RenderError, ViewWeights};

/// Width of a surface in widths of a line, up to which it is about as wide as the line.
pub(super) const AS_WIDE: f64 = 2.0;
/// Area around a line that is looked at, in areas of the line: as much on each side as makes a surface that ends at the
/// line wider than [`AS_WIDE`].
const LOOKED_AT: f64 = 2.0 * AS_WIDE + 1.0;

/// Surroundings of a line. The line is widened by the radius of a Gaussian on each side.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LineBand {
    /// Gaussians along the line: those with most of their weight in it, hidden ones, too.
    pub(super) along: Vec<u32>,
    /// Area of the line, px.
    pub(super) area_px: f64,
    /// Weights of the Gaussians in and around the line, px.
    pub(super) around: BTreeMap<u32, f32>,
}

impl LineBand {
    /// Looks around the pixels `is_line` of a part of a view, of which `view` has the weights; `None` if the part has too little room for that.
    pub(super) fn new(
        view: &mut ViewWeights<'_>,
        (part, is_line): (&ViewPart, &[bool]),
        (radius_px, room_px): (f64, usize),
    ) -> Result<Option<Self>, RenderError> {
        let far = distances(part.width_px, is_line, room_px);
        // The line ends half a pixel beyond the centers of its pixels.
        let is_wide = |i: usize| far[i] <= radius_px + 0.5;
        let area_px = (0..far.len()).filter(|i| is_wide(*i)).count() as f64;
        let mut near: Vec<f64> = far.iter().copied().filter(|d| d.is_finite()).collect();
        near.sort_by(f64::total_cmp);
        let Some(reach) = near.get((LOOKED_AT * area_px) as usize).copied() else { return Ok(None) };
        let mut around: BTreeMap<u32, f32> = BTreeMap::new();
        for seen in part.weights(view, &|i| far[i] <= reach)? {
            *around.entry(seen.gaussian).or_default() += seen.weight;
        }
        // A Gaussian has most of its weight where its center is.
        let is_along = |i: &u32| {
            let at = part.camera.project(view.cloud.world_position(*i as usize));
            at.filter(|at| at.min_element() >= 0.0).is_some_and(|at| {
                let [x, y] = [at.x as usize, at.y as usize];
                x < part.width_px && y < part.height_px && is_wide(y * part.width_px + x)
            })
        };
        let along = (0..view.cloud.len() as u32).filter(is_along).collect();
        Ok(Some(Self { along, area_px, around }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::hierarchy::tests::{H, W, cameras, sheet};
    use super::*;
    use crate::render::{RenderSettings, Renderer};
    use crate::scene::Mask;

    /// Surroundings of a level line of three rows, 40 px long, in the middle of the sheet.
    fn band(radius_px: f64, room_px: usize) -> Option<LineBand> {
        let line = |i: usize| (44..84).contains(&(i % W)) && (47..50).contains(&(i / W));
        let mask = Mask::from_fn(W, H, line);
        let part = ViewPart::around(&mask.bounds().expect("a line"), room_px, &cameras()[0]);
        let is_line = part.cut(&mask);
        assert_eq!(is_line.iter().filter(|is| **is).count(), mask.area());
        let (settings, cloud) = (RenderSettings::default(), sheet().0);
        let mut renderer = Renderer::new();
        let mut view = renderer.weights(&cloud, &part.camera, &settings);
        LineBand::new(&mut view, (&part, &is_line), (radius_px, room_px)).expect("drawn")
    }

    #[test]
    fn a_line_is_widened_and_its_surroundings_are_five_times_as_large() {
        let plain = band(0.0, 32).expect("room");
        assert_eq!(plain.area_px, 120.0, "as drawn");
        let wide = band(1.6, 32).expect("room");
        // Two pixels more on each side, and rounded ends.
        assert!((280.0..=44.0 * 7.0).contains(&wide.area_px), "{}", wide.area_px);
        let seen: f32 = wide.around.values().sum();
        let share = f64::from(seen) / (LOOKED_AT * wide.area_px);
        assert!((0.85..1.1).contains(&share), "the sheet hides all behind it: {share}");
        // Gaussians are 2.6 px apart: 15 columns of one row, or 17 of three.
        assert!((14..=17).contains(&plain.along.len()), "{}", plain.along.len());
        assert!((32..=54).contains(&wide.along.len()), "{}", wide.along.len());
        assert!(plain.along.iter().all(|i| wide.along.contains(i)));
    }

    #[test]
    fn without_room_nothing_is_said_of_the_surroundings() {
        assert_eq!(band(1.6, 4), None);
        assert!(band(1.6, 16).is_some(), "the control");
    }
}
