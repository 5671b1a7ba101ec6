//! Tree of Gaussians that belong together, and the selection of its nodes by marks.

use std::collections::BTreeMap;

use super::leaves::{borders, leaves};
use super::marks::{StrokeMark, StrokeMarks};
use super::surface::{NEIGHBORS, SplatSurface};
use crate::pipeline::observer::Observer;
use crate::pipeline::semantics::lifting::error::FindError;
use crate::pipeline::semantics::lifting::nearest::nearest;
use crate::pipeline::semantics::lifting::regions::segment::unlike;
use crate::pipeline::semantics::lifting::regions::tree::{Piece, Tree, grow};
use crate::render::RenderSettings;
use crate::scene::{Camera, GaussianCloud};

/// Corrected Gaussians of something known.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CorrectedSplats {
    /// True for each of its Gaussians.
    pub(crate) is_in: Vec<bool>,
    /// True if the last mark is a click that was kept from changing more.
    pub(crate) is_limited: bool,
}

impl CorrectedSplats {
    /// Gaussians that nothing limited.
    pub(crate) fn new(is_in: Vec<bool>) -> Self {
        Self { is_in, is_limited: false }
    }
}

/// Gaussians as a tree, whose leaves are a few that look the same.
#[derive(Debug)]
pub(crate) struct Hierarchy {
    /// The leaf of each Gaussian.
    pub(super) leaf: Vec<u32>,
    pub(super) leaves: usize,
    pub(super) tree: Tree,
    /// Area of each Gaussian, square units.
    pub(super) area: Vec<f64>,
}

impl Hierarchy {
    /// Builds the tree of a cloud as seen by these cameras.
    pub(crate) fn new(
        cloud: &GaussianCloud,
        cameras: &[Camera],
        settings: &RenderSettings,
        observer: &mut dyn Observer,
    ) -> Result<Self, FindError> {
        Ok(Self::of(&SplatSurface::new(cloud, &nearest(cloud, NEIGHBORS), cameras, settings, observer)?))
    }

    /// Builds the tree of a surface.
    pub(crate) fn of(surface: &SplatSurface) -> Self {
        let (leaf, count) = leaves(surface);
        let mut pieces = vec![Piece { area: 0.0, sums: vec![0.0; 3] }; count];
        for (piece, leaf) in surface.pieces.iter().zip(&leaf) {
            let whole = &mut pieces[*leaf as usize];
            whole.area += piece.area;
            whole.sums.iter_mut().zip(&piece.sums).for_each(|(s, p)| *s += p);
        }
        let borders = borders(surface, &leaf);
        let unit = pieces.iter().map(|p| p.area).sum::<f64>() / 1000.0;
        let tree = grow(pieces, borders, &move |a, b, border| unlike(a, b, border, true, unit));
        Self { leaf, leaves: count, tree, area: surface.pieces.iter().map(|p| p.area).collect() }
    }

    /// Returns the Gaussians that the marks select, starting from the Gaussians `from` if a selection is corrected
    /// (indices).
    ///
    /// Finds, stroke by stroke, the cheapest labels of the tree's nodes. A mark that is not followed has a cost. So
    /// has each node with another label than its parent: less, the longer the node stood alone while the tree grew.
    /// Changed area costs by the square of the stroke's length, so that a stroke is about something of its own size.
    /// It costs least if a minus removes it, and little if a click adds it, since a click gives a place but no size.
    pub(crate) fn select(&self, marks: &StrokeMarks, from: &[usize]) -> Vec<bool> {
        self.marked(marks, from, &[KNOWN_BY_CLICK]).is_in
    }

    /// Returns the Gaussians of something known, `from`, as marks correct it. The cost of area rises while a click
    /// changes more than all of it and more than a click is about, so that a small part does not grow over all around
    /// it.
    pub(crate) fn correct(&self, marks: &StrokeMarks, from: &[usize]) -> CorrectedSplats {
        self.marked(marks, from, &CORRECTED_BY_CLICK)
    }

