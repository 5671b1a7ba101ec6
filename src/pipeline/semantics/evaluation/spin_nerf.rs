//! `spin-nerf`: IoU of the foreground and share of correct pixels, at 1008 x 567, plain means
//! over labeled views.

use super::{AskedScene, LabeledView, Unit};
use crate::scene::Mask;

/// Size at which masks are compared, px.
pub(crate) const SIZE: [usize; 2] = [1_008, 567];

#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(crate) struct Foreground {
    pub(crate) unit: Unit,
    /// Share of all pixels that are correct.
    pub(crate) accuracy: f64,
}

/// Compares the one category of a view with the answer to `query`; `None` if the view has no labels.
pub(crate) fn compare(scene: &mut AskedScene<'_>, view: &LabeledView<'_>, query: &str) -> Option<Foreground> {
    // A view without labels is not asked.
    view.categories.first()?;
    let answered = (scene.ask)(query);
    let mask = answered.map(|a| a.mask(view.exact, Some(view.blended), &scene.map.identities, 1));
    let mask = mask.unwrap_or_else(|| Mask::empty(view.exact.width_px, view.exact.height_px));
    of_mask(&mask, view, query)
}

/// Compares a `mask` from another source with the labels.
pub(crate) fn of_mask(mask: &Mask, view: &LabeledView<'_>, query: &str) -> Option<Foreground> {
    let first = view.categories.first()?;
    let mut truth = Mask::empty(first.mask.width_px(), first.mask.height_px());
    view.categories.iter().for_each(|c| truth.add(&c.mask));
    let (iou, accuracy) = score(mask, &truth);
    let unit = Unit { query: query.into(), ..first.unit(view.name, iou, None) };
    Some(Foreground { unit, accuracy })
}

fn score(mask: &Mask, truth: &Mask) -> (f64, f64) {
    let (mask, truth) = (mask.resized(SIZE[0], SIZE[1]), truth.resized(SIZE[0], SIZE[1]));
    let wrong = mask.area() + truth.area() - 2 * mask.overlap(&truth);
    (mask.iou(&truth), 1.0 - wrong as f64 / (SIZE[0] * SIZE[1]) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn background_counts_for_accuracy_only() {
        let truth = Mask::from_fn(100, 100, |i| i % 100 < 10);
        let half = Mask::from_fn(100, 100, |i| i % 100 < 5);
        let (iou, accuracy) = score(&half, &truth);
        assert!((iou - 0.5).abs() < 0.02 && (accuracy - 0.95).abs() < 0.01, "{iou} {accuracy}");
        assert_eq!(score(&truth, &truth), (1.0, 1.0));
        assert_eq!(score(&Mask::empty(100, 100), &truth).0, 0.0);
    }
}
