//! Masks of one photo, and their sources.

use super::error::FindError;
use super::filters::Kept;
use crate::io::labels::language_features::MaskVectors;
use crate::io::labels::{Labels, Region};
use crate::pipeline::observer::{Observer, Ticker};
use crate::scene::{Level, Mask, Photo};

/// A mask that a segmenter found in one photo.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundMask {
    pub(crate) level: Level,
    /// Index of its whole's mask, which comes before it.
    pub(crate) parent: Option<usize>,
    /// Name, if the segmenter knows one.
    pub(crate) name: Option<String>,
    /// Its pixels.
    pub mask: Mask,
}

/// Returns the objects, in their order, then the parts that each has, without names.
pub(super) fn with_parts(objects: Vec<Kept>, parts_of: impl Fn(&Kept) -> Vec<Kept>) -> Vec<FoundMask> {
    let (mut found, mut parts) = (Vec::new(), Vec::new());
    for (parent, object) in objects.into_iter().enumerate() {
        parts.extend(parts_of(&object).into_iter().map(|part| (parent, part.mask)));
        found.push(FoundMask { level: Level::Object, parent: None, name: None, mask: object.mask });
    }
    let part = |(parent, mask)| FoundMask { level: Level::Part, parent: Some(parent), name: None, mask };
    found.extend(parts.into_iter().map(part));
    found
}

/// Finds the objects and parts of a photo.
pub trait Segmenter {
    /// Name for display.
    fn name(&self) -> &str;

    /// Returns whether the segmenter has masks of a photo.
    fn covers(&self, photo: &Photo) -> bool;

    /// Returns the photo to begin with, by index: the first that is covered.
    fn first(&self, photos: &[Photo], _: &mut dyn Observer) -> Result<Option<usize>, FindError> {
        Ok(photos.iter().position(|p| self.covers(p)))
    }

    /// Returns the names that the user gave to things in a photo; none if masks are computed.
    ///
    /// # Errors
    /// If they cannot be read.
    fn names(&self, _: &Photo) -> Result<Vec<String>, FindError> {
        Ok(Vec::new())
    }

    /// Returns the masks of a photo with the vectors that came with them, undistorted and scaled to at most
    /// `max_side_px`; `None` if there are none.
    ///
    /// # Errors
    /// If they cannot be read.
    fn vectors(&self, _: &Photo, _max_side_px: u32) -> Result<Option<MaskVectors>, FindError> {
        Ok(None)
    }

    /// Returns the masks of a photo, undistorted and scaled to at most `max_side_px`, wholes before pieces. Empty if
    /// it finds nothing.
    fn segment(
        &mut self,
        photo: &Photo,
        max_side_px: u32,
        observer: &mut dyn Observer,
    ) -> Result<Vec<FoundMask>, FindError>;
}

/// Masks that come with the dataset. Regions without a level count as objects if no other contains them, else as
/// parts of the smallest that does.
pub(crate) struct FileMasks(pub(crate) Labels);

/// Most photos whose labels are counted, their longer side meanwhile, least pixels of a counted region, and pixels at
/// which a region is shown half as well as possible.
const COUNTED: usize = 64;
const COUNTED_SIDE_PX: u32 = 512;
const COUNTED_PX: usize = 12;
const HALF_PX: f64 = 50.0;

/// Least share of a region that lies in another one for it to be its piece.
const INSIDE: f64 = 0.9;

impl Segmenter for FileMasks {
    fn name(&self) -> &str {
        "files"
    }

    fn covers(&self, photo: &Photo) -> bool {
        self.0.has(photo)
    }

    /// The photo with most labeled things; of equals, the one that shows them best.
    fn first(&self, photos: &[Photo], observer: &mut dyn Observer) -> Result<Option<usize>, FindError> {
        let covered: Vec<usize> = (0..photos.len()).filter(|i| self.covers(&photos[*i])).collect();
        let counted: Vec<usize> = covered.iter().copied().step_by(covered.len().div_ceil(COUNTED).max(1)).collect();
        if counted.len() < 2 {
            return Ok(counted.first().copied());
        }
        let mut ticker = Ticker::new("Counting labels", counted.len());
        let mut most: Option<((usize, f64), usize)> = None;
        for (k, &i) in counted.iter().enumerate() {
            // Unreadable labels are reported by the code that uses them.
            let regions = self.0.of(&photos[i], COUNTED_SIDE_PX).unwrap_or_default();
            let area = |r: &Region| r.mask.area() as f64;
            let count = regions.iter().filter(|r| r.mask.area() >= COUNTED_PX).count();
            let shown = (count, regions.iter().map(|r| area(r) / (area(r) + HALF_PX)).sum());
            if most.is_none_or(|m| shown > m.0) {
                most = Some((shown, i));
            }
            ticker.tick(k + 1, observer)?;
        }
        Ok(most.map(|m| m.1))
    }

    fn names(&self, photo: &Photo) -> Result<Vec<String>, FindError> {
        Ok(self.0.names(photo)?)
    }

    fn vectors(&self, photo: &Photo, max_side_px: u32) -> Result<Option<MaskVectors>, FindError> {
        Ok(self.0.vectors(photo, max_side_px)?)
    }

