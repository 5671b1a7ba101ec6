//! Evaluation: the protocols of the literature, one per file, each under the name that it is printed with.
//!
//! Labels of a view become categories by name; a scene is asked for each of them, and a protocol compares the answers
//! with the labels, one unit for each category and view. Views are matched with labels by name, never by index.
//! [`raw_features`] and [`by_similarity`] are baselines without tracked identities. [`referring`] writes
//! questions with their truth about scenes of meshes.

pub(crate) mod by_rule;
pub(crate) mod by_similarity;
#[cfg(test)]
mod end_to_end_tests;
pub(crate) mod fastlgs_ex;
#[cfg(test)]
mod hand_computed_tests;
pub(crate) mod known_things;
pub(crate) mod langsplat;
pub(crate) mod limits;
pub(crate) mod masks;
pub(crate) mod multi_class;
pub(crate) mod part_recall;
pub(crate) mod raw_features;
pub(crate) mod recipes;
pub(crate) mod ref_lerf;
pub(crate) mod referring;
pub(crate) mod selection_3d;
pub(crate) mod spin_nerf;
pub(crate) mod strokes;

use std::collections::BTreeMap;

use super::code_map::CodeMap;
use super::view_map::ViewMap;
use crate::pipeline::semantics::lifting::segmenter::FoundMask;
use crate::pipeline::semantics::query::answer::QueryAnswer;
use crate::scene::identity::whole_names::BETWEEN;
use crate::scene::{Camera, Level, Mask, PixelBox, SemanticMap};

pub(crate) struct AskedScene<'a> {
    pub(crate) map: &'a SemanticMap,
    /// Answers a phrase; `None` for an empty one.
    pub(crate) ask: &'a mut dyn FnMut(&str) -> Option<QueryAnswer>,
}

pub(crate) struct LabeledView<'a> {
    pub(crate) name: &'a str,
    pub(crate) camera: &'a Camera,
    pub(crate) exact: &'a ViewMap,
    pub(crate) blended: &'a CodeMap,
    pub(crate) categories: Vec<Category>,
}

/// A photo with its labels.
pub(crate) struct LabeledPhoto {
    pub(crate) name: String,
    pub(crate) camera: Camera,
    pub(crate) categories: Vec<Category>,
}

/// All regions of one name in a view.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Category {
    /// The name, as asked for: "button · red controller".
    pub(crate) name: String,
    /// A part, if it is a piece of something that has a name.
    pub(crate) level: Level,
    pub(crate) mask: Mask,
    pub(crate) boxes: Vec<PixelBox>,
}

impl Category {
    /// A comparison of it in the photo `view`.
    pub(crate) fn unit(&self, view: &str, iou: f64, hit: Option<bool>) -> Unit {
        Unit { view: view.to_owned(), query: self.name.clone(), level: self.level, iou, hit }
    }
}

#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(crate) struct Unit {
    pub(crate) view: String,
    pub(crate) query: String,
    /// Level of the category.
    pub(crate) level: Level,
    pub(crate) iou: f64,
    /// True if the point of largest relevancy is on it; `None` if the protocol does not measure that.
    pub(crate) hit: Option<bool>,
}

/// Category of labels without any name.
const FOREGROUND: &str = "foreground";

/// Returns the labels of a view by name, with regions of one name together. A piece is called "X · Y". If none has a
/// name (SPIn-NeRF), all are the foreground.
pub(crate) fn categories(labels: &[FoundMask]) -> Vec<Category> {
    let mut all: BTreeMap<String, Category> = BTreeMap::new();
    let (unnamed, is_named) = (FOREGROUND.to_owned(), labels.iter().any(|l| l.name.is_some()));
    for label in labels {
        let Some(name) = label.name.as_ref().or((!is_named).then_some(&unnamed)) else { continue };
        let wholes = std::iter::successors(label.parent, |p| labels[*p].parent).take(labels.len());
        let line: Vec<&str> =
            std::iter::once(name).chain(wholes.map_while(|p| labels[p].name.as_ref())).map(String::as_str).collect();
        let level = if line.len() > 1 { Level::Part } else { Level::Object };
        let name = line.join(BETWEEN);
        let empty = || Mask::empty(label.mask.width_px(), label.mask.height_px());
        let category =
            all.entry(name.clone()).or_insert_with(|| Category { name, level, mask: empty(), boxes: Vec::new() });
        category.mask.add(&label.mask);
        category.boxes.extend(label.mask.bounds());
    }
    all.into_values().collect()
}

/// Mean IoU of all units (micro), and of the views' means (macro); NaN without any.
pub(crate) fn means(units: &[Unit]) -> (f64, f64) {
    let mut views: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    units.iter().for_each(|u| views.entry(&u.view).or_default().push(u.iou));
    let of = |v: &[f64]| crate::math::stats::mean(v);
    let micro = of(&units.iter().map(|u| u.iou).collect::<Vec<_>>());
    (micro, of(&views.values().map(|v| of(v)).collect::<Vec<_>>()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_of_one_name_are_one_category_with_all_their_boxes() {
        let label = |name: &str, parent, from: usize, to: usize| FoundMask {
            level: Level::Object,
            parent,
            name: Some(name.into()),
            mask: Mask::from_fn(20, 1, |i| (from..to).contains(&i)),
        };
        let all = categories(&[label("doll", None, 0, 9), label("eye", Some(0), 2, 3), label("eye", Some(0), 5, 7)]);
        let list: Vec<_> = all.iter().map(|c| (c.name.as_str(), c.mask.area(), c.boxes.len())).collect();
        assert_eq!(list, [("doll", 9, 1), ("eye · doll", 3, 2)]);
        let mut unnamed = [label("", None, 0, 4), label("", None, 6, 9)];
        unnamed.iter_mut().for_each(|l| l.name = None);
        let foreground = categories(&unnamed);
        assert_eq!((foreground.len(), foreground[0].name.as_str(), foreground[0].mask.area()), (1, "foreground", 7));
        unnamed[0].name = Some("cup".into());
        assert_eq!(categories(&unnamed).len(), 1, "beside names, what has none is not asked for");
        let unit =
            |view: &str, iou| Unit { view: view.into(), query: String::new(), level: Level::Object, iou, hit: None };
        let (micro, by_view) = means(&[unit("a", 1.0), unit("a", 0.0), unit("b", 1.0)]);
        assert!((micro - 2.0 / 3.0).abs() < 1e-12 && (by_view - 0.75).abs() < 1e-12);
    }
}
