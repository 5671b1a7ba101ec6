//! Masks found by a network (SAM, SAM 2) that is asked for everything in a photo, sorted into objects
//! and parts by the paper's filters.

use super::filters::{self, FilterOptions};
use super::segmenter::{FoundMask, SegmentError, Segmenter};
use crate::io;
use crate::models::catalogue::{self, Role};
use crate::models::sam::automatic::{AutomaticOptions, everything};
use crate::models::sam::{PromptedMasks, Sam};
use crate::models::sam2::Sam2;
use crate::models::{ModelError, metadata};
use crate::scene::{Level, Mask, Photo};

/// Masks by a network.
pub struct NetworkMasks {
    network: Box<dyn PromptedMasks>,
    /// Which of its answers are taken.
    pub options: AutomaticOptions,
    /// Which of those are objects, and parts.
    pub filters: FilterOptions,
}

impl NetworkMasks {
    /// The network of this name: a model of the catalogue, or the path of a model's description.
    ///
    /// # Errors
    /// If it is not on this machine, or finds no masks.
    pub fn open(name: &str) -> Result<Self, ModelError> {
        let path = catalogue::find(name, Role::Segmenter)?;
        let mut options = AutomaticOptions::default();
        let network: Box<dyn PromptedMasks> = match metadata::kind(&path)?.as_str() {
            "sam" => Box::new(Sam::open(&path)?),
            "sam2" => {
                // Its small regions are those of low-resolution masks, 16 times as coarse.
                options.least_region_px /= 16;
                Box::new(Sam2::open(&path)?)
            }
            other => return Err(ModelError::Metadata { path, problem: format!("a '{other}' model finds no masks") }),
        };
        Ok(Self { network, options, filters: FilterOptions::default() })
    }
}

impl Segmenter for NetworkMasks {
    fn name(&self) -> &str {
        self.network.name()
    }

    fn covers(&self, _: &Photo) -> bool {
        true
    }

    fn segment(&mut self, photo: &Photo, max_side_px: u32) -> Result<Vec<FoundMask>, SegmentError> {
        let picture = io::photo::load(photo, max_side_px)?;
        let all = everything(&mut *self.network, &picture, &self.options, &mut |_| true)?;
        let masks: Vec<Mask> = all.into_iter().map(|f| f.mask).collect();
        Ok(objects_and_parts(&masks, &self.filters))
    }
}

/// Masks as objects, largest first, then their parts; none has a name.
pub fn objects_and_parts(masks: &[Mask], options: &FilterOptions) -> Vec<FoundMask> {
    let (mut found, mut parts) = (Vec::new(), Vec::new());
    for (parent, object) in filters::objects(masks, options).into_iter().enumerate() {
        let pieces = filters::parts(&object.mask, masks, options);
        parts.extend(pieces.into_iter().map(|p| (parent, p.mask)));
        found.push(FoundMask { level: Level::Object, parent: None, name: None, mask: object.mask });
    }
    let part = |(parent, mask)| FoundMask { level: Level::Part, parent: Some(parent), name: None, mask };
    found.extend(parts.into_iter().map(part));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_inside_something_is_its_part() {
        let mask = |from: usize, to: usize| Mask::from_fn(100, 1, |i| (from..to).contains(&i));
        let found =
            objects_and_parts(&[mask(10, 20), mask(0, 50), mask(60, 90), mask(61, 90)], &FilterOptions::default());
        let list: Vec<_> = found.iter().map(|f| (f.level, f.parent, f.mask.area())).collect();
        // What is nearly all of something is that thing.
        assert_eq!(list, [(Level::Object, None, 50), (Level::Object, None, 30), (Level::Part, Some(0), 10)]);
    }
}
