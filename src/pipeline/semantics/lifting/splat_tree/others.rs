//! Other identities than the one that is corrected: what a mark would take from them, and what it leaves them.

use std::collections::{BTreeMap, BTreeSet};

use crate::math::format;
use crate::scene::{Identities, IdentityId, NO_IDENTITY, SemanticMap};

/// Largest share of another identity's visible area that a mark takes without touching it.
const UNTOUCHED: f64 = 0.03;

/// Identities of the Gaussians around a known thing that is corrected. The default knows nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct OtherIdentities {
    /// Identity that would lose each Gaussian: `NO_IDENTITY` for those of the thing itself and of its wholes, which
    /// it stays a part of.
    of: Vec<IdentityId>,
    /// True for the parts of the thing: they lose what the thing loses, all others what it gains.
    is_part: Vec<bool>,
    all: Identities,
}

/// Change of another identity by a mark.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OtherChange {
    pub(crate) id: IdentityId,
    /// Number of its Gaussians that change, and their share of its visible area.
    pub(crate) gaussians: usize,
    pub(crate) share: f64,
    /// True if they were left as they were, since the mark does not touch it.
    pub(crate) is_left: bool,
}

impl OtherChange {
    /// Returns whether more than a few percent change.
    pub(crate) fn is_large(&self) -> bool {
        self.share > UNTOUCHED
    }
}

impl OtherIdentities {
    /// Identities of a map around `id`.
    pub(crate) fn new(map: &SemanticMap, id: IdentityId) -> Self {
        let all = &map.identities;
        let mut is_part = all.descendants(id);
        is_part.iter_mut().skip(id as usize).take(1).for_each(|own| *own = false);
        let own: BTreeSet<IdentityId> = all.ancestors(id).collect();
        let is_other = |of: IdentityId| !own.contains(&of) && all.get(of).is_some();
        let of = map.identity_of.iter().map(|of| if is_other(*of) { *of } else { NO_IDENTITY }).collect();
        Self { of, is_part, all: all.clone() }
    }

    /// Identity that loses a Gaussian if that gets this label.
    fn loser(&self, (gaussian, is_in): (u32, bool)) -> Option<IdentityId> {
        let id = self.of.get(gaussian as usize).copied().filter(|id| *id != NO_IDENTITY)?;
        (self.is_part[id as usize] != is_in).then_some(id)
    }

    /// Takes the flips away by which an identity would lose more than a few percent, though none of its Gaussians is
    /// among the `touched`. Returns the changes of all others, the largest share first, and the Gaussians that are left
    /// with their labels.
    ///
    /// A flip is a Gaussian with its new label, `area` the visible area of each Gaussian.
    pub(super) fn spare(
        &self,
        flips: &mut Vec<(u32, bool)>,
        touched: &BTreeMap<u32, f32>,
        area: &[f64],
    ) -> (Vec<OtherChange>, Vec<(u32, bool)>) {
        let mut lost: BTreeMap<IdentityId, (usize, f64)> = BTreeMap::new();
        for flip in flips.iter() {
            if let Some(id) = self.loser(*flip) {
                let (gaussians, sum) = lost.entry(id).or_default();
                (*gaussians, *sum) = (*gaussians + 1, *sum + area[flip.0 as usize]);
            }
        }
        if lost.is_empty() {
            return (Vec::new(), Vec::new());
        }
        let mut whole: BTreeMap<IdentityId, f64> = lost.keys().map(|id| (*id, 0.0)).collect();
        for (id, area) in self.of.iter().zip(area) {
            whole.entry(*id).and_modify(|sum| *sum += area);
        }
        // A mark on a part touches its whole.
        let labels: BTreeSet<IdentityId> = touched.keys().filter_map(|i| self.of.get(*i as usize)).copied().collect();
        let touched: BTreeSet<IdentityId> = labels.into_iter().flat_map(|id| self.all.ancestors(id)).collect();
        let change = |(id, (gaussians, lost)): (IdentityId, (usize, f64))| {
            let share = lost / whole[&id].max(f64::MIN_POSITIVE);
            let change = OtherChange { id, gaussians, share, is_left: false };
            OtherChange { is_left: change.is_large() && !touched.contains(&id), ..change }
        };
        let mut changes: Vec<OtherChange> = lost.into_iter().map(change).collect();
        let left: BTreeSet<IdentityId> = changes.iter().filter(|c| c.is_left).map(|c| c.id).collect();
        let is_left = |flip: &mut (u32, bool)| self.loser(*flip).is_some_and(|id| left.contains(&id));
        let stay = flips.extract_if(.., is_left).map(|(gaussian, is_in)| (gaussian, !is_in)).collect();
        changes.sort_by(|a, b| b.share.total_cmp(&a.share).then(a.id.cmp(&b.id)));
        (changes, stay)
    }
}

