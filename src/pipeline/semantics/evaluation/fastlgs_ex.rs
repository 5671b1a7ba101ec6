//! `fastlgs-ex`: pixels whose blended code is within 5/255 of the best target's, and a running pooled
//! IoU. The published evaluator never empties intersection and union between categories, so each of
//! its values is that of all categories so far. Printed for comparison with published numbers, never
//! beside other protocols without its name.

use super::{AskedScene, LabeledView, Unit};
use crate::pipeline::semantics::lifting::codes::TOLERANCE;
use crate::pipeline::semantics::query::matching;
use crate::scene::Mask;

/// Intersection and union so far, px.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pool {
    intersection: usize,
    union: usize,
}

/// Compares all categories of a view; `pool` goes from view to view.
pub(crate) fn compare(scene: &mut AskedScene<'_>, view: &LabeledView<'_>, pool: &mut Pool) -> Vec<Unit> {
    let mut units = Vec::new();
    for category in &view.categories {
        // One target per query, the best.
        let best = (scene.ask)(&category.name).and_then(|a| a.chosen(1).first().copied());
        let mask = match best {
            Some(id) => matching::blend(view.blended, &scene.map.identities, id, TOLERANCE),
            None => Mask::empty(view.blended.width_px, view.blended.height_px),
        };
        let both = mask.overlap(&category.mask);
        pool.intersection += both;
        pool.union += mask.area() + category.mask.area() - both;
        let iou = pool.intersection as f64 / pool.union.max(1) as f64;
        units.push(category.unit(view.name, iou, None));
    }
    units
}
