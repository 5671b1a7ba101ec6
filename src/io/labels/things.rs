//! Regions of label files: drawn in order, with holes cut and parts linked to their wholes.

use super::Region;
use crate::scene::Mask;

/// A region, its key, and the key of the whole that it is a part of.
pub(super) struct Thing {
    pub(super) key: String,
    pub(super) whole: Option<String>,
    pub(super) region: Region,
}

/// Returns whether a category is the background, which cuts holes and is no region itself.
pub(super) fn is_background(name: &str) -> bool {
    matches!(name.trim(), "__background__" | "_background_")
}

/// Returns whether pixels of a category do not count.
pub(super) fn is_ignored(name: &str) -> bool {
    matches!(name.trim(), "__ignore__" | "_ignore_")
}

/// Sorts wholes before their parts, at any depth. If several wholes share a key, a part belongs to the one that covers
/// most of its pixels.
///
/// # Errors
/// The key of a part whose whole is missing, or is a part of itself.
pub(super) fn wholes_first(things: Vec<Thing>) -> Result<Vec<Region>, String> {
    let mut ordered: Vec<Region> = Vec::with_capacity(things.len());
    let mut keys: Vec<String> = Vec::with_capacity(things.len());
    let mut waiting = things;
    while !waiting.is_empty() {
        let open: Vec<bool> = waiting
            .iter()
            .map(|t| {
                t.whole
                    .as_ref()
                    .is_none_or(|whole| keys.contains(whole) && !waiting.iter().any(|other| other.key == *whole))
            })
            .collect();
        if !open.contains(&true) {
            return Err(waiting.swap_remove(0).key);
        }
        let mut later = Vec::new();
        for (Thing { key, whole, mut region }, open) in waiting.into_iter().zip(open) {
            if !open {
                later.push(Thing { key, whole, region });
                continue;
            }
            let wholes = (0..keys.len()).filter(|i| whole.as_ref() == Some(&keys[*i]));
            region.parent = wholes.max_by_key(|i| (shared(&ordered[*i].mask, &region.mask), std::cmp::Reverse(*i)));
            ordered.push(region);
            keys.push(key);
        }
        waiting = later;
    }
    Ok(ordered)
}

/// Number of pixels that two masks of one picture share.
fn shared(a: &Mask, b: &Mask) -> usize {
    if (a.width_px(), a.height_px()) == (b.width_px(), b.height_px()) { a.overlap(b) } else { 0 }
}

/// Adds the regions of one more label file of a photo. Regions of one name that mostly overlap are merged.
pub(super) fn join(all: &mut Vec<Region>, more: Vec<Region>) {
    let before = all.len();
    let mut place = Vec::with_capacity(more.len());
    for region in more {
        let same = (0..before).find(|i| {
            let other = &all[*i];
            let least = other.mask.area().min(region.mask.area());
            other.name == region.name && other.level == region.level && 2 * shared(&other.mask, &region.mask) > least
        });
        let parent = region.parent.and_then(|p| place.get(p).copied());
        place.push(same.unwrap_or(all.len()));
        match same {
            Some(i) => all[i].mask.add(&region.mask),
            None => all.push(Region { parent, ..region }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thing(key: &str, whole: Option<&str>, x: std::ops::Range<usize>) -> Thing {
        let mask = Mask::from_fn(20, 4, |i| x.contains(&(i % 20)));
        let region = Region { name: key.into(), level: None, parent: None, mask };
        Thing { key: key.into(), whole: whole.map(str::to_owned), region }
    }

    #[test]
    fn a_piece_belongs_to_the_whole_that_it_lies_in() {
        let things = vec![
            thing("cup", None, 0..8),
            thing("rim", Some("handle"), 14..15),
            thing("handle", Some("cup"), 13..16),
            thing("cup", None, 10..18),
        ];
        let found = wholes_first(things).expect("ordered");
        let list: Vec<_> = found.iter().map(|r| (r.name.as_str(), r.parent)).collect();
        assert_eq!(list, [("cup", None), ("cup", None), ("handle", Some(1)), ("rim", Some(2))]);
        assert_eq!(
            wholes_first(vec![thing("a", Some("b"), 0..1), thing("b", Some("a"), 0..1)]).err().as_deref(),
            Some("a")
        );
        assert_eq!(wholes_first(vec![thing("a", Some("none"), 0..1)]).err().as_deref(), Some("a"));
    }

    #[test]
    fn a_copy_of_a_file_adds_nothing_and_another_thing_is_added() {
        let regions = |list: &[(&str, Option<usize>, std::ops::Range<usize>)]| {
            let region = |(name, parent, x): &(&str, Option<usize>, std::ops::Range<usize>)| Region {
                parent: *parent,
                ..thing(name, None, x.clone()).region
            };
            list.iter().map(region).collect::<Vec<_>>()
        };
        let mut all = regions(&[("cup", None, 0..8), ("rim", Some(0), 0..2)]);
        join(&mut all, regions(&[("cup", None, 1..9), ("cup", None, 12..16), ("rim", Some(1), 12..13)]));
        let list: Vec<_> = all.iter().map(|r| (r.name.as_str(), r.parent, r.mask.area())).collect();
        assert_eq!(list, [("cup", None, 36), ("rim", Some(0), 8), ("cup", None, 16), ("rim", Some(2), 4)]);
    }
}
