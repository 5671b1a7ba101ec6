//! The tree of what belongs together, and what of it marks select.

use std::collections::BTreeMap;

use glam::DVec3;

use super::marks::Marks;
use super::surface::Surface;
use crate::pipeline::observer::Observer;
use crate::pipeline::semantics::error::FindError;
use crate::pipeline::semantics::regions::segment::unlike;
use crate::pipeline::semantics::regions::tree::{Border, Piece, Tree, grow};
use crate::render::RenderSettings;
use crate::scene::{Camera, GaussianCloud};

/// Most Gaussians of a leaf, and how unlike they are at most, in Lab steps.
const LEAF: usize = 16;
const LEAF_STEP: f64 = 3.0;

/// Gaussians as a tree: its leaves are a few that look the same.
#[derive(Debug)]
pub(crate) struct Hierarchy {
    /// The leaf of each Gaussian.
    leaf: Vec<u32>,
    /// The middle of each leaf, in the cloud's own frame.
    center: Vec<DVec3>,
    tree: Tree,
}

impl Hierarchy {
    /// Of a cloud as it is seen by these cameras.
    pub(crate) fn new(
        cloud: &GaussianCloud,
        cameras: &[Camera],
        settings: &RenderSettings,
        observer: &mut dyn Observer,
    ) -> Result<Self, FindError> {
        Ok(Self::of(&Surface::new(cloud, cameras, settings, observer)?, cloud))
    }

    fn of(surface: &Surface, cloud: &GaussianCloud) -> Self {
        let (leaf, count) = leaves(surface);
        let mut center = vec![(DVec3::ZERO, 0.0); count];
        for (leaf, p) in leaf.iter().zip(&cloud.positions) {
            let (sum, n) = &mut center[*leaf as usize];
            *sum += DVec3::from(p.map(f64::from));
            *n += 1.0;
        }
        let center = center.into_iter().map(|(sum, n)| sum / n).collect();
        let mut pieces = vec![Piece { area: 0.0, sums: vec![0.0; 3] }; count];
        for (piece, leaf) in surface.pieces.iter().zip(&leaf) {
            let whole = &mut pieces[*leaf as usize];
            whole.area += piece.area;
            whole.sums.iter_mut().zip(&piece.sums).for_each(|(s, p)| *s += p);
        }
        let mut borders: BTreeMap<(u32, u32), Border> = BTreeMap::new();
        for (&(a, b), border) in surface.edges.iter().zip(&surface.borders) {
            let (a, b) = (leaf[a as usize], leaf[b as usize]);
            if a != b {
                borders.entry((a.min(b), a.max(b))).or_default().add(border);
            }
        }
        let unit = pieces.iter().map(|p| p.area).sum::<f64>() / 1000.0;
        let tree = grow(pieces, borders, &move |a, b, border| unlike(a, b, border, true, unit));
        Self { leaf, center, tree }
    }

    /// The Gaussians that marks select, beginning with those `from` which there is to correct (indices).
    ///
    /// Stroke by stroke, the labels of the tree's nodes that cost least: a mark that is not followed costs, and so does
    /// each node that is not what it is a piece of, the less the longer it stood alone while the tree grew. Area that
    /// changes costs by the square of the stroke's length, so that a stroke is about something of its own size.
    pub(crate) fn select(&self, marks: &Marks, from: &[usize]) -> Vec<bool> {
        let mut gaussians = vec![false; self.leaf.len()];
        from.iter().for_each(|&i| gaussians[i] = true);
        let mut share = vec![[0_u32; 2]; self.center.len()];
        for (leaf, is_in) in self.leaf.iter().zip(&gaussians) {
            share[*leaf as usize][usize::from(*is_in)] += 1;
        }
        let before: Vec<bool> = share.iter().map(|[out, own]| own > out).collect();
        let mut now = before.clone();
        let mut marked = vec![[0.0_f64; 2]; self.center.len()];
        for (k, stroke) in marks.strokes.iter().enumerate() {
            let mut weights: BTreeMap<u32, f64> = BTreeMap::new();
            for (gaussian, weight) in &stroke.weights {
                *weights.entry(self.leaf[*gaussian as usize]).or_default() += f64::from(*weight);
            }
            let all: f64 = weights.values().sum();
            // Not to be followed is what costs.
            weights.iter().for_each(|(leaf, w)| marked[*leaf as usize][usize::from(!stroke.is_plus)] += MARK * w / all);
            let size = self.size_of(&weights);
            let change = if k == 0 && from.is_empty() { FIRST } else { CHANGE } / size;
            now = self.cheapest(&marked, &now, change);
        }
        for (is_in, leaf) in gaussians.iter_mut().zip(&self.leaf) {
            let leaf = *leaf as usize;
            // Leaves that stayed what they were keep what they had.
            if now[leaf] != before[leaf] {
                *is_in = now[leaf];
            }
        }
        gaussians
    }

