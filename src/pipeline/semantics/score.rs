//! How well queries by name find the labelled regions of photos.

use std::collections::BTreeMap;

use serde::Serialize;

use super::answer::by_name;
use super::grammar::{Kind, Phrase};
use super::segmenter::FoundMask;
use super::view_map::ViewMap;
use crate::math::stats::mean;
use crate::scene::{Identities, Level, Mask};

/// One query in one view.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QueryScore {
    /// The photo.
    pub view: String,
    /// What was asked.
    pub query: String,
    /// Object or part.
    pub level: Level,
    /// Intersection over union of the answer's and the label's pixels.
    pub iou: f64,
    /// Pixels of the label.
    pub pixels: usize,
}

/// Asks for every named region of a labelled view, "PART of the WHOLE", and compares. Regions that
/// the same words ask for count together, as do identities that the answer cannot tell apart.
pub fn score_view(view: &str, map: &ViewMap, identities: &Identities, labels: &[FoundMask]) -> Vec<QueryScore> {
    let mut asked: BTreeMap<String, (Level, Mask)> = BTreeMap::new();
    for label in labels {
        let Some(name) = &label.name else { continue };
        let whole = label.parent.and_then(|p| labels[p].name.as_ref());
        let query = whole.map_or_else(|| name.clone(), |w| format!("{name} of the {w}"));
        let all = asked.entry(query).or_insert_with(|| (label.level, Mask::empty(map.width_px, map.height_px)));
        all.1.add(&label.mask);
    }
    let mut scores = Vec::new();
    for (query, (level, truth)) in asked {
        let found = Phrase::parse(&query).map(|p| by_name(identities, &p, Kind::Auto));
        let mask = found.map_or_else(|| Mask::empty(map.width_px, map.height_px), |f| f.mask(map, identities, 1));
        scores.push(QueryScore { view: view.into(), query, level, iou: mask.iou(&truth), pixels: truth.area() });
    }
    scores
}

/// Mean IoU of one level; NaN without any.
pub fn mean_iou(scores: &[QueryScore], level: Level) -> f64 {
    mean(&scores.iter().filter(|s| s.level == level).map(|s| s.iou).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::NOBODY;

    #[test]
    fn every_named_region_is_asked_for() {
        let mut all = Identities::default();
        let lamp = all.add(Level::Object, NOBODY, vec!["lamp".into()]);
        let foot = |all: &mut Identities| all.add(Level::Part, lamp, vec!["foot".into()]);
        let (left, right) = (foot(&mut all), foot(&mut all));
        let identity = (0..20).map(|i| [lamp, left, right, NOBODY, NOBODY][i / 4]).collect();
        let map = ViewMap { width_px: 20, height_px: 1, identity, share: vec![1.0; 20], alpha: vec![1.0; 20] };
        let label = |name: &str, level, parent, from: usize, to: usize| FoundMask {
            level,
            parent,
            name: Some(name.into()),
            mask: Mask::from_fn(20, 1, |i| (from..to).contains(&i)),
        };
        let labels = [
            label("lamp", Level::Object, None, 0, 12),
            label("foot", Level::Part, Some(0), 4, 8),
            label("foot", Level::Part, Some(0), 8, 10),
            label("cat", Level::Object, None, 16, 20),
        ];
        let scores = score_view("v", &map, &all, &labels);
        let list: Vec<_> = scores.iter().map(|s| (s.query.as_str(), s.iou)).collect();
        assert_eq!(list, [("cat", 0.0), ("foot of the lamp", 6.0 / 8.0), ("lamp", 1.0)]);
        assert_eq!((mean_iou(&scores, Level::Object), mean_iou(&scores, Level::Part)), (0.5, 0.75));
    }
}