    fn segment(&mut self, photo: &Photo, max_side_px: u32, _: &mut dyn Observer) -> Result<Vec<FoundMask>, FindError> {
        Ok(found(self.0.of(photo, max_side_px)?))
    }
}

/// Gives every region a level and a parent, and puts wholes before pieces.
fn found(regions: Vec<Region>) -> Vec<FoundMask> {
    let areas: Vec<usize> = regions.iter().map(|r| r.mask.area()).collect();
    let parent_of = |i: usize| -> Option<usize> {
        let region = &regions[i];
        if region.level == Some(Level::Object) {
            return None;
        }
        region.parent.or_else(|| {
            let around = (0..regions.len()).filter(|&j| {
                areas[j] > areas[i] && region.mask.overlap(&regions[j].mask) as f64 >= INSIDE * areas[i] as f64
            });
            around.min_by_key(|&j| areas[j])
        })
    };
    let parents: Vec<Option<usize>> = (0..regions.len()).map(parent_of).collect();
    let depth = |i: usize| std::iter::successors(Some(i), |&i| parents[i]).take(regions.len() + 1).count();
    let mut order: Vec<usize> = (0..regions.len()).collect();
    order.sort_by_key(|&i| depth(i));
    let mut place = vec![0; regions.len()];
    order.iter().enumerate().for_each(|(at, &i)| place[i] = at);
    let make = |&i: &usize| {
        let region = &regions[i];
        let level = region.level.unwrap_or(if parents[i].is_some() { Level::Part } else { Level::Object });
        FoundMask {
            level,
            parent: parents[i].map(|p| place[p]).filter(|p| *p < place[i]),
            name: Some(region.name.clone()).filter(|n| !n.is_empty()),
            mask: region.mask.clone(),
        }
    };
    order.iter().map(make).collect()
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use glam::DVec3;

    use super::*;
    use crate::pipeline::observer::Silent;
    use crate::scene::Camera;

    fn region(name: &str, level: Option<Level>, x: std::ops::Range<usize>) -> Region {
        let mask = Mask::from_fn(20, 4, |i| x.contains(&(i % 20)));
        Region { name: name.into(), level, parent: None, mask }
    }

    #[test]
    fn what_lies_inside_another_is_its_part() {
        let masks = found(vec![region("button", None, 3..5), region("pad", None, 2..9), region("box", None, 0..12)]);
        let list: Vec<_> = masks.iter().map(|m| (m.name.as_deref(), m.level, m.parent)).collect();
        let expected = [
            (Some("box"), Level::Object, None),
            (Some("pad"), Level::Part, Some(0)),
            (Some("button"), Level::Part, Some(1)),
        ];
        assert_eq!(list, expected);
    }

    #[test]
    fn the_photo_with_most_labels_is_the_first() {
        let folder = tempfile::tempdir().expect("folder");
        let square = |x: usize| [[x, 1], [x + 5, 1], [x + 5, 8], [x, 8]];
        // Two crumbs are less than a thing; unreadable labels count as nothing; of equals, the first.
        for (name, boxes, crumbs) in [("a", 1, 2), ("c", 2, 0), ("d", 2, 0)] {
            let object = |k: usize, place| serde_json::json!({ "category": format!("c{k}"), "segmentation": place });
            let things = (0..boxes).map(|k| object(k, serde_json::json!(square(6 * k))));
            let small = [[18, 1], [20, 1], [20, 3], [18, 3]];
            let objects: Vec<_> = things.chain((0..crumbs).map(|k| object(9 + k, serde_json::json!(small)))).collect();
            let file = serde_json::json!({
                "info": { "name": format!("{name}.jpg"), "width": 20, "height": 10 }, "objects": objects
            });
            std::fs::write(folder.path().join(format!("{name}.json")), file.to_string()).expect("written");
        }
        let broken = serde_json::json!({
            "info": { "name": "b.jpg", "width": 20, "height": 10 },
            "objects": [{ "category": "c0", "segmentation": [["left", 0], [5, 5], [0, 5]] }]
        });
        std::fs::write(folder.path().join("b.json"), broken.to_string()).expect("written");
        let camera = Camera::look_at(DVec3::NEG_Z, DVec3::ZERO, DVec3::NEG_Y, 0.8, 20, 10).expect("valid");
        let photo = |name: &str| Photo::new(name, PathBuf::new(), camera.clone());
        let photos = ["none.jpg", "a.jpg", "b.jpg", "c.jpg", "d.jpg"].map(photo);
        let masks = FileMasks(Labels::open(folder.path()).expect("labels"));
        assert_eq!(masks.first(&photos, &mut Silent).expect("counted"), Some(3));
        assert_eq!(masks.first(&photos[..2], &mut Silent).expect("counted"), Some(1));
        assert_eq!(masks.first(&photos[..1], &mut Silent).expect("counted"), None);
    }

    #[test]
    fn objects_stay_objects_and_lone_parts_have_no_parent() {
        let masks = found(vec![region("inner", Some(Level::Object), 3..5), region("outer", Some(Level::Object), 0..9)]);
        assert!(masks.iter().all(|m| m.level == Level::Object && m.parent.is_none()));
        let masks = found(vec![region("lone", Some(Level::Part), 3..5), region("", None, 8..12)]);
        assert_eq!((masks[0].parent, masks[1].level, masks[1].name.clone()), (None, Level::Object, None));
    }
}
