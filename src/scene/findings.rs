//! Evidence from the search for objects and parts: the photos that show each, the confidence, disagreements of photos,
//! and the unknown share of each photo. Kept with the semantic map.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::{Identities, IdentityId, NO_IDENTITY, text};
use crate::math::format::things;

/// Most disagreements that are kept: more of them call for other masks, not for a longer list.
const MAX_CONFLICTS: usize = 1_000;
/// Least share of inferred pixels for which a photo is worth labeling.
const WORTH_LABELING: f64 = 0.05;

/// Disagreement between the masks of a photo and the identities expected in its view.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ConflictKind {
    /// Two masks fit the identity; one of them became an identity of its own.
    Split(IdentityId),
    /// One mask covers several identities that were separate before.
    Merge(Vec<IdentityId>),
    /// A mask is named as the first identity where the second was expected.
    Switch(IdentityId, IdentityId),
    /// Tracked masks and voted Gaussians place the identity differently.
    Drift(IdentityId),
}

impl ConflictKind {
    /// The identities that it is about.
    pub(crate) fn about(&self) -> Vec<IdentityId> {
        match self {
            Self::Split(id) | Self::Drift(id) => vec![*id],
            Self::Switch(is, other) => vec![*is, *other],
            Self::Merge(all) => all.clone(),
        }
    }

    /// In words, with these names.
    pub(crate) fn text(&self, name: impl Fn(IdentityId) -> String) -> String {
        let name = |id: &IdentityId| name(*id);
        match self {
            Self::Split(of) => format!("{} appears in two pieces; one becomes a new identity", name(of)),
            Self::Merge(all) => {
                let all: Vec<String> = all.iter().map(name).collect();
                format!("one mask covers {}; they are kept apart", all.join(" and "))
            }
            Self::Drift(id) => format!("{} was tracked to a wrong place and is ignored there", name(id)),
            Self::Switch(is, other) => format!("{} was found where {} was expected", name(is), name(other)),
        }
    }

    /// One sentence per kind of disagreement: the first case, and the number of others.
    pub(crate) fn summary(
        all: &[(usize, Self)],
        photo: impl Fn(usize) -> String,
        name: impl Fn(IdentityId) -> String,
    ) -> Vec<String> {
        let mut kinds: Vec<Vec<&(usize, Self)>> = Vec::new();
        for conflict in all {
            let kind = std::mem::discriminant(&conflict.1);
            match kinds.iter_mut().find(|k| std::mem::discriminant(&k[0].1) == kind) {
                Some(same) => same.push(conflict),
                None => kinds.push(vec![conflict]),
            }
        }
        let sentence = |same: Vec<&(usize, Self)>| {
            let first = format!("{}: {}", photo(same[0].0), same[0].1.text(&name));
            match same.len() - 1 {
                0 => first,
                more => {
                    let photos: BTreeSet<usize> = same.iter().map(|d| d.0).collect();
                    format!("{first} ({more} more like this, in {} in all)", things(photos.len(), "photo"))
                }
            }
        };
        kinds.into_iter().map(sentence).collect()
    }

    /// The same with new identity numbers; `None` if its identities are gone or merged into one.
    fn renumbered(&self, number: &[IdentityId]) -> Option<Self> {
        let new = |id: &IdentityId| number.get(*id as usize).copied().filter(|id| *id != NO_IDENTITY);
        Some(match self {
            Self::Split(id) => Self::Split(new(id)?),
            Self::Drift(id) => Self::Drift(new(id)?),
            Self::Switch(is, other) => match (new(is)?, new(other)?) {
                (is, other) if is == other => return None,
                (is, other) => Self::Switch(is, other),
            },
            Self::Merge(all) => {
                let mut all: Vec<IdentityId> = all.iter().filter_map(new).collect();
                all.sort_unstable();
                all.dedup();
                Self::Merge(Some(all).filter(|all| all.len() > 1)?)
            }
        })
    }
}

/// A disagreement, and the photo in which it was seen.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct MaskConflict {
    /// Its place in [`SegmentationReport::photos`].
    pub(crate) photo: u32,
    pub(crate) what: ConflictKind,
}

/// A photo that was searched for objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PhotoFinding {
    #[serde(deserialize_with = "text::read_name")]
    pub(crate) name: String,
    /// Share of its pixels with an unknown label.
    pub(crate) unknown: f64,
    /// Share of its pixels that no mask speaks for, so that their labels are inferred.
    #[serde(default)]
    pub(crate) inferred: f64,
}

