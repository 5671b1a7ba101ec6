//! Binary partition tree: the two least different neighbors are merged until one piece is left.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

#[derive(Clone, Debug, Default)]
pub(crate) struct Piece {
    /// Pixels.
    pub(crate) area: f64,
    /// Sum of each feature over the pixels.
    pub(crate) sums: Vec<f64>,
}

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Border {
    /// Pairs of pixels.
    pub(crate) length: f64,
    /// Sum of the edge strength over them.
    pub(crate) strength: f64,
    /// Sum of the surface ends over them, 0 to 1 each.
    pub(crate) ends: f64,
}

impl Border {
    /// Adds another stretch of border.
    pub(crate) fn add(&mut self, other: &Self) {
        self.length += other.length;
        self.strength += other.strength;
        self.ends += other.ends;
    }
}

pub(crate) type Unlike = dyn Fn(&Piece, &Piece, &Border) -> f64 + Sync;

/// Node of the tree: a leaf, or two merged nodes.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// Nodes that were merged into it; `None` for a leaf.
    pub(crate) children: Option<[u32; 2]>,
    /// Node that it was merged into; `None` for a root.
    pub(crate) parent: Option<u32>,
    /// Unlikeness at which it was created; 0 for leaves.
    pub(crate) birth: f64,
    /// Unlikeness at which it was merged; for roots, that of the last merge.
    pub(crate) death: f64,
    pub(crate) area: f64,
}

/// Leaves first, children before parents.
#[derive(Debug)]
pub(crate) struct Tree {
    pub(crate) nodes: Vec<Node>,
}

/// Merges pieces in the order of their unlikeness.
pub(crate) fn grow(pieces: Vec<Piece>, borders: BTreeMap<(u32, u32), Border>, unlike: &Unlike) -> Tree {
    let mut g = Growing::new(pieces, unlike);
    for (&(a, b), border) in &borders {
        g.near[a as usize].insert(b, *border);
        g.near[b as usize].insert(a, *border);
        g.push(a, b);
    }
    while let Some(Reverse((bits, a, b))) = g.open.pop() {
        let Some(now) = g.unlikeness(a, b) else { continue };
        // The pieces have grown since; this pair's turn comes later.
        if now > f64::from_bits(bits) {
            g.open.push(Reverse((now.to_bits(), a, b)));
        } else {
            g.merge(a, b, f64::from_bits(bits));
        }
    }
    // Nodes that were never merged live on to the end.
    g.nodes.iter_mut().filter(|n| n.parent.is_none()).for_each(|n| n.death = g.last);
    Tree { nodes: g.nodes }
}

/// Pieces that are merged in place: the one with more neighbors absorbs the other.
struct Growing<'a> {
    unlike: &'a Unlike,
    nodes: Vec<Node>,
    pieces: Vec<Piece>,
    /// Current node of each piece.
    node: Vec<u32>,
    near: Vec<BTreeMap<u32, Border>>,
    open: BinaryHeap<Reverse<(u64, u32, u32)>>,
    last: f64,
}

impl<'a> Growing<'a> {
    fn new(pieces: Vec<Piece>, unlike: &'a Unlike) -> Self {
        let leaf = |p: &Piece| Node { children: None, parent: None, birth: 0.0, death: 0.0, area: p.area };
        let leaves = pieces.len();
        Self {
            unlike,

            nodes: pieces.iter().map(leaf).collect(),
            node: (0..leaves as u32).collect(),
            near: vec![BTreeMap::new(); leaves],
            open: BinaryHeap::new(),
            last: 0.0,
            pieces,
        }
    }

    /// Unlikeness of two pieces now; `None` if they are no neighbors any more.
    fn unlikeness(&self, a: u32, b: u32) -> Option<f64> {
        let border = self.near[a as usize].get(&b)?;
        Some((self.unlike)(&self.pieces[a as usize], &self.pieces[b as usize], border).max(0.0))
    }

    fn push(&mut self, a: u32, b: u32) {
        if let Some(unlike) = self.unlikeness(a, b) {
            // Non-negative floats order like their bits.
            self.open.push(Reverse((unlike.to_bits(), a, b)));
        }
    }

