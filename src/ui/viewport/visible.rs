//! Which identities are drawn: hidden ones left out, or one alone.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::scene::{GaussianCloud, Identities, IdentityId, NOBODY, SemanticMap};
use crate::worker::Versioned;

/// What of a scene is drawn.
#[derive(Clone, Debug, Default)]
pub(crate) struct Visibility {
    /// Whose own Gaussians are left out; nobody's have the number of nobody.
    hidden: BTreeSet<IdentityId>,
    /// The Gaussians that are left, with what they were made from.
    left: Option<Left>,
}

#[derive(Clone, Debug)]
struct Left {
    of: (u64, u64),
    cloud: Versioned<GaussianCloud>,
    semantics: Versioned<SemanticMap>,
}

impl Visibility {
    /// Whether anything is left out.
    pub(crate) fn is_partial(&self) -> bool {
        !self.hidden.is_empty()
    }

    /// Whether what belongs to nobody is left out: only some objects or parts are shown.
    pub(crate) fn is_isolated(&self) -> bool {
        self.hidden.contains(&NOBODY)
    }

    /// Whether an identity is drawn with its pieces; `None` if only some of them are.
    pub(crate) fn draws(&self, all: &Identities, id: IdentityId) -> Option<bool> {
        let mut drawn = pieces(all, id).map(|i| !self.hidden.contains(&i));
        let first = drawn.next().unwrap_or(true);
        drawn.all(|d| d == first).then_some(first)
    }

    /// Identities whose own Gaussians are left out.
    pub(crate) fn hidden(&self) -> &BTreeSet<IdentityId> {
        &self.hidden
    }

    /// Leaves out these and no others.
    pub(crate) fn set_hidden(&mut self, ids: impl IntoIterator<Item = IdentityId>) {
        *self = Self { hidden: ids.into_iter().collect(), left: None };
    }

    /// Hides an identity with its pieces, or shows them again if none is drawn.
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

    /// Shows one identity with its pieces alone; `None` shows all.
    pub(crate) fn isolate(&mut self, all: &Identities, only: Option<IdentityId>) {
        let inside = only.map_or_else(Vec::new, |id| all.descendants(id));
        self.set_hidden((0..).zip(inside).filter(|(_, inside)| !inside).map(|(id, _)| id));
    }

    /// Follows identities to their new numbers: each keeps its code.
    pub(crate) fn renumber(&mut self, old: &Identities, new: &Identities) {
        let now = |id: &IdentityId| match old.get(*id) {
            None => Some(NOBODY),
            Some(identity) => new.iter().find(|(_, i)| i.code == identity.code).map(|(id, _)| id),
        };
        self.set_hidden(self.hidden.iter().filter_map(now).collect::<Vec<_>>());
    }

    /// The Gaussians to draw and what they belong to.
    pub(crate) fn apply(
        &mut self,
        cloud: &Versioned<GaussianCloud>,
        semantics: &Versioned<SemanticMap>,
    ) -> (Versioned<GaussianCloud>, Versioned<SemanticMap>) {
        if !self.is_partial() || semantics.identity_of.len() != cloud.len() {
            return (cloud.clone(), semantics.clone());
        }
        let of = (cloud.generation(), semantics.generation());
        if self.left.as_ref().is_none_or(|l| l.of != of) {
            let kept: Vec<usize> =
                (0..cloud.len()).filter(|&i| !self.hidden.contains(&semantics.identity_of[i])).collect();
            let (cloud, semantics) = (cloud.select(&kept), semantics.select(&kept));
            let (cloud, semantics) = (Versioned::new(Arc::new(cloud)), Versioned::new(Arc::new(semantics)));
            self.left = Some(Left { of, cloud, semantics });
        }
        match &self.left {
            Some(l) => (l.cloud.clone(), l.semantics.clone()),
            None => (cloud.clone(), semantics.clone()),
        }
    }
}

/// An identity and all its pieces.
fn pieces(all: &Identities, id: IdentityId) -> impl Iterator<Item = IdentityId> {
    (0..).zip(all.descendants(id)).filter(|(_, inside)| *inside).map(|(id, _)| id)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Level;

    #[test]
    fn what_is_hidden_is_not_drawn() {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NOBODY, vec![]);
        let eye = all.add(Level::Part, doll, vec![]);
        let cat = all.add(Level::Object, NOBODY, vec![]);
        let map = SemanticMap::from_identities(all, vec![doll, eye, cat, NOBODY], vec![1.0; 4], vec![]);
        let map = Versioned::new(Arc::new(map));
        let n = 4;
        let cloud = GaussianCloud::isotropic((0..n).map(|i| [i as f32, 0.0, 0.0]).collect(), 0.0, 0.0);
        let cloud = Versioned::new(Arc::new(cloud));
        let mut v = Visibility::default();
        let xs = |v: &mut Visibility| {
            let (cloud, map) = v.apply(&cloud, &map);
            assert_eq!(cloud.len(), map.identity_of.len());
            cloud.positions.iter().map(|p| p[0] as i32).collect::<Vec<_>>()
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
        assert_eq!((xs(&mut v).len(), v.is_partial()), (4, false));
    }

    #[test]
    fn what_is_hidden_stays_hidden_under_another_number() {
        let named = |codes: &[f32]| {
            let mut all = Identities::default();
            for code in codes {
                let id = all.add(Level::Object, NOBODY, vec![]);
                all.get_mut(id).expect("there").code = [*code; 3];
            }
            all
        };
        let (old, new) = (named(&[0.1, 0.2, 0.3]), named(&[0.2, 0.3]));
        let mut v = Visibility::default();
        v.set_hidden([NOBODY, 1, 3]);
        v.renumber(&old, &new);
        assert_eq!(v.hidden().iter().copied().collect::<Vec<_>>(), [NOBODY, 2], "the first is gone");
    }
}
