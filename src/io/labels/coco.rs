//! COCO's instances: one file for many pictures, each annotation a region, as polygons or run lengths.
//! `fmlgs segment --all` writes such files too, with the level of a category as `supercategory` and its
//! whole as `parent`.

use std::collections::HashMap;
use std::path::Path;

use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use super::rle::Rle;
use super::things::{Thing, is_background, is_ignored, wholes_first};
use super::{Passed, Region, Sheet, draw};
use crate::io::{IoError, files};
use crate::scene::identity::whole_names::BETWEEN;
use crate::scene::{Level, Mask};

#[derive(Deserialize)]
struct File {
    images: Vec<ListedImage>,
    annotations: Vec<Annotation>,
    #[serde(default)]
    categories: Vec<ListedCategory>,
}

#[derive(Deserialize)]
struct ListedImage {
    id: Value,
    file_name: String,
    #[serde(default)]
    width: Option<u32>,
    #[serde(default)]
    height: Option<u32>,
}

#[derive(Deserialize)]
struct ListedCategory {
    id: Value,
    #[serde(default)]
    name: String,
    #[serde(default)]
    supercategory: Value,
    /// Present but `null` for an object, which is a part of nothing.
    #[serde(default, deserialize_with = "stated")]
    parent: Option<Value>,
}

fn stated<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Value>, D::Error> {
    Value::deserialize(deserializer).map(Some)
}

#[derive(Deserialize)]
struct Annotation {
    image_id: Value,
    #[serde(default)]
    category_id: Value,
    #[serde(default)]
    segmentation: Option<Segmentation>,
    #[serde(default)]
    iscrowd: Value,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Segmentation {
    Polygons(Vec<Vec<f64>>),
    Runs(Rle),
    Other(IgnoredAny),
}

/// Name and level of a category, and the category that it is a part of.
struct Category {
    name: String,
    level: Option<Level>,
    whole: Option<String>,
}

/// The pictures of a file and their regions.
pub(crate) struct CocoFile {
    categories: HashMap<String, Category>,
    images: Vec<Image>,
}

struct Image {
    file_name: String,
    size: [Option<u32>; 2],
    /// Index in the file's list, and the annotation.
    annotations: Vec<(usize, Annotation)>,
}

impl CocoFile {
    /// Parses a JSON file; `None` if it is of another kind. Skipped content is counted.
    pub(super) fn parse(file: Value, path: &Path, passed: &mut Passed) -> Result<Option<Self>, IoError> {
        if !file["images"].is_array() || !file["annotations"].is_array() {
            return Ok(None);
        }
        let file: File = serde_json::from_value(file).map_err(|e| files::json_error(path, &e))?;
        let known: HashMap<String, String> =
            file.categories.iter().map(|c| (c.id.to_string(), c.name.clone())).collect();
        let category = |c: ListedCategory| {
            // Other programs' supercategories do not state wholes.
            let level = c.parent.is_some().then(|| serde_json::from_value(c.supercategory).ok()).flatten();
            let whole = c.parent.filter(|p| !p.is_null()).map(|p| p.to_string());
            let suffix = whole.as_ref().and_then(|whole| known.get(whole)).map(|whole| format!("{BETWEEN}{whole}"));
            let own = suffix.and_then(|suffix| c.name.strip_suffix(&suffix).map(str::to_owned));
            (c.id.to_string(), Category { name: own.unwrap_or(c.name), level, whole })
        };
        let categories = file.categories.into_iter().map(category).collect();
        let mut place: HashMap<String, usize> = HashMap::new();
        let mut images: Vec<Image> = Vec::with_capacity(file.images.len());
        for image in file.images {
            place.insert(image.id.to_string(), images.len());
            let size = [image.width, image.height];
            images.push(Image { file_name: image.file_name, size, annotations: Vec::new() });
        }
        for (i, annotation) in file.annotations.into_iter().enumerate() {
            let Some(at) = place.get(&annotation.image_id.to_string()) else {
                passed.add("annotations of pictures that are not in the list 'images'", path);
                continue;
            };
            match &annotation.segmentation {
                Some(Segmentation::Polygons(list)) if list.iter().any(|p| p.len() >= 6) => {}
                Some(Segmentation::Runs(_)) => {}
                _ => {
                    passed.add("annotations without a mask (boxes, key points)", path);
                    continue;
                }
            }
            if annotation.iscrowd.as_i64() == Some(1) || annotation.iscrowd.as_bool() == Some(true) {
                passed.report("annotations are marked as crowds (iscrowd); each is read as one thing", path);
            }
            images[*at].annotations.push((i, annotation));
        }
        Ok(Some(Self { categories, images }))
    }

    /// Returns the labeled pictures: index in the file's list, and name.
    pub(super) fn labeled(&self) -> impl Iterator<Item = (usize, &str)> {
        let labeled = self.images.iter().enumerate().filter(|(_, image)| !image.annotations.is_empty());
        labeled.map(|(i, image)| (i, image.file_name.as_str()))
    }

    /// Reads the regions of the picture `index` of the file, wholes first.
    pub(super) fn regions(&self, index: usize, path: &Path, sheet: Sheet<'_>) -> Result<Vec<Region>, IoError> {
        let Some(image) = self.images.get(index) else { return Ok(Vec::new()) };
        let [w, h] = sheet.size_px();
        let size = (image.size[0].unwrap_or(w), image.size[1].unwrap_or(h));
        sheet.check(path, size, image.annotations.len())?;
        let mut things: Vec<Thing> = Vec::new();
        for (i, annotation) in &image.annotations {
            let place = || format!("annotations[{i}]");
            let mask = match &annotation.segmentation {
                Some(Segmentation::Polygons(polygons)) => {
                    let mut mask = Mask::empty(size.0 as usize, size.1 as usize);
                    for polygon in polygons {
                        if polygon.len() % 2 == 1 || polygon.iter().any(|v| !v.is_finite()) {
                            return Err(IoError::syntax(path, place(), "a polygon that is not x and y in turn"));
                        }
                        draw(&mut mask, polygon.chunks_exact(2).map(|p| [p[0], p[1]]));
                    }
                    mask
                }
                Some(Segmentation::Runs(runs)) => {
                    sheet.check(path, runs.size_px(), image.annotations.len())?;
                    runs.mask().map_err(|reason| IoError::syntax(path, place(), reason))?
                }
                _ => continue,
            };
            let key = annotation.category_id.to_string();
            let category = self.categories.get(&key);
            let name = category.map(|c| c.name.clone()).unwrap_or_default();
            if is_background(&name) || is_ignored(&name) {
                continue;
            }
            let region = Region { name, level: category.and_then(|c| c.level), parent: None, mask };
            things.push(Thing { key, whole: category.and_then(|c| c.whole.clone()), region });
        }
        // Without its whole in the picture, a part has no parent there.
        let shown: Vec<String> = things.iter().map(|t| t.key.clone()).collect();
        things.iter_mut().for_each(|t| t.whole = t.whole.take().filter(|whole| shown.contains(whole)));
        wholes_first(things)
            .map_err(|category| IoError::syntax(path, format!("category {category}"), "it is a piece of itself"))
    }
}
