//! Features of a photo and of a rendered view that are the same point: nearest by descriptor, both ways, and clearly
//! nearer than the second.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::descriptor::{LENGTH, PictureFeature};
use crate::math::vector::dot;

/// Largest ratio of the distances to the nearest and the second nearest descriptor (Lowe: 0.8).
const RATIO: f32 = 0.85;
/// Largest squared distance of descriptors that match, for where there is no second.
const FARTHEST: f32 = 1.0;
/// Two features nearer than this in their picture are one: neither is the other's rival, px.
const SAME_PX: f64 = 4.0;

/// A feature of a rendered view with its place in the world.
#[derive(Clone, Debug)]
pub(super) struct WorldFeature {
    pub(super) world: DVec3,
    /// Place in the rendered view, px.
    pub(super) at: DVec2,
    pub(super) descriptor: [f32; LENGTH],
}

/// Squared distance of two descriptors of unit length.
fn distance(a: &[f32; LENGTH], b: &[f32; LENGTH]) -> f32 {
    (2.0 - 2.0 * dot(a, b)).max(0.0)
}

/// Pairs of a photo's and a view's feature that match. Pairs of places that `allowed` refuses are not compared.
pub(super) fn pairs(
    photo: &[PictureFeature],
    view: &[WorldFeature],
    allowed: impl Fn(DVec2, DVec2) -> bool + Sync,
) -> Vec<(usize, usize)> {
    if view.is_empty() {
        return Vec::new();
    }
    // Of each feature of the photo, the squared distances to all of the view.
    let mut table = vec![0.0_f32; photo.len() * view.len()];
    table.par_chunks_mut(view.len()).zip(photo).for_each(|(out, own)| {
        out.iter_mut().zip(view).for_each(|(d, other)| *d = distance(&own.descriptor, &other.descriptor));
    });
    let distance = |i: usize, j: usize| table[i * view.len() + j];
    let nearest = |i: usize| -> Option<(usize, usize)> {
        let own = &photo[i];
        let mut best = (f32::INFINITY, usize::MAX);
        let mut rival = f32::INFINITY;
        for (j, other) in view.iter().enumerate().filter(|(_, other)| allowed(own.at, other.at)) {
            let d = distance(i, j);
            let apart = |k: usize| view.get(k).is_none_or(|b| b.at.distance(other.at) > SAME_PX);
            if d < best.0 {
                if apart(best.1) {
                    rival = best.0;
                }
                best = (d, j);
            } else if d < rival && apart(best.1) {
                rival = d;
            }
        }
        (best.1 != usize::MAX && best.0 < FARTHEST.min(RATIO * RATIO * rival)).then_some((i, best.1))
    };
    let found: Vec<(usize, usize)> = (0..photo.len()).into_par_iter().filter_map(nearest).collect();
    let mutual = |&(i, j): &(usize, usize)| {
        let nearer = |k: usize| {
            let p = &photo[k];
            distance(k, j) < distance(i, j) && p.at.distance(photo[i].at) > SAME_PX && allowed(p.at, view[j].at)
        };
        !(0..photo.len()).any(nearer)
    };
    found.into_par_iter().filter(mutual).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(k: usize) -> [f32; LENGTH] {
        std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 })
    }

    #[test]
    fn what_is_alike_twice_matches_nothing() {
        let photo = |k: usize, x: f64| PictureFeature { at: DVec2::new(x, 0.0), descriptor: one(k) };
        let view = |k: usize, x: f64| WorldFeature { world: DVec3::ZERO, at: DVec2::new(x, 0.0), descriptor: one(k) };
        let photos = [photo(0, 10.0), photo(1, 50.0)];
        let anywhere = |_: DVec2, _: DVec2| true;
        assert_eq!(pairs(&photos, &[view(1, 80.0), view(0, 20.0)], anywhere), [(0, 1), (1, 0)]);
        let twice = [view(1, 80.0), view(0, 20.0), view(0, 60.0)];
        assert_eq!(pairs(&photos, &twice, anywhere), [(1, 0)]);
        let near = |a: DVec2, b: DVec2| a.distance(b) < 15.0;
        assert_eq!(pairs(&photos, &twice, near), [(0, 1)]);
        // Two photo features of one point: the one that is nearer matches.
        let mut blend = one(0);
        (blend[0], blend[1]) = (0.8, 0.6);
        let close = [PictureFeature { at: DVec2::ZERO, descriptor: blend }, photo(0, 30.0)];
        assert_eq!(pairs(&close, &[view(0, 1.0), view(5, 70.0)], anywhere), [(1, 0)]);
    }
}
