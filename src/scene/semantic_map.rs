//! Identities together with the Gaussians that belong to them.

use std::sync::Arc;

use super::colors::SeenColors;
use super::findings::IdentityEvidence;
use super::shapes::SeenShapes;
use super::{
    ExtraProperty, GaussianCloud, Identities, IdentityId, LanguageFeatures, NO_IDENTITY, Preparation,
    SegmentationReport,
};

/// Channels of a Gaussian's codes: those of its object, then those of its part.
pub(crate) const CODE_CHANNELS: usize = 6;

/// Code of unlabeled Gaussians: the middle of code space.
pub(crate) const BACKGROUND_CODE: [f32; 3] = [0.5; 3];

/// Per-Gaussian properties that carry the map in a `.ply`: identity, margin of its votes, codes.
pub(crate) const IDENTITY: &str = "fmlgs_identity";
const MARGIN: &str = "fmlgs_margin";
const CODES: [&str; CODE_CHANNELS] = [
    "fmlgs_object_code_0",
    "fmlgs_object_code_1",
    "fmlgs_object_code_2",
    "fmlgs_part_code_0",
    "fmlgs_part_code_1",
    "fmlgs_part_code_2",
];

/// Identities of a scene, and the label of each Gaussian.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SemanticMap {
    /// Objects and parts.
    pub identities: Identities,
    /// The innermost identity of each Gaussian; `NO_IDENTITY` for none.
    pub identity_of: Vec<IdentityId>,
    /// Margin of each Gaussian's label, 0 (a guess) to 1. An unlabeled one with 0 is unknown: see [`Self::is_unknown`].
    pub margin: Vec<f32>,
    /// Codes of each Gaussian, of its object and its part: those of its identity, or trained ones.
    pub codes: Vec<[f32; CODE_CHANNELS]>,
    /// Language features of the identities, once computed.
    pub language: Option<LanguageFeatures>,
    /// Names of the photos whose masks it comes from.
    pub seeds: Vec<String>,
    /// Choices of its preparation, if known.
    pub prepared: Option<Preparation>,
    /// Evidence from the search for objects and parts, if known.
    pub findings: Option<SegmentationReport>,
    /// Gaussians that were removed from the scene for good, as they were: photos still show them.
    pub removed: Option<Arc<GaussianCloud>>,
}

impl SemanticMap {
    /// A map whose Gaussians have the codes of their identities.
    pub fn from_identities(identities: Identities, of: Vec<IdentityId>, margin: Vec<f32>, seeds: Vec<String>) -> Self {
        let by_id: Vec<_> = (0..=identities.len() as IdentityId).map(|id| identities.codes(id)).collect();
        let codes = of.iter().map(|id| by_id.get(*id as usize).copied().unwrap_or(by_id[0])).collect();
        Self {
            identities,
            identity_of: of,
            margin,
            codes,
            language: None,
            seeds,
            prepared: None,
            findings: None,
            removed: None,
        }
    }

    /// Writes identities, margins and codes into the cloud's extra properties.
    pub fn store(&self, cloud: &mut GaussianCloud) {
        let ours = |name: &str| name == IDENTITY || name == MARGIN || CODES.contains(&name);
        cloud.extras.retain(|e| !ours(&e.name));
        let mut add = |name: &str, values: Vec<f32>| cloud.extras.push(ExtraProperty { name: name.into(), values });
        // Whole numbers up to 2^24 are exact.
        add(IDENTITY, self.identity_of.iter().map(|id| *id as f32).collect());
        add(MARGIN, self.margin.clone());
        for (c, name) in CODES.iter().enumerate() {
            add(name, self.codes.iter().map(|codes| codes[c]).collect());
        }
    }