    fn merge(&mut self, a: u32, b: u32, unlike: f64) {
        // Never less than before, so that scales are nested.
        self.last = self.last.max(unlike);
        let (keep, gone) = if self.near[a as usize].len() < self.near[b as usize].len() { (b, a) } else { (a, b) };
        let children = [self.node[keep as usize], self.node[gone as usize]];
        let new = self.nodes.len() as u32;
        for child in children {
            let child = &mut self.nodes[child as usize];
            (child.parent, child.death) = (Some(new), self.last);
        }
        self.node[keep as usize] = new;
        let other = std::mem::take(&mut self.pieces[gone as usize]);
        let piece = &mut self.pieces[keep as usize];
        piece.area += other.area;
        piece.sums.iter_mut().zip(&other.sums).for_each(|(s, o)| *s += o);
        let (birth, area) = (self.last, piece.area);
        self.nodes.push(Node { children: Some(children), parent: None, birth, death: birth, area });
        for (id, border) in std::mem::take(&mut self.near[gone as usize]) {
            self.near[id as usize].remove(&gone);
            if id == keep {
                continue;
            }
            let sum = self.near[keep as usize].entry(id).or_default();
            sum.add(&border);
            let sum = *sum;
            self.near[id as usize].insert(keep, sum);
            self.push(keep, id);
        }
    }
}

impl Tree {
    /// Returns the nodes left if merging stops at `unlike`: every leaf is in one.
    pub(crate) fn cut(&self, unlike: f64) -> Vec<u32> {
        let whole = |n: &Node| n.birth < unlike && (n.death >= unlike || n.parent.is_none());
        (0..self.nodes.len() as u32).filter(|&i| whole(&self.nodes[i as usize])).collect()
    }

    pub(crate) fn leaves_of(&self, node: u32) -> Vec<u32> {
        let mut open = vec![node];
        let mut found = Vec::new();
        while let Some(at) = open.pop() {
            match self.nodes[at as usize].children {
                Some(children) => open.extend(children),
                None => found.push(at),
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of pieces of one feature, each as large as given.
    fn row(values: &[(f64, f64)]) -> Tree {
        let pieces = values.iter().map(|&(v, area)| Piece { area, sums: vec![v * area] }).collect();
        let border = Border { length: 1.0, ..Border::default() };
        let borders = (1..values.len() as u32).map(|i| ((i - 1, i), border)).collect();
        grow(pieces, borders, &|a, b, _| (a.sums[0] / a.area - b.sums[0] / b.area).abs())
    }

    #[test]
    fn the_most_alike_merge_first() {
        let tree = row(&[(0.0, 1.0), (1.0, 1.0), (9.0, 2.0), (9.5, 2.0), (30.0, 1.0)]);
        assert_eq!(tree.nodes.len(), 9);
        let whole = |unlike| {
            let sorted = |node| {
                let mut leaves = tree.leaves_of(node);
                leaves.sort_unstable();
                leaves
            };
            let mut cut: Vec<_> = tree.cut(unlike).into_iter().map(sorted).collect();
            cut.sort();
            cut
        };
        assert_eq!(whole(2.0), [vec![0, 1], vec![2, 3], vec![4]]);
        assert_eq!(whole(10.0), [vec![0, 1, 2, 3], vec![4]]);
        assert_eq!(whole(1e9), [vec![0, 1, 2, 3, 4]]);
        assert!(tree.nodes.iter().all(|n| n.birth <= n.death));
        let root = &tree.nodes[8];
        assert_eq!((root.area, root.parent), (7.0, None));
    }

    #[test]
    fn pieces_that_do_not_touch_stay_apart() {
        let pieces = vec![Piece { area: 1.0, sums: vec![] }; 3];
        let border = Border { length: 1.0, strength: 2.0, ends: 0.0 };
        let tree = grow(pieces, BTreeMap::from([((0, 2), border)]), &|_, _, b| b.strength / b.length);
        assert_eq!(tree.cut(1e9).len(), 2);
        assert!(grow(Vec::new(), BTreeMap::new(), &|_, _, _| 0.0).cut(1.0).is_empty());
    }
}