    /// The square of a stroke's length, at least the area of what it shows.
    fn size_of(&self, weights: &BTreeMap<u32, f64>) -> f64 {
        let all: f64 = weights.values().sum();
        let mean = weights.iter().map(|(l, w)| *w * self.center[*l as usize]).sum::<DVec3>() / all;
        let spread =
            weights.iter().map(|(l, w)| w * self.center[*l as usize].distance_squared(mean)).sum::<f64>() / all;
        let area = weights.keys().map(|l| self.tree.nodes[*l as usize].area).sum::<f64>();
        // A line of length l has a variance of l squared over 12.
        (12.0 * spread).max(area).max(f64::MIN_POSITIVE)
    }

    /// The labels of the leaves that cost least: `marked` against each label, `change` by area that is not as `before`.
    fn cheapest(&self, marked: &[[f64; 2]], before: &[bool], change: f64) -> Vec<bool> {
        let nodes = &self.tree.nodes;
        let alone: Vec<f64> = nodes.iter().map(|n| ((n.birth + LEAF_STEP) / (n.death + LEAF_STEP)).powi(2)).collect();
        let mut cost = vec![[0.0_f64; 2]; nodes.len()];
        for (i, node) in nodes.iter().enumerate() {
            let Some(children) = node.children else {
                cost[i] = marked[i];
                cost[i][usize::from(!before[i])] += change * node.area;
                continue;
            };
            for child in children.map(|c| c as usize) {
                let [out, own] = cost[child];
                cost[i][0] += out.min(own + alone[child]);
                cost[i][1] += own.min(out + alone[child]);
            }
        }
        let mut selected = vec![false; nodes.len()];
        for i in (0..nodes.len()).rev() {
            let of_selected = nodes[i].parent.is_some_and(|p| selected[p as usize]);
            let mut of = cost[i];
            of[usize::from(!of_selected)] += alone[i];
            selected[i] = of[1] < of[0];
        }
        selected.truncate(before.len());
        selected
    }
}

/// What it costs not to follow a stroke at all, in nodes that were cut off though nothing tells them apart.
const MARK: f64 = 40.0;
/// The same for area of the square of a stroke's length that the first stroke selects, and that a later one changes.
const FIRST: f64 = 0.01;
const CHANGE: f64 = 0.5;

/// Gaussians that look the same, a few together: the leaf of each, and how many there are.
fn leaves(surface: &Surface) -> (Vec<u32>, usize) {
    let mut order: Vec<(f64, usize)> = (surface.edges.iter().zip(&surface.borders).enumerate())
        .map(|(i, (&(a, b), border))| {
            let [a, b] = [a, b].map(|g| &surface.pieces[g as usize]);
            (unlike(a, b, border, true, a.area.min(b.area)), i)
        })
        .filter(|(step, _)| *step <= LEAF_STEP)
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut of: Vec<u32> = (0..surface.pieces.len() as u32).collect();
    let mut size = vec![1_usize; of.len()];
    for (_, edge) in order {
        let (a, b) = surface.edges[edge];
        let (a, b) = (root(&mut of, a), root(&mut of, b));
        let together = size[a as usize] + size[b as usize];
        if a != b && together <= LEAF {
            of[b as usize] = a;
            size[a as usize] = together;
        }
    }
    let mut number = vec![u32::MAX; of.len()];
    let mut count = 0;
    let leaf = (0..of.len() as u32).map(|i| {
        let root = root(&mut of, i) as usize;
        if number[root] == u32::MAX {
            number[root] = count;
            count += 1;
        }
        number[root]
    });
    let leaf: Vec<u32> = leaf.collect();
    (leaf, count as usize)
}

fn root(of: &mut [u32], mut i: u32) -> u32 {
    while of[i as usize] != i {
        of[i as usize] = of[of[i as usize] as usize];
        i = of[i as usize];
    }
    i
}
