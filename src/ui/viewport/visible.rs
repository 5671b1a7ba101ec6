//! Which identities are drawn: hidden ones left out, or one alone.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::scene::{GaussianCloud, IdentityId, SemanticMap};
use crate::worker::Versioned;

/// What of a scene is drawn.
#[derive(Clone, Debug, Default)]
pub(crate) struct Visibility {
    hidden: BTreeSet<IdentityId>,
    only: Option<IdentityId>,
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
        self.only.is_some() || !self.hidden.is_empty()
    }

    /// Whether one identity is shown alone.
    pub(crate) fn is_isolated(&self) -> bool {
        self.only.is_some()
    }

    /// Whether an identity was hidden itself.
    pub(crate) fn is_hidden(&self, id: IdentityId) -> bool {
        self.hidden.contains(&id)
    }

    /// Identities that were hidden themselves.
    pub(crate) fn hidden(&self) -> impl Iterator<Item = IdentityId> + '_ {
        self.hidden.iter().copied()
    }

    /// Hides these and no others.
    pub(crate) fn set_hidden(&mut self, ids: impl IntoIterator<Item = IdentityId>) {
        *self = Self { hidden: ids.into_iter().collect(), ..Self::default() };
    }

    /// Hides an identity, or shows it again.
    pub(crate) fn toggle(&mut self, id: IdentityId) {
        if !self.hidden.remove(&id) {
            self.hidden.insert(id);
        }
        self.left = None;
    }

    /// Shows one identity alone; `None` shows all.
    pub(crate) fn isolate(&mut self, only: Option<IdentityId>) {
        *self = Self { only, ..Self::default() };
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
            let shown = self.shown(semantics);
            let kept: Vec<usize> = (0..cloud.len())
                .filter(|&i| shown.get(semantics.identity_of[i] as usize).copied().unwrap_or(true))
                .collect();
            let (cloud, semantics) = (cloud.select(&kept), semantics.select(&kept));
            let (cloud, semantics) = (Versioned::new(Arc::new(cloud)), Versioned::new(Arc::new(semantics)));
            self.left = Some(Left { of, cloud, semantics });
        }
        match &self.left {
            Some(l) => (l.cloud.clone(), l.semantics.clone()),
            None => (cloud.clone(), semantics.clone()),
        }
    }

    /// For each number from 0, whether it is drawn.
    fn shown(&self, semantics: &SemanticMap) -> Vec<bool> {
        let all = &semantics.identities;
        let mut shown = match self.only {
            Some(id) => all.descendants(id),
            None => vec![true; all.len() + 1],
        };
        for &id in &self.hidden {
            shown.iter_mut().zip(all.descendants(id)).for_each(|(s, inside)| *s &= !inside);
        }
        shown
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Identities, Level, NOBODY};

    #[test]
    fn what_is_hidden_is_not_drawn() {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NOBODY, vec![]);
        let eye = all.add(Level::Part, doll, vec![]);
        let cat = all.add(Level::Object, NOBODY, vec![]);
        let map = SemanticMap::from_identities(all, vec![doll, eye, cat, NOBODY], vec![1.0; 4], vec![]);
        let map = Versioned::new(Arc::new(map));
        let n = 4;
        let cloud = GaussianCloud {
            positions: (0..n).map(|i| [i as f32, 0.0, 0.0]).collect(),
            log_scales: vec![[0.0; 3]; n],
            quaternions: vec![[1.0, 0.0, 0.0, 0.0]; n],
            opacity_logits: vec![0.0; n],
            sh: vec![[0.0; 3]; n],
            ..GaussianCloud::default()
        };
        let cloud = Versioned::new(Arc::new(cloud));
        let mut v = Visibility::default();
        let xs = |v: &mut Visibility| {
            let (cloud, map) = v.apply(&cloud, &map);
            assert_eq!(cloud.len(), map.identity_of.len());
            cloud.positions.iter().map(|p| p[0] as i32).collect::<Vec<_>>()
        };
        assert_eq!(xs(&mut v), [0, 1, 2, 3]);
        v.toggle(eye);
        assert_eq!((xs(&mut v), v.is_hidden(eye)), (vec![0, 2, 3], true));
        v.toggle(doll);
        assert_eq!(xs(&mut v), [2, 3]);
        v.isolate(Some(doll));
        assert_eq!(xs(&mut v), [0, 1]);
        v.isolate(None);
        assert_eq!((xs(&mut v).len(), v.is_partial()), (4, false));
    }
}