    /// `by_click` are the costs of area of a given selection that a click changes, from the first that is enough.
    fn marked(&self, marks: &StrokeMarks, from: &[usize], by_click: &[f64]) -> CorrectedSplats {
        let mut gaussians = vec![false; self.leaf.len()];
        from.iter().for_each(|&i| gaussians[i] = true);
        let mut share = vec![[0_u32; 2]; self.leaves];
        for (leaf, is_in) in self.leaf.iter().zip(&gaussians) {
            share[*leaf as usize][usize::from(*is_in)] += 1;
        }
        let before: Vec<bool> = share.iter().map(|[out, own]| own > out).collect();
        let mut now = before.clone();
        let mut alone: Vec<f64> = self.tree.nodes.iter().map(Self::price).collect();
        if !from.is_empty() {
            // The borders of the given selection are free, so that they stay and are not smoothed.
            let fixed =
                |leaf: usize| [before[leaf], !before[leaf]].map(|other| if other { f64::INFINITY } else { 0.0 });
            let own = self.cheapest(&fixed, &alone);
            for (i, node) in self.tree.nodes.iter().enumerate() {
                let whole = node.parent.is_some_and(|p| own[p as usize]);
                if own[i] != whole {
                    alone[i] = 0.0;
                }
            }
        }
        let area = |of: &dyn Fn(usize) -> bool| -> f64 {
            (0..self.leaves).filter(|leaf| of(*leaf)).map(|leaf| self.tree.nodes[leaf].area).sum()
        };
        let known = area(&|leaf| before[leaf]);
        let mut is_limited = false;
        let mut marked = vec![[0.0_f64; 2]; self.leaves];
        for (k, stroke) in marks.strokes.iter().enumerate() {
            let mut weights: BTreeMap<u32, f64> = BTreeMap::new();
            for (gaussian, weight) in &stroke.weights {
                *weights.entry(self.leaf[*gaussian as usize]).or_default() += f64::from(*weight);
            }
            let all: f64 = weights.values().sum();
            // The cost is for not following a mark.
            for (leaf, weight) in weights {
                let [out, own] = &mut marked[leaf as usize];
                let (against, follows) = if stroke.is_plus { (out, own) } else { (own, out) };
                *against += MARK * weight / all;
                // Of two opposite marks, the later one counts.
                *follows = 0.0;
            }
            let change = match stroke {
                StrokeMark { is_click, .. } if !from.is_empty() => [if *is_click { by_click[0] } else { KNOWN }; 2],
                _ if k == 0 => [FIRST; 2],
                StrokeMark { is_plus: false, .. } => [REMOVE, CHANGE],
                StrokeMark { is_click: true, .. } => [CHANGE, ADD_BY_CLICK],
                _ => [CHANGE; 2],
            };
            let after = |change: [f64; 2]| {
                let change = change.map(|c| c / stroke.size.max(f64::MIN_POSITIVE));
                let cost = |leaf: usize| {
                    let (mut cost, other) = (marked[leaf], usize::from(!now[leaf]));
                    cost[other] += change[other] * self.tree.nodes[leaf].area;
                    cost
                };
                self.cheapest(&cost, &alone)
            };
            let mut nodes = after(change);
            is_limited = false;
            for dearer in by_click[1..].iter().filter(|_| stroke.is_click) {
                if area(&|leaf| nodes[leaf] != now[leaf]) <= known.max(stroke.size) {
                    break;
                }
                (nodes, is_limited) = (after([*dearer; 2]), true);
            }
            now = nodes[..self.leaves].to_vec();
        }
        for (is_in, leaf) in gaussians.iter_mut().zip(&self.leaf) {
            let leaf = *leaf as usize;
            // Gaussians in leaves without a change stay as they were.
            if now[leaf] != before[leaf] {
                *is_in = now[leaf];
            }
        }
        CorrectedSplats { is_in: gaussians, is_limited }
    }
}

