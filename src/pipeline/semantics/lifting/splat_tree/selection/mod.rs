//! Gaussians that marks select in the tree, from nothing or from a given selection.

use std::collections::BTreeMap;

use super::band::AS_WIDE;
use super::hierarchy::Hierarchy;
use super::marks::{StrokeMark, StrokeMarks};
use super::others::{OtherChange, OtherIdentities, left_text, taken_text};
use crate::scene::IdentityId;

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
/// The same for a click that corrects something known, from the first that is enough, and the largest shares of it that
/// such a click adds and removes.
const CORRECTED_BY_CLICK: [f64; 5] = [KNOWN_BY_CLICK, 0.4, 1.6, 6.4, KNOWN];
const ADDED_BY_CLICK: f64 = 1.0;
const REMOVED_BY_CLICK: f64 = 0.2;

/// Gaussians that marks select.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct MarkedSplats {
    /// True for each selected Gaussian.
    pub(crate) is_in: Vec<bool>,
    /// Effect of the last mark.
    pub(crate) effect: MarkEffect,
}

/// Effect of a mark beside the selection itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct MarkEffect {
    /// True if it is a click that was kept from changing more of something known.
    pub(crate) is_limited: bool,
    /// True if it is a line that changed only what is along it.
    pub(crate) is_along: bool,
    /// Changes of all other identities.
    pub(crate) others: Vec<OtherChange>,
}

impl MarkEffect {
    /// Sentences on what the stroke left to others, took from them, and took of a thin surface, by their `name`: "left
    /// 2 Gaussians of 'mouth' as they were".
    pub(crate) fn sentences(&self, name: &dyn Fn(IdentityId) -> String) -> [Option<String>; 3] {
        let along = "changed only what is along the line: the surface is hardly wider there";
        let along = self.is_along.then(|| along.to_owned());
        [left_text(&self.others, name), taken_text(&self.others, name), along]
    }
}

impl Hierarchy {
    /// Returns the Gaussians that the marks select, starting from the Gaussians `from` if a selection is corrected
    /// (indices).
    ///
    /// Finds, stroke by stroke, the cheapest labels of the tree's nodes. A mark that is not followed has a cost. So
    /// has each node with another label than its parent: less, the longer the node stood alone while the tree grew.
    /// Changed area costs by the square of the stroke's length, so that a stroke is about something of its own size.
    /// It costs least if a minus removes it, and little if a click adds it, since a click gives a place but no size.
    pub(crate) fn select(&self, marks: &StrokeMarks, from: &[usize]) -> MarkedSplats {
        self.marked(marks, from, &[KNOWN_BY_CLICK], &OtherIdentities::default())
    }

    /// Returns the Gaussians of something known, `from`, as marks correct it. The cost of area rises while a click
    /// changes more than a click is about, adds more than all of the thing, or removes more than a fifth: its place
    /// tells of no more. A click that may not change a whole leaf changes what is under it. Of other identities, a
    /// mark changes hardly more than it touches.
    pub(crate) fn correct(&self, marks: &StrokeMarks, from: &[usize], others: &OtherIdentities) -> MarkedSplats {
        self.marked(marks, from, &CORRECTED_BY_CLICK, others)
    }

    /// `by_click` are the costs of area of a given selection that a click changes, from the first that is enough.
    fn marked(&self, marks: &StrokeMarks, from: &[usize], by_click: &[f64], others: &OtherIdentities) -> MarkedSplats {
        let mut labels = MarkedLabels::new(self, from);
        let mut effect = MarkEffect::default();
        for (k, stroke) in marks.strokes.iter().enumerate() {
            effect = labels.follow(stroke, k == 0, by_click, others);
        }
        MarkedSplats { is_in: labels.is_in, effect }
    }
}

/// Labels of leaves and Gaussians, while marks are followed one after another.
struct MarkedLabels<'a> {
    tree: &'a Hierarchy,
    /// The given selection: true for its Gaussians, and for leaves with most of them.
    given: Vec<bool>,
    before: Vec<bool>,
    is_given: bool,
    /// Cost of each node for another label than its parent's.
    alone: Vec<f64>,
    /// Costs of the leaves for not following marks, being out and in.
    marked: Vec<[f64; 2]>,
    /// Labels of the leaves, and of the Gaussians.
    now: Vec<bool>,
    is_in: Vec<bool>,
    /// Labels of Gaussians along lines, whatever their leaves have.
    along: BTreeMap<u32, bool>,
    /// Labels of Gaussians that were left to other identities.
    left: BTreeMap<u32, bool>,
}

