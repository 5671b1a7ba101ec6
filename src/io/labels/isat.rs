//! ISAT label files, as in lerf_ovs: polygons with a category and a group, drawn by layer. Polygons of one category and
//! one group are one region; `__background__` cuts regions of lower layers. The files of lerf_ovs, which lack ISAT's
//! marks, number polygons as groups: there a category is one region, as in its evaluations. Two additional fields are
//! read: `level` ("object" or "part") and `parent` (the category that it is a part of).

use std::collections::HashMap;
use std::path::Path;

use serde::Deserialize;
use serde_json::{Value, json};

use super::polygons::polygons;
use super::things::{Thing, is_background, is_ignored, wholes_first};
use super::{Region, Sheet};
use crate::io::{IoError, files};
use crate::scene::identity::whole_names::BETWEEN;
use crate::scene::{Level, Mask};

const MAX_VERTICES: usize = 4_000_000;

#[derive(Deserialize)]
struct File {
    info: Info,
    objects: Vec<Polygon>,
}

#[derive(Deserialize)]
struct Info {
    width: u32,
    height: u32,
    /// "ISAT"; lerf_ovs has neither this nor the folder.
    #[serde(default)]
    description: Option<Value>,
    #[serde(default)]
    folder: Option<Value>,
}

#[derive(Deserialize)]
struct Polygon {
    category: String,
    /// A number, in some versions a string; files of other programs lack it.
    #[serde(default)]
    group: Value,
    #[serde(default)]
    layer: Value,
    segmentation: Vec<[f64; 2]>,
    #[serde(default)]
    level: Option<Level>,
    #[serde(default)]
    parent: Option<String>,
}

impl Polygon {
    fn layer(&self) -> f64 {
        self.layer.as_f64().or_else(|| self.layer.as_str()?.trim().parse().ok()).unwrap_or(0.0)
    }
}

/// Returns the folder and the name of the photo stated in a label file; `None` if it is JSON of another kind.
pub(crate) fn photo_of(file: &Value) -> Option<(&str, &str)> {
    let info = &file["info"];
    let name = info["name"].as_str().filter(|_| file["objects"].is_array())?;
    Some((info["folder"].as_str().unwrap_or_default(), name))
}

/// Reads the regions of a label file, objects before parts.
pub(crate) fn read(path: &Path, sheet: Sheet<'_>) -> Result<Vec<Region>, IoError> {
    let file: File = files::read_json(path)?;
    let Info { width, height, description, folder } = &file.info;
    let (width, height, has_groups) = (*width, *height, description.is_some() || folder.is_some());
    let bad = |place: String, reason: &str| IoError::Syntax { path: path.into(), place, reason: reason.into() };
    if file.objects.iter().map(|p| p.segmentation.len()).sum::<usize>() > MAX_VERTICES {
        return Err(bad("objects".into(), "more vertices than a label file can need"));
    }
    // Region of each polygon, in the file's order.
    let mut place: HashMap<(&str, String), usize> = HashMap::new();
    let mut first: Vec<&Polygon> = Vec::new();
    let mut drawn_into: Vec<Option<usize>> = Vec::with_capacity(file.objects.len());
    for (i, polygon) in file.objects.iter().enumerate() {
        if polygon.segmentation.iter().flatten().any(|v| !v.is_finite()) {
            return Err(bad(format!("objects[{i}].segmentation"), "a vertex that is not a number"));
        }
        let is_thing = !is_background(&polygon.category) && !is_ignored(&polygon.category);
        drawn_into.push(is_thing.then(|| {
            let group = if has_groups { polygon.group.to_string() } else { String::new() };
            *place.entry((&polygon.category, group)).or_insert_with(|| {
                first.push(polygon);
                first.len() - 1
            })
        }));
    }
    sheet.check(path, (width, height), first.len())?;
    let mut masks = vec![Mask::empty(width as usize, height as usize); first.len()];
    let mut order: Vec<usize> = (0..file.objects.len()).collect();
    order.sort_by(|a, b| file.objects[*a].layer().total_cmp(&file.objects[*b].layer()));
    for i in order {
        let polygon = &file.objects[i];
        // Convention of the LERF evaluations: vertices are truncated to whole pixels.
        let whole: Vec<[f64; 2]> = polygon.segmentation.iter().map(|v| v.map(f64::trunc)).collect();
        match drawn_into[i] {
            Some(at) => masks[at].add_polygon(&whole),
            None if is_ignored(&polygon.category) => {}
            None => {
                let mut hole = Mask::empty(width as usize, height as usize);
                hole.add_polygon(&whole);
                masks.iter_mut().for_each(|mask| mask.subtract(&hole));
            }
        }
    }
    let thing = |(polygon, mask): (&Polygon, Mask)| {
        // "handle · mug", a part of the mug, is named "handle".
        let suffix = polygon.parent.as_ref().map(|parent| format!("{BETWEEN}{parent}"));
        let own = suffix.and_then(|suffix| polygon.category.strip_suffix(&suffix));
        let name = own.unwrap_or(&polygon.category).to_owned();
        let region = Region { name, level: polygon.level, parent: None, mask };
        Thing { key: polygon.category.clone(), whole: polygon.parent.clone(), region }
    };
    wholes_first(first.into_iter().zip(masks).map(thing).collect()).map_err(|category| {
        bad(format!("category '{category}'"), "its parent is not in the file, or is a piece of itself")
    })
}

/// Makes a label file of a photo that [`read`] restores exactly: regions with distinct names, wholes first.
pub(crate) fn document(photo: &str, [width, height]: [usize; 2], regions: &[Region]) -> Value {
    let mut objects = Vec::new();
    for (i, region) in regions.iter().enumerate() {
        for polygon in polygons(&region.mask) {
            let side = |at: usize, of: fn(i32, i32) -> i32| polygon.iter().map(|v| v[at]).reduce(of).unwrap_or(0);
            objects.push(json!({
                "category": region.name,
                "group": i + 1,
                "layer": i + 1,
                "segmentation": polygon,
                "area": region.mask.area(),
                "bbox": [side(0, i32::min), side(1, i32::min), side(0, i32::max), side(1, i32::max)],
                "iscrowd": 0,
                "note": "",
                "level": region.level,
                "parent": region.parent.map(|p| &regions[p].name),
            }));
        }
    }
    let info = json!({
        "description": "ISAT", "folder": "", "name": photo, "width": width, "height": height, "depth": 3, "note": ""
    });
    json!({ "info": info, "objects": objects })
}
