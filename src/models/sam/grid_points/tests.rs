//! Simulated network over nested rectangles: each point prompt returns the rectangles that contain it.

use crate::models::ModelError;
use crate::models::preprocess::FitSide;
use crate::models::sam::automatic::{AutomaticOptions, everything};
use crate::models::sam::{Prompted, PromptedMasks};
use crate::models::tensor::Tensor;
use crate::scene::{Mask, PhotoPixels};

/// Side of the picture and of the network's square, px, and of its low-resolution masks.
const SIDE: usize = 256;
const LOW: usize = SIDE / 4;

/// Rectangles by left, top, right and bottom px; outer ones come before inner ones.
struct Knowing {
    things: Vec<[usize; 4]>,
    asked: usize,
}

impl Knowing {
    fn around(&self, x: f32, y: f32) -> Vec<[usize; 4]> {
        let inside =
            |[l, t, r, b]: &&[usize; 4]| (*l as f32..*r as f32).contains(&x) && (*t as f32..*b as f32).contains(&y);
        self.things.iter().filter(inside).rev().copied().collect()
    }
}

impl PromptedMasks for Knowing {
    fn name(&self) -> &str {
        "knowing"
    }

    fn look(&mut self, _: &PhotoPixels) -> Result<(), ModelError> {
        Ok(())
    }

    fn masks(&mut self, points: Tensor, _: Tensor, _: Option<Tensor>) -> Result<Prompted, ModelError> {
        let n = points.shape[0];
        self.asked += n;
        let (mut masks, mut iou) = (vec![-8.0; n * 4 * LOW * LOW], vec![0.0; n * 4]);
        for p in 0..n {
            let [x, y] = [points.values[4 * p], points.values[4 * p + 1]];
            for (j, [l, t, r, b]) in self.around(x, y).into_iter().take(3).enumerate() {
                iou[4 * p + 1 + j] = 0.95;
                let plane = (4 * p + 1 + j) * LOW * LOW;
                let inside = (t / 4..b / 4).flat_map(|y| (l / 4..r / 4).map(move |x| y * LOW + x));
                inside.for_each(|i| masks[plane + i] = 8.0);
            }
        }
        Ok(Prompted { masks: Tensor::new(&[n, 4, LOW, LOW], masks), iou: Tensor::new(&[n, 4], iou) })
    }

    fn side_px(&self) -> usize {
        SIDE
    }

    fn fit(&self) -> FitSide {
        FitSide::Longer
    }
}

/// Masks of everything, and the number of points that were prompted.
fn found(things: &[[usize; 4]], adaptive: bool) -> (Vec<Mask>, usize) {
    let mut network = Knowing { things: things.to_vec(), asked: 0 };
    let rgb = vec![[0; 3]; SIDE * SIDE];
    let picture = PhotoPixels { width_px: SIDE as u32, height_px: SIDE as u32, rgb, coverage: None, alpha: None };
    let options = AutomaticOptions { crop_layers: 0, adaptive, ..AutomaticOptions::default() };
    let masks = everything(&mut network, &picture, &options, &mut |_| true).expect("masks");
    let mut masks: Vec<Mask> = masks.into_iter().map(|m| m.mask).collect();
    masks.sort_by_key(|m| (m.area(), m.pixels().next()));
    (masks, network.asked)
}

/// Table with objects on it, their parts, and parts of these.
const THINGS: [[usize; 4]; 8] = [
    [12, 20, 240, 244],
    [32, 40, 128, 152],
    [48, 56, 72, 80],
    [52, 60, 68, 76],
    [88, 56, 112, 74],
    [150, 48, 224, 210],
    [160, 60, 178, 198],
    [198, 150, 216, 168],
];

#[test]
fn what_is_larger_than_two_steps_of_the_grid_is_found_with_fewer_points() {
    let (all, asked) = found(&THINGS, false);
    assert_eq!((all.len(), asked), (THINGS.len(), 32 * 32));
    let (adaptive, fewer) = found(&THINGS, true);
    assert_eq!(adaptive, all);
    assert!(fewer < asked * 6 / 10, "{fewer} of {asked}");
}

#[test]
fn what_is_smaller_than_two_steps_may_be_missed_amid_something_else() {
    // Between the points that are prompted first, in the middle of the table.
    let mut things = THINGS.to_vec();
    things.push([136, 216, 148, 228]);
    let ((all, _), (adaptive, _)) = (found(&things, false), found(&things, true));
    assert_eq!((all.len(), adaptive.len()), (things.len(), THINGS.len()));
}

#[test]
fn where_nothing_is_answered_every_point_is_asked() {
    let (masks, asked) = found(&[], true);
    assert_eq!((masks.len(), asked), (0, 32 * 32));
}
