//! Labels of objects and parts on screen: their names or, without one, their appearance; and the answers to a list of
//! phrases.

use std::path::PathBuf;

use crate::jobs::phrases::PhraseRow;
use crate::scene::appearance::Appearance;
use crate::scene::{Identities, IdentityId};

/// Stand-in labels of unnamed identities, indexed by number - 1.
#[derive(Clone, Debug, Default)]
pub(crate) struct ScreenNames(Vec<Option<String>>);

impl ScreenNames {
    pub(crate) fn new(appearances: &[Option<Appearance>], meters_per_unit: Option<f64>) -> Self {
        Self(appearances.iter().map(|a| a.map(|a| a.text(meters_per_unit))).collect())
    }

    /// Stand-in label of an identity without a name.
    fn instead(&self, all: &Identities, id: IdentityId) -> Option<&str> {
        let unnamed = all.get(id).is_some_and(|i| i.names.is_empty());
        self.0.get((id as usize).checked_sub(1)?)?.as_deref().filter(|_| unnamed)
    }

    /// Label such as "kettle" or "pale blue region, 12 cm".
    pub(crate) fn name(&self, all: &Identities, id: IdentityId) -> String {
        self.instead(all, id).map_or_else(|| all.label(id), str::to_owned)
    }

    /// Label in the list of objects, which is narrow: "kettle" or "pale blue, 12 cm".
    pub(crate) fn name_in_list(&self, all: &Identities, id: IdentityId) -> String {
        self.instead(all, id).map_or_else(|| all.label(id), |text| text.replacen(" region, ", ", ", 1))
    }

    /// Label with the whole, such as "lid · kettle" or "pale blue region, 12 cm".
    pub(crate) fn full_name(&self, all: &Identities, id: IdentityId) -> String {
        self.instead(all, id).map_or_else(|| all.full_name(id), str::to_owned)
    }
}

/// Latest answers to a list of phrases.
#[derive(Clone, Debug, Default)]
pub struct PhraseTable {
    /// One row per phrase and view.
    pub rows: Vec<PhraseRow>,
    /// Folder of the masks, if they were written.
    pub(crate) written: Option<PathBuf>,
}

impl PhraseTable {
    pub(crate) fn finished(&mut self, rows: Vec<PhraseRow>, written: Option<PathBuf>) {
        *self = Self { rows, written };
    }
}

/// Share of the largest region's Gaussians below which an unnamed region is tiny.
const TINY: f64 = 0.01;

/// Identities in the order of the list: named ones in their order, then unnamed ones by falling size. Tiny unnamed ones
/// are returned separately.
pub(crate) fn listed(all: &Identities, sizes: &[usize], ids: Vec<IdentityId>) -> (Vec<IdentityId>, Vec<IdentityId>) {
    let size = |id: &IdentityId| sizes.get(*id as usize).copied().unwrap_or(0);
    let is_named = |id: &IdentityId| all.get(*id).is_some_and(|i| !i.names.is_empty());
    let (mut named, mut others): (Vec<_>, Vec<_>) = ids.into_iter().partition(is_named);
    others.sort_by_key(|id| std::cmp::Reverse(size(id)));
    let least = others.first().map_or(0.0, |id| TINY * size(id) as f64);
    let tiny = others.split_off(others.partition_point(|id| size(id) as f64 >= least));
    named.append(&mut others);
    (named, tiny)
}

/// The text with a capital first letter.
pub(super) fn sentence(what: &str) -> String {
    let mut letters = what.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Level, NO_IDENTITY};

    #[test]
    fn the_large_come_first_the_tiny_apart_and_names_as_they_were() {
        let mut all = Identities::default();
        for name in ["", "mug", "", "", "lamp"] {
            all.add(Level::Object, NO_IDENTITY, if name.is_empty() { vec![] } else { vec![name.into()] });
        }
        let sizes = [0, 20, 1, 19, 2_000, 3];
        let ids: Vec<IdentityId> = (1..=5).collect();
        assert_eq!(listed(&all, &sizes, ids), (vec![2, 5, 4, 1], vec![3]));
        assert_eq!(listed(&all, &[], vec![1, 3]), (vec![1, 3], vec![]), "nothing is counted yet");
    }

    #[test]
    fn a_name_comes_before_what_something_looks_like() {
        let mut all = Identities::default();
        let region = all.add(Level::Object, NO_IDENTITY, vec![]);
        let part = all.add(Level::Part, region, vec![]);
        let labels = ScreenNames(vec![Some("red region, 2 cm".into()), None]);
        assert_eq!(labels.name(&all, region), "red region, 2 cm");
        assert_eq!(labels.name_in_list(&all, region), "red, 2 cm");
        assert_eq!((labels.name(&all, part), labels.full_name(&all, part)), ("#2".into(), "#2 · #1".into()));
        all.rename(region, "apple");
        assert_eq!(labels.name_in_list(&all, region), "apple", "the control");
        assert_eq!((labels.name(&all, region), labels.full_name(&all, part)), ("apple".into(), "#2 · apple".into()));
        assert_eq!(labels.name(&all, NO_IDENTITY), "nothing");
    }
}
