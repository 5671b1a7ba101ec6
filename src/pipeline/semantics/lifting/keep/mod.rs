//! Edited objects kept in a new search: their Gaussians stay theirs, and the search finds no second copy of them.

use std::collections::{BTreeMap, BTreeSet};

use super::edit::{free_code, renumber};
use crate::scene::{IdentityId, NO_IDENTITY, SemanticMap};

/// Least number of Gaussians that must be left of a found object or part.
const LEAST: usize = 4;

/// Returns the objects of a map that the user has edited, with all of their parts, and nothing else; `None` if there
/// are none.
pub(crate) fn worked_on(map: &SemanticMap) -> Option<SemanticMap> {
    let all = &map.identities;
    let objects: BTreeSet<IdentityId> = map.by_hand().into_iter().map(|id| all.object_of(id)).collect();
    let mut kept = map.clone();
    renumber(&mut kept, |id| !objects.contains(&all.object_of(id)), None);
    (!objects.is_empty()).then_some(kept)
}

/// Joins the map that was `found` with the `kept` one, which comes first and keeps its numbers. A found identity that
/// lies mostly in a kept one is that one; its remaining pieces become pieces of it. Without language features: the
/// result has not been embedded.
pub(crate) fn joined(found: &SemanticMap, kept: &SemanticMap) -> SemanticMap {
    let (all, old) = (&found.identities, &kept.identities);
    let twin = twins(found, kept);
    let is_gone = |id: IdentityId| twin[id as usize] != NO_IDENTITY;
    let mut identities = old.clone();
    identities.blur_px2 = all.blur_px2;
    identities.add_removed(all.removed.iter().cloned());
    // New numbers of the found identities; for one that is gone, that of the next larger one that is not.
    let mut number = vec![NO_IDENTITY; all.len() + 1];
    let mut stays = vec![false; all.len() + 1];
    for (id, identity) in all.iter() {
        let parent = identity.parent;
        if is_gone(id) {
            number[id as usize] = number[parent as usize];
            continue;
        }
        let whole = if is_gone(parent) { twin[parent as usize] } else { number[parent as usize] };
        let now = identities.add(identity.level, whole, identity.names.clone());
        identities.get_mut(now).into_iter().for_each(|new| new.code = identity.code);
        number[id as usize] = now;
        stays[id as usize] = parent == NO_IDENTITY || stays[parent as usize];
    }
    for id in 1..=old.len() as IdentityId {
        let code = free_code(&identities);
        identities.get_mut(id).into_iter().for_each(|identity| identity.code = code);
    }
    let n = found.identity_of.len();
    let is_kept = |i: usize| kept.identity_of[i] != NO_IDENTITY;
    let now = |i: usize| if is_kept(i) { kept.identity_of[i] } else { number[found.identity_of[i] as usize] };
    let identity_of = (0..n).map(now).collect();
    let margin = (0..n).map(|i| if is_kept(i) { kept.margin[i] } else { found.margin[i] }).collect();
    let mut map = SemanticMap::from_identities(identities, identity_of, margin, found.seeds.clone());
    // Codes may have been trained: those of unchanged identities stay.
    for i in (0..n).filter(|i| !is_kept(*i) && stays[found.identity_of[*i] as usize]) {
        map.codes[i] = found.codes[i];
    }
    map.prepared = found.prepared;
    map.findings.clone_from(&found.findings);
    if let Some(findings) = &mut map.findings {
        let of = |id: usize| if twin[id] != NO_IDENTITY { twin[id] } else { number[id] };
        let number: Vec<IdentityId> = (0..number.len()).map(of).collect();
        findings.renumber(&number, map.identities.len());
    }
    map
}

/// Returns the kept twin of each found identity, by number; nobody if little or nothing of it is kept.
fn twins(found: &SemanticMap, kept: &SemanticMap) -> Vec<IdentityId> {
    let (sizes, kept_sizes) = (found.sizes(), kept.sizes());
    let mut shared: Vec<BTreeMap<IdentityId, usize>> = vec![BTreeMap::new(); sizes.len()];
    let mut taken = vec![0; sizes.len()];
    for (of, by) in found.identity_of.iter().zip(&kept.identity_of).filter(|(_, by)| **by != NO_IDENTITY) {
        for id in found.identities.ancestors(*of) {
            taken[id as usize] += 1;
            for by in kept.identities.ancestors(*by) {
                *shared[id as usize].entry(by).or_default() += 1;
            }
        }
    }
    let twin = |id: usize| {
        let left = sizes[id] - taken[id];
        let is_gone = taken[id] > 0 && (taken[id] > left || left < LEAST);
        // The most alike; of a whole and its only piece the whole, which has the lower number.
        let alike = |by: IdentityId, both: usize| both as f64 / (sizes[id] + kept_sizes[by as usize] - both) as f64;
        let shared = shared[id].iter().map(|(by, both)| (*by, alike(*by, *both)));
        let most = shared.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        most.filter(|_| is_gone).map_or(NO_IDENTITY, |(by, _)| by)
    };
    (0..sizes.len()).map(twin).collect()
}

#[cfg(test)]
mod tests;
