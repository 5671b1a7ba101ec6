//! Selections on a sheet with a square of two colors, and on trees made by hand.

use glam::DVec3;

use super::super::band::LineBand;
use super::super::hierarchy::tests::{H, W, cameras, hierarchy, sheet};
use super::super::marks::Stroke;
use super::*;
use crate::pipeline::observer::Silent;
use crate::pipeline::semantics::lifting::regions::tree::{Node, Tree};
use crate::render::{RenderSettings, Renderer};
use crate::scene::{GaussianCloud, Identities, IdentityId, Mask, SemanticMap};

/// A dot around a place of the sheet in the first view.
fn dot(at: [f64; 2], is_plus: bool) -> Stroke {
    let camera = cameras().remove(0);
    let p = camera.project(DVec3::new(at[0], at[1], 0.0)).expect("in front");
    let near = |i: usize| ((i % W) as f64 + 0.5 - p.x).hypot((i / W) as f64 + 0.5 - p.y) < 1.5;
    Stroke { camera, pixels: Mask::from_fn(W, H, near), is_plus }
}

/// A line between two places of the sheet in the first view.
fn line(from: [f64; 2], to: [f64; 2], is_plus: bool) -> Stroke {
    let place = |t: f64| [0, 1].map(|c| from[c] + t * (to[c] - from[c]));
    let dots = (0..=20).map(|k| dot(place(f64::from(k) / 20.0), is_plus));
    let all = dots.reduce(|mut a, b| {
        a.pixels.add(&b.pixels);
        a
    });
    all.expect("dots")
}

fn marks(cloud: &GaussianCloud, strokes: &[Stroke]) -> StrokeMarks {
    let mut marks = StrokeMarks::default();
    for stroke in strokes {
        marks.add(&mut Renderer::new(), cloud, &RenderSettings::default(), stroke).expect("drawn");
    }
    marks
}

/// A tree of leaves with these numbers of Gaussians, of area 1 each, and of merges with their unlikeness.
fn made(sizes: &[usize], merges: &[([u32; 2], f64)]) -> Hierarchy {
    let leaf: Vec<u32> = (0..).zip(sizes).flat_map(|(k, n)| std::iter::repeat_n(k, *n)).collect();
    let last = merges.last().map_or(0.0, |m| m.1);
    let node = |area| Node { children: None, parent: None, birth: 0.0, death: last, area };
    let mut nodes: Vec<Node> = sizes.iter().map(|n| node(*n as f64)).collect();
    for &(children, birth) in merges {
        let parent = nodes.len() as u32;
        for child in children.map(|c| c as usize) {
            (nodes[child].parent, nodes[child].death) = (Some(parent), birth);
        }
        let area = children.iter().map(|c| nodes[*c as usize].area).sum();
        nodes.push(Node { children: Some(children), birth, ..node(area) });
    }
    Hierarchy { area: vec![1.0; leaf.len()], leaves: sizes.len(), leaf, tree: Tree { nodes } }
}

/// A click on these Gaussians that adds.
fn click(on: &[u32]) -> StrokeMark {
    let weights = on.iter().map(|i| (*i, 1.0)).collect();
    StrokeMark { weights, is_plus: true, is_click: true, size: 100.0, band: None }
}

/// A line over the first `n` Gaussians, with `beside` others that are seen around it, and one along it of another leaf.
fn line_on(n: u32, beside: u32, is_plus: bool, another: u32) -> StrokeMark {
    let around = (0..n + beside).chain([another]).map(|i| (i, 1.0)).collect();
    let band = LineBand { along: (0..n).chain([another]).collect(), area_px: f64::from(n), around };
    StrokeMark { weights: (0..n).map(|i| (i, 1.0)).collect(), is_plus, is_click: false, size: 100.0, band: Some(band) }
}

/// The same without a look around it: leaves decide.
fn by_leaves(line: &StrokeMark) -> StrokeMark {
    StrokeMark { band: None, ..line.clone() }
}

/// Counts the selected Gaussians of each of the three.
fn counts(selected: &[bool], whose: &[usize]) -> [usize; 3] {
    [0, 1, 2].map(|k| selected.iter().zip(whose).filter(|(s, w)| **s && **w == k).count())
}

