//! Regions of pictures whose objects and parts are known.

use super::*;
use crate::scene::Level;

const W: usize = 320;
const H: usize = 240;

/// A red plate with a white and a dark button, and a green ball that touches it, before a gray wall
/// that gets darker downwards; some noise everywhere.
fn scene() -> (Vec<[u8; 3]>, Vec<u8>) {
    let mut random = 1_u32;
    let mut rgb = Vec::new();
    let mut ids = Vec::new();
    for i in 0..W * H {
        let (x, y) = ((i % W) as f64, (i / W) as f64);
        let near = |cx: f64, cy: f64, r: f64| (x - cx).hypot(y - cy) < r;
        let (id, color) = match () {
            () if near(90.0, 90.0, 14.0) => (2, [235.0, 235.0, 230.0]),
            () if near(140.0, 130.0, 12.0) => (3, [30.0, 30.0, 40.0]),
            () if (50.0..180.0).contains(&x) && (50.0..180.0).contains(&y) => (1, [200.0, 40.0, 30.0]),
            () if near(215.0, 120.0, 36.0) => (4, [40.0, 150.0, 60.0]),
            () => (0, [150.0 - 0.2 * y; 3]),
        };
        rgb.push(color.map(|c: f64| {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (c + f64::from(random >> 24) / 32.0 - 4.0).clamp(0.0, 255.0) as u8
        }));
        ids.push(id);
    }
    (rgb, ids)
}

fn find(rgb: &[[u8; 3]], coverage: Option<&[u8]>) -> Vec<FoundMask> {
    Regions::default().find(&Picture { width: W, rgb, coverage, ends: None })
}

/// Largest IoU of any region with the pixels that have one of the ids.
fn best(found: &[FoundMask], ids: &[u8], wanted: &[u8]) -> f64 {
    let truth = Mask::from_fn(W, H, |i| wanted.contains(&ids[i]));
    found.iter().map(|f| f.mask.iou(&truth)).fold(0.0, f64::max)
}

#[test]
fn things_of_one_color_are_found_and_noise_is_not() {
    let (rgb, ids) = scene();
    let found = find(&rgb, None);
    for wanted in [&[1][..], &[2], &[3], &[4]] {
        assert!(best(&found, &ids, wanted) > 0.85, "{wanted:?}: {}", best(&found, &ids, wanted));
    }
    assert!(found.len() < 12, "{} regions", found.len());
    assert_eq!(found, find(&rgb, None), "the same every time");
    // Control: pixels in another order hold nothing.
    let mut shuffled: Vec<usize> = (0..W * H).collect();
    let mut random = 7_usize;
    (1..W * H).for_each(|i| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        shuffled.swap(i, (random >> 33) % (i + 1));
    });
    let found = find(&shuffled.iter().map(|&i| rgb[i]).collect::<Vec<_>>(), None);
    assert!([&[1][..], &[2], &[3], &[4]].iter().all(|wanted| best(&found, &ids, wanted) < 0.5));
}

#[test]
fn what_a_photo_does_not_show_is_in_no_region() {
    let (rgb, _) = scene();
    let coverage: Vec<u8> = (0..W * H).map(|i| u8::from(i % W < 170)).collect();
    let found = find(&rgb, Some(&coverage));
    assert!(!found.is_empty() && found.iter().all(|f| f.mask.pixels().all(|i| i % W < 170)));
    assert!(find(&rgb, Some(&[0; W * H])).is_empty());
    assert!(Regions::default().find(&Picture { width: 0, rgb: &[], coverage: None, ends: None }).is_empty());
    assert!(Regions::default().find(&Picture { width: 1, rgb: &[[9; 3]], coverage: None, ends: None }).is_empty());
}

#[test]
fn objects_are_apart_and_parts_are_inside_theirs() {
    let (rgb, _) = scene();
    let found = find(&rgb, None);
    for (i, f) in found.iter().enumerate() {
        match f.parent {
            None => assert_eq!(f.level, Level::Object),
            Some(p) => {
                assert!(p < i && f.level == Level::Part && found[p].level == Level::Object);
                assert_eq!(f.mask.overlap(&found[p].mask), f.mask.area());
            }
        }
        let same = |g: &&FoundMask| g.level == f.level && g.mask != f.mask;
        assert!(found.iter().filter(same).all(|g| g.mask.overlap(&f.mask) == 0));
    }
}