/// Sentence on what a mark left to other identities, by their `name`; `None` if nothing.
pub(super) fn left_text(changes: &[OtherChange], name: &dyn Fn(IdentityId) -> String) -> Option<String> {
    let left: Vec<&OtherChange> = changes.iter().filter(|c| c.is_left).collect();
    let each = left.iter().enumerate().map(|(k, c)| {
        let count = if k == 0 { format::things(c.gaussians, "Gaussian") } else { format::count(c.gaussians as u64) };
        format!("{count} of '{}'", name(c.id))
    });
    let (was, it) = match left.as_slice() {
        [] => return None,
        [one] if one.gaussians == 1 => ("it was", "it"),
        [_] => ("they were", "it"),
        _ => ("they were", "them"),
    };
    let each = format::list(&each.collect::<Vec<_>>());
    Some(format!("left {each} as {was}: the stroke does not touch {it}"))
}

/// Sentence on what a mark takes from other identities, by their `name`; `None` if nothing.
pub(super) fn taken_text(changes: &[OtherChange], name: &dyn Fn(IdentityId) -> String) -> Option<String> {
    let taken = changes.iter().filter(|c| !c.is_left).map(|c| {
        let (gaussians, share) = (format::things(c.gaussians, "Gaussian"), format::percent(c.share));
        format!("{gaussians} from '{}' ({share})", name(c.id))
    });
    let taken: Vec<String> = taken.collect();
    (!taken.is_empty()).then(|| format!("took {}", format::list(&taken)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Level;

    const DOLL: IdentityId = 1;
    const FACE: IdentityId = 2;
    const MOUTH: IdentityId = 3;
    const CUP: IdentityId = 4;

    /// A doll with a face, which has a mouth, and a cup, of 10 Gaussians each; the last 10 are of nothing.
    fn map() -> SemanticMap {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec!["doll".into()]);
        let face = all.add(Level::Part, doll, vec!["face".into()]);
        all.add(Level::Part, face, vec!["mouth".into()]);
        all.add(Level::Object, NO_IDENTITY, vec!["cup".into()]);
        let of = [DOLL, FACE, MOUTH, CUP, NO_IDENTITY].into_iter().flat_map(|id| [id; 10]).collect();
        SemanticMap::from_identities(all, of, vec![1.0; 50], Vec::new())
    }

    fn spare(id: IdentityId, flips: &[(u32, bool)], touched: &[u32]) -> (Vec<(u32, bool)>, Vec<OtherChange>) {
        let (mut flips, touched) = (flips.to_vec(), touched.iter().map(|i| (*i, 1.0)).collect());
        // The first Gaussian of each ten has half of their area.
        let area: Vec<f64> = (0..50).map(|i| if i % 10 == 0 { 9.0 } else { 1.0 }).collect();
        let before = flips.clone();
        let (changes, stay) = OtherIdentities::new(&map(), id).spare(&mut flips, &touched, &area);
        let others = before.into_iter().filter(|flip| !flips.contains(flip));
        assert_eq!(stay, others.map(|(gaussian, is_in)| (gaussian, !is_in)).collect::<Vec<_>>());
        (flips, changes)
    }

    #[test]
    fn what_is_not_touched_is_left_and_what_is_touched_is_told() {
        let all = [(31, true), (32, true), (41, true)];
        let (left, changes) = spare(FACE, &all, &[41]);
        assert_eq!(left, [(41, true)], "two of the cup stay with it");
        assert_eq!(changes, [OtherChange { id: CUP, gaussians: 2, share: 2.0 / 18.0, is_left: true }]);
        // Controls: the cup is touched, or loses little, or nothing is known of it.
        let (left, changes) = spare(FACE, &all, &[35]);
        assert_eq!((left.as_slice(), changes[0].is_left), (&all[..], false));
        let mut flips = all.to_vec();
        let (changes, _) = OtherIdentities::default().spare(&mut flips, &BTreeMap::new(), &[1.0; 50]);
        assert_eq!((flips.as_slice(), changes), (&all[..], Vec::new()));
        let wide: Vec<f64> = (0..50).map(|i| if i == 30 { 100.0 } else { 1.0 }).collect();
        let (changes, _) = OtherIdentities::new(&map(), FACE).spare(&mut flips, &BTreeMap::new(), &wide);
        assert_eq!((flips.as_slice(), changes[0].is_left), (&all[..], false), "two of 109");
    }

    #[test]
    fn wholes_lose_nothing_to_their_parts_and_parts_lose_what_their_whole_loses() {
        // The face takes from its own whole, and gives back to it.
        let (left, changes) = spare(FACE, &[(1, true), (11, false)], &[]);
        assert_eq!((left.len(), changes), (2, Vec::new()));
        // The face gives up its mouth, unseen: the mouth stays. The mouth is touched, or grows: it goes, or nothing.
        let (left, changes) = spare(FACE, &[(20, false), (11, false)], &[11]);
        assert_eq!(left, [(11, false)]);
        assert_eq!(changes, [OtherChange { id: MOUTH, gaussians: 1, share: 0.5, is_left: true }]);
        assert_eq!(spare(FACE, &[(20, false)], &[29]).0, [(20, false)]);
        assert_eq!(spare(FACE, &[(20, true)], &[]), (vec![(20, true)], Vec::new()));
        // A mark on the mouth touches face and doll, too.
        assert_eq!(spare(CUP, &[(1, true), (11, true)], &[25]).0.len(), 2);
        assert_eq!(spare(CUP, &[(1, true), (11, true)], &[15]).0.len(), 2);
        assert_eq!(spare(CUP, &[(1, true), (11, true)], &[5]).0, [(1, true)], "the doll alone is touched");
    }

    #[test]
    fn sentences_name_everything_that_changes() {
        let name = |id: IdentityId| ["", "doll", "face", "mouth", "cup"][id as usize].to_owned();
        let change = |id, gaussians, is_left| OtherChange { id, gaussians, share: 0.12, is_left };
        let told = |changes: &[OtherChange]| (left_text(changes, &name), taken_text(changes, &name));
        let (left, taken) = told(&[change(MOUTH, 120, true), change(CUP, 1, false)]);
        assert_eq!(left.as_deref(), Some("left 120 Gaussians of 'mouth' as they were: the stroke does not touch it"));
        assert_eq!(taken.as_deref(), Some("took 1 Gaussian from 'cup' (12 %)"));
        let (left, taken) = told(&[change(MOUTH, 2, true), change(CUP, 1, true)]);
        let text = "left 2 Gaussians of 'mouth' and 1 of 'cup' as they were: the stroke does not touch them";
        assert_eq!((left.as_deref(), taken), (Some(text), None));
        let one = told(&[change(CUP, 1, true)]).0;
        assert_eq!(one.as_deref(), Some("left 1 Gaussian of 'cup' as it was: the stroke does not touch it"));
        assert_eq!(told(&[]), (None, None));
    }
}
