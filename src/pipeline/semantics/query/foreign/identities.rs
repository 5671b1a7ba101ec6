//! A `SemanticMap` of what another method has: classes, clusters with embeddings, or objects of alike features.

use std::collections::BTreeMap;

use super::descriptors::direction;
use super::{ForeignError, affinity, classes};
use crate::io::results::{ClusterLevel, LevelValues, MethodResult};
use crate::math::vector::unit;
use crate::pipeline::semantics::lifting::codes;
use crate::pipeline::semantics::relevancy::deviate;
use crate::scene::{
    GaussianCloud, Identities, IdentityId, LanguageFeatures, Level, NO_IDENTITY, PART_WEIGHT, SemanticMap, ViewFeatures,
};

/// Scale at which objects of SAGA are found, unless another is asked for.
pub const USUAL_SCALE: f32 = 0.5;

/// Makes a map of a result's classes, clusters or alike features; `scale` is SAGA's.
///
/// # Errors
/// If the result has only embeddings.
pub fn semantic_map(result: &MethodResult, scale: f32) -> Result<SemanticMap, ForeignError> {
    let clusters: Vec<&ClusterLevel> = result.levels.iter().filter_map(|level| clusters(&level.values)).collect();
    match (clusters.as_slice(), result.levels.first().map(|level| &level.values)) {
        ([.., parts, wholes], _) => Ok(nested(result, wholes, parts)),
        ([only], _) => Ok(flat(result, only)),
        (_, Some(LevelValues::Classes { features, classifier })) => {
            let found = classes::of_gaussians(classifier, features);
            // Class 0 is nothing.
            let of: Vec<Option<u32>> = found.iter().map(|f| (f.class > 0).then_some(f.class)).collect();
            let own = |class| classifier.names.get(&class).cloned();
            let mut numbered =
                Numbered::new(&of, |class| own(class).into_iter().chain([format!("class {class}")]).collect());
            numbered.margin = found.iter().map(|f| f.margin).collect();
            Ok(numbered.map(&result.cloud, None))
        }
        (_, Some(LevelValues::Affinity { features, gate })) => {
            let of = affinity::objects(features, gate.as_ref(), scale);
            Ok(Numbered::new(&of, |_| Vec::new()).map(&result.cloud, None))
        }
        _ => Err(ForeignError::NoIdentities(result.method.name())),
    }
}

fn clusters(values: &LevelValues) -> Option<&ClusterLevel> {
    match values {
        LevelValues::Clusters(clusters) => Some(clusters),
        _ => None,
    }
}

/// Objects by the numbers that a method gave them; only those that some Gaussian has.
struct Numbered {
    identities: Identities,
    /// By the method's number.
    known: BTreeMap<u32, IdentityId>,
    of: Vec<IdentityId>,
    margin: Vec<f32>,
}

impl Numbered {
    fn new(of: &[Option<u32>], names: impl Fn(u32) -> Vec<String>) -> Self {
        let mut known: BTreeMap<u32, IdentityId> = of.iter().flatten().map(|k| (*k, NO_IDENTITY)).collect();
        let mut identities = Identities::default();
        for (k, id) in &mut known {
            *id = identities.add(Level::Object, NO_IDENTITY, names(*k));
        }
        let of: Vec<IdentityId> = of.iter().map(|k| k.map_or(NO_IDENTITY, |k| known[&k])).collect();
        let margin = vec![1.0; of.len()];
        Self { identities, known, of, margin }
    }

    /// The map with a code for each identity.
    fn map(mut self, cloud: &GaussianCloud, language: Option<LanguageFeatures>) -> SemanticMap {
        let centers = codes::centers(cloud, &self.of, &self.identities);
        codes::assign(&mut self.identities, &centers);
        let mut map = SemanticMap::from_identities(self.identities, self.of, self.margin, Vec::new());
        map.language = language;
        map.look_at(cloud);
        map
    }
}

/// Embeddings by identity.
struct Known<'a> {
    encoder: &'a str,
    dimension: usize,
    by_identity: Vec<ViewFeatures>,
}

impl Known<'_> {
    /// Adds the embeddings of the next identity, a part of a whole if that has one.
    fn add(&mut self, raw: Vec<Vec<f32>>, whole: Option<&[f32]>) {
        let deviated = |own: &Vec<f32>| whole.and_then(|w| deviate(own, w, PART_WEIGHT)).unwrap_or_else(|| own.clone());
        let deviated = raw.iter().map(deviated).collect();
        self.by_identity.push(ViewFeatures { raw, deviated });
    }

    fn language(self) -> LanguageFeatures {
        LanguageFeatures { encoder: self.encoder.into(), dimension: self.dimension, by_identity: self.by_identity }
    }
}

fn known<'a>(result: &'a MethodResult, clusters: &ClusterLevel) -> Known<'a> {
    let encoder = result.encoder.as_deref().unwrap_or_default();
    Known { encoder, dimension: clusters.features.dim(), by_identity: Vec::new() }
}

/// Embeddings of a cluster that count, of unit length.
fn units(clusters: &ClusterLevel, k: u32) -> Vec<Vec<f32>> {
    let counting = clusters.weighted(k as usize).filter(|(_, weight)| *weight > 0.0);
    counting.filter_map(|(row, _)| unit(&clusters.features.row(row))).collect()
}

/// Clusters of one level, as objects.
fn flat(result: &MethodResult, clusters: &ClusterLevel) -> SemanticMap {
    let numbered = Numbered::new(&clusters.of, |_| Vec::new());
    let mut known = known(result, clusters);
    numbered.known.keys().for_each(|k| known.add(units(clusters, *k), None));
    numbered.map(&result.cloud, Some(known.language()))
}

/// Clusters of two levels, as objects and their parts. A part belongs to the object that most of its Gaussians are in;
/// one that is nearly the whole object is none.
fn nested(result: &MethodResult, wholes: &ClusterLevel, parts: &ClusterLevel) -> SemanticMap {
    /// Share of an object from which a part is the object itself.
    const SAME: f64 = 0.9;
    let mut numbered = Numbered::new(&wholes.of, |_| Vec::new());
    let mut known = known(result, wholes);
    numbered.known.keys().for_each(|k| known.add(units(wholes, *k), None));
    let mut shared: BTreeMap<u32, BTreeMap<u32, usize>> = BTreeMap::new();
    let mut sizes: BTreeMap<u32, usize> = BTreeMap::new();
    for (whole, part) in wholes.of.iter().zip(&parts.of) {
        if let (Some(whole), Some(part)) = (whole, part) {
            *shared.entry(*part).or_default().entry(*whole).or_default() += 1;
            *sizes.entry(*whole).or_default() += 1;
        }
    }
    let mut ids: BTreeMap<u32, (u32, IdentityId)> = BTreeMap::new();
    for (part, within) in &shared {
        let Some((whole, count)) = within.iter().max_by_key(|(whole, count)| (**count, std::cmp::Reverse(**whole)))
        else {
            continue;
        };
        if *count as f64 >= SAME * sizes[whole] as f64 {
            continue;
        }
        let id = numbered.identities.add(Level::Part, numbered.known[whole], Vec::new());
        known.add(units(parts, *part), direction(wholes, *whole as usize).as_deref());
        ids.insert(*part, (*whole, id));
    }
    for (i, (whole, part)) in wholes.of.iter().zip(&parts.of).enumerate() {
        if let Some((of, id)) = part.as_ref().and_then(|part| ids.get(part))
            && *whole == Some(*of)
        {
            numbered.of[i] = *id;
        }
    }
    numbered.map(&result.cloud, Some(known.language()))
}