    /// The map of a cloud that [`Self::store`] has written to, with these identities. `None` if
    /// the cloud carries none, or refers to identities that are not there.
    pub(crate) fn restore(identities: Identities, seeds: Vec<String>, cloud: &GaussianCloud) -> Option<Self> {
        let values = |name: &str| cloud.extras.iter().find(|e| e.name == name).map(|e| e.values.as_slice());
        let id = |v: &f32| {
            let whole = *v >= 0.0 && v.fract() == 0.0 && *v <= identities.len() as f32;
            whole.then_some(*v as IdentityId)
        };
        let of: Vec<IdentityId> = values(IDENTITY)?.iter().map(id).collect::<Option<_>>()?;
        let margin = values(MARGIN).map_or_else(|| vec![0.0; of.len()], <[f32]>::to_vec);
        let mut map = Self::from_identities(identities, of, margin, seeds);
        for (c, name) in CODES.iter().enumerate() {
            let stored = values(name).into_iter().flatten().filter(|v| v.is_finite());
            map.codes.iter_mut().zip(stored).for_each(|(codes, v)| codes[c] = *v);
        }
        map.look_at(cloud);
        Some(map)
    }

    /// Computes colors and shapes of the identities in `cloud`, for queries.
    pub(crate) fn look_at(&mut self, cloud: &GaussianCloud) {
        (self.identities.colors, self.identities.shapes) = (SeenColors::of(cloud, self), SeenShapes::of(cloud, self));
    }

    /// Records Gaussians that are removed from the scene for good, beside earlier ones.
    pub(crate) fn add_removed(&mut self, gone: GaussianCloud) {
        let bare = GaussianCloud { extras: Vec::new(), ..gone };
        let before = self.removed.take().map(Arc::unwrap_or_clone);
        self.removed = Some(Arc::new(GaussianCloud::joined(before.into_iter().chain([bare]).collect())));
    }

    /// Indices of the Gaussians of an identity and its parts, rising.
    pub(crate) fn members(&self, id: IdentityId) -> Vec<usize> {
        let inside = self.identities.descendants(id);
        let is_in = |i: &usize| inside.get(self.identity_of[*i] as usize) == Some(&true);
        (0..self.identity_of.len()).filter(is_in).collect()
    }

    /// The map of these Gaussians alone, as [`GaussianCloud::select`] has them. Without language
    /// features and findings: it is for drawing.
    pub(crate) fn select(&self, gaussians: &[usize]) -> Self {
        Self {
            identities: self.identities.clone(),
            identity_of: gaussians.iter().map(|&i| self.identity_of[i]).collect(),
            margin: gaussians.iter().map(|&i| self.margin[i]).collect(),
            codes: gaussians.iter().map(|&i| self.codes[i]).collect(),
            language: None,
            seeds: self.seeds.clone(),
            prepared: self.prepared,
            findings: None,
            removed: None,
        }
    }

    /// As [`Self::select`], with language features, findings and removed Gaussians.
    pub(crate) fn select_fully(&self, gaussians: &[usize]) -> Self {
        Self {
            language: self.language.clone(),
            findings: self.findings.clone(),
            removed: self.removed.clone(),
            ..self.select(gaussians)
        }
    }

    /// Identities that the user edited, by rising number. In files of versions without the mark they are those with a
    /// second name, or all if no photo was a seed, as all were selected by clicks.
    pub(crate) fn by_hand(&self) -> Vec<IdentityId> {
        let by_clicks = self.seeds.is_empty();
        let is = |i: &super::Identity| i.by_hand || by_clicks || i.names.len() > 1;
        self.identities.iter().filter(|(_, i)| is(i)).map(|(id, _)| id).collect()
    }

    /// Returns whether the label of a Gaussian is unknown: no mask and no photo assigns it to an identity or to none.
    pub(crate) fn is_unknown(&self, i: usize) -> bool {
        self.identity_of.get(i) == Some(&NO_IDENTITY) && self.margin.get(i) == Some(&0.0)
    }

    /// Evidence for every identity, by number; unlabeled Gaussians first.
    pub(crate) fn facts(&self) -> Vec<IdentityEvidence> {
        SegmentationReport::facts(self.findings.as_ref(), &self.identities, &self.sizes())
    }

    /// Bytes of the values per Gaussian and per identity.
    pub(crate) fn bytes(&self) -> u64 {
        let each = size_of::<IdentityId>() + size_of::<f32>() * (1 + CODE_CHANNELS);
        let numbers = |l: &LanguageFeatures| {
            l.dimension * l.by_identity.iter().map(|f| f.raw.len() + f.deviated.len()).sum::<usize>() * size_of::<f32>()
        };
        (self.identity_of.len() * each + self.language.as_ref().map_or(0, numbers)) as u64
    }