impl<'a> MarkedLabels<'a> {
    fn new(tree: &'a Hierarchy, from: &[usize]) -> Self {
        let mut given = vec![false; tree.leaf.len()];
        from.iter().for_each(|&i| given[i] = true);
        let mut share = vec![[0_u32; 2]; tree.leaves];
        for (leaf, is_in) in tree.leaf.iter().zip(&given) {
            share[*leaf as usize][usize::from(*is_in)] += 1;
        }
        let before: Vec<bool> = share.iter().map(|[out, own]| own > out).collect();
        let mut alone: Vec<f64> = tree.tree.nodes.iter().map(Hierarchy::price).collect();
        if !from.is_empty() {
            // The borders of the given selection are free, so that they stay and are not smoothed.
            let fixed =
                |leaf: usize| [before[leaf], !before[leaf]].map(|other| if other { f64::INFINITY } else { 0.0 });
            let own = tree.cheapest(&fixed, &alone);
            for (i, node) in tree.tree.nodes.iter().enumerate() {
                let whole = node.parent.is_some_and(|p| own[p as usize]);
                if own[i] != whole {
                    alone[i] = 0.0;
                }
            }
        }
        let (marked, now, is_in) = (vec![[0.0; 2]; tree.leaves], before.clone(), given.clone());
        let (is_given, along, left) = (!from.is_empty(), BTreeMap::new(), BTreeMap::new());
        Self { tree, given, before, is_given, alone, marked, now, is_in, along, left }
    }

    /// Area of some leaves, square units.
    fn area(&self, of: &dyn Fn(usize) -> bool) -> f64 {
        (0..self.tree.leaves).filter(|leaf| of(*leaf)).map(|leaf| self.tree.tree.nodes[leaf].area).sum()
    }

    /// Follows a mark.
    fn follow(
        &mut self,
        stroke: &StrokeMark,
        is_first: bool,
        by_click: &[f64],
        others: &OtherIdentities,
    ) -> MarkEffect {
        // A mark of the same kind may take what was left before; what undoes it takes nothing more.
        self.left.retain(|_, is_in| *is_in == stroke.is_plus);
        let unmarked = self.marked.clone();
        self.mark(stroke);
        let change = match stroke {
            StrokeMark { is_click, .. } if self.is_given => [if *is_click { by_click[0] } else { KNOWN }; 2],
            _ if is_first => [FIRST; 2],
            StrokeMark { is_plus: false, .. } => [REMOVE, CHANGE],
            StrokeMark { is_click: true, .. } => [CHANGE, ADD_BY_CLICK],
            _ => [CHANGE; 2],
        };
        let mut nodes = self.cheapest(stroke, change);
        let mut is_limited = false;
        let whole = self.area(&|leaf| self.now[leaf]);
        let share = if stroke.is_plus { ADDED_BY_CLICK } else { REMOVED_BY_CLICK };
        let most = if whole > 0.0 { stroke.size.min(share * whole) } else { stroke.size };
        for dearer in by_click[1..].iter().filter(|_| stroke.is_click) {
            if self.area(&|leaf| nodes[leaf] != self.now[leaf]) <= most {
                break;
            }
            (nodes, is_limited) = (self.cheapest(stroke, [*dearer; 2]), true);
        }
        let mut along = self.along(stroke, &nodes);
        if is_limited && self.now.iter().zip(&nodes).all(|(now, node)| now == node) {
            along = Some(stroke.weights.keys().copied().collect());
        }
        let mut flips = match &along {
            Some(along) => {
                self.marked = unmarked;
                let flips = along.iter().map(|gaussian| (*gaussian, stroke.is_plus));
                flips.filter(|(gaussian, is_in)| self.is_in[*gaussian as usize] != *is_in).collect()
            }
            None => self.by_leaves(nodes, stroke),
        };
        let (others, stay) = others.spare(&mut flips, &stroke.weights, &self.tree.area);
        self.leave(stay);
        flips.iter().for_each(|&(gaussian, is_in)| self.is_in[gaussian as usize] = is_in);
        // Those that were left to others are not marked.
        let follows = |gaussian: &&u32| self.is_in[**gaussian as usize] == stroke.is_plus;
        self.along.extend(along.iter().flatten().filter(follows).map(|gaussian| (*gaussian, stroke.is_plus)));
        MarkEffect { is_limited, is_along: along.is_some() && !stroke.is_click, others }
    }

    /// Leaves Gaussians with their labels. A leaf of which nothing else changes has not changed.
    fn leave(&mut self, stay: Vec<(u32, bool)>) {
        self.left.extend(stay);
        if self.left.is_empty() {
            return;
        }
        let mut changed = vec![false; self.tree.leaves];
        for (gaussian, leaf) in self.tree.leaf.iter().enumerate() {
            changed[*leaf as usize] |= !self.left.contains_key(&(gaussian as u32));
        }
        let leaves: Vec<(usize, bool)> =
            self.left.iter().map(|(gaussian, is_in)| (self.tree.leaf[*gaussian as usize] as usize, *is_in)).collect();
        leaves.into_iter().filter(|(leaf, _)| !changed[*leaf]).for_each(|(leaf, is_in)| self.now[leaf] = is_in);
    }

