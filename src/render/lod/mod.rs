//! Levels of detail for more Gaussians than can be drawn in time: a tree in which each node stands for those beneath
//! it, and cuts through it that are fine enough for a view.
//!
//! Nodes are Gaussians of a second cloud. They are named by numbers that go on where those of the cloud end, so that
//! a cut is a list of numbers, of Gaussians and of nodes. A splat of a node has the index of the heaviest Gaussian
//! beneath it, so objects, masks and picks are the same at every level.
//!
//! Levels are for moving views only: at rest every Gaussian is drawn, bit for bit as without a tree.

mod build;
mod cut;
mod merge;
mod pace;
#[cfg(test)]
mod tests;

use std::sync::Arc;

pub(crate) use self::build::build;
pub(crate) use self::pace::{MOVING_SECS, Pace};

use crate::math::Real;
use crate::math::prefetch::prefetch;
use crate::scene::GaussianCloud;

/// Levels of detail of one cloud.
#[derive(Debug, Default)]
pub(crate) struct LodTree<R = f32> {
    /// Gaussians of the cloud that this was built of.
    leaves: usize,
    /// A Gaussian for each node, those beneath it before it.
    merged: GaussianCloud<R>,
    nodes: Vec<Node>,
    /// Numbers of the children, node after node.
    children: Vec<u32>,
    /// Numbers of the nodes and Gaussians without a parent.
    roots: Vec<u32>,
}

/// Node of the tree, as cuts need it.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Standard deviation of its Gaussian along the longest axis, scene units, more for many colors and less for one.
    size: f32,
    /// No Gaussian beneath it can be seen farther from its center.
    reach: f32,
    /// Its part of the children.
    first: u32,
    count: u32,
    /// The heaviest Gaussian beneath it.
    heaviest: u32,
}

/// Gaussians and nodes that are drawn instead of a whole cloud.
#[derive(Clone, Debug)]
pub(crate) struct Cut<R = f32> {
    tree: Arc<LodTree<R>>,
    list: Vec<u32>,
}

impl<R: Real> LodTree<R> {
    /// Something to show while there is no tree yet: about `most` Gaussians of a cloud, evenly by their numbers, each as
    /// much larger as it stands for more.
    pub(crate) fn sample(cloud: &GaussianCloud<R>, most: usize) -> Self {
        let each = cloud.len().div_ceil(most.max(1)).max(1);
        let chosen: Vec<usize> = (0..cloud.len()).step_by(each).collect();
        let mut merged = GaussianCloud { extras: Vec::new(), ..cloud.select(&chosen) };
        let larger = R::of(0.5 * (each as f64).ln());
        merged.log_scales.iter_mut().flatten().for_each(|s| *s += larger);
        let node = |(k, heaviest): (usize, &usize)| {
            let widest = merged.log_scales[k].iter().fold(f64::MIN, |m, s| m.max(s.f64())).exp();
            let reach = (4.0 * widest).min(f64::from(f32::MAX)) as f32;
            // Of no size: there is nothing finer beneath it.
            Node { size: 0.0, reach, first: 0, count: 0, heaviest: *heaviest as u32 }
        };
        let nodes: Vec<Node> = chosen.iter().enumerate().map(node).collect();
        let roots = (0..nodes.len()).map(|k| (cloud.len() + k) as u32).collect();
        Self { leaves: cloud.len(), merged, nodes, children: Vec::new(), roots }
    }

    #[cfg(test)]
    pub(crate) fn nodes(&self) -> usize {
        self.nodes.len()
    }

    /// Bytes that it takes beside its cloud.
    pub(crate) fn bytes(&self) -> u64 {
        let lists = size_of_val(&*self.nodes) + size_of_val(&*self.children) + size_of_val(&*self.roots);
        self.merged.bytes() + lists as u64
    }

    fn children(&self, node: &Node) -> &[u32] {
        &self.children[node.first as usize..][..node.count as usize]
    }
}

impl<R: Real> Cut<R> {
    /// Number of Gaussians that it draws.
    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }

    /// Returns whether `cloud` has as many Gaussians as the cloud of its tree.
    pub(crate) fn fits(&self, cloud: &GaussianCloud<R>) -> bool {
        self.tree.leaves == cloud.len()
    }

    /// Prefetches the result of `of(cloud, k)`, if there is one.
    #[inline(always)]
    pub(crate) fn fetch(&self, cloud: &GaussianCloud<R>, k: usize) {
        let Some(&number) = self.list.get(k) else { return };
        let (cloud, i) = match (number as usize).checked_sub(self.tree.leaves) {
            None => (cloud, number as usize),
            Some(node) => {
                prefetch(&self.tree.nodes[node]);
                (&self.tree.merged, node)
            }
        };
        prefetch(&cloud.positions[i]);
        prefetch(&cloud.log_scales[i]);
        prefetch(&cloud.quaternions[i]);
        prefetch(&cloud.opacity_logits[i]);
        // Of the colors two lines of the cache, which is all of a node's.
        let sh = cloud.gaussian(i).sh;
        prefetch(&sh[0]);
        prefetch(&sh[sh.len() - 1]);
    }

    /// The cloud and the place of its Gaussian `k`, and the number in `cloud` that it stands for.
    #[inline(always)]
    pub(crate) fn of<'a>(&'a self, cloud: &'a GaussianCloud<R>, k: usize) -> (&'a GaussianCloud<R>, usize, u32) {
        let number = self.list[k];
        match (number as usize).checked_sub(self.tree.leaves) {
            None => (cloud, number as usize, number),
            Some(node) => (&self.tree.merged, node, self.tree.nodes[node].heaviest),
        }
    }
}
