//! Regions of one photo without any network: pieces of even color grow together into a tree, and
//! what is still apart where only large differences are left is taken for an object; inside an
//! object the same, once more, gives its parts. Where Gaussians are trained already, neighbors on
//! one unbroken surface go together sooner. Nothing has a name, and borders are where colors
//! change: rough, but there is no scene for which it says nothing.
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
use super::filters::{self, FilterOptions};
use super::segmenter::{FoundMask, Segmenter};
use crate::io;
use crate::pipeline::observer::Observer;
use crate::render::RenderSettings;
use crate::scene::{GaussianCloud, Level, Mask, Photo};

/// The built-in segmenter. It can say something about every photo.
#[derive(Clone, Debug, Default)]
pub struct Regions<'a> {
    /// Gaussians that were trained on the photos, and how they are drawn, for the scene's shape.
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
        let ends = self.trained.and_then(|(cloud, settings)| shape::ends_of(cloud, settings, &camera));
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
        let mut parts = Vec::new();
        let mut found = Vec::new();
        for (parent, object) in filters::objects(&masks, &self.filters).into_iter().enumerate() {
            let pieces = filters::parts(&object.mask, &candidates[object.index].pieces, &self.filters);
            parts.extend(pieces.into_iter().map(|p| (parent, p.mask)));
            found.push(FoundMask { level: Level::Object, parent: None, name: None, mask: object.mask });
        }
        let part = |(parent, mask)| FoundMask { level: Level::Part, parent: Some(parent), name: None, mask };
        found.extend(parts.into_iter().map(part));
        found
    }
}

#[cfg(test)]
mod tests;