#[test]
fn a_click_takes_what_it_is_on_and_corrections_add_and_remove() {
    let (cloud, whose) = sheet();
    let tree = hierarchy(&cloud);
    let [left, right, gray] = [[-0.15, 0.0], [0.15, 0.0], [-0.6, -0.6]];
    let select = |strokes: &[Stroke], from: &[usize]| counts(&tree.select(&marks(&cloud, strokes), from).is_in, &whose);
    // The rims of the three are of mixed colors; inside of them are 40, 40 and more of the gray.
    let one = select(&[dot(left, true)], &[]);
    let both = select(&[dot(left, true), dot(right, true)], &[]);
    let back = select(&[dot(left, true), dot(right, true), dot(right, false)], &[]);
    // The corrected selection stays, except for the marked Gaussians.
    let from: Vec<usize> = (0..whose.len()).filter(|i| whose[*i] > 0).collect();
    let without = select(&[dot(left, false)], &from);
    let other = select(&[dot(gray, true)], &[]);
    assert!(one[1] >= 40 && one[0] + one[2] <= 8, "{one:?}");
    assert!(both[1] >= 40 && both[2] >= 40 && both[0] <= 8, "{both:?}");
    assert!(back[1] >= 40 && back[2] <= 8 && back[0] <= 8, "{back:?}");
    assert!(without[1] <= 32 && without[2] >= 64 && without[0] == 0, "{without:?}");
    // Controls: no mark, nothing; a mark elsewhere selects something else.
    assert_eq!(select(&[], &[]), [0; 3]);
    assert!(other[0] >= 400 && other[1] + other[2] <= 8, "{other:?}");
}

#[test]
fn what_is_known_keeps_its_borders_and_a_line_corrects_what_it_covers() {
    let (cloud, whose) = sheet();
    let tree = hierarchy(&cloud);
    // The given selection ends without a visible border: the upper gray, and all of the blue.
    let from: Vec<usize> = (0..whose.len()).filter(|i| whose[*i] == 2 || whose[*i] == 0 && i / 32 < 9).collect();
    let select = |stroke: &Stroke| tree.select(&marks(&cloud, std::slice::from_ref(stroke)), &from).is_in;
    let without_blue = select(&line([0.15, -0.2], [0.15, 0.2], false));
    let [gray, red, blue] = counts(&without_blue, &whose);
    assert!(gray == 288 && red == 0 && (40..64).contains(&blue), "{gray} {red} {blue}");
    let with_red = select(&line([-0.15, -0.2], [-0.15, 0.2], true));
    let [gray, red, blue] = counts(&with_red, &whose);
    assert!((280..300).contains(&gray) && (8..40).contains(&red) && blue >= 64, "{gray} {red} {blue}");
    // In the middle of an even area, hardly more than the line itself.
    let lower = select(&line([-0.6, 0.6], [0.0, 0.6], true));
    let more = counts(&lower, &whose)[0] - 288;
    assert!((8..120).contains(&more), "{more} of the lower gray");
    // The control: from nothing, the same line selects the whole even area.
    let alone = tree.select(&marks(&cloud, &[line([-0.6, 0.6], [0.0, 0.6], true)]), &[]).is_in;
    assert!(counts(&alone, &whose)[0] > 400);
}

#[test]
fn a_click_beside_a_small_part_does_not_take_all_around_it() {
    let (cloud, whose) = sheet();
    let tree = hierarchy(&cloud);
    // A corner of the gray, and a click on the gray beside it, on the upper left and far from its other borders.
    let is_corner = |i: usize| i % 32 < 5 && i / 32 < 5;
    let from: Vec<usize> = (0..whose.len()).filter(|i| is_corner(*i)).collect();
    let click = marks(&cloud, &[dot([-0.5, -0.65], true)]);
    let found = tree.correct(&click, &from, &OtherIdentities::default());
    let added = |of: &[bool]| (0..whose.len()).filter(|i| of[*i] && !is_corner(*i)).count();
    let (few, all) = (added(&found.is_in), added(&tree.select(&click, &from).is_in));
    assert!(few < 60 && found.effect.is_limited, "{few}");
    assert!(from.iter().all(|i| found.is_in[*i]), "what was known stays");
    assert!(few < all, "the control, of what is only given: {few} of {all}");
}

#[test]
fn a_click_that_removes_does_not_take_all_of_something_large() {
    // A Gaussian, and twenty others behind a border.
    let from = Vec::from_iter(0..21);
    let left = |size: f64, border: f64| {
        let tree = made(&[1, 20], &[([0, 1], border)]);
        let marks = StrokeMarks { strokes: vec![StrokeMark { is_plus: false, size, ..click(&[0]) }] };
        let found = tree.correct(&marks, &from, &OtherIdentities::default());
        let of_given = tree.select(&marks, &from).is_in;
        let count = |of: &[bool]| of.iter().filter(|is_in| **is_in).count();
        (count(&found.is_in), found.effect.is_limited, count(&of_given))
    };
    assert_eq!(left(5.0, 0.0), (20, true, 0), "the control, of what is only given, loses all");
    assert_eq!(left(25.0, 0.0), (20, true, 0), "a click about more than that is about no more than a piece");
    assert_eq!(left(25.0, 10.0), (20, false, 20), "the control: a piece behind a border goes at once");
}

