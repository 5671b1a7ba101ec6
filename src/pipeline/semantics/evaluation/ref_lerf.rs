//! `ref-lerf`: the answer to every sentence against the mask of the object that it refers to, as in ReferSplat. Objects
//! without a pixel in the view are not asked for; without an answer, the IoU is 0.

use super::{AskedScene, Category, LabeledView, Unit};
use crate::io::labels::ref_lerf::ReferredPhoto;

/// Compares the answers to a view's sentences with the labels.
pub(crate) fn compare(scene: &mut AskedScene<'_>, view: &LabeledView<'_>, photo: &ReferredPhoto) -> Vec<Unit> {
    let mut units = Vec::new();
    for (category, sentence) in asked(view, photo) {
        let mask = (scene.ask)(sentence).map(|a| a.mask(view.exact, Some(view.blended), &scene.map.identities, 1));
        let unit = category.unit(view.name, mask.map_or(0.0, |m| m.iou(&category.mask)), None);
        units.push(Unit { query: sentence.to_owned(), ..unit });
    }
    units
}

/// Returns the sentences about objects that the view shows, each with its object.
pub(crate) fn asked<'a>(view: &'a LabeledView<'_>, photo: &'a ReferredPhoto) -> Vec<(&'a Category, &'a str)> {
    let mut all = Vec::new();
    for object in &photo.objects {
        let Some(category) = view.categories.iter().find(|c| c.name == object.name) else { continue };
        all.extend(object.sentences.iter().map(|sentence| (category, sentence.as_str())));
    }
    all
}
