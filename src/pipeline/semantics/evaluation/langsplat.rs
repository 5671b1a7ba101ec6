//! `langsplat`: relevancy maps of both levels, smoothed, normalized and cut at 0.4.
//!
//! `avg` = 30 x 30 box filter (window x-15..x+14, edges mirrored); `v = (avg + relevancy) / 2`; `o` =
//! `v` scaled to 0..1, then `clip(2 o - 1, 0, 1)`; mask = `o > 0.4`, then a 7 x 7 majority. The level
//! with the largest `v` counts. The arg-max of `avg` is a hit inside any of the category's boxes.

use super::{AskedScene, LabeledView, Unit};
use crate::pipeline::semantics::query::answer::QueryAnswer;
use crate::pipeline::semantics::smoothing::by_smoothing;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::scene::{Identities, IdentityId, Level, Mask};

pub(crate) fn compare(scene: &mut AskedScene<'_>, view: &LabeledView<'_>) -> Vec<Unit> {
    let (w, h) = (view.exact.width_px, view.exact.height_px);
    let identities = &scene.map.identities;
    let one = |category: &super::Category| {
        let answered = (scene.ask)(&category.name);
        let (mask, at) = match &answered {
            Some(a) => answer(a, view.exact, identities),
            None => (Mask::empty(w, h), 0),
        };
        let hit = answered.is_some() && category.boxes.iter().any(|b| b.contains(at % w, at / w));
        category.unit(view.name, mask.iou(&category.mask), Some(hit))
    };
    view.categories.iter().map(one).collect()
}

/// Mask and index of the most relevant pixel.
fn answer(answered: &QueryAnswer, map: &ViewMap, identities: &Identities) -> (Mask, usize) {
    let (w, h) = (map.width_px, map.height_px);
    let found = by_smoothing(&levels(answered, map, identities), w, h);
    found.map_or_else(|| (Mask::empty(w, h), 0), |found| (found.mask, found.peak.unwrap_or(0)))
}

/// Relevancy of every pixel's object, and of its part.
pub(crate) fn levels(answered: &QueryAnswer, map: &ViewMap, identities: &Identities) -> [Vec<f32>; 2] {
    let at = |level| map.identity.iter().map(|id| at_level(answered, identities, *id, level)).collect();
    [Level::Object, Level::Part].map(at)
}

/// Relevancy of a pixel's object, or of its part.
fn at_level(answered: &QueryAnswer, identities: &Identities, id: IdentityId, level: Level) -> f32 {
    let of = match level {
        Level::Object => identities.object_of(id),
        Level::Part if identities.get(id).is_some_and(|i| i.level == Level::Part) => id,
        Level::Part => 0,
    };
    answered.relevancy.get(of as usize).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::Category;
    use super::*;
    use crate::pipeline::semantics::code_map::CodeMap;
    use crate::pipeline::semantics::query::answer::Basis;
    use crate::pipeline::semantics::query::localize::Answer;
    use crate::pipeline::semantics::query::recipe::QueryConfig;
    use crate::scene::{Camera, NO_IDENTITY, SemanticMap};
    use glam::DVec3;

    #[test]
    fn the_most_relevant_identity_is_cut_out() {
        let (w, h) = (80, 60);
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec![]);
        let eye = all.add(Level::Part, doll, vec![]);
        let in_box = |i: usize, x: std::ops::Range<usize>, y: std::ops::Range<usize>| {
            x.contains(&(i % w)) && y.contains(&(i / w))
        };
        let identity: Vec<IdentityId> = (0..w * h)
            .map(|i| {
                if in_box(i, 30..60, 20..50) {
                    eye
                } else if in_box(i, 10..70, 10..55) {
                    doll
                } else {
                    NO_IDENTITY
                }
            })
            .collect();
        let map = SemanticMap { identities: all, ..SemanticMap::default() };
        let exact = ViewMap::certain(w, identity);
        let truth = exact.mask(&map.identities, eye);
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, w as u32, h as u32).expect("valid");
        let blended = CodeMap::default();
        let compare_with = |relevancy: Vec<f32>| {
            let mut ask = |_: &str| {
                let nothing = Answer::NotFound(vec![]);
                Some(QueryAnswer::new(nothing, Basis::Embedding, relevancy.clone(), &QueryConfig::default()))
            };
            let boxes = truth.bounds().into_iter().collect();
            let categories = vec![Category { name: "eye".into(), level: Level::Object, mask: truth.clone(), boxes }];
            let view = LabeledView { name: "v", camera: &camera, exact: &exact, blended: &blended, categories };
            compare(&mut AskedScene { map: &map, ask: &mut ask }, &view).remove(0)
        };
        let right = compare_with(vec![0.1, 0.3, 0.9]);
        // The box filter rounds the corners off.
        assert!(right.iou > 0.8 && right.hit == Some(true), "{right:?}");
        let wrong = compare_with(vec![0.1, 0.9, 0.3]);
        assert!(wrong.iou < 0.5, "{wrong:?}");
        let nothing = compare_with(vec![0.0; 3]);
        assert_eq!(nothing.iou, 0.0);
    }
}