#[test]
fn a_click_that_may_not_take_a_large_leaf_takes_what_is_under_it() {
    let (tree, from) = (made(&[10, 50], &[([0, 1], 10.0)]), Vec::from_iter(0..10));
    let found = |size: f64, from: &[usize]| {
        let marks = StrokeMarks { strokes: vec![StrokeMark { size, ..click(&[12, 13]) }] };
        let found = tree.correct(&marks, from, &OtherIdentities::default());
        let added = (10..60).filter(|i| found.is_in[*i]).collect::<Vec<_>>();
        (added, found.effect.is_limited, found.effect.is_along)
    };
    assert_eq!(found(5.0, &from), (vec![12, 13], true, false));
    // The control: of nothing, the leaf.
    assert_eq!(found(100.0, &[]).0.len(), 50);
}

#[test]
fn the_last_stroke_is_taken_back_and_selecting_twice_gives_the_same() {
    let (cloud, whose) = sheet();
    let tree = hierarchy(&cloud);
    let mut all = marks(&cloud, &[dot([-0.15, 0.0], true), dot([0.15, 0.0], true)]);
    let both = tree.select(&all, &[]).is_in;
    assert_eq!(both, hierarchy(&cloud).select(&all, &[]).is_in);
    all.remove_last();
    let one = tree.select(&all, &[]).is_in;
    assert_eq!(one, tree.select(&marks(&cloud, &[dot([-0.15, 0.0], true)]), &[]).is_in);
    assert_ne!(counts(&one, &whose), counts(&both, &whose));
    all.remove_last();
    all.remove_last();
    assert_eq!((all.len(), counts(&tree.select(&all, &[]).is_in, &whose)), (0, [0; 3]));
}

#[test]
fn clouds_of_none_of_one_and_of_many_in_one_place() {
    let settings = RenderSettings::default();
    for n in [0, 1, 2] {
        let cloud = GaussianCloud::isotropic(vec![[0.0; 3]; n], -2.0, 3.0);
        for cameras in [cameras(), Vec::new()] {
            let tree = Hierarchy::new(&cloud, &cameras, &settings, &mut Silent).expect("made");
            let selected = tree.select(&marks(&cloud, &[dot([0.0, 0.0], true)]), &[]).is_in;
            assert_eq!(selected.len(), n);
        }
    }
    // All in one place, and one far off that no view shows.
    let mut cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 40], -2.0, 3.0);
    cloud.positions[39] = [1e6, 0.0, 0.0];
    let tree = Hierarchy::new(&cloud, &cameras(), &settings, &mut Silent).expect("made");
    let selected = tree.select(&marks(&cloud, &[dot([0.0, 0.0], true)]), &[]).is_in;
    assert!(selected[..39].iter().any(|s| *s) && !selected[39]);
}

#[test]
fn what_a_click_does_not_touch_stays_with_its_identity() {
    // The thing itself, and two leaves that hardly differ, small beside it. The second leaf is a mouth.
    let tree = made(&[100, 10, 10], &[([1, 2], 0.1), ([0, 3], 10.0)]);
    let from: Vec<usize> = (0..100).collect();
    let of: Vec<IdentityId> = (0..120_usize).map(|i| [1, 0, 2][i.saturating_sub(90) / 10]).collect();
    let map = SemanticMap::from_identities(Identities::objects(2), of, vec![1.0; 120], Vec::new());
    let others = OtherIdentities::new(&map, 1);
    let correct = |strokes: Vec<StrokeMark>, others: &OtherIdentities| {
        let found = tree.correct(&StrokeMarks { strokes }, &from, others);
        ([0..100, 100..110, 110..120].map(|of| found.is_in[of].iter().filter(|s| **s).count()), found.effect.others)
    };
    let mouth = |is_left| vec![OtherChange { id: 2, gaussians: 10, share: 1.0, is_left }];
    // The control: as long as nothing is known of the mouth, it is taken with what is clicked on.
    assert_eq!(correct(vec![click(&[100, 101])], &OtherIdentities::default()), ([100, 10, 10], Vec::new()));
    assert_eq!(correct(vec![click(&[100, 101])], &others), ([100, 10, 0], mouth(true)));
    // It is taken and told by a click that touches it, also a later one.
    assert_eq!(correct(vec![click(&[100, 110])], &others), ([100, 10, 10], mouth(false)));
    assert_eq!(correct(vec![click(&[100, 101]), click(&[115])], &others), ([100, 10, 10], mouth(false)));
    assert_eq!(correct(vec![click(&[100, 101]), click(&[102])], &others), ([100, 10, 0], mouth(true)));
    // A mark that removes takes nothing of what was left, whatever it touches.
    let minus = |on: &[u32]| StrokeMark { is_plus: false, is_click: false, ..click(on) };
    for on in [&[115][..], &[115, 116, 101], &[3, 115]] {
        let [own, near, of_mouth] = correct(vec![click(&[100, 101]), minus(on)], &others).0;
        assert!(of_mouth == 0 && own <= 100 && near <= 10, "{on:?}: {own}, {near}, {of_mouth}");
    }
    // What is taken is no change any more.
    assert_eq!(correct(vec![click(&[100, 110]), click(&[101])], &others), ([100, 10, 10], Vec::new()));
}

