//! `3d-ovs`: every pixel's class, both ways of counting: the IoU of each class's own mask, as the
//! LangSplat family reports it, and that of an arg-max over all classes, the original's.

use super::{AskedScene, LabeledView, Unit};
use crate::scene::Mask;

/// Compares all classes of a view: by their own masks, and by the arg-max of relevancy.
pub(crate) fn compare(scene: &mut AskedScene<'_>, view: &LabeledView<'_>, classes: &[String]) -> [Vec<Unit>; 2] {
    let (w, h) = (view.exact.width_px, view.exact.height_px);
    let identities = &scene.map.identities;
    let answers: Vec<_> = classes.iter().map(|c| (scene.ask)(c)).collect();
    // Classes compete by identity: all pixels of one agree.
    let relevancy = |class: usize, id: u32| {
        let of = |a: &super::QueryAnswer| a.relevancy.get(id as usize).copied().unwrap_or(0.0);
        answers[class].as_ref().map_or(f32::NEG_INFINITY, of)
    };
    let best_of =
        |id: u32| (0..classes.len()).max_by(|&a, &b| relevancy(a, id).total_cmp(&relevancy(b, id)).then(b.cmp(&a)));
    let winners: Vec<Option<usize>> = (0..=identities.len() as u32).map(best_of).collect();
    let unit = |class: usize, mask: &Mask| -> Option<Unit> {
        let truth = view.categories.iter().find(|c| c.name == classes[class])?;
        Some(truth.unit(view.name, mask.iou(&truth.mask), None))
    };
    let own = |class: usize| {
        let mask = answers[class].as_ref().map(|a| a.mask(view.exact, Some(view.blended), identities, 1));
        unit(class, &mask.unwrap_or_else(|| Mask::empty(w, h)))
    };
    let of_winner = |class: usize| {
        let wins = |id: u32| winners.get(id as usize).copied().flatten() == Some(class);
        unit(class, &Mask::from_fn(w, h, |i| wins(view.exact.identity[i])))
    };
    [(0..classes.len()).filter_map(own).collect(), (0..classes.len()).filter_map(of_winner).collect()]
}