/// Views of an identity, its parts not included.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Seen {
    /// One bit for each of [`SegmentationReport::photos`], 32 to a number, the lowest first.
    photos: Vec<u32>,
    /// Pixels in the small views that were looked at.
    pixels: u64,
    /// Mean share of its object in them, 0 to 1.
    confidence: f64,
    /// Gaussians that it has by a guess from its mirror image.
    #[serde(default)]
    pub(crate) guessed: u64,
}

impl Seen {
    /// Adds its pixels in a photo.
    pub(crate) fn add(&mut self, photo: usize, pixels: u64, confidence: f64) {
        let mut bits = vec![0; photo / 32 + 1];
        bits[photo / 32] = 1 << (photo % 32);
        self.join(&Self { photos: bits, pixels, confidence, guessed: 0 });
    }

    fn join(&mut self, other: &Self) {
        if self.photos.len() < other.photos.len() {
            self.photos.resize(other.photos.len(), 0);
        }
        self.photos.iter_mut().zip(&other.photos).for_each(|(bits, more)| *bits |= more);
        let sum = self.confidence * self.pixels as f64 + other.confidence * other.pixels as f64;
        self.guessed += other.guessed;
        self.pixels += other.pixels;
        self.confidence = sum / self.pixels.max(1) as f64;
    }
}

/// Evidence from the search for objects and parts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SegmentationReport {
    /// The photos that were searched.
    pub(crate) photos: Vec<PhotoFinding>,
    /// Views of each identity, by number less one.
    seen: Vec<Seen>,
    #[serde(rename = "doubts")]
    conflicts: Vec<MaskConflict>,
}

/// Evidence for an identity, its parts included.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct IdentityEvidence {
    pub(crate) gaussians: usize,
    /// Photos in which it is seen, if that is known.
    pub(crate) photos: Option<usize>,
    /// Mean share of its object in its pixels, if that is known.
    pub(crate) confidence: Option<f64>,
    pub(crate) guessed: u64,
    /// Places in [`SegmentationReport::conflicts`].
    pub(crate) conflicts: Vec<usize>,
}

impl SegmentationReport {
    pub(crate) fn new(photos: Vec<PhotoFinding>, seen: Vec<Seen>, mut conflicts: Vec<MaskConflict>) -> Self {
        conflicts.truncate(MAX_CONFLICTS);
        Self { photos, seen, conflicts }
    }

    pub(crate) fn conflicts(&self) -> &[MaskConflict] {
        &self.conflicts
    }

    /// The photo of a doubt.
    pub(crate) fn photo(&self, conflict: &MaskConflict) -> &str {
        self.photos.get(conflict.photo as usize).map_or("", |p| &p.name)
    }

    /// Mean share of unknown pixels of a photo; `None` without photos.
    pub(crate) fn unknown(&self) -> Option<f64> {
        let sum: f64 = self.photos.iter().map(|p| p.unknown).sum();
        (!self.photos.is_empty()).then(|| sum / self.photos.len() as f64)
    }

    /// The photo whose labels would tell most, and the share of its pixels whose labels are inferred; `None` if masks
    /// speak for nearly all pixels of every photo.
    pub(crate) fn next_to_label(&self) -> Option<(&str, f64)> {
        let most = self.photos.iter().rev().max_by(|a, b| a.inferred.total_cmp(&b.inferred))?;
        (most.inferred >= WORTH_LABELING).then_some((most.name.as_str(), most.inferred))
    }

    /// Returns whether its photos and identities exist and its shares lie between 0 and 1.
    pub(crate) fn is_valid(&self, identities: &Identities) -> bool {
        let share = |v: f64| (0.0..=1.0).contains(&v);
        let is_there = |id: &IdentityId| identities.get(*id).is_some();
        self.photos.iter().all(|p| share(p.unknown) && share(p.inferred))
            && self.seen.len() == identities.len()
            && self.seen.iter().all(|s| share(s.confidence) && s.photos.len() <= self.photos.len().div_ceil(32))
            && self.conflicts.len() <= MAX_CONFLICTS
            && self
                .conflicts
                .iter()
                .all(|d| (d.photo as usize) < self.photos.len() && d.what.about().iter().all(is_there))
    }

