//! Labels of all Gaussians from votes for some of them, by the tree of Gaussians that belong together.
//!
//! Each node of the tree has one identity, or several by its pieces. A node with another identity than its parent has
//! a cost, less the longer it stood alone while the tree grew (the price of selections, too). A leaf with another
//! identity than its votes has a cost. The cheapest labels of all nodes are found exactly, from the leaves up and
//! back.

use std::collections::BTreeMap;

use super::hierarchy::Hierarchy;
use crate::pipeline::semantics::lifting::votes::{Assignment, UNKNOWN, Votes};
use crate::scene::{Identities, IdentityId};

/// Cost of a leaf that contradicts the masks, in nodes that are cut off without any visible difference.
const SAID: f64 = 3.0;
/// The same for votes grown by colors and edges of photos.
const SUGGESTED: f64 = 0.3;
/// Margin from which a Gaussian keeps the identity of its own masks, whatever its neighbors are.
const CLEAR: f32 = 0.25;
/// Margin of an identity from the tree alone.
const INHERITED: f32 = 0.1;

/// Votes for the Gaussians of a leaf.
#[derive(Clone, Debug, Default)]
struct LeafVotes {
    by_identity: BTreeMap<IdentityId, f64>,
    /// Area of the Gaussians with votes, square units.
    area: f64,
}

/// Cost of a subtree for each identity at its top: some by number, and the rest.
#[derive(Clone, Debug, Default, PartialEq)]
struct Costs {
    of: Vec<(IdentityId, f64)>,
    rest: f64,
}

impl Costs {
    /// Costs of a leaf's votes: `all` is the cost of an identity without votes.
    fn new(votes: &LeafVotes, all: f64) -> Self {
        let total: f64 = votes.by_identity.values().sum();
        let of = votes.by_identity.iter().map(|(id, weight)| (*id, all * (1.0 - weight / total))).collect();
        Self { of, rest: all }
    }

    fn of(&self, id: IdentityId) -> f64 {
        self.of.binary_search_by_key(&id, |c| c.0).map_or(self.rest, |k| self.of[k].1)
    }

    fn least(&self) -> (IdentityId, f64) {
        let least = self.of.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        least.filter(|l| l.1 <= self.rest).unwrap_or((UNKNOWN, self.rest))
    }

    /// The same if the subtree may differ from its parent for a price.
    fn below(&self, price: f64) -> Self {
        let rest = self.rest.min(self.least().1 + price);
        Self { of: self.of.iter().copied().filter(|c| c.1 < rest).collect(), rest }
    }

    fn plus(&self, other: &Self) -> Self {
        let mut of = Vec::with_capacity(self.of.len() + other.of.len());
        let (mut a, mut b) = (self.of.iter().peekable(), other.of.iter().peekable());
        while let Some(id) = a.peek().into_iter().chain(b.peek()).map(|c| c.0).min() {
            let cost = |c: Option<&(IdentityId, f64)>, rest: f64| c.map_or(rest, |c| c.1);
            let cost = cost(a.next_if(|c| c.0 == id), self.rest) + cost(b.next_if(|c| c.0 == id), other.rest);
            of.push((id, cost));
        }
        Self { of, rest: self.rest + other.rest }
    }
}

impl Hierarchy {
    /// Returns the identity of every Gaussian: by the votes of masks, `said`, and by `all` votes for the rest. Leaves
    /// without votes stay `UNKNOWN`; votes of less than `least` px do not count.
    pub(crate) fn label(&self, said: &Votes, all: &Votes, identities: &Identities, least: f32) -> Vec<Assignment> {
        let nodes = &self.tree.nodes;
        let alone: Vec<f64> = nodes.iter().map(Self::price).collect();
        let votes = [said, all].map(|votes| self.votes_of_leaves(votes, least));
        let mut costs: Vec<Costs> = Vec::with_capacity(nodes.len());
        for (i, node) in nodes.iter().enumerate() {
            costs.push(match node.children {
                Some([a, b]) => {
                    let child = |c: u32| costs[c as usize].below(alone[c as usize]);
                    child(a).plus(&child(b))
                }
                None => {
                    let share = |votes: &LeafVotes| (votes.area / node.area.max(f64::MIN_POSITIVE)).min(1.0);
                    let [said, all] = [&votes[0][i], &votes[1][i]];
                    let left = (share(all) - share(said)).max(0.0);
                    Costs::new(said, SAID * share(said)).plus(&Costs::new(all, SUGGESTED * left))
                }
            });
        }
        let mut label = vec![UNKNOWN; nodes.len()];
        for i in (0..nodes.len()).rev() {
            let (best, least) = costs[i].least();
            label[i] = match nodes[i].parent.map(|p| label[p as usize]) {
                Some(of) if costs[i].of(of) <= least + alone[i] => of,
                _ => best,
            };
        }
        let own = [said, all].map(|votes| votes.decide(identities, least));
        let of = |(g, &leaf): (usize, &u32)| match label[leaf as usize] {
            _ if own[0][g].margin >= CLEAR => own[0][g],
            _ if costs[leaf as usize].of.is_empty() => Assignment { identity: UNKNOWN, margin: 0.0 },
            identity if identity == own[1][g].identity => own[1][g],
            identity => Assignment { identity, margin: INHERITED },
        };
        self.leaf.iter().enumerate().map(of).collect()
    }

