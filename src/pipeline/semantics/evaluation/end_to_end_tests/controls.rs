//! Controls that must fail the limits: scenes that are harmed before they are queried.

use crate::pipeline::semantics::relevancy::deviate;
use crate::scene::{Identities, IdentityId, Level, PART_WEIGHT, SemanticMap};

/// Fault made in a scene before it is queried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fault {
    Nothing,
    /// Everything has the name of another thing, or another part.
    Names,
    /// Everything has the looks of another thing, or another part.
    Looks,
    /// Parts take most of their whole's looks.
    Deviation,
    /// Canonical phrases mean nothing, so that anything is more relevant.
    Canonical,
}

/// Place of each identity after all have moved on to the next of their level.
fn next_of_level(identities: &Identities) -> Vec<usize> {
    let of_level = |level: Level| identities.iter().filter(move |(_, i)| i.level == level).map(|(id, _)| id);
    let mut next: Vec<usize> = (0..identities.len()).collect();
    for level in [Level::Object, Level::Part] {
        let all: Vec<IdentityId> = of_level(level).collect();
        // Far enough that a part goes to another thing.
        let step = all.len() / 2;
        all.iter().enumerate().for_each(|(k, id)| next[*id as usize - 1] = all[(k + step) % all.len()] as usize - 1);
    }
    next
}

pub(super) fn with_fault(map: &SemanticMap, fault: Fault) -> SemanticMap {
    let mut map = map.clone();
    let next = next_of_level(&map.identities);
    match (fault, &mut map.language) {
        (Fault::Names, _) => {
            let names: Vec<Vec<String>> = map.identities.iter().map(|(_, i)| i.names.clone()).collect();
            for (k, from) in next.iter().enumerate() {
                if let Some(identity) = map.identities.get_mut(k as IdentityId + 1) {
                    identity.names = names[*from].clone();
                }
            }
        }
        (Fault::Looks, Some(language)) => {
            language.by_identity = next.iter().map(|k| language.by_identity[*k].clone()).collect()
        }
        (Fault::Deviation, Some(language)) => {
            let wholes = language.by_identity.clone();
            for (id, identity) in map.identities.iter().filter(|(_, i)| i.level == Level::Part) {
                let whole = &wholes[map.identities.object_of(id) as usize - 1].raw;
                let of = &mut language.by_identity[id as usize - 1];
                let Some(whole) = whole.first() else { continue };
                let exchanged = |raw: &Vec<f32>| deviate(whole, raw, PART_WEIGHT).expect("a direction");
                of.deviated = of.raw.iter().map(exchanged).collect();
                assert_ne!(identity.parent, 0);
            }
        }
        _ => {}
    }
    map
}
