//! Known objects that a selection takes most of.

use crate::jobs::select::SelectFor;
use crate::math::format;
use crate::scene::{IdentityId, NO_IDENTITY, SemanticMap};

/// An object of which a selection takes more than half.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TakenObject {
    pub(super) from: IdentityId,
    /// Number of its Gaussians that are taken, and of all of them.
    taken: usize,
    of: usize,
}

impl TakenObject {
    /// The objects of which these Gaussians are more than half, by falling number.
    pub(super) fn all_of(map: &SemanticMap, gaussians: &[u32]) -> Vec<Self> {
        let mut counts = vec![[0_usize; 2]; map.identities.len() + 1];
        let object = |of: &u32| map.identities.get(*of).map(|_| map.identities.object_of(*of) as usize);
        let objects: Vec<usize> = (0..counts.len() as u32).map(|id| object(&id).unwrap_or(0)).collect();
        let mut add = |id: Option<&IdentityId>, i: usize| {
            if let Some(counts) = id.and_then(|id| objects.get(*id as usize)).and_then(|of| counts.get_mut(*of)) {
                counts[i] += 1;
            }
        };
        map.identity_of.iter().for_each(|id| add(Some(id), 1));
        gaussians.iter().for_each(|i| add(map.identity_of.get(*i as usize), 0));
        let objects = counts.into_iter().enumerate().skip(1);
        let mut all: Vec<Self> = objects.map(|(id, [taken, of])| Self { from: id as IdentityId, taken, of }).collect();
        all.retain(|object| 2 * object.taken > object.of);
        all.sort_by_key(|object| std::cmp::Reverse(object.taken));
        all
    }

    /// True if the loss is not what the selection is for.
    pub(super) fn surprises(&self, purpose: &SelectFor, map: &SemanticMap) -> bool {
        match purpose {
            SelectFor::New(NO_IDENTITY) => true,
            SelectFor::New(id) | SelectFor::Extent(id) => map.identities.object_of(*id) != self.from,
        }
    }

    /// A sentence such as "Takes 2,896 of the 2,900 Gaussians of cookie jar."
    pub(super) fn text(&self, name: &str) -> String {
        let [taken, of] = [self.taken, self.of].map(|n| format::count(n as u64));
        format!("Takes {taken} of the {of} Gaussians of {name}.")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Identities, Level};

    #[test]
    fn an_object_that_loses_most_of_itself_with_its_parts_is_told() {
        let mut all = Identities::default();
        let jar = all.add(Level::Object, NO_IDENTITY, vec!["cookie jar".into()]);
        let lid = all.add(Level::Part, jar, vec!["lid".into()]);
        let mug = all.add(Level::Object, NO_IDENTITY, vec!["mug".into()]);
        let map = SemanticMap::from_identities(all, vec![jar, jar, lid, mug, mug, 0], vec![1.0; 6], Vec::new());
        let taken = TakenObject::all_of(&map, &[1, 2, 3, 5]);
        assert_eq!(taken, [TakenObject { from: jar, taken: 2, of: 3 }], "half of the mug is not most of it");
        assert_eq!(taken[0].text("cookie jar"), "Takes 2 of the 3 Gaussians of cookie jar.");
        let told = |purpose| taken[0].surprises(&purpose, &map);
        assert!(told(SelectFor::New(NO_IDENTITY)) && told(SelectFor::Extent(mug)));
        assert!(!told(SelectFor::New(jar)) && !told(SelectFor::Extent(lid)), "a piece of it");
        assert_eq!(TakenObject::all_of(&map, &[]), []);
    }
}
