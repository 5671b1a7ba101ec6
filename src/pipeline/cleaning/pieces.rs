//! Connected pieces: Gaussians that reach their neighbors.

use crate::math::disjoint::root;

/// Reach of a Gaussian, in standard deviations.
const REACH: f32 = 3.0;

/// Pieces of a cloud.
pub(super) struct Pieces {
    /// Piece of each Gaussian: the index of one of its Gaussians.
    of: Vec<u32>,
    /// Number of Gaussians of each piece, at that index.
    sizes: Vec<u32>,
}

impl Pieces {
    pub(super) fn of(&self, i: usize) -> u32 {
        self.of[i]
    }

    /// Number of Gaussians in the piece of Gaussian `i`.
    pub(super) fn size(&self, i: usize) -> u32 {
        self.sizes[self.of[i] as usize]
    }
}

/// Joins neighbors if one reaches the other and both are `among` those that count; `sizes` are standard deviations.
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
