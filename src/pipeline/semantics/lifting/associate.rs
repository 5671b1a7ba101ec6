//! Association of the masks of a photo with known identities.

use super::segmenter::FoundMask;
use super::votes::UNKNOWN;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::scene::findings::ConflictKind;
use crate::scene::{Identities, IdentityId, Level, NO_IDENTITY};

/// Least share of an identity's visible pixels, and of a mask's known pixels, that must agree.
const SAME: f64 = 0.5;
/// Least number of pixels that must agree.
const LEAST_PX: usize = 12;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Link {
    Known(IdentityId),
    New,
    /// Another mask fits this identity better.
    Split(IdentityId),
}

/// Pixels of a view, or of a piece of it, by identity.
struct PixelCounts {
    /// Pixels of each identity and its pieces, by number.
    of: Vec<usize>,
    /// Pixels that are not unknown.
    known: usize,
}

impl PixelCounts {
    fn new(map: &ViewMap, identities: &Identities, pixels: impl Iterator<Item = usize>) -> Self {
        let (mut of, mut known) = (vec![0; identities.len() + 1], 0);
        for id in pixels.map(|i| map.identity[i]).filter(|id| *id != UNKNOWN) {
            known += 1;
            of.get_mut(id as usize).into_iter().for_each(|count| *count += 1);
        }
        // A whole's number is smaller than its pieces'.
        for (id, identity) in (1..of.len()).rev().filter_map(|id| Some((id, identities.get(id as IdentityId)?))) {
            if identity.parent != NO_IDENTITY {
                of[identity.parent as usize] += of[id];
            }
        }
        Self { of, known }
    }
}

/// Links the masks of a photo with the identities `known` in its view. A part can only be a piece of its linked
/// whole. A mask with the name of an identity of the same whole is linked to it, however little of it has been seen;
/// others must overlap.
pub(crate) fn link(found: &[FoundMask], known: Option<&ViewMap>, identities: &Identities) -> Vec<Link> {
    let Some(map) = known else { return vec![Link::New; found.len()] };
    let visible = PixelCounts::new(map, identities, 0..map.identity.len());
    let fit = |inside: &PixelCounts, id: IdentityId| -> Option<f64> {
        let [overlap, seen] = [inside, &visible].map(|counts| counts.of[id as usize]);
        let (of_seen, of_known) = (overlap as f64 / seen as f64, overlap as f64 / inside.known.max(1) as f64);
        (overlap >= LEAST_PX && of_seen >= SAME && of_known >= SAME).then_some(of_seen * of_known)
    };
    let mut links: Vec<Link> = Vec::with_capacity(found.len());
    let mut taken: Vec<(IdentityId, usize, f64)> = Vec::new();
    for (i, mask) in found.iter().enumerate() {
        let whole = mask.parent.map(|p| links[p]);
        let candidates: Vec<IdentityId> = match (mask.level, whole) {
            (Level::Object, _) => {
                identities.iter().filter(|(_, i)| i.level == Level::Object).map(|(id, _)| id).collect()
            }
            (Level::Part, Some(Link::Known(whole))) => identities.children(whole).collect(),
            (Level::Part, Some(_)) => Vec::new(),
            (Level::Part, None) => {
                identities.iter().filter(|(_, i)| i.level == Level::Part).map(|(id, _)| id).collect()
            }
        };
        let called = |id: &&IdentityId| {
            let names = identities.get(**id).map(|i| i.names.as_slice()).unwrap_or_default();
            mask.name.as_ref().is_some_and(|name| names.contains(name)) && taken.iter().all(|t| t.0 != **id)
        };
        if let Some(&id) = candidates.iter().find(called) {
            taken.push((id, i, f64::INFINITY));
            links.push(Link::Known(id));
            continue;
        }
        // Another name means another identity.
        let nameless = |id: &IdentityId| mask.name.is_none() || identities.get(*id).is_some_and(|i| i.names.is_empty());
        let fits = candidates.into_iter().filter(nameless);
        let inside = PixelCounts::new(map, identities, mask.mask.pixels());
        let fits = fits.filter_map(|id| Some((id, fit(&inside, id)?)));
        let best = fits.max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((id, score)) = best else {
            links.push(Link::New);
            continue;
        };
        match taken.iter_mut().find(|t| t.0 == id) {
            None => {
                taken.push((id, i, score));
                links.push(Link::Known(id));
            }
            Some(other) if other.2 < score => {
                links[other.1] = Link::Split(id);
                *other = (id, i, score);
                links.push(Link::Known(id));
            }
            Some(_) => links.push(Link::Split(id)),
        }
    }
    links
}

