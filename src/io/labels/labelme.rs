//! LabelMe's label files: shapes with a label; shapes of one label and one `group_id` are one region. Lines and points
//! have no area and are skipped.

use std::path::Path;

use serde::Deserialize;
use serde_json::Value;

use super::things::{is_background, is_ignored};
use super::{Passed, Region, Sheet, draw};
use crate::io::{IoError, files, photo};
use crate::scene::Mask;

/// Corners of the polygon that stands for a circle.
const CORNERS: u32 = 90;
/// Largest distance of a line's ends, px, at which it counts as closed.
const CLOSED_PX: f64 = 1.5;
/// Most pixels of a mask that is stored as a picture.
const MOST_PX: u64 = 1 << 28;

#[derive(Deserialize)]
struct File {
    #[serde(default, rename = "imageWidth")]
    width: Option<u32>,
    #[serde(default, rename = "imageHeight")]
    height: Option<u32>,
    shapes: Vec<Shape>,
}

#[derive(Deserialize)]
struct Shape {
    label: String,
    points: Vec<[f64; 2]>,
    #[serde(default)]
    shape_type: Option<String>,
    #[serde(default)]
    group_id: Value,
    /// Mask of the rectangle between the two points, a picture in base64.
    #[serde(default)]
    mask: Option<String>,
}

/// Area of a shape.
enum Area {
    Polygon(Vec<[f64; 2]>),
    /// A picture, and the position of its top left pixel.
    Picture(String, [f64; 2]),
}

impl Shape {
    fn kind(&self) -> &str {
        self.shape_type.as_deref().unwrap_or("polygon")
    }

    /// Returns the area; `None` for a shape without one.
    fn area(self) -> Option<Area> {
        let kind = self.kind().to_owned();
        let points = self.points;
        let far = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let polygon = match (kind.as_str(), &points[..]) {
            ("mask", [start, ..]) => return self.mask.map(|mask| Area::Picture(mask, *start)),
            ("rectangle", [[x0, y0], [x1, y1]]) => vec![[*x0, *y0], [*x1, *y0], [*x1, *y1], [*x0, *y1]],
            ("circle", [center, edge]) => {
                let radius = far(*center, *edge);
                let corner = |k: u32| (f64::from(k) / f64::from(CORNERS) * std::f64::consts::TAU).sin_cos();
                let at = |(sin, cos): (f64, f64)| [center[0] + radius * cos, center[1] + radius * sin];
                (0..CORNERS).map(corner).map(at).collect()
            }
            ("polygon" | "rectangle" | "rotation" | "quadrilateral", [_, _, _, ..]) => points,
            // A line drawn around a region.
            ("linestrip", [first, _, _, .., last]) if far(*first, *last) <= CLOSED_PX => points,
            _ => return None,
        };
        Some(Area::Polygon(polygon))
    }
}

/// Returns the name of the photo stated in a label file, may be empty; `None` if it is JSON of another kind or has no
/// regions. Shapes that [`read`] leaves out are counted.
pub(super) fn photo_of<'a>(file: &'a Value, path: &Path, passed: &mut Passed) -> Option<&'a str> {
    let shapes = file["shapes"].as_array()?;
    let is_own = ["imagePath", "imageHeight", "version"].iter().any(|key| file.get(key).is_some());
    if !is_own || !shapes.iter().all(|shape| shape["label"].is_string() && shape["points"].is_array()) {
        return None;
    }
    let mut left = shapes.len();
    for shape in shapes {
        let what = if is_ignored(shape["label"].as_str().unwrap_or_default()) {
            "shapes that are to be ignored"
        } else if Shape::deserialize(shape).is_ok_and(|shape| shape.area().is_none()) {
            "shapes without an area (points, lines) or of an unknown kind"
        } else {
            continue;
        };
        passed.add(what, path);
        left -= 1;
    }
    (left > 0).then(|| file["imagePath"].as_str().unwrap_or_default())
}

/// Reads the regions of a label file.
pub(super) fn read(path: &Path, sheet: Sheet<'_>) -> Result<Vec<Region>, IoError> {
    let file: File = files::read_json(path)?;
    let [w, h] = sheet.size_px();
    let size = (file.width.unwrap_or(w), file.height.unwrap_or(h));
    sheet.check(path, size, file.shapes.len())?;
    let (width, height) = (size.0 as usize, size.1 as usize);
    let mut regions: Vec<(Value, Region)> = Vec::new();
    for (i, shape) in file.shapes.into_iter().enumerate().filter(|(_, shape)| !is_ignored(&shape.label)) {
        let place = || format!("shapes[{i}]");
        if shape.points.iter().flatten().any(|v| !v.is_finite()) {
            return Err(IoError::syntax(path, place(), "a point that is not a number"));
        }
        let (label, group) = (shape.label.clone(), shape.group_id.clone());
        let Some(area) = shape.area() else { continue };
        let mut mask = Mask::empty(width, height);
        match area {
            Area::Polygon(points) => draw(&mut mask, points.into_iter()),
            Area::Picture(text, start) => picture(&mut mask, &text, start, path, &place())?,
        }
        if is_background(&label) {
            regions.iter_mut().for_each(|(_, region)| region.mask.subtract(&mask));
            continue;
        }
        // Shapes without a group are regions of their own.
        let same = |(of, region): &&mut (Value, Region)| !group.is_null() && *of == group && region.name == label;
        match regions.iter_mut().find(same) {
            Some((_, region)) => region.mask.add(&mask),
            None => regions.push((group, Region { name: label, level: None, parent: None, mask })),
        }
    }
    Ok(regions.into_iter().map(|(_, region)| region).collect())
}

/// Adds the pixels of a picture in base64 that are not black.
fn picture(mask: &mut Mask, text: &str, start: [f64; 2], path: &Path, place: &str) -> Result<(), IoError> {
    let bad = |reason: String| IoError::syntax(path, place, format!("its mask {reason}"));
    let bytes = base64::decode(text.trim()).map_err(|e| bad(format!("is no base64: {e}")))?;
    let (w, h, values) = photo::decode_brightest(&bytes, path).map_err(|e| bad(format!("is no picture: {e}")))?;
    if (w as u64).saturating_mul(h as u64) > MOST_PX {
        return Err(bad("is too large".into()));
    }
    let [left, top] = start.map(|v| v.round() as i64);
    for i in (0..w * h).filter(|i| values[*i] > 0) {
        let [x, y] = [left.saturating_add((i % w) as i64), top.saturating_add((i / w) as i64)];
        if (0..mask.width_px() as i64).contains(&x) && (0..mask.height_px() as i64).contains(&y) {
            mask.insert(y as usize * mask.width_px() + x as usize);
        }
    }
    Ok(())
}