/// Cost of ignoring a stroke entirely, in nodes that are cut off without any visible difference.
const MARK: f64 = 10.0;
/// Cost of area, per square of a stroke's length: for the selection of the first stroke, and for a later change.
const FIRST: f64 = 0.01;
const CHANGE: f64 = 0.5;
/// Cost of area that a minus removes, and that a click adds.
const REMOVE: f64 = 0.05;
const ADD_BY_CLICK: f64 = 0.1;
/// Cost of area of a given selection that a line changes, and that a click changes.
const KNOWN: f64 = 16.0;
const KNOWN_BY_CLICK: f64 = 0.1;
/// The same for a click that corrects something known, from the first that is enough.
const CORRECTED_BY_CLICK: [f64; 5] = [KNOWN_BY_CLICK, 0.4, 1.6, 6.4, KNOWN];

#[cfg(test)]
pub(super) mod tests {
    use glam::DVec3;

    use super::*;
    use crate::pipeline::observer::testing::StopsAfter;
    use crate::pipeline::observer::{Interrupted, Silent};
    use crate::pipeline::semantics::lifting::splat_tree::marks::Stroke;
    use crate::render::Renderer;
    use crate::scene::Mask;

    const W: usize = 128;
    const H: usize = 96;

    /// A sheet of gray Gaussians with a square of 12 x 12 in it, red on the left, blue on the right. Their labels are
    /// 0, 1 and 2.
    pub(in super::super) fn sheet() -> (GaussianCloud, Vec<usize>) {
        let n = 32;
        let of = |i: usize| match (i % n, i / n) {
            (x, y) if (10..16).contains(&x) && (10..22).contains(&y) => 1,
            (x, y) if (16..22).contains(&x) && (10..22).contains(&y) => 2,
            _ => 0,
        };
        let color = [[0.0; 3], [1.6, -1.6, -1.6], [-1.6, -1.2, 1.6]];
        let place = |i: usize| [(i % n) as f32 * 0.05 - 0.8, (i / n) as f32 * 0.05 - 0.8, 0.0];
        let whose: Vec<usize> = (0..n * n).map(of).collect();
        let cloud = GaussianCloud {
            sh: whose.iter().map(|w| color[*w]).collect(),
            log_scales: vec![[-3.7, -3.7, -5.0]; n * n],
            ..GaussianCloud::isotropic((0..n * n).map(place).collect(), -3.7, 4.0)
        };
        (cloud, whose)
    }

    pub(in super::super) fn cameras() -> Vec<Camera> {
        let from = |x: f64, y: f64| {
            Camera::look_at(DVec3::new(x, y, -2.2), DVec3::ZERO, DVec3::NEG_Y, 0.8, W as u32, H as u32).expect("valid")
        };
        vec![from(0.0, 0.0), from(0.5, 0.2), from(-0.4, -0.3)]
    }

    /// A dot around a place of the sheet in the first view.
    fn dot(at: [f64; 2], is_plus: bool) -> Stroke {
        let camera = cameras().remove(0);
        let p = camera.project(DVec3::new(at[0], at[1], 0.0)).expect("in front");
        let near = |i: usize| ((i % W) as f64 + 0.5 - p.x).hypot((i / W) as f64 + 0.5 - p.y) < 1.5;
        Stroke { camera, pixels: Mask::from_fn(W, H, near), is_plus }
    }

    fn marks(cloud: &GaussianCloud, strokes: &[Stroke]) -> StrokeMarks {
        let mut marks = StrokeMarks::default();
        for stroke in strokes {
            marks.add(&mut Renderer::new(), cloud, &RenderSettings::default(), stroke).expect("drawn");
        }
        marks
    }

    /// Counts the selected Gaussians of each of the three.
    fn counts(selected: &[bool], whose: &[usize]) -> [usize; 3] {
        [0, 1, 2].map(|k| selected.iter().zip(whose).filter(|(s, w)| **s && **w == k).count())
    }

