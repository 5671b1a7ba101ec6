//! The drawn part of a scene: hidden identities left out, or one isolated, inside a crop box.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::splat_selection::SplatSelection;
use crate::scene::{CropBox, GaussianCloud, Identities, IdentityId, NO_IDENTITY, SemanticMap};
use crate::worker::Versioned;

/// Visibility of the Gaussians of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Visibility {
    /// Identities whose own Gaussians are hidden; `NO_IDENTITY` for unlabeled Gaussians.
    hidden: BTreeSet<IdentityId>,
    /// Crop box of the rest.
    crop: Option<CropBox>,
    /// Gaussians chosen for deletion.
    chosen: Option<Arc<SplatSelection>>,
    /// The drawn Gaussians, with the generations of their sources.
    left: Option<((u64, Option<u64>), VisibleCloud)>,
}

/// The drawn Gaussians.
#[derive(Clone, Debug)]
pub(crate) struct VisibleCloud {
    pub(crate) cloud: Versioned<GaussianCloud>,
    pub(crate) semantics: Option<Versioned<SemanticMap>>,
    /// Their numbers in the whole cloud, if they are a part of it.
    pub(crate) numbers: Option<Arc<Vec<usize>>>,
}

impl Visibility {
    /// True if anything is hidden.
    pub(crate) fn is_partial(&self) -> bool {
        !self.hidden.is_empty()
    }

    /// True if unlabeled Gaussians are hidden: only some objects or parts are shown.
    pub(crate) fn is_isolated(&self) -> bool {
        self.hidden.contains(&NO_IDENTITY)
    }

    /// True if an identity is drawn with its parts; `None` if only some of them are.
    pub(crate) fn draws(&self, all: &Identities, id: IdentityId) -> Option<bool> {
        let mut drawn = pieces(all, id).map(|i| !self.hidden.contains(&i));
        let first = drawn.next().unwrap_or(true);
        drawn.all(|d| d == first).then_some(first)
    }

    /// Identities whose own Gaussians are hidden.
    pub(crate) fn hidden(&self) -> &BTreeSet<IdentityId> {
        &self.hidden
    }

    /// Hides only these identities.
    pub(crate) fn set_hidden(&mut self, ids: impl IntoIterator<Item = IdentityId>) {
        (self.hidden, self.left) = (ids.into_iter().collect(), None);
    }

    /// Crop box of all that is not hidden.
    pub(crate) fn crop(&self) -> Option<CropBox> {
        self.crop
    }

    /// Sets the crop box of all that is not hidden.
    pub(crate) fn set_crop(&mut self, crop: Option<CropBox>) {
        if self.crop != crop {
            (self.crop, self.left) = (crop, None);
        }
    }

    /// Sets the Gaussians chosen for deletion.
    pub(crate) fn set_chosen(&mut self, chosen: Option<Arc<SplatSelection>>) {
        if self.chosen != chosen {
            (self.chosen, self.left) = (chosen, None);
        }
    }

    /// Hides an identity with its parts, or shows them again if none is drawn.
    pub(crate) fn toggle(&mut self, all: &Identities, id: IdentityId) {
        let hide = self.draws(all, id) != Some(false);
        for piece in pieces(all, id) {
            if hide {
                self.hidden.insert(piece)
            } else {
                self.hidden.remove(&piece)
            };
        }
        self.left = None;
    }

    /// Shows only one identity with its parts; `None` shows all.
    pub(crate) fn isolate(&mut self, all: &Identities, only: Option<IdentityId>) {
        let inside = only.map_or_else(Vec::new, |id| all.descendants(id));
        self.set_hidden((0..).zip(inside).filter(|(_, inside)| !inside).map(|(id, _)| id));
    }

    /// Maps hidden identities to their new numbers: each keeps its code.
    pub(crate) fn renumber(&mut self, old: &Identities, new: &Identities) {
        let now = |id: &IdentityId| match old.get(*id) {
            None => Some(NO_IDENTITY),
            Some(identity) => new.iter().find(|(_, i)| i.code == identity.code).map(|(id, _)| id),
        };
        self.set_hidden(self.hidden.iter().filter_map(now).collect::<Vec<_>>());
    }