    /// Prepends the disagreements of earlier findings on the same identities, as far as their photos are known.
    pub(crate) fn keep_conflicts(&mut self, before: &Self) {
        let place = |d: &MaskConflict| self.photos.iter().position(|p| p.name == before.photo(d));
        let kept = before
            .conflicts
            .iter()
            .filter_map(|d| Some(MaskConflict { photo: place(d)? as u32, what: d.what.clone() }));
        let mut conflicts: Vec<MaskConflict> = kept.collect();
        conflicts.append(&mut self.conflicts);
        conflicts.truncate(MAX_CONFLICTS);
        self.conflicts = conflicts;
    }

    /// Adds an identity without evidence.
    pub(crate) fn add_identity(&mut self) {
        self.seen.push(Seen::default());
    }

    /// Clears the views of an identity, which no longer hold.
    pub(crate) fn forget_seen(&mut self, id: IdentityId) {
        if let Some(seen) = (id as usize).checked_sub(1).and_then(|i| self.seen.get_mut(i)) {
            *seen = Seen::default();
        }
    }

    /// Renumbers identities and merges those with one new number. `number` is indexed by the old numbers; `len` are
    /// left.
    pub(crate) fn renumber(&mut self, number: &[IdentityId], len: usize) {
        let mut seen = vec![Seen::default(); len];
        for (old, new) in self.seen.iter().zip(number.iter().skip(1)) {
            if let Some(seen) = (*new as usize).checked_sub(1).and_then(|i| seen.get_mut(i)) {
                seen.join(old);
            }
        }
        self.seen = seen;
        let conflicts = self.conflicts.iter();
        let renumbered = |d: &MaskConflict| Some(MaskConflict { photo: d.photo, what: d.what.renumbered(number)? });
        self.conflicts = conflicts.filter_map(renumbered).collect();
    }

    /// Evidence for every identity, by number, unlabeled Gaussians first. `sizes` are their numbers of Gaussians.
    pub(crate) fn facts(findings: Option<&Self>, identities: &Identities, sizes: &[usize]) -> Vec<IdentityEvidence> {
        let of = |gaussians: &usize| IdentityEvidence { gaussians: *gaussians, ..IdentityEvidence::default() };
        let mut facts: Vec<IdentityEvidence> = sizes.iter().map(of).collect();
        let Some(findings) = findings else { return facts };
        let mut seen = vec![Seen::default(); facts.len()];
        for (id, own) in (1..).zip(&findings.seen) {
            identities.ancestors(id).for_each(|at| seen[at as usize].join(own));
        }
        for (fact, seen) in facts.iter_mut().zip(&seen).filter(|(_, seen)| seen.pixels > 0) {
            fact.photos = Some(seen.photos.iter().map(|bits| bits.count_ones() as usize).sum());
            (fact.confidence, fact.guessed) = (Some(seen.confidence), seen.guessed);
        }
        for (k, conflict) in findings.conflicts.iter().enumerate() {
            for id in conflict.what.about() {
                for at in identities.ancestors(id) {
                    let conflicts = &mut facts[at as usize].conflicts;
                    // A disagreement on several of its parts counts once.
                    if conflicts.last() != Some(&k) {
                        conflicts.push(k);
                    }
                }
            }
        }
        facts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Level;

    /// A doll with an eye, a cat; two photos.
    fn scene() -> (Identities, SegmentationReport) {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec!["doll".into()]);
        all.add(Level::Part, doll, vec!["eye".into()]);
        all.add(Level::Object, NO_IDENTITY, vec!["cat".into()]);
        let mut seen = vec![Seen::default(); 3];
        seen[0].add(0, 30, 0.5);
        seen[1].add(0, 10, 0.9);
        seen[1].add(40, 10, 0.7);
        let photo = |k: usize| PhotoFinding {
            name: format!("{k}.jpg"),
            unknown: if k == 0 { 0.41 } else { 0.0 },
            inferred: k as f64 * 0.01,
        };
        let conflicts = vec![
            MaskConflict { photo: 40, what: ConflictKind::Merge(vec![2, 3]) },
            MaskConflict { photo: 0, what: ConflictKind::Switch(1, 3) },
            MaskConflict { photo: 1, what: ConflictKind::Split(3) },
        ];
        let found = SegmentationReport::new((0..41).map(photo).collect(), seen, conflicts);
        assert!(found.is_valid(&all) && (found.unknown().expect("photos") - 0.01).abs() < 1e-9);
        (all, found)
    }

