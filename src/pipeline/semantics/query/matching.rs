//! Pixels and Gaussians of a target: those whose code is within a tolerance per channel of the target's.
//!
//! In `exact` mode a pixel has the code of the identity of largest weight, so at the usual tolerance
//! the match is that identity; a wider one takes in what lies near it in code space. In `blend` mode
//! a pixel has the alpha-blended codes of its Gaussians, as in the paper.

use serde::{Deserialize, Serialize};

use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::lifting::codes::matches;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::scene::{Identities, IdentityId, Level, Mask, SemanticMap};

/// Source of the codes of pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum, strum::Display)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum MatchMode {
    /// Codes of the winning identities
    #[default]
    Identities,
    /// Alpha-blended codes, as in the paper
    Codes,
    /// Relevancy over 20 % of LERF's scale, whatever the answer
    Relevancy,
}

/// Returns, for each number from 0, whether the identity matches the target: its code, or that of one of its wholes,
/// is within `tolerance` of the target's.
pub(crate) fn matching(identities: &Identities, target: IdentityId, tolerance: f32) -> Vec<bool> {
    let mut found = vec![false; identities.len() + 1];
    let Some(wanted) = identities.get(target) else { return found };
    for (id, identity) in identities.iter() {
        let own = identity.level == wanted.level && matches(identity.code, wanted.code, tolerance);
        found[id as usize] = id == target || own || found[identity.parent as usize];
    }
    found
}

/// Pixels of the target; by the winning identities if there are no blended codes.
pub(crate) fn pixels(
    (map, codes): (&ViewMap, Option<&CodeMap>),
    identities: &Identities,
    target: IdentityId,
    mode: MatchMode,
    tolerance: f32,
) -> Mask {
    match (codes, mode) {
        (Some(codes), MatchMode::Codes) => blend(codes, identities, target, tolerance),
        _ => exact(map, identities, target, tolerance),
    }
}

/// Pixels of the target by the winning identities.
pub(crate) fn exact(map: &ViewMap, identities: &Identities, target: IdentityId, tolerance: f32) -> Mask {
    let mut found = matching(identities, target, tolerance);
    // One more entry for numbers without an identity.
    found.push(false);
    let last = found.len() - 1;
    Mask::from_fn(map.width_px, map.height_px, |i| found[(map.identity[i] as usize).min(last)])
}

/// Pixels of the target by blended codes. Pieces of the target that have codes of their own belong to it.
pub fn blend(map: &CodeMap, identities: &Identities, target: IdentityId, tolerance: f32) -> Mask {
    let mut mask = Mask::empty(map.width_px, map.height_px);
    for (level, code) in codes_of(identities, target) {
        let [a, b, c] = map.level(level) else { continue };
        // Without parts there are no planes of theirs, and nothing that they could match.
        if a.is_empty() {
            continue;
        }
        let near = |v: f32, code: f32| (v - code).abs() <= tolerance;
        mask.add(&Mask::from_fn(map.width_px, map.height_px, |i| {
            near(a[i], code[0]) & near(b[i], code[1]) & near(c[i], code[2])
        }));
    }
    mask
}

/// Gaussians of the target, by the same match.
pub(crate) fn gaussians(map: &SemanticMap, target: IdentityId, mode: MatchMode, tolerance: f32) -> Vec<bool> {
    match mode {
        MatchMode::Identities | MatchMode::Relevancy => {
            let found = matching(&map.identities, target, tolerance);
            map.identity_of.iter().map(|id| found.get(*id as usize).copied().unwrap_or(false)).collect()
        }
        MatchMode::Codes => {
            let wanted = codes_of(&map.identities, target);
            let of_level = |codes: &[f32; 6], level| match level {
                Level::Object => [codes[0], codes[1], codes[2]],
                Level::Part => [codes[3], codes[4], codes[5]],
            };
            let one = |codes: &[f32; 6]| wanted.iter().any(|(l, code)| matches(of_level(codes, *l), *code, tolerance));
            map.codes.iter().map(one).collect()
        }
    }
}

/// Codes of the target: its own, and for a part those of its pieces.
fn codes_of(identities: &Identities, target: IdentityId) -> Vec<(Level, [f32; 3])> {
    let Some(wanted) = identities.get(target) else { return Vec::new() };
    let inside = identities.descendants(target);
    let meant = identities.iter().filter(|(id, i)| inside[*id as usize] && i.level == wanted.level);
    meant.map(|(_, i)| (i.level, i.code)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::NO_IDENTITY;
    use crate::scene::semantic_map::BACKGROUND_CODE;

    /// A doll with an eye, a cat, and codes one tolerance apart for doll and cat.
    fn scene() -> SemanticMap {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec![]);
        let cat = all.add(Level::Object, NO_IDENTITY, vec![]);
        let face = all.add(Level::Part, doll, vec![]);
        let eye = all.add(Level::Part, face, vec![]);
        for (id, code) in
            [(doll, [0.1, 0.5, 0.5]), (cat, [0.15, 0.5, 0.5]), (face, [0.9, 0.5, 0.1]), (eye, [0.5, 0.9, 0.9])]
        {
            all.get_mut(id).expect("there").code = code;
        }
        SemanticMap::from_identities(all, vec![doll, cat, face, eye, NO_IDENTITY], vec![1.0; 5], vec![])
    }

    #[test]
    fn the_usual_tolerance_is_the_identity_and_a_wide_one_its_neighbors() {
        let map = scene();
        for mode in [MatchMode::Identities, MatchMode::Codes] {
            let found = |target, tolerance| gaussians(&map, target, mode, tolerance);
            assert_eq!(found(1, 0.02), [true, false, true, true, false], "{mode:?}");
            assert_eq!(found(1, 0.06), [true, true, true, true, false], "{mode:?}");
            assert_eq!(found(3, 0.02), [false, false, true, true, false], "a part with its piece, {mode:?}");
            assert_eq!(found(4, 0.02), [false, false, false, true, false], "{mode:?}");
            assert_eq!(found(99, 1.0), [false; 5], "no such identity, {mode:?}");
        }
    }

    #[test]
    fn pixels_match_like_gaussians() {
        let map = scene();
        let view = ViewMap::certain(5, map.identity_of.clone());
        let planes = std::array::from_fn(|c| map.codes.iter().map(|codes| codes[c]).collect());
        let mut codes = CodeMap { width_px: 5, height_px: 1, planes };
        for (target, tolerance) in [(1, 0.02), (1, 0.06), (2, 0.02), (3, 0.02), (4, 0.02)] {
            let wanted = gaussians(&map, target, MatchMode::Identities, tolerance);
            let wanted = Mask::from_fn(5, 1, |i| wanted[i]);
            assert_eq!(exact(&view, &map.identities, target, tolerance), wanted);
            assert_eq!(blend(&codes, &map.identities, target, tolerance), wanted);
        }
        // Half the light of the doll, half of the background: neither.
        codes.planes[0][0] = 0.5 * (codes.planes[0][0] + BACKGROUND_CODE[0]);
        codes.planes[0][2] = f32::NAN;
        assert_eq!(blend(&codes, &map.identities, 1, 0.02).area(), 1);
    }
}
