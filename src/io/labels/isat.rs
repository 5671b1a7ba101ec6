//! ISAT label files, as lerf_ovs has them: polygons with a category, several of which may make up
//! one region. Two fields more are understood: `level` ("object" or "part") and `parent` (the
//! category that it is a piece of).

use std::collections::{HashMap, HashSet};
use std::path::Path;

use serde::Deserialize;
use serde_json::{Value, json};

use super::polygons::polygons;
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
}

#[derive(Deserialize)]
struct Polygon {
    category: String,
    segmentation: Vec<[f64; 2]>,
    #[serde(default)]
    level: Option<Level>,
    #[serde(default)]
    parent: Option<String>,
}

/// The photo that a label file belongs to; `None` if it is JSON of another kind.
pub(crate) fn photo_of(file: &serde_json::Value) -> Option<&str> {
    file["info"]["name"].as_str().filter(|_| file["objects"].is_array())
}

/// The regions of a label file: polygons of one category together, objects before parts.
pub(crate) fn read(path: &Path, sheet: Sheet<'_>) -> Result<Vec<Region>, IoError> {
    let file: File = files::read_json(path)?;
    let Info { width, height, .. } = file.info;
    let names: HashSet<&str> = file.objects.iter().map(|p| p.category.as_str()).collect();
    sheet.check(path, (width, height), names.len())?;
    let bad = |place: String, reason: &str| IoError::Syntax { path: path.into(), place, reason: reason.into() };
    if file.objects.iter().map(|p| p.segmentation.len()).sum::<usize>() > MAX_VERTICES {
        return Err(bad("objects".into(), "more vertices than a label file can need"));
    }
    let mut regions: Vec<(Option<String>, Region)> = Vec::new();
    let mut place: HashMap<String, usize> = HashMap::new();
    for (i, polygon) in file.objects.into_iter().enumerate() {
        if polygon.segmentation.iter().flatten().any(|v| !v.is_finite()) {
            return Err(bad(format!("objects[{i}].segmentation"), "a vertex that is not a number"));
        }
        let at = *place.entry(polygon.category).or_insert_with_key(|name| {
            let mask = Mask::empty(width as usize, height as usize);
            let region = Region { name: name.clone(), level: polygon.level, parent: None, mask };
            regions.push((polygon.parent, region));
            regions.len() - 1
        });
        // The convention of the LERF evaluations: vertices are cut to whole pixels.
        let whole: Vec<[f64; 2]> = polygon.segmentation.iter().map(|v| v.map(f64::trunc)).collect();
        regions[at].1.mask.add_polygon(&whole);
    }
    // Whole before piece, as deep as pieces of pieces go.
    let mut ordered: Vec<Region> = Vec::with_capacity(regions.len());
    let mut placed: HashMap<String, usize> = HashMap::new();
    while !regions.is_empty() {
        let before = regions.len();
        let mut waiting = Vec::new();
        for (parent, mut region) in regions {
            let at = parent.as_ref().and_then(|p| placed.get(p).copied());
            match parent {
                Some(_) if at.is_none() => waiting.push((parent, region)),
                _ => {
                    region.parent = at;
                    placed.insert(region.name.clone(), ordered.len());
                    // "handle · mug" of the mug is its handle.
                    let whole = parent.map(|parent| format!("{BETWEEN}{parent}"));
                    if let Some(own) = whole.and_then(|whole| region.name.strip_suffix(&whole).map(str::to_owned)) {
                        region.name = own;
                    }
                    ordered.push(region);
                }
            }
        }
        regions = waiting;
        if regions.len() == before {
            let place = format!("category '{}'", regions[0].1.name);
            return Err(bad(place, "its parent is not in the file, or is a piece of itself"));
        }
    }
    Ok(ordered)
}

/// A label file of a photo that [`read`] reads as it was: regions with names of their own, wholes first.
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