#[test]
fn a_line_on_a_thin_part_corrects_what_is_along_it() {
    // A known strip of one leaf, and all around it.
    let tree = made(&[16, 40], &[([0, 1], 5.0)]);
    let from: Vec<usize> = (0..16).collect();
    let correct = |line: StrokeMark| {
        let found = tree.correct(&StrokeMarks { strokes: vec![line] }, &from, &OtherIdentities::default());
        let these: Vec<usize> = (0..56).filter(|i| found.is_in[*i]).collect();
        (these, found.effect.is_along)
    };
    let thin = line_on(6, 4, false, 20);
    // The control: the leaf goes as a whole.
    assert_eq!(correct(by_leaves(&thin)), (Vec::new(), false));
    assert_eq!(correct(thin), ((6..16).collect::<Vec<_>>(), true));
    // Where the strip is wider than the line, and where the line covers most of it, leaves decide as before.
    for line in [line_on(6, 7, false, 20), line_on(8, 4, false, 20)] {
        assert_eq!(correct(line), (Vec::new(), false));
    }
    assert_eq!(correct(line_on(6, 4, true, 20)), (from.clone(), false), "nothing is missing there");
}

#[test]
fn a_line_on_a_stick_does_not_take_the_disk_at_its_end() {
    // A stick and a disk that look the same, and something else.
    let tree = made(&[8, 400, 100], &[([0, 1], 0.1), ([3, 2], 8.0)]);
    let select = |strokes: &[StrokeMark]| {
        let found = tree.select(&StrokeMarks { strokes: strokes.to_vec() }, &[]);
        let count = |range: std::ops::Range<usize>| found.is_in[range].iter().filter(|s| **s).count();
        ([count(0..4), count(4..8), count(8..408), count(408..508)], found.effect.is_along)
    };
    let stick = line_on(4, 2, true, 450);
    assert_eq!(select(&[by_leaves(&stick)]), ([4, 4, 400, 0], false), "the control");
    assert_eq!(select(std::slice::from_ref(&stick)), ([4, 0, 0, 0], true));
    // On the disk, the line selects all of it.
    assert_eq!(select(&[line_on(4, 6, true, 450)]), ([4, 4, 400, 0], false));
    // Later marks leave it alone, unless they are about it.
    assert_eq!(select(&[stick.clone(), click(&[450])]), ([4, 0, 0, 100], false));
    assert_eq!(select(&[stick.clone(), StrokeMark { is_plus: false, ..click(&[2]) }]).0, [3, 0, 0, 0]);
    let mut all = StrokeMarks { strokes: vec![stick.clone(), click(&[450])] };
    all.remove_last();
    assert_eq!(tree.select(&all, &[]), tree.select(&StrokeMarks { strokes: vec![stick] }, &[]));
}

#[test]
fn lines_on_broad_surfaces_select_as_without_a_look_around_them() {
    let (cloud, whose) = sheet();
    let tree = hierarchy(&cloud);
    let upper: Vec<usize> = (0..whose.len()).filter(|i| whose[*i] == 2 || whose[*i] == 0 && i / 32 < 9).collect();
    let lower = [line([-0.6, 0.6], [0.0, 0.6], true), line([0.6, -0.2], [0.6, 0.5], true)];
    for (strokes, from) in [(&lower[..], &[][..]), (&lower[..1], &[][..]), (&lower[..], &upper[..])] {
        let looked = marks(&cloud, strokes);
        assert!(looked.strokes.iter().all(|s| s.band.is_some() && !s.is_click));
        let plain = StrokeMarks { strokes: looked.strokes.iter().map(by_leaves).collect() };
        assert_eq!(tree.select(&looked, from), tree.select(&plain, from));
    }
}