    pub(in super::super) fn hierarchy(cloud: &GaussianCloud) -> Hierarchy {
        Hierarchy::new(cloud, &cameras(), &RenderSettings::default(), &mut Silent).expect("made")
    }

    #[test]
    fn a_click_takes_what_it_is_on_and_corrections_add_and_remove() {
        let (cloud, whose) = sheet();
        let tree = hierarchy(&cloud);
        let [left, right, gray] = [[-0.15, 0.0], [0.15, 0.0], [-0.6, -0.6]];
        let select = |strokes: &[Stroke], from: &[usize]| counts(&tree.select(&marks(&cloud, strokes), from), &whose);
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
        let line = |from: [f64; 2], to: [f64; 2], is_plus: bool| {
            let place = |t: f64| [0, 1].map(|c| from[c] + t * (to[c] - from[c]));
            let dots = (0..=20).map(|k| dot(place(f64::from(k) / 20.0), is_plus));
            let all = dots.reduce(|mut a, b| {
                a.pixels.add(&b.pixels);
                a
            });
            all.expect("dots")
        };
        let select = |stroke: &Stroke| tree.select(&marks(&cloud, std::slice::from_ref(stroke)), &from);
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
        let alone = tree.select(&marks(&cloud, &[line([-0.6, 0.6], [0.0, 0.6], true)]), &[]);
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
        let found = tree.correct(&click, &from);
        let added = |of: &[bool]| (0..whose.len()).filter(|i| of[*i] && !is_corner(*i)).count();
        let (few, all) = (added(&found.is_in), added(&tree.select(&click, &from)));
        assert!(few < 60 && found.is_limited, "{few}");
        assert!(from.iter().all(|i| found.is_in[*i]), "what was known stays");
        assert!(few < all, "the control, of what is only given: {few} of {all}");
    }

    #[test]
    fn the_last_stroke_is_taken_back_and_selecting_twice_gives_the_same() {
        let (cloud, whose) = sheet();
        let tree = hierarchy(&cloud);
        let mut all = marks(&cloud, &[dot([-0.15, 0.0], true), dot([0.15, 0.0], true)]);
        let both = tree.select(&all, &[]);
        assert_eq!(both, hierarchy(&cloud).select(&all, &[]));
        all.remove_last();
        let one = tree.select(&all, &[]);
        assert_eq!(one, tree.select(&marks(&cloud, &[dot([-0.15, 0.0], true)]), &[]));
        assert_ne!(counts(&one, &whose), counts(&both, &whose));
        all.remove_last();
        all.remove_last();
        assert_eq!((all.len(), counts(&tree.select(&all, &[]), &whose)), (0, [0; 3]));
    }

    #[test]
    fn extreme_clouds_and_a_stop() {
        let settings = RenderSettings::default();
        for n in [0, 1, 2] {
            let cloud = GaussianCloud::isotropic(vec![[0.0; 3]; n], -2.0, 3.0);
            for cameras in [cameras(), Vec::new()] {
                let tree = Hierarchy::new(&cloud, &cameras, &settings, &mut Silent).expect("made");
                let selected = tree.select(&marks(&cloud, &[dot([0.0, 0.0], true)]), &[]);
                assert_eq!(selected.len(), n);
            }
        }
        // All in one place, and one far off that no view shows.
        let mut cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 40], -2.0, 3.0);
        cloud.positions[39] = [1e6, 0.0, 0.0];
        let tree = Hierarchy::new(&cloud, &cameras(), &settings, &mut Silent).expect("made");
        let selected = tree.select(&marks(&cloud, &[dot([0.0, 0.0], true)]), &[]);
        assert!(selected[..39].iter().any(|s| *s) && !selected[39]);
        let stopped = Hierarchy::new(&sheet().0, &cameras(), &settings, &mut StopsAfter::new(0)).expect_err("stopped");
        assert!(Interrupted::is_cause_of(&stopped), "{stopped}");
    }
}
