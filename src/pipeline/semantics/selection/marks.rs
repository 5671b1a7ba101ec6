//! Clicks and strokes: pixels of a view, and the Gaussians that they show.

use std::collections::BTreeMap;

use crate::math::lanes::Lane;
use crate::render::{ContributionSink, RenderError, RenderSettings, Renderer, TILE_PX};
use crate::scene::{Camera, GaussianCloud, Mask};

/// Share of a pixel's light, from its foremost contributor on, that is what one points at.
const POINTED_AT: f32 = 0.6;

/// Pixels of a view that are marked, as being of it or as not being of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    pub(crate) camera: Camera,
    pub(crate) pixels: Mask,
    /// Whether this belongs to what is meant.
    pub(crate) is_plus: bool,
}

/// What was marked.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Marks {
    pub(super) strokes: Vec<Marked>,
}

/// The Gaussians that a stroke shows, and how much of each, px.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Marked {
    pub(super) weights: BTreeMap<u32, f32>,
    pub(super) is_plus: bool,
}

impl Marks {
    /// Strokes so far.
    pub(crate) fn len(&self) -> usize {
        self.strokes.len()
    }

    /// Takes the last stroke back.
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
        let camera = &stroke.camera;
        let (width, height) = (camera.width_px as usize, camera.height_px as usize);
        let row = || Row { pixels: &stroke.pixels, width, found: Vec::new() };
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
        self.strokes.push(Marked { weights, is_plus: stroke.is_plus });
        Ok(())
    }
}

/// Collects who contributes to the marked pixels of one row of tiles.
struct Row<'a> {
    pixels: &'a Mask,
    width: usize,
    found: Vec<(u32, u32, f32)>,
}

impl ContributionSink<f32> for Row<'_> {
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
        for (k, &weight) in weights.iter().enumerate().take(self.width - x).filter(|(_, w)| **w > 0.0) {
            let pixel = y * self.width + x + k;
            if self.pixels.contains(pixel) {
                self.found.push((pixel as u32, gaussian, weight));
            }
        }
    }
}