/// Returns the disagreements between the linked masks and the identities known before.
pub(crate) fn conflicts(
    found: &[FoundMask],
    links: &[Link],
    known: &ViewMap,
    identities: &Identities,
) -> Vec<ConflictKind> {
    let mut list = Vec::new();
    // An identity with a mask of its own in this photo is told apart, wherever it was expected.
    let has_mask = |id: IdentityId| links.contains(&Link::Known(id));
    let visible = PixelCounts::new(known, identities, 0..known.identity.len());
    for (mask, link) in found.iter().zip(links) {
        if let Link::Split(of) = link {
            list.push(ConflictKind::Split(*of));
        }
        let peers = identities.iter().filter(|(_, i)| i.level == mask.level);
        let within = PixelCounts::new(known, identities, mask.mask.pixels());
        let inside = |id: IdentityId| {
            let [overlap, seen] = [&within, &visible].map(|counts| counts.of[id as usize]);
            overlap >= LEAST_PX && overlap as f64 >= SAME * seen as f64
        };
        let covered: Vec<IdentityId> = peers.map(|(id, _)| id).filter(|id| inside(*id)).collect();
        // A part of a part is no peer of its whole.
        let apart = |id: &IdentityId| covered.iter().all(|o| o == id || !identities.ancestors(*id).any(|i| i == *o));
        let covered: Vec<IdentityId> = covered.iter().copied().filter(apart).collect();
        let own = if let Link::Known(id) = link { *id } else { NO_IDENTITY };
        let merged: Vec<IdentityId> = covered.iter().copied().filter(|id| *id == own || !has_mask(*id)).collect();
        match (link, covered.as_slice()) {
            (_, [_, _, ..]) if merged.len() > 1 => list.push(ConflictKind::Merge(merged)),
            (Link::Known(is), [other]) if is != other && !identities.ancestors(*other).any(|i| i == *is) => {
                list.push(ConflictKind::Switch(*is, *other));
            }
            _ => {}
        }
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Mask;

    fn mask(from: usize, to: usize) -> Mask {
        Mask::from_fn(100, 1, |i| (from..to).contains(&i))
    }

    fn found(level: Level, parent: Option<usize>, mask: Mask) -> FoundMask {
        FoundMask { level, parent, name: None, mask }
    }

    #[test]
    fn a_whole_counts_the_pixels_of_its_pieces_and_the_unknown_count_for_nobody() {
        let mut all = Identities::default();
        let pot = all.add(Level::Object, NO_IDENTITY, vec![]);
        let lid = all.add(Level::Part, pot, vec![]);
        all.add(Level::Part, lid, vec![]);
        let map = ViewMap::certain(10, vec![0, 1, 2, 2, 3, 3, 3, UNKNOWN, UNKNOWN, 9]);
        let counts = PixelCounts::new(&map, &all, 0..10);
        assert_eq!((&counts.of[1..], counts.known), (&[6, 5, 3][..], 8));
        let inside = PixelCounts::new(&map, &all, [3, 4, 7].into_iter());
        assert_eq!((&inside.of[1..], inside.known), (&[2, 2, 1][..], 2));
        for id in 1..=3 {
            assert_eq!(counts.of[id as usize], map.mask(&all, id).area(), "as the mask of {id} has it");
        }
    }

    #[test]
    fn masks_find_their_identity_where_something_is_known() {
        let mut all = Identities::default();
        let cup = all.add(Level::Object, NO_IDENTITY, vec![]);
        let pot = all.add(Level::Object, NO_IDENTITY, vec![]);
        let lid = all.add(Level::Part, pot, vec![]);
        let mut identity = vec![NO_IDENTITY; 100];
        identity[..20].fill(cup);
        identity[20..40].fill(pot);
        identity[40..55].fill(lid);
        identity[60..].fill(UNKNOWN);
        let map = ViewMap::certain(100, identity);
        let masks = [
            // The pot with its far side, which is still unknown.
            found(Level::Object, None, Mask::from_fn(100, 1, |i| (22..55).contains(&i) || i >= 70)),
            found(Level::Object, None, mask(0, 19)),
            found(Level::Object, None, mask(60, 70)),
            found(Level::Part, Some(0), mask(41, 56)),
            found(Level::Part, Some(0), mask(22, 39)),
            // The cup's part cannot be the pot's lid.
            found(Level::Part, Some(1), mask(41, 56)),
        ];
        let links = link(&masks, Some(&map), &all);
        assert_eq!(links, [Link::Known(pot), Link::Known(cup), Link::New, Link::Known(lid), Link::New, Link::New]);
        assert_eq!(link(&masks, None, &all), [Link::New; 6]);
    }

    #[test]
    fn two_masks_cannot_be_the_same_identity() {
        let mut all = Identities::default();
        let cup = all.add(Level::Object, NO_IDENTITY, vec![]);
        let map = ViewMap::certain(100, vec![cup; 100]);
        let masks = [found(Level::Object, None, mask(0, 55)), found(Level::Object, None, mask(40, 100))];
        let links = link(&masks, Some(&map), &all);
        assert_eq!(links, [Link::Split(cup), Link::Known(cup)]);
        assert_eq!(conflicts(&masks, &links, &map, &all), [ConflictKind::Split(cup)]);
    }

    #[test]
    fn one_mask_over_two_identities_is_told() {
        let mut all = Identities::default();
        let cup = all.add(Level::Object, NO_IDENTITY, vec![]);
        let pot = all.add(Level::Object, NO_IDENTITY, vec![]);
        let lid = all.add(Level::Part, pot, vec![]);
        let mut identity = vec![cup; 50];
        identity.extend(vec![pot; 30]);
        identity.extend(vec![lid; 20]);
        let map = ViewMap::certain(100, identity);
        let both = [found(Level::Object, None, mask(5, 100))];
        let links = link(&both, Some(&map), &all);
        assert_eq!(conflicts(&both, &links, &map, &all), [ConflictKind::Merge(vec![cup, pot])]);
        // One mask for one identity, and one for its part, agree with what is known.
        let each = [found(Level::Object, None, mask(50, 100)), found(Level::Part, Some(0), mask(80, 100))];
        let links = link(&each, Some(&map), &all);
        assert_eq!(conflicts(&each, &links, &map, &all), []);
    }

    #[test]
    fn names_say_more_than_overlap() {
        let mut all = Identities::default();
        let cup = all.add(Level::Object, NO_IDENTITY, vec!["cup".into()]);
        let handle = all.add(Level::Part, cup, vec!["handle".into()]);
        let pot = all.add(Level::Object, NO_IDENTITY, vec!["pot".into()]);
        let mut identity = vec![NO_IDENTITY; 100];
        identity[..50].fill(pot);
        let map = ViewMap::certain(100, identity);
        let named = |name: &str, level, parent, from, to| FoundMask {
            name: Some(name.into()),
            ..found(level, parent, mask(from, to))
        };
        let masks = [
            // The cup, with its handle, is where the pot was expected, never seen from here.
            named("cup", Level::Object, None, 0, 50),
            named("handle", Level::Part, Some(0), 0, 10),
            // Another thing where the pot is, and the pot's own handle.
            named("jug", Level::Object, None, 5, 50),
            named("pot", Level::Object, None, 60, 80),
            named("handle", Level::Part, Some(3), 60, 65),
        ];
        let links = link(&masks, Some(&map), &all);
        assert_eq!(links, [Link::Known(cup), Link::Known(handle), Link::New, Link::Known(pot), Link::New]);
        // The cup is where the pot was; the jug there is new, and says nothing about the pot.
        assert_eq!(conflicts(&masks, &links, &map, &all), [ConflictKind::Switch(cup, pot)]);
    }

    #[test]
    fn half_of_both_is_needed_and_a_dozen_pixels() {
        let mut all = Identities::default();
        let cup = all.add(Level::Object, NO_IDENTITY, vec![]);
        let view = |from: usize, to: usize| {
            let identity = (0..100).map(|i| if (from..to).contains(&i) { cup } else { NO_IDENTITY }).collect();
            ViewMap::certain(100, identity)
        };
        let one = |known: (usize, usize), seen: (usize, usize)| {
            link(&[found(Level::Object, None, mask(seen.0, seen.1))], Some(&view(known.0, known.1)), &all)[0]
        };
        assert_eq!(one((0, 40), (20, 60)), Link::Known(cup), "half of what is known, half of the mask");
        assert_eq!(one((0, 40), (21, 60)), Link::New, "less of what is known");
        assert_eq!(one((0, 40), (20, 61)), Link::New, "less of the mask");
        assert_eq!(one((0, 12), (0, 12)), Link::Known(cup));
        assert_eq!(one((0, 11), (0, 11)), Link::New, "too small to say");
        // Over unknown pixels, the mask may be larger.
        let mut map = view(0, 20);
        map.identity[20..].fill(UNKNOWN);
        assert_eq!(link(&[found(Level::Object, None, mask(0, 90))], Some(&map), &all), [Link::Known(cup)]);
        // A part is no object, and a lone part fits parts only.
        assert_eq!(link(&[found(Level::Part, None, mask(0, 20))], Some(&map), &all), [Link::New]);
        let handle = all.add(Level::Part, cup, vec![]);
        map.identity[..20].fill(handle);
        assert_eq!(link(&[found(Level::Part, None, mask(0, 20))], Some(&map), &all), [Link::Known(handle)]);
        assert_eq!(link(&[found(Level::Part, None, mask(0, 20))], None, &all), [Link::New]);
    }
}