    /// Reason why no Gaussian of an identity is drawn, for the user; `None` if one is.
    pub(crate) fn why_not_drawn(&self, all: &Identities, id: IdentityId) -> Option<&'static str> {
        if self.draws(all, id) == Some(false) {
            return Some("hidden");
        }
        self.crop?;
        let (_, visible) = self.left.as_ref()?;
        let inside = all.descendants(id);
        let is_of = |of: &IdentityId| inside.get(*of as usize) == Some(&true);
        let is_left = visible.semantics.as_ref()?.identity_of.iter().any(is_of);
        (!is_left).then_some("outside the crop box")
    }

    /// The numbers of the drawn Gaussians, if not all.
    pub(super) fn numbers(&self) -> Option<Arc<Vec<usize>>> {
        self.left.as_ref().and_then(|(_, visible)| visible.numbers.clone())
    }

    /// Number of drawn Gaussians, if not all.
    pub(crate) fn count(&self) -> Option<usize> {
        let hides = self.chosen.as_ref().is_none_or(|chosen| chosen.hide);
        let leaves_out = hides || self.crop.is_some() || !self.hidden.is_empty();
        self.left.as_ref().filter(|_| leaves_out).map(|(_, visible)| visible.cloud.len())
    }

    /// The Gaussians to draw and their identities.
    pub(crate) fn apply(
        &mut self,
        cloud: &Versioned<GaussianCloud>,
        semantics: Option<&Versioned<SemanticMap>>,
    ) -> VisibleCloud {
        let all = || VisibleCloud { cloud: cloud.clone(), semantics: semantics.cloned(), numbers: None };
        let fits = semantics.is_none_or(|map| map.identity_of.len() == cloud.len());
        let chosen = self.chosen.as_deref().filter(|chosen| chosen.of.len() == cloud.len());
        let all_drawn = self.crop.is_none() && chosen.is_none() && (self.hidden.is_empty() || semantics.is_none());
        if !fits || all_drawn {
            self.left = None;
            return all();
        }
        let of = (cloud.generation(), semantics.map(Versioned::generation));
        if let Some((_, visible)) = self.left.as_ref().filter(|(made_of, _)| *made_of == of) {
            return visible.clone();
        }
        let drawn = |i: &usize| {
            semantics.is_none_or(|map| !self.hidden.contains(&map.identity_of[*i]))
                && self.crop.is_none_or(|crop| crop.keeps(cloud.world_position(*i)))
                && chosen.is_none_or(|chosen| chosen.draws(*i))
        };
        let kept: Vec<usize> = (0..cloud.len()).filter(drawn).collect();
        let mut left = cloud.select(&kept);
        chosen.into_iter().for_each(|chosen| chosen.mark(&mut left, &kept));
        let visible = VisibleCloud {
            cloud: Versioned::new(Arc::new(left)),
            semantics: semantics.map(|map| Versioned::new(Arc::new(map.select(&kept)))),
            numbers: Some(Arc::new(kept)),
        };
        self.left = Some((of, visible.clone()));
        visible
    }
}

/// An identity and all its parts.
fn pieces(all: &Identities, id: IdentityId) -> impl Iterator<Item = IdentityId> {
    (0..).zip(all.descendants(id)).filter(|(_, inside)| *inside).map(|(id, _)| id)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Bounds, Level};

    #[test]
    fn what_is_hidden_is_not_drawn() {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec![]);
        let eye = all.add(Level::Part, doll, vec![]);
        let cat = all.add(Level::Object, NO_IDENTITY, vec![]);
        let map = SemanticMap::from_identities(all, vec![doll, eye, cat, NO_IDENTITY], vec![1.0; 4], vec![]);
        let map = Versioned::new(Arc::new(map));
        let n = 4;
        let cloud = GaussianCloud::isotropic((0..n).map(|i| [i as f32, 0.0, 0.0]).collect(), 0.0, 0.0);
        let cloud = Versioned::new(Arc::new(cloud));
        let mut v = Visibility::default();
        let xs = |v: &mut Visibility| {
            let visible = v.apply(&cloud, Some(&map));
            assert_eq!(Some(visible.cloud.len()), visible.semantics.map(|map| map.identity_of.len()));
            let xs: Vec<i32> = visible.cloud.positions.iter().map(|p| p[0] as i32).collect();
            let numbers = visible.numbers.map_or_else(|| vec![0, 1, 2, 3], |numbers| numbers.to_vec());
            assert_eq!(xs, numbers.into_iter().map(|i| i as i32).collect::<Vec<_>>(), "each knows its number");
            xs
        };
        let all = &map.identities;
        assert_eq!(xs(&mut v), [0, 1, 2, 3]);
        v.toggle(all, eye);
        assert_eq!((xs(&mut v), v.draws(all, eye), v.draws(all, doll)), (vec![0, 2, 3], Some(false), None));
        v.toggle(all, doll);
        assert_eq!((xs(&mut v), v.draws(all, doll)), (vec![2, 3], Some(false)), "all of it goes first");
        v.toggle(all, eye);
        assert_eq!(xs(&mut v), [1, 2, 3], "a piece can be shown without its whole");
        v.isolate(all, Some(doll));
        assert_eq!((xs(&mut v), v.draws(all, doll), v.draws(all, cat)), (vec![0, 1], Some(true), Some(false)));
        v.toggle(all, cat);
        assert_eq!(xs(&mut v), [0, 1, 2], "a tick adds to what is isolated");
        v.isolate(all, None);
        assert_eq!((xs(&mut v).len(), v.is_partial(), v.count()), (4, false, None));

        let bounds = Bounds { min: DVec3::new(0.5, -1.0, -1.0), max: DVec3::new(2.5, 1.0, 1.0) };
        let crop = CropBox { bounds, outside: false };
        v.set_crop(Some(crop));
        assert_eq!((xs(&mut v), v.count()), (vec![1, 2], Some(2)));
        v.toggle(all, eye);
        assert_eq!(xs(&mut v), [2], "hidden and cropped");
        v.set_crop(Some(CropBox { outside: true, ..crop }));
        assert_eq!(xs(&mut v), [0, 3]);
        let alone = v.apply(&cloud, None);
        assert_eq!((alone.cloud.len(), alone.semantics.is_none()), (2, true), "a scene without objects is cropped too");
        v.set_crop(None);
        assert_eq!(xs(&mut v), [0, 2, 3]);
    }

    #[test]
    fn what_is_hidden_stays_hidden_under_another_number() {
        let named = |codes: &[f32]| {
            let mut all = Identities::default();
            for code in codes {
                let id = all.add(Level::Object, NO_IDENTITY, vec![]);
                all.get_mut(id).expect("there").code = [*code; 3];
            }
            all
        };
        let (old, new) = (named(&[0.1, 0.2, 0.3]), named(&[0.2, 0.3]));
        let mut v = Visibility::default();
        v.set_hidden([NO_IDENTITY, 1, 3]);
        v.renumber(&old, &new);
        assert_eq!(v.hidden().iter().copied().collect::<Vec<_>>(), [NO_IDENTITY, 2], "the first is gone");
    }
}