    #[test]
    fn what_is_told_of_an_object_includes_its_pieces() {
        let (all, found) = scene();
        let facts = SegmentationReport::facts(Some(&found), &all, &[5, 7, 2, 1]);
        let photos: Vec<_> = facts.iter().map(|f| f.photos).collect();
        assert_eq!(photos, [None, Some(2), Some(2), None], "a photo counts once, and nothing is known of the cat");
        let sure = facts[1].confidence.expect("seen");
        assert!((sure - (30.0 * 0.5 + 10.0 * 0.9 + 10.0 * 0.7) / 50.0).abs() < 1e-9, "{sure}");
        let conflicts: Vec<_> = facts.iter().map(|f| f.conflicts.clone()).collect();
        assert_eq!(conflicts, [vec![], vec![0, 1], vec![0], vec![0, 1, 2]]);
        assert_eq!(facts[1].gaussians, 7);
        let nothing = SegmentationReport::facts(None, &all, &[5, 7, 2, 1]);
        assert!(nothing.iter().all(|f| f.photos.is_none() && f.conflicts.is_empty()), "old scenes have none");
        let told = found.conflicts()[0].what.text(|id| all.full_name(id));
        assert!(told.starts_with("one mask covers ") && told.contains("cat") && told.ends_with("kept apart"), "{told}");
        assert_eq!(found.photo(&found.conflicts()[0]), "40.jpg");
    }

    #[test]
    fn the_photo_with_most_inferred_pixels_is_the_next_to_label() {
        let (_, mut found) = scene();
        assert_eq!(found.next_to_label(), Some(("40.jpg", 0.4)));
        found.photos.iter_mut().for_each(|p| p.inferred = 0.02);
        assert_eq!(found.next_to_label(), None, "the control: masks speak for nearly all");
        // Scenes of earlier versions do not say.
        let old: PhotoFinding = serde_json::from_str(r#"{"name": "a.jpg", "unknown": 0.5}"#).expect("read");
        assert_eq!(old.inferred, 0.0);
        assert_eq!(SegmentationReport::default().next_to_label(), None);
    }

    #[test]
    fn doubts_of_one_kind_are_told_in_one_sentence() {
        let merge = |photo: usize| (photo, ConflictKind::Merge(vec![1, 3]));
        let all = [merge(4), (2, ConflictKind::Drift(2)), merge(4), merge(7)];
        let told = ConflictKind::summary(&all, |photo| format!("{photo}.jpg"), |id| id.to_string());
        assert_eq!(
            told,
            [
                "4.jpg: one mask covers 1 and 3; they are kept apart (2 more like this, in 2 photos in all)",
                "2.jpg: 2 was tracked to a wrong place and is ignored there",
            ]
        );
    }

    #[test]
    fn what_still_holds_stays_when_numbers_change() {
        let (all, mut found) = scene();
        // The cat becomes the doll: what told them apart is settled, that there were two is not.
        found.renumber(&[0, 1, 2, 1], 2);
        let merged = [ConflictKind::Merge(vec![1, 2]), ConflictKind::Split(1)];
        assert_eq!(found.conflicts().iter().map(|d| d.what.clone()).collect::<Vec<_>>(), merged);
        let mut left = Identities::default();
        left.add(Level::Object, NO_IDENTITY, vec![]);
        left.add(Level::Part, 1, vec![]);
        assert!(found.is_valid(&left) && !found.is_valid(&all), "one identity less");
        found.add_identity();
        assert!(found.is_valid(&all));
        found.forget_seen(2);
        let facts = SegmentationReport::facts(Some(&found), &all, &[0; 4]);
        assert_eq!([facts[1].photos, facts[2].photos, facts[3].photos], [Some(1), None, None]);
    }

    #[test]
    fn what_speaks_of_nothing_that_is_there_is_refused() {
        let (all, found) = scene();
        for spoil in [
            |f: &mut SegmentationReport| f.conflicts[0].photo = 41,
            |f: &mut SegmentationReport| f.conflicts[0].what = ConflictKind::Drift(4),
            |f: &mut SegmentationReport| f.photos[0].unknown = f64::NAN,
            |f: &mut SegmentationReport| f.seen[1].photos.push(1),
            |f: &mut SegmentationReport| f.seen[1].confidence = 2.0,
        ] {
            let mut spoiled = found.clone();
            spoil(&mut spoiled);
            assert!(!spoiled.is_valid(&all));
        }
        let conflicts = vec![MaskConflict { photo: 0, what: ConflictKind::Split(1) }; MAX_CONFLICTS + 5];
        let many = SegmentationReport::new(found.photos.clone(), found.seen.clone(), conflicts);
        assert!(many.is_valid(&all) && many.conflicts().len() == MAX_CONFLICTS);
    }
}
