//! Labels, drift and reports of views.

use super::views::{Sighting, report};
use super::*;
use crate::scene::{Level, Mask};

#[test]
fn the_innermost_mask_labels_a_pixel() {
    let mask = |from: usize, to: usize| Mask::from_fn(10, 1, |i| (from..to).contains(&i));
    let found = |level, mask| FoundMask { level, parent: None, name: None, mask };
    let all = [found(Level::Object, mask(1, 8)), found(Level::Part, mask(2, 5))];
    assert_eq!(labels_of(&all, &[4, 9], 10), [0, 4, 9, 9, 9, 4, 4, 4, 0, 0]);
}

#[test]
fn what_was_followed_elsewhere_is_contradicted() {
    let map = |from: usize, to: usize, id: IdentityId| -> Vec<IdentityId> {
        (0..400).map(|i| if (from..to).contains(&i) { id } else { UNKNOWN }).collect()
    };
    assert_eq!(contradicted(&map(0, 100, 2), &map(200, 300, 2), 3), [2]);
    assert!(contradicted(&map(0, 100, 2), &map(50, 150, 2), 3).is_empty(), "half of it agrees");
    assert!(contradicted(&map(0, 100, 2), &map(0, 400, UNKNOWN), 3).is_empty(), "nothing is known");
    assert!(contradicted(&map(0, 20, 2), &map(200, 300, 2), 3).is_empty(), "too few pixels to say");
    assert!(contradicted(&map(0, 100, 1), &map(0, 100, 2), 3).is_empty(), "each is seen once");
}

#[test]
fn a_view_reports_who_is_seen_and_what_is_not_known() {
    let map = ViewMap {
        width_px: 4,
        height_px: 1,
        identity: vec![1, 1, UNKNOWN, NO_IDENTITY],
        share: vec![1.0, 0.5, 1.0, 0.0],
        alpha: vec![1.0; 4],
    };
    let r = report(3, &map, 2);
    assert_eq!(r.unknown, 0.25);
    assert_eq!(r.seen, [Sighting { identity: 1, pixels: 2, confidence: 0.75 }]);
}
