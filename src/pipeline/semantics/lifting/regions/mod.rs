//! Regions of one photo without any network. Pieces of even color are merged into a tree. Pieces that are still apart
//! at large differences are objects; the same inside an object gives its parts. With trained Gaussians, neighbors on
//! one unbroken surface merge sooner. Nothing has a name, and borders are color changes: rough, but it works on every
//! scene.
//!
//! [`lab`] colors, [`edges`] between them, [`shape`] of the scene, [`basins`] of the edges, the
//! [`tree`] of the basins, and [`mod@segment`] from it.

pub(crate) mod basins;
pub(crate) mod edges;
pub(crate) mod lab;
pub mod segment;
pub(crate) mod shape;
pub(crate) mod tree;

use self::segment::{Picture, RegionOptions, segment};
use super::error::FindError;
use super::filters::{self, FilterOptions, Kept};
use super::segmenter::{FoundMask, Segmenter, with_parts};
use crate::io;
use crate::pipeline::observer::Observer;
use crate::render::{RenderSettings, Renderer};
use crate::scene::{GaussianCloud, Mask, Photo};

/// The built-in segmenter. It covers every photo.
#[derive(Clone, Debug, Default)]
pub struct Regions<'a> {
    /// Gaussians trained on the photos, and render settings, for the shape of the scene.
    pub(crate) trained: Option<(&'a GaussianCloud, &'a RenderSettings)>,
    pub(crate) options: RegionOptions,
    pub(crate) filters: FilterOptions,
}

impl Segmenter for Regions<'_> {
    fn name(&self) -> &str {
        "regions"
    }

    fn covers(&self, _: &Photo) -> bool {
        true
    }

    fn segment(&mut self, photo: &Photo, max_side_px: u32, _: &mut dyn Observer) -> Result<Vec<FoundMask>, FindError> {
        let pixels = io::photo::load(photo, max_side_px)?;
        let camera = photo.camera.limited_to(max_side_px);
        let ends =
            self.trained.and_then(|(cloud, settings)| shape::ends_of(&mut Renderer::new(), cloud, settings, &camera));
        let picture = Picture {
            width: pixels.width_px as usize,
            rgb: &pixels.rgb,
            coverage: pixels.coverage.as_deref(),
            ends: ends.as_deref(),
        };
        Ok(self.find(&picture))
    }
}

impl Regions<'_> {
    /// Objects of a picture, largest first, then their parts; none has a name.
    pub fn find(&self, picture: &Picture<'_>) -> Vec<FoundMask> {
        let candidates = segment(picture, &self.options);
        let masks: Vec<Mask> = candidates.iter().map(|c| c.mask.clone()).collect();
        let pieces = |object: &Kept| &candidates[object.index].pieces;
        let objects = filters::objects(&masks, &self.filters);
        with_parts(objects, |object| filters::parts(&object.mask, pieces(object), &self.filters))
    }
}

#[cfg(test)]
mod tests;
