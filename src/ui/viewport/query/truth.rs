//! The newest answer against a true mask: hits, misses and false alarms in colors, and their IoU.

use std::sync::Arc;

use crate::math::format;
use crate::navigate::Pose;
use crate::scene::Mask;

/// Colors of hits, misses and false alarms, distinct for red-green color blindness too.
const COLORS: [[u8; 3]; 3] = [[40, 200, 120], [230, 60, 60], [250, 180, 30]];

/// A true mask of the view from one pose.
#[derive(Clone, Debug)]
struct ViewTruth {
    mask: Arc<Mask>,
    at: Pose,
}

/// Pixel counts of hits, misses and false alarms, and the IoU.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TruthComparison {
    pub(super) hits: usize,
    pub(super) misses: usize,
    pub(super) false_alarms: usize,
    pub(super) iou: f64,
}

/// A true mask to compare answers with, and the current camera pose.
#[derive(Default)]
pub(super) struct TrueMask {
    truth: Option<ViewTruth>,
    eye: Option<Pose>,
}

impl TrueMask {
    /// Sets or removes the mask of the view from a pose.
    pub(super) fn set(&mut self, truth: Option<(Arc<Mask>, Pose)>) {
        self.truth = truth.map(|(mask, at)| ViewTruth { mask, at });
    }

    /// Sets the current pose: a mask is true of one view only. Returns true if comparisons change.
    pub(super) fn stand(&mut self, pose: Pose) -> bool {
        self.eye.replace(pose) != Some(pose) && self.truth.is_some()
    }

    /// The true mask of the current view.
    pub(super) fn here(&self) -> Option<Arc<Mask>> {
        let here = |t: &&ViewTruth| self.eye.is_some_and(|eye| is_same(&eye, &t.at));
        self.truth.as_ref().filter(here).map(|t| Arc::clone(&t.mask))
    }
}

/// The masks to draw: the newest against the true mask, if there is one.
pub(super) fn compared(
    truth: Option<&Mask>,
    masks: Vec<([u8; 3], Mask)>,
) -> (Option<TruthComparison>, Vec<([u8; 3], Mask)>) {
    let (Some(truth), Some((_, newest))) = (truth, masks.last()) else { return (None, masks) };
    let truth = truth.resized(newest.width_px(), newest.height_px());
    let (comparison, masks) = compare(newest, &truth);
    (Some(comparison), COLORS.into_iter().zip(masks).collect())
}

fn is_same(a: &Pose, b: &Pose) -> bool {
    let turned = a.world_from_camera - b.world_from_camera;
    let columns = [turned.x_axis, turned.y_axis, turned.z_axis];
    a.center.distance(b.center) <= 1e-9 * (1.0 + a.center.length()) && columns.iter().all(|c| c.length() < 1e-9)
}

/// Hits, misses and false alarms of an answer.
fn compare(answer: &Mask, truth: &Mask) -> (TruthComparison, [Mask; 3]) {
    let (mut hits, mut misses, mut alarms) = (answer.clone(), truth.clone(), answer.clone());
    hits.intersect(truth);
    misses.subtract(answer);
    alarms.subtract(truth);
    let comparison = TruthComparison {
        hits: hits.area(),
        misses: misses.area(),
        false_alarms: alarms.area(),
        iou: answer.iou(truth),
    };
    (comparison, [hits, misses, alarms])
}

impl TruthComparison {
    /// The IoU as text.
    pub(super) fn figure(&self) -> String {
        format!("IoU {:.3}", self.iou)
    }

    /// Draws the IoU and the legend of the colors.
    pub(super) fn show(&self, ui: &mut egui::Ui) {
        let Self { hits, misses, false_alarms, .. } = self;
        ui.horizontal_wrapped(|ui| {
            ui.strong(self.figure());
            let [hits, misses, alarms] = [*hits, *misses, *false_alarms].map(|n| format::count(n as u64));
            let texts = [format!("{hits} px hit"), format!("{misses} missed"), format!("{alarms} false alarms")];
            for ([r, g, b], text) in COLORS.into_iter().zip(texts) {
                ui.colored_label(egui::Color32::from_rgb(r, g, b), text);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ui::viewport::query::Queries;
    use glam::{DMat3, DVec3};

    #[test]
    fn hits_misses_and_false_alarms_are_told_apart() {
        let answer = Mask::from_fn(10, 1, |i| i < 6);
        let truth = Mask::from_fn(10, 1, |i| (4..8).contains(&i));
        let (told, masks) = compare(&answer, &truth);
        assert_eq!(told, TruthComparison { hits: 2, misses: 2, false_alarms: 4, iou: 0.25 });
        assert_eq!(masks.map(|m| m.pixels().collect::<Vec<_>>()), [vec![4, 5], vec![6, 7], vec![0, 1, 2, 3]]);
        // Control: the true mask matches itself.
        assert_eq!(compare(&truth, &truth).0, TruthComparison { hits: 4, misses: 0, false_alarms: 0, iou: 1.0 });
    }

    #[test]
    fn a_mask_is_true_of_the_view_that_it_was_loaded_in() {
        let pose = |x: f64| Pose { center: DVec3::X * x, world_from_camera: DMat3::IDENTITY, fov_y_rad: 0.8 };
        let mut queries = Queries::default();
        queries.stand(pose(0.0));
        queries.compare_with(Some((Arc::new(Mask::from_fn(4, 4, |_| true)), pose(0.0))));
        assert!(queries.truth().is_some());
        queries.stand(pose(0.5));
        assert!(queries.truth().is_none(), "seen from elsewhere");
        queries.stand(pose(0.0));
        assert!(queries.truth().is_some(), "back again");
        let masks = vec![([1; 3], Mask::from_fn(2, 2, |i| i == 0))];
        let (comparison, masks) = compared(queries.truth().as_deref(), masks);
        assert_eq!(masks.iter().map(|m| m.1.area()).collect::<Vec<_>>(), [1, 3, 0]);
        assert_eq!(comparison.map(|c| c.iou), Some(0.25));
        queries.compare_with(None);
        assert!(queries.truth().is_none() && !queries.compares());
    }
}