    pub(crate) fn has_parts(&self) -> bool {
        self.identities.iter().any(|(_, i)| i.level == super::Level::Part)
    }

    /// Number of Gaussians of each identity, parts included, by number; unlabeled ones first.
    pub(crate) fn sizes(&self) -> Vec<usize> {
        let mut sizes = vec![0; self.identities.len() + 1];
        for &id in &self.identity_of {
            if id == NO_IDENTITY {
                sizes[0] += 1;
            }
            for i in self.identities.ancestors(id) {
                sizes[i as usize] += 1;
            }
        }
        sizes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Level;

    #[test]
    fn a_cloud_carries_its_map() {
        let mut identities = Identities::default();
        let doll = identities.add(Level::Object, NO_IDENTITY, vec!["doll".into()]);
        let eye = identities.add(Level::Part, doll, vec!["eye".into()]);
        let (of, margin) = (vec![eye, NO_IDENTITY, doll], vec![0.5, 0.0, 1.0]);
        let mut map = SemanticMap::from_identities(identities.clone(), of, margin, vec!["a.jpg".into()]);
        map.codes[2][4] = 0.25;
        let mut cloud = GaussianCloud { positions: vec![[0.0; 3]; 3], ..GaussianCloud::default() };
        cloud.extras.push(ExtraProperty { name: "kept".into(), values: vec![7.0; 3] });
        map.store(&mut cloud);
        map.store(&mut cloud);
        assert_eq!(cloud.extras.len(), 9);
        assert_eq!(SemanticMap::restore(identities.clone(), map.seeds.clone(), &cloud), Some(map.clone()));
        assert_eq!(map.sizes(), [1, 2, 1]);
        assert_eq!((map.members(doll), map.members(eye), map.members(77)), (vec![0, 2], vec![0], vec![]));
        let left = map.select(&[2]);
        assert_eq!((left.identity_of, left.margin, left.codes[0][4]), (vec![doll], vec![1.0], 0.25));
        assert_eq!(SemanticMap::restore(Identities::default(), vec![], &cloud), None, "identities are missing");
        for bad in [-1.0, 0.5, 3.0, f32::NAN] {
            cloud.extras[1].values[0] = bad;
            assert_eq!(SemanticMap::restore(identities.clone(), vec![], &cloud), None, "{bad}");
        }
        assert_eq!(SemanticMap::restore(identities, vec![], &GaussianCloud::default()), None);
    }

    #[test]
    fn maps_are_counted_and_codes_are_those_of_object_and_part() {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec![]);
        assert!(!SemanticMap { identities: all.clone(), ..SemanticMap::default() }.has_parts());
        let eye = all.add(Level::Part, doll, vec![]);
        all.get_mut(doll).expect("there").code = [0.1, 0.2, 0.3];
        all.get_mut(eye).expect("there").code = [0.7, 0.8, 0.9];
        let mut map = SemanticMap::from_identities(all, vec![doll, eye, NO_IDENTITY, 99], vec![1.0; 4], vec![]);
        assert!(map.has_parts());
        let codes = [[0.1, 0.2, 0.3, 0.5, 0.5, 0.5], [0.1, 0.2, 0.3, 0.7, 0.8, 0.9], [0.5; 6], [0.5; 6]];
        assert_eq!(map.codes, codes);
        // Eight numbers of 4 bytes a Gaussian; two views of three numbers, raw and deviated.
        assert_eq!(map.bytes(), 4 * 32);
        let seen = crate::scene::ViewFeatures { raw: vec![vec![0.0; 3]; 2], deviated: vec![vec![0.0; 3]; 2] };
        map.language = Some(LanguageFeatures { encoder: "t".into(), dimension: 3, by_identity: vec![seen] });
        assert_eq!(map.bytes(), 4 * 32 + 4 * 3 * 4);
        assert_eq!(map.sizes(), [1, 2, 1]);
    }
}
