//! Building the tree: Gaussians along the Z-order curve, those of a voxel merged, voxels growing bit by bit.

use rayon::prelude::*;

use super::merge::{GaussianMoments, Merged, merge};
use super::{LodTree, Node};
use crate::math::morton::{BITS, interleave};
use crate::math::{Real, sh};
use crate::scene::GaussianCloud;

/// Gaussians and nodes that are merged into one, at least: fewer wait for a larger voxel.
const LEAST: usize = 4;
/// Highest degree of the harmonics of nodes: merged Gaussians have little view dependence.
const DEGREE: u8 = 1;
/// The smallest voxels are those in which at least this share of the Gaussians is not alone.
const TOGETHER: f64 = 0.01;

/// Nodes that are made at once.
const AT_ONCE: usize = 1 << 14;

/// Standard deviation of colors at which a node counts with its true size. One of a single color counts as a third of
/// that, as its grain is invisible.
const CONTRAST: f64 = 0.1;
const FLAT: f64 = 0.1;
const COLORFUL: f64 = 3.0;

/// A Gaussian or node without a parent so far: its place on the curve and its number.
type Item = (u64, u32);

/// Builds the tree of a cloud. `None` as soon as `proceed` returns false.
pub(crate) fn build<R: Real>(cloud: &GaussianCloud<R>, proceed: impl Fn() -> bool) -> Option<LodTree<R>> {
    let degree = cloud.sh_degree.min(DEGREE);
    let merged = GaussianCloud { origin: cloud.origin, sh_degree: degree, ..GaussianCloud::default() };
    let tree = LodTree { leaves: cloud.len(), merged, ..LodTree::default() };
    let mut builder = TreeBuilder { cloud, tree, weighed: Vec::new() };
    let mut items = along_the_curve(cloud);
    for shift in first_shift(&items)..=3 * BITS {
        if !proceed() {
            return None;
        }
        let (groups, rest) = grouped(&items, shift, builder.tree.leaves + builder.tree.nodes.len());
        // Bounded, as merging takes more memory than its result.
        groups.chunks(AT_ONCE).for_each(|groups| builder.add(&items, groups));
        items = rest;
    }
    builder.tree.roots = items.into_iter().map(|(_, number)| number).collect();
    Some(builder.tree)
}

/// A tree to which nodes are added.
struct TreeBuilder<'a, R> {
    cloud: &'a GaussianCloud<R>,
    tree: LodTree<R>,
    /// Weight and contrast of each node.
    weighed: Vec<(f64, f64)>,
}

impl<R: Real> TreeBuilder<'_, R> {
    /// Adds a node for each group of items.
    fn add(&mut self, items: &[Item], groups: &[std::ops::Range<usize>]) {
        let known = &*self;
        let made = |group: &std::ops::Range<usize>| {
            let beneath = &items[group.clone()];
            let merged = merge(&beneath.iter().map(|item| known.moments(item.1)).collect::<Vec<_>>());
            let color = known.color(beneath, &merged);
            let heaviest = merged.shares.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(k, _)| k);
            (merged, color, known.heaviest(beneath[heaviest].1))
        };
        let made: Vec<_> = groups.par_iter().map(made).collect();
        let tree = &mut self.tree;
        for ((merged, color, heaviest), group) in made.into_iter().zip(groups) {
            let Merged { part, log_scale, quaternion, opacity_logit, .. } = merged;
            let size = (log_scale.x.exp() * roughness(part.contrast)) as f32;
            let reach = part.reach.min(f64::from(f32::MAX)) as f32;
            let (first, count) = (tree.children.len() as u32, group.len() as u32);
            tree.nodes.push(Node { size, reach, first, count, heaviest });
            tree.children.extend(items[group.clone()].iter().map(|item| item.1));
            tree.merged.positions.push(part.mean.to_array().map(R::of));
            tree.merged.log_scales.push(log_scale.to_array().map(R::of));
            tree.merged.quaternions.push(quaternion.map(R::of));
            tree.merged.opacity_logits.push(R::of(opacity_logit));
            tree.merged.sh.extend(&color[..tree.merged.sh_stride()]);
            self.weighed.push((part.weight, part.contrast));
        }
    }

    /// The node of a number; `None` if it is that of a Gaussian.
    fn node(&self, number: u32) -> Option<usize> {
        (number as usize).checked_sub(self.tree.leaves)
    }

    /// Moments of a Gaussian or node; `None` if it cannot be drawn.
    fn moments(&self, number: u32) -> Option<GaussianMoments> {
        let Some(node) = self.node(number) else { return GaussianMoments::of(self.cloud, number as usize) };
        let ((weight, contrast), reach) = (self.weighed[node], f64::from(self.tree.nodes[node].reach));
        GaussianMoments::of(&self.tree.merged, node).map(|part| GaussianMoments { weight, reach, contrast, ..part })
    }

    /// The heaviest Gaussian of a Gaussian or node.
    fn heaviest(&self, number: u32) -> u32 {
        self.node(number).map_or(number, |node| self.tree.nodes[node].heaviest)
    }

    /// Mean color of the merged Gaussians.
    fn color(&self, beneath: &[Item], merged: &Merged) -> [[R; 3]; sh::coefficients(DEGREE)] {
        let stride = self.tree.merged.sh_stride();
        let mut sum = [[0.0; 3]; sh::coefficients(DEGREE)];
        for (&(_, number), share) in beneath.iter().zip(&merged.shares) {
            let own = match self.node(number) {
                None => self.cloud.gaussian(number as usize).sh,
                Some(node) => self.tree.merged.gaussian(node).sh,
            };
            for (sum, own) in sum.iter_mut().zip(&own[..stride]) {
                [0, 1, 2].into_iter().for_each(|k| sum[k] += share * own[k].f64());
            }
        }
        sum.map(|c| c.map(R::of))
    }
}

