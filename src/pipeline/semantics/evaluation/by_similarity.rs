//! Identities by feature similarity, the baseline of feature mapping without tracking: look-alikes are taken for one
//! thing, wherever they were seen (FastLGS's feature matching).

use crate::math::vector::{dot, unit};
use crate::pipeline::semantics::lifting::codes;
use crate::scene::language::MAX_VIEWS;
use crate::scene::{GaussianCloud, Identities, IdentityId, LanguageFeatures, SemanticMap, ViewFeatures};

/// Least cosine of two features of one thing.
pub(crate) const ALIKE: f32 = 0.9;

/// Mean feature of an identity, if it has any, and the features of all identities joined to it.
type Looks = (Option<Vec<f32>>, Vec<Vec<f32>>);

/// Returns the map with look-alike identities of one level joined, each by the mean of its raw features. They keep
/// raw features only, and have no names. `None` without features.
pub(crate) fn rejoined(map: &SemanticMap, cloud: &GaussianCloud) -> Option<SemanticMap> {
    let language = map.language.as_ref()?;
    let mean = |f: &ViewFeatures| -> Option<Vec<f32>> {
        let sum: Vec<f32> = (0..language.dimension).map(|c| f.raw.iter().map(|v| v[c]).sum()).collect();
        unit(&sum)
    };
    let mut joined = Identities::default();
    let mut first: Vec<Looks> = Vec::new();
    let mut now: Vec<IdentityId> = vec![0];
    for ((_, identity), features) in map.identities.iter().zip(&language.by_identity) {
        let own = mean(features);
        let alike = |id: &IdentityId| {
            let of = first[*id as usize - 1].0.as_ref().zip(own.as_ref());
            of.is_some_and(|(a, b)| dot(a, b) >= ALIKE) && joined.get(*id).is_some_and(|i| i.level == identity.level)
        };
        let known = (1..=joined.len() as IdentityId).find(alike);
        let id = known.unwrap_or_else(|| {
            first.push((own.clone(), Vec::new()));
            // A whole comes before its pieces, and so does the identity that it was joined to.
            joined.add(identity.level, now.get(identity.parent as usize).copied().unwrap_or(0), Vec::new())
        });
        first[id as usize - 1].1.extend(features.raw.iter().cloned());
        now.push(id);
    }
    let of = map.identity_of.iter().map(|id| now.get(*id as usize).copied().unwrap_or(*id)).collect::<Vec<_>>();
    let centers = codes::centers(cloud, &of, &joined);
    codes::assign(&mut joined, &centers);
    let views = |mut raw: Vec<Vec<f32>>| {
        raw.truncate(MAX_VIEWS);
        ViewFeatures { deviated: raw.clone(), raw }
    };
    let by_identity = first.into_iter().map(|f| views(f.1)).collect();
    let mut out = SemanticMap::from_identities(joined, of, map.margin.clone(), map.seeds.clone());
    out.language = Some(LanguageFeatures { by_identity, ..language.clone() });
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Level, NO_IDENTITY};

    #[test]
    fn what_looks_alike_becomes_one() {
        let mut all = Identities::default();
        let mug = all.add(Level::Object, NO_IDENTITY, vec!["mug".into()]);
        let lid = all.add(Level::Part, mug, vec![]);
        let other = all.add(Level::Object, NO_IDENTITY, vec!["red mug".into()]);
        let lamp = all.add(Level::Object, NO_IDENTITY, vec![]);
        let handle = all.add(Level::Part, other, vec![]);
        let of = vec![mug, lid, other, lamp, handle, NO_IDENTITY];
        let cloud = GaussianCloud::isotropic((0..6).map(|i| [i as f32, 0.0, 0.0]).collect(), -2.0, 4.0);
        let mut map = SemanticMap::from_identities(all, of, vec![1.0; 6], vec![]);
        let seen = |v: [f32; 2]| ViewFeatures { raw: vec![v.to_vec()], deviated: vec![v.to_vec()] };
        // The lid looks like its mug, but is a part; the second mug nearly like the first.
        let by_identity = [[1.0, 0.0], [1.0, 0.0], [0.96, 0.28], [0.0, 1.0], [0.6, 0.8]].map(seen).to_vec();
        map.language = Some(LanguageFeatures { encoder: "t".into(), dimension: 2, by_identity });
        let joined = rejoined(&map, &cloud).expect("features");
        assert_eq!(joined.identity_of, [1, 2, 1, 3, 4, NO_IDENTITY]);
        assert_eq!(joined.identities.len(), 4);
        assert_eq!(joined.identities.object_of(4), 1, "the handle is a piece of what its mug was joined to");
        let language = joined.language.as_ref().expect("kept");
        assert!(language.is_valid(&joined.identities) && language.by_identity[0].raw.len() == 2);
        // A control: a little less alike, and they stay apart.
        map.language.as_mut().expect("there").by_identity[2] = seen([0.89, 0.456]);
        assert_eq!(rejoined(&map, &cloud).expect("features").identities.len(), 5);
        map.language = None;
        assert!(rejoined(&map, &cloud).is_none());
    }
}
