//! Masks of several levels, each pixel of a level in one mask at most: which is a piece of which.

use std::collections::{BTreeMap, HashMap};

use crate::scene::Level;

/// Number of no mask.
pub(crate) const NO_MASK: u16 = u16::MAX;

/// Least share of a mask that lies in a coarser one of which it is a piece.
const INSIDE: f64 = 0.9;
/// Least IoU of two masks of one thing.
const SAME: f64 = 0.8;

/// A mask and its whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NestedMask {
    /// Place of its level.
    pub(super) place: usize,
    /// Number of the mask.
    pub(super) number: u16,
    pub(super) level: Level,
    /// Place of its whole in the list.
    pub(super) parent: Option<usize>,
}

/// Sorts the masks of `levels`, the coarsest first, into wholes and their pieces. A mask is a piece of the smallest
/// coarser mask that contains it; a mask that is nearly a coarser one is left out.
pub(super) fn nested(levels: &[&[u16]]) -> Vec<NestedMask> {
    let mut areas: BTreeMap<(usize, u16), usize> = BTreeMap::new();
    let mut overlaps: HashMap<(usize, u16), BTreeMap<(usize, u16), usize>> = HashMap::new();
    let pixels = levels.first().map_or(0, |level| level.len());
    let alike = |a: usize, b: usize| levels.iter().all(|level| level[a] == level[b]);
    // Counted by runs of pixels of the same masks.
    let mut begin = 0;
    for end in 1..=pixels {
        if end < pixels && alike(begin, end) {
            continue;
        }
        let (i, run) = (begin, end - begin);
        for (k, level) in levels.iter().enumerate().filter(|(_, level)| level[i] != NO_MASK) {
            *areas.entry((k, level[i])).or_default() += run;
            for (j, coarser) in levels[..k].iter().enumerate().filter(|(_, level)| level[i] != NO_MASK) {
                *overlaps.entry((k, level[i])).or_default().entry((j, coarser[i])).or_default() += run;
            }
        }
        begin = end;
    }
    let mut list: Vec<NestedMask> = Vec::new();
    let mut place_of: HashMap<(usize, u16), usize> = HashMap::new();
    for (&mask, &area) in &areas {
        let none = BTreeMap::new();
        let over = overlaps.get(&mask).unwrap_or(&none);
        let iou = |other: &(usize, u16), shared: usize| shared as f64 / (area + areas[other] - shared) as f64;
        let same = over.iter().map(|(other, shared)| (other, iou(other, *shared))).max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((other, _)) = same.filter(|(_, iou)| *iou >= SAME) {
            place_of.insert(mask, place_of[other]);
            continue;
        }
        let around = over.iter().filter(|(_, shared)| **shared as f64 >= INSIDE * area as f64);
        let parent = around
            .min_by_key(|(other, _)| (areas[*other], std::cmp::Reverse(**other)))
            .map(|(other, _)| place_of[other]);
        let level = if parent.is_some() { Level::Part } else { Level::Object };
        place_of.insert(mask, list.len());
        list.push(NestedMask { place: mask.0, number: mask.1, level, parent });
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A level whose masks are ranges of pixels.
    fn level(masks: &[(u16, std::ops::Range<usize>)]) -> Vec<u16> {
        let mut level = vec![NO_MASK; 100];
        masks.iter().for_each(|(number, range)| level[range.clone()].fill(*number));
        level
    }

    #[test]
    fn a_mask_is_a_piece_of_the_smallest_coarser_one_around_it() {
        let large = level(&[(20, 0..50)]);
        let medium = level(&[(10, 0..20), (11, 45..70), (12, 80..90)]);
        let small = level(&[(1, 2..8), (2, 30..40), (3, 60..65), (4, 95..99)]);
        let list = nested(&[&large, &medium, &small]);
        let found: Vec<_> = list.iter().map(|m| (m.number, m.level, m.parent)).collect();
        use Level::{Object, Part};
        assert_eq!(
            found,
            [
                (20, Object, None),
                (10, Part, Some(0)),
                // A fifth of it lies in the large one.
                (11, Object, None),
                (12, Object, None),
                (1, Part, Some(1)),
                (2, Part, Some(0)),
                (3, Part, Some(2)),
                (4, Object, None),
            ]
        );
    }

    #[test]
    fn one_thing_at_several_levels_is_one_mask() {
        let (large, medium) = (level(&[(5, 0..50)]), level(&[(3, 0..52)]));
        let small = level(&[(0, 2..49), (1, 60..70)]);
        let list = nested(&[&large, &medium, &small]);
        assert_eq!(list.iter().map(|m| m.number).collect::<Vec<_>>(), [5, 1]);
        // The control: with half of it, it is a piece.
        let small = level(&[(0, 2..30)]);
        let list = nested(&[&large, &medium, &small]);
        assert_eq!((list.len(), list[1].parent), (2, Some(0)));
        assert_eq!(nested(&[]), []);
    }
}
