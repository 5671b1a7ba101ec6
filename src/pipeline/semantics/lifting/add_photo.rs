//! Adds the objects and parts of one more photo to a known map; labeled Gaussians keep their labels.

use super::edit::add;
use super::tracker::Tracked;
use super::votes::UNKNOWN;
use crate::scene::{IdentityId, NO_IDENTITY, Photo, SemanticMap};

/// Least number of Gaussians of a new object or part.
const LEAST: usize = 4;

/// Returns the map `known` with the identities of `tracked` added to it.
pub(crate) fn joined(known: &SemanticMap, tracked: &Tracked, photos: &[Photo]) -> SemanticMap {
    let mut map = known.clone();
    let all = &tracked.identities;
    let old = known.identities.len() as IdentityId;
    let mut own: Vec<Vec<usize>> = vec![Vec::new(); all.len() + 1];
    let free = tracked.assignments.iter().enumerate().filter(|(i, _)| known.identity_of[*i] == NO_IDENTITY);
    for (i, assignment) in free.filter(|(_, a)| a.identity != UNKNOWN) {
        own[assignment.identity as usize].push(i);
    }
    // New numbers in the map; wholes come before their pieces.
    let mut number: Vec<IdentityId> = (0..=old).collect();
    for (id, identity) in all.iter().skip(old as usize) {
        let inside = all.descendants(id);
        let size: usize = own.iter().zip(&inside).filter(|(_, is_in)| **is_in).map(|(own, _)| own.len()).sum();
        let whole = number[identity.parent as usize];
        let is_one = size >= LEAST && (identity.parent == NO_IDENTITY || whole != NO_IDENTITY);
        let name = identity.names.first().cloned().unwrap_or_default();
        let new = if is_one { add(&mut map, identity.level, whole, name, &[]) } else { NO_IDENTITY };
        map.identities.mark_by_hand(new);
        number.push(new);
    }
    for (id, gaussians) in own.iter().enumerate() {
        let now = number[id];
        if now == NO_IDENTITY && id != NO_IDENTITY as usize {
            continue;
        }
        let codes = map.identities.codes(now);
        for &i in gaussians {
            (map.identity_of[i], map.codes[i], map.margin[i]) = (now, codes, tracked.assignments[i].margin);
        }
    }
    let seeds = tracked.seeds.iter().map(|&i| photos[i].name.clone()).filter(|name| !known.seeds.contains(name));
    map.seeds.extend(seeds);
    let mut findings = tracked.findings(photos);
    findings.renumber(&number, map.identities.len());
    if let Some(before) = &known.findings {
        findings.keep_conflicts(before);
    }
    map.findings = Some(findings);
    map
}

/// Describes in words the additions to a map.
pub(crate) fn summary(known: &SemanticMap, map: &SemanticMap) -> String {
    let new = map.identities.len() - known.identities.len();
    let count = |is: &dyn Fn(usize) -> bool| (0..map.identity_of.len()).filter(|i| is(*i)).count();
    let taken = count(&|i| known.identity_of[i] == NO_IDENTITY && map.identity_of[i] != NO_IDENTITY);
    let unknown = count(&|i| map.is_unknown(i));
    let [new, taken, unknown] = [new, taken, unknown].map(|n| crate::math::format::count(n as u64));
    format!("{new} new objects and parts; {taken} Gaussians were nobody's before, {unknown} are unknown")
}
