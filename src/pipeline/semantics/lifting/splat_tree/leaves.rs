//! Leaves of the tree: a few Gaussians each that look the same, and the borders between them.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::surface::SplatSurface;
use crate::math::disjoint::root;
use crate::pipeline::semantics::lifting::regions::segment::unlike;
use crate::pipeline::semantics::lifting::regions::tree::Border;

/// Most Gaussians of a leaf, and their largest difference, in Lab steps.
const LEAF: usize = 16;
pub(super) const LEAF_STEP: f64 = 3.0;

/// Groups Gaussians that look the same; returns the leaf of each, and the number of leaves.
pub(super) fn leaves(surface: &SplatSurface) -> (Vec<u32>, usize) {
    let step = |(i, (&(a, b), border)): (usize, (&(u32, u32), &Border))| {
        let [a, b] = [a, b].map(|g| &surface.pieces[g as usize]);
        (unlike(a, b, border, true, a.area.min(b.area)), i)
    };
    let edges = surface.edges.par_iter().zip(&surface.borders).enumerate();
    let mut order: Vec<(f64, usize)> = edges.map(step).filter(|(step, _)| *step <= LEAF_STEP).collect();
    order.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
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

/// Adds up the borders between the Gaussians of two leaves each, in the order of the edges; `leaf` is the leaf of each
/// Gaussian.
pub(super) fn borders(surface: &SplatSurface, leaf: &[u32]) -> BTreeMap<(u32, u32), Border> {
    let between = |(i, &(a, b)): (usize, &(u32, u32))| {
        let (a, b) = (leaf[a as usize], leaf[b as usize]);
        (a != b).then_some(((a.min(b), a.max(b)), i))
    };
    let mut stretches: Vec<((u32, u32), usize)> = surface.edges.par_iter().enumerate().filter_map(between).collect();
    stretches.par_sort_unstable();
    let mut borders: Vec<((u32, u32), Border)> = Vec::new();
    for (pair, edge) in stretches {
        if borders.last().is_none_or(|last| last.0 != pair) {
            borders.push((pair, Border::default()));
        }
        borders.last_mut().into_iter().for_each(|last| last.1.add(&surface.borders[edge]));
    }
    borders.into_iter().collect()
}