/// Factor on the size of a node for the contrast of its colors.
fn roughness(contrast: f64) -> f64 {
    (FLAT + contrast.sqrt() / CONTRAST).clamp(FLAT, COLORFUL).sqrt()
}

/// All Gaussians along the Z-order curve, in voxels that are cubes.
fn along_the_curve<R: Real>(cloud: &GaussianCloud<R>) -> Vec<Item> {
    let ends = || ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let wider = |a: ([f64; 3], [f64; 3]), b: ([f64; 3], [f64; 3])| {
        ([0, 1, 2].map(|k| a.0[k].min(b.0[k])), [0, 1, 2].map(|k| a.1[k].max(b.1[k])))
    };
    let point = |p: &[R; 3]| p.map(Real::f64);
    let positions = cloud.positions.par_iter();
    let (min, max) = positions.clone().map(|p| (point(p), point(p))).reduce(ends, wider);
    let widest = (0..3).map(|k| max[k] - min[k]).fold(0.0, f64::max);
    let step = ((1_u64 << BITS) - 1) as f64 / widest.max(f64::MIN_POSITIVE);
    let code = |p: &[R; 3]| interleave([0, 1, 2].map(|k| ((p[k].f64() - min[k]) * step) as u64));
    let mut items: Vec<Item> = positions.enumerate().map(|(i, p)| (code(p), i as u32)).collect();
    items.par_sort_unstable();
    items
}

/// Bits by which the smallest voxels are coarser than the curve.
fn first_shift(items: &[Item]) -> u32 {
    // Numbers of neighbors on the curve that share a voxel of each size: from the highest bit in which they differ.
    let mut alone = [0_usize; 65];
    for pair in items.windows(2) {
        alone[64 - (pair[0].0 ^ pair[1].0).leading_zeros() as usize] += 1;
    }
    let enough = (items.len() as f64 * TOGETHER).ceil() as usize;
    let mut together = 0;
    let shift = alone.iter().position(|n| {
        together += n;
        together >= enough
    });
    shift.unwrap_or(0).min(3 * BITS as usize) as u32
}

/// Groups of items in one voxel that are enough for a node, the first of which gets the number `next`; and the items
/// that are left for larger voxels.
fn grouped(items: &[Item], shift: u32, next: usize) -> (Vec<std::ops::Range<usize>>, Vec<Item>) {
    let (mut groups, mut rest) = (Vec::new(), Vec::new());
    let mut first = 0;
    for group in items.chunk_by(|a, b| a.0 >> shift == b.0 >> shift) {
        let range = first..first + group.len();
        first = range.end;
        if range.len() < LEAST && shift < 3 * BITS || range.len() < 2 {
            rest.extend_from_slice(group);
        } else {
            rest.push((group[0].0, (next + groups.len()) as u32));
            groups.push(range);
        }
    }
    (groups, rest)
}
