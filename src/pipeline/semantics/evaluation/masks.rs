//! `masks`: the pixels of the answer to every name against the region, objects and parts separately.

use super::{AskedScene, Category, LabeledView, Unit, means};
use crate::scene::Level;

pub(crate) fn compare(scene: &mut AskedScene<'_>, view: &LabeledView<'_>) -> Vec<Unit> {
    let unit = |c: &Category| {
        let mask = (scene.ask)(&c.name).map(|a| a.mask(view.exact, Some(view.blended), &scene.map.identities, 1));
        c.unit(view.name, mask.map_or(0.0, |m| m.iou(&c.mask)), None)
    };
    view.categories.iter().map(unit).collect()
}

/// Mean IoU of objects and of parts; NaN where there are none.
pub(crate) fn by_level(units: &[Unit]) -> [f64; 2] {
    [Level::Object, Level::Part].map(|level| {
        let of_level: Vec<Unit> = units.iter().filter(|u| u.level == level).cloned().collect();
        means(&of_level).0
    })
}
