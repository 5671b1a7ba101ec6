//! Cheapest labels of the nodes of a tree: each node costs by its label, and by a border to its parent with another.

use super::hierarchy::Hierarchy;
use super::leaves::LEAF_STEP;
use crate::pipeline::semantics::lifting::regions::tree::Node;

impl Hierarchy {
    /// Cost of another label than the parent's.
    pub(super) fn price(node: &Node) -> f64 {
        ((node.birth + LEAF_STEP) / (node.death + LEAF_STEP)).powi(2)
    }

    /// Returns the cheapest labels of all nodes: `leaf` gives the costs of a leaf for being out and in, `alone` the
    /// cost of each node for another label than its parent's.
    pub(super) fn cheapest(&self, leaf: &dyn Fn(usize) -> [f64; 2], alone: &[f64]) -> Vec<bool> {
        let nodes = &self.tree.nodes;
        let mut cost = vec![[0.0_f64; 2]; nodes.len()];
        for (i, node) in nodes.iter().enumerate() {
            let Some(children) = node.children else {
                cost[i] = leaf(i);
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
        selected
    }
}