    /// Gaussians along a line, if they are to change in place of the leaves: the tree knows regions only, and all of a
    /// thin one would go with a line on it, or with a part of it.
    ///
    /// That is so where two things hold. The surface that is to change, as far as it belongs together under the line or
    /// up to a known border, is about as wide as the line. And the leaves to be changed are much more than the line is
    /// about: of a given selection more than about the Gaussians along the line, else more than a stroke's size. So
    /// lines on broad surfaces, and on thin ones that end with them, change leaves.
    fn along(&self, stroke: &StrokeMark, nodes: &[bool]) -> Option<Vec<u32>> {
        let band = stroke.band.as_ref()?;
        let changed = self.area(&|leaf| nodes[leaf] != self.now[leaf]);
        if !self.is_given && changed <= stroke.size {
            return None;
        }
        let surface = self.surface(stroke);
        let is_on = |gaussian: &&u32| surface[self.tree.leaf[**gaussian as usize] as usize];
        let on_surface = band.around.iter().filter(|(gaussian, _)| is_on(gaussian));
        let seen_px: f64 = on_surface.map(|(_, weight)| f64::from(*weight)).sum();
        let along: Vec<u32> = band.along.iter().filter(is_on).copied().collect();
        let area: f64 = along.iter().map(|gaussian| self.tree.area[*gaussian as usize]).sum();
        let is_thin = seen_px <= AS_WIDE * band.area_px;
        (is_thin && !along.is_empty() && (!self.is_given || changed > AS_WIDE * area)).then_some(along)
    }

    /// Leaves that belong together under a stroke: those that it would select as the first one, were it only where it
    /// is to change something.
    fn surface(&self, stroke: &StrokeMark) -> Vec<bool> {
        let (mut weights, _) = self.under(stroke);
        weights.retain(|leaf, _| self.now[*leaf as usize] != stroke.is_plus);
        let all: f64 = weights.values().sum();
        let by_area = FIRST / stroke.size.max(f64::MIN_POSITIVE);
        let cost = |leaf: usize| {
            let against = weights.get(&(leaf as u32)).map_or(0.0, |weight| MARK * weight / all);
            [against, by_area * self.tree.tree.nodes[leaf].area]
        };
        self.tree.cheapest(&cost, &self.alone)
    }

    /// Weights of the leaves under a stroke, and their sum.
    fn under(&self, stroke: &StrokeMark) -> (BTreeMap<u32, f64>, f64) {
        let mut weights: BTreeMap<u32, f64> = BTreeMap::new();
        for (gaussian, weight) in &stroke.weights {
            *weights.entry(self.tree.leaf[*gaussian as usize]).or_default() += f64::from(*weight);
        }
        let all = weights.values().sum();
        (weights, all)
    }

    /// Adds the costs for not following a mark.
    fn mark(&mut self, stroke: &StrokeMark) {
        let (weights, all) = self.under(stroke);
        for (leaf, weight) in weights {
            let [out, own] = &mut self.marked[leaf as usize];
            let (against, follows) = if stroke.is_plus { (out, own) } else { (own, out) };
            *against += MARK * weight / all;
            // Of two opposite marks, the later one counts.
            *follows = 0.0;
        }
    }

    /// Cheapest labels of the nodes if changed area has these costs, by its new label.
    fn cheapest(&self, stroke: &StrokeMark, change: [f64; 2]) -> Vec<bool> {
        let change = change.map(|c| c / stroke.size.max(f64::MIN_POSITIVE));
        let cost = |leaf: usize| {
            let (mut cost, other) = (self.marked[leaf], usize::from(!self.now[leaf]));
            cost[other] += change[other] * self.tree.tree.nodes[leaf].area;
            cost
        };
        self.tree.cheapest(&cost, &self.alone)
    }

    /// Takes new labels of the leaves over; returns the Gaussians that change by that, with their new labels.
    fn by_leaves(&mut self, mut nodes: Vec<bool>, stroke: &StrokeMark) -> Vec<(u32, bool)> {
        nodes.truncate(self.tree.leaves);
        self.now = nodes;
        // Of two opposite marks, the later one counts.
        self.along.retain(|gaussian, is_in| *is_in == stroke.is_plus || !stroke.weights.contains_key(gaussian));
        let label = |gaussian: usize| {
            let leaf = self.tree.leaf[gaussian] as usize;
            // Gaussians in leaves without a change are as they were given.
            let by_leaf = if self.now[leaf] != self.before[leaf] { self.now[leaf] } else { self.given[gaussian] };
            let (along, left) = (self.along.get(&(gaussian as u32)), self.left.get(&(gaussian as u32)));
            left.or(along).copied().unwrap_or(by_leaf)
        };
        let all = (0..self.is_in.len()).map(|gaussian| (gaussian as u32, label(gaussian)));
        all.filter(|(gaussian, is_in)| self.is_in[*gaussian as usize] != *is_in).collect()
    }
}

#[cfg(test)]
mod tests;
