//! What hangs together: Gaussians that reach their neighbors.

use crate::math::disjoint::root;

/// Standard deviations that a Gaussian reaches.
const REACH: f32 = 3.0;

/// Pieces of a cloud.
pub(super) struct Pieces {
    /// The piece of each Gaussian: one of its Gaussians stands for it.
    of: Vec<u32>,
    /// Gaussians of each piece, where that one stands.
    sizes: Vec<u32>,
}

impl Pieces {
    pub(super) fn of(&self, i: usize) -> u32 {
        self.of[i]
    }

    /// Gaussians of the piece that Gaussian `i` is in.
    pub(super) fn size(&self, i: usize) -> u32 {
        self.sizes[self.of[i] as usize]
    }
}

/// Joins neighbors of which one reaches the other, as far as both are `among` those that count; `sizes` are standard
/// deviations.
pub(super) fn pieces(neighbors: &[Vec<(u32, f32)>], sizes: &[f32], among: impl Fn(usize) -> bool) -> Pieces {
    let mut parent: Vec<u32> = (0..neighbors.len() as u32).collect();
    for (i, near) in neighbors.iter().enumerate() {
        for &(j, distance) in near {
            if distance <= REACH * sizes[i].max(sizes[j as usize]) && among(i) && among(j as usize) {
                let (a, b) = (root(&mut parent, i as u32), root(&mut parent, j));
                parent[a.max(b) as usize] = a.min(b);
            }
        }
    }
    let of: Vec<u32> = (0..neighbors.len() as u32).map(|i| root(&mut parent, i)).collect();
    let mut sizes = vec![0; of.len()];
    of.iter().for_each(|piece| sizes[*piece as usize] += 1);
    Pieces { of, sizes }
}
