//! LERF's rule for masks: relevancy is scaled from one half (no more relevant than a canonical phrase) to the largest
//! of the view. Pixels over a fifth of that scale belong to the mask.

use crate::pipeline::semantics::relevancy::{LERFS_SHARE, on_lerfs_scale};
use crate::scene::Mask;

/// Returns the mask of a view's relevancy, row-major; empty if no pixel is more relevant than a canonical phrase.
pub(crate) fn mask(relevancy: &[f32], width_px: usize) -> Mask {
    let height_px = relevancy.len() / width_px.max(1);
    let most = relevancy.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    Mask::from_fn(width_px, height_px, |i| on_lerfs_scale(relevancy[i], most) > LERFS_SHARE)
}

/// Index of the most relevant pixel, the first of equal ones.
pub(crate) fn peak(relevancy: &[f32]) -> Option<usize> {
    (0..relevancy.len()).max_by(|&a, &b| relevancy[a].total_cmp(&relevancy[b]).then(b.cmp(&a)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fifth_of_the_way_to_the_largest_is_cut_off() {
        // The scale goes from 0.5 to 0.7, the cut is at 0.54.
        let relevancy = [0.2, 0.5, 0.53, 0.55, 0.7, 0.69];
        assert_eq!(mask(&relevancy, 3).pixels().collect::<Vec<_>>(), [3, 4, 5]);
        assert_eq!(peak(&relevancy), Some(4));
        assert!(mask(&[0.5, 0.1], 2).is_empty(), "nothing is more relevant than a canonical phrase");
        assert!(mask(&[f32::NAN, f32::NAN], 2).is_empty() && mask(&[], 0).is_empty());
        assert_eq!(peak(&[0.6, 0.6]), Some(0));
    }
}