    fn votes_of_leaves(&self, votes: &Votes, least: f32) -> Vec<LeafVotes> {
        let mut sums = vec![LeafVotes::default(); self.leaves];
        for (g, leaf) in self.leaf.iter().enumerate() {
            if votes.weight(g) < least {
                continue;
            }
            let sum = &mut sums[*leaf as usize];
            sum.area += self.area[g];
            for &(id, weight) in votes.of(g) {
                *sum.by_identity.entry(id).or_default() += f64::from(weight);
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::super::hierarchy::tests::{cameras, hierarchy, sheet};
    use super::*;
    use crate::render::{RenderSettings, Renderer};
    use crate::scene::{GaussianCloud, Identities, NO_IDENTITY};

    /// Votes of the first view, with labels for pixels around places of the sheet.
    fn votes(cloud: &GaussianCloud, said: &[([f64; 2], IdentityId)]) -> Votes {
        let camera = &cameras()[0];
        let (w, h) = (camera.width_px as usize, camera.height_px as usize);
        let mut labels = vec![UNKNOWN; w * h];
        for (at, id) in said {
            let p = camera.project(glam::DVec3::new(at[0], at[1], 0.0)).expect("in front");
            let near = |i: &usize| ((i % w) as f64 + 0.5 - p.x).hypot((i / w) as f64 + 0.5 - p.y) < 4.0;
            (0..w * h).filter(near).for_each(|i| labels[i] = *id);
        }
        let mut votes = Votes::new(cloud.len());
        votes.add_view(&mut Renderer::new(), cloud, camera, &RenderSettings::default(), &labels).expect("drawn");
        votes
    }

    /// Counts the Gaussians of each of the three by identity; the last column is unknown.
    fn table(labels: &[Assignment], whose: &[usize]) -> [[usize; 4]; 3] {
        let mut table = [[0; 4]; 3];
        for (label, whose) in labels.iter().zip(whose) {
            table[*whose][if label.identity == UNKNOWN { 3 } else { label.identity as usize }] += 1;
        }
        table
    }

    #[test]
    fn a_few_votes_label_what_belongs_together() {
        let (cloud, whose) = sheet();
        let (tree, all) = (hierarchy(&cloud), Identities::objects(2));
        let said = votes(&cloud, &[([-0.15, 0.0], 1), ([0.15, 0.0], 2), ([-0.6, -0.6], NO_IDENTITY)]);
        let labels = tree.label(&said, &said, &all, 0.05);
        let voted = |i: &usize| said.weight(*i) >= 0.05;
        let told = (0..whose.len()).filter(voted).count();
        assert!((20..200).contains(&told), "a few of the 1,024: {told}");
        let found = table(&labels, &whose);
        assert!(found[1][1] >= 12 && found[1][2] == 0 && found[2][2] >= 12 && found[2][1] == 0, "{found:?}");
        assert!(found[0][0] >= 20 && found[0][1] + found[0][2] <= 8, "{found:?}");
        // Only leaves with votes are known; the rest stays unknown.
        let leaves: Vec<u32> = (0..whose.len()).filter(voted).map(|i| tree.leaf[i]).collect();
        let known = |i: usize| leaves.contains(&tree.leaf[i]);
        assert!((0..whose.len()).all(|i| known(i) == (labels[i].identity != UNKNOWN)));
        assert!(labels.iter().all(|l| (l.margin > 0.0) == (l.identity != UNKNOWN)));
        // The control: without votes everything is unknown.
        let none = Votes::new(cloud.len());
        assert!(tree.label(&none, &none, &all, 0.05).iter().all(|l| l.identity == UNKNOWN));
    }

    #[test]
    fn what_masks_say_counts_for_more_than_what_is_suggested() {
        let (cloud, whose) = sheet();
        let (tree, all) = (hierarchy(&cloud), Identities::objects(2));
        let places = [[-0.2, -0.2], [-0.2, -0.1], [-0.1, 0.0], [-0.2, 0.1], [-0.1, 0.2]];
        let suggested = votes(&cloud, &places.map(|p| (p, 2)));
        let said = votes(&cloud, &[([-0.15, 0.0], 1)]);
        let mut both = said.clone();
        both.add_view(
            &mut Renderer::new(),
            &cloud,
            &cameras()[0],
            &RenderSettings::default(),
            &vec![2; (cameras()[0].width_px * cameras()[0].height_px) as usize],
        )
        .expect("drawn");
        let found = table(&tree.label(&said, &both, &all, 0.05), &whose);
        assert!(found[1][1] > found[1][2], "{found:?}");
        // The control: with equal weight, the identity with most votes wins.
        let found = table(&tree.label(&both, &both, &all, 0.05), &whose);
        assert!(found[1][2] > found[1][1], "{found:?}");
        let found = table(&tree.label(&Votes::new(cloud.len()), &suggested, &all, 0.05), &whose);
        assert!(found[1][2] > 12 && found[1][1] == 0, "{found:?}");
    }

    #[test]
    fn costs_add_up_and_what_is_dearer_than_a_cut_is_left_out() {
        let a = Costs { of: vec![(1, 0.2), (4, 0.9)], rest: 2.0 };
        let b = Costs { of: vec![(4, 0.1)], rest: 1.0 };
        assert_eq!(a.plus(&b), Costs { of: vec![(1, 1.2), (4, 1.0)], rest: 3.0 });
        assert_eq!(a.below(0.5), Costs { of: vec![(1, 0.2)], rest: 0.7 });
        assert_eq!((a.of(4), a.of(3), a.least()), (0.9, 2.0, (1, 0.2)));
        assert_eq!(Costs::default().least(), (UNKNOWN, 0.0));
        let votes = LeafVotes { by_identity: [(7, 1.0), (2, 3.0)].into(), area: 1.0 };
        assert_eq!(Costs::new(&votes, 4.0), Costs { of: vec![(2, 1.0), (7, 3.0)], rest: 4.0 });
    }
}
