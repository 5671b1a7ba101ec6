//! The semantic map's file: safetensors with a JSON header, so that Python reads it in two lines.
//!
//! | entry | what |
//! |---|---|
//! | metadata `fmlgs` | JSON: `version`, `seeds`, `encoder`, `prepared`, `identities` (`level`, `parent`, `names`, `code`), `findings` |
//! | tensor `codes` | `[identities, 3]` f32 |
//! | tensor `parents` | `[identities]` u32, 0 = none; identities count from 1 |
//! | tensor `views` | `[identities]` u32, views with language features, if an encoder has looked |
//! | tensors `raw`, `deviated` | `[identities, 4, dimension]` f16, unit length; 0 beyond `views` |
//! | tensors `removed_places`, `removed_shapes` | `[n, 3]` f64, `[n, 8]` f32: Gaussians that were taken out for good |
//!
//! The identity of each Gaussian and its code are in `point_cloud.ply`.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use bytemuck::cast_slice;
use half::f16;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};

use super::{IoError, files, removed};
use crate::scene::language::MAX_VIEWS;
use crate::scene::{
    GaussianCloud, Identities, LanguageFeatures, Preparation, SegmentationReport, SemanticMap, ViewFeatures,
};

/// The file's name in a trained scene's folder.
pub use super::scene_files::MAP_FILE as FILE;
/// Version that this program writes, and the highest it reads.
const VERSION: u64 = 1;
const KEY: &str = "fmlgs";
/// Largest file of a semantic map, bytes.
pub(crate) const MAX_BYTES: u64 = 256 << 20;
/// Bytes of the length before the header.
const LENGTH: u64 = 8;

#[derive(Serialize, Deserialize)]
struct Header {
    version: u64,
    /// State of the scene that it was saved with.
    #[serde(default)]
    state: Option<String>,
    #[serde(default)]
    seeds: Vec<String>,
    #[serde(default)]
    encoder: Option<String>,
    #[serde(default)]
    prepared: Option<Preparation>,
    identities: Identities,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    findings: Option<SegmentationReport>,
}

/// Encodes a map that belongs to a scene's state; `path` is for errors.
pub fn encode(map: &SemanticMap, state: Option<&str>, path: &Path) -> Result<Vec<u8>, IoError> {
    let language = map.language.as_ref();
    let header = Header {
        version: VERSION,
        state: state.map(Into::into),
        seeds: map.seeds.clone(),
        encoder: language.map(|l| l.encoder.clone()),
        prepared: map.prepared,
        identities: map.identities.clone(),
        findings: map.findings.clone(),
    };
    let broken = |e: &dyn std::fmt::Display| IoError::syntax(path, "semantic map", e.to_string());
    let text = serde_json::to_string(&header).map_err(|e| broken(&e))?;
    let codes: Vec<[f32; 3]> = map.identities.iter().map(|(_, i)| i.code).collect();
    let parents: Vec<u32> = map.identities.iter().map(|(_, i)| i.parent).collect();
    let view = |dtype, shape, bytes| TensorView::new(dtype, shape, bytes).map_err(|e| broken(&e));
    let n = map.identities.len();
    let views: Vec<u32> =
        language.map_or_else(Vec::new, |l| l.by_identity.iter().map(|f| f.raw.len() as u32).collect());
    let raw = language.map_or_else(Vec::new, |l| packed(l, |f| &f.raw));
    let deviated = language.map_or_else(Vec::new, |l| packed(l, |f| &f.deviated));
    let mut tensors = vec![
        ("codes", view(Dtype::F32, vec![n, 3], cast_slice(&codes))?),
        ("parents", view(Dtype::U32, vec![n], cast_slice(&parents))?),
    ];
    if let Some(l) = language {
        let shape = vec![n, MAX_VIEWS, l.dimension];
        tensors.push(("views", view(Dtype::U32, vec![n], cast_slice(&views))?));
        tensors.push(("raw", view(Dtype::F16, shape.clone(), cast_slice(&raw))?));
        tensors.push(("deviated", view(Dtype::F16, shape, cast_slice(&deviated))?));
    }
    let gone = map.removed.as_deref().map(removed::pack);
    if let Some((places, shapes)) = &gone {
        let n = places.len();
        tensors.push((removed::PLACES, view(Dtype::F64, vec![n, 3], cast_slice(places))?));
        tensors.push((removed::SHAPES, view(Dtype::F32, vec![n, removed::SHAPE], cast_slice(shapes))?));
    }
    let metadata = HashMap::from([(KEY.to_owned(), text)]);
    safetensors::serialize(tensors, Some(metadata)).map_err(|e| broken(&e))
}

/// Objects and parts stored with the scene in `folder`, without their embeddings; none if they cannot be read.
pub(crate) fn identities(folder: &Path) -> Identities {
    let path = folder.join(FILE);
    // Embeddings follow the header, and are most of the file.
    let read = || {
        let length = files::read_start(&path, LENGTH)?;
        let length = length.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
        let head = files::read_start(&path, length.saturating_add(LENGTH).min(MAX_BYTES))?;
        let tensors: serde_json::Value = files::json(head.get(LENGTH as usize..).unwrap_or_default(), &path)?;
        parsed(&path, tensors["__metadata__"][KEY].as_str())
    };
    read().map_or_else(|_| Identities::default(), |header| header.identities)
}

/// Loads the map of the scene in `folder`, whose Gaussians `cloud` are of the save `state`; `None` if it has none.
pub fn load(folder: &Path, state: Option<&str>, cloud: &GaussianCloud) -> Result<Option<SemanticMap>, IoError> {
    let path = folder.join(FILE);
    if !path.exists() {
        return Ok(None);
    }
    decode(&files::read(&path, MAX_BYTES)?, state, cloud, &path).map(Some)
}

/// Decodes a map for the Gaussians `cloud` of the save `state`; `path` is for errors.
pub(crate) fn decode(
    bytes: &[u8],
    state: Option<&str>,
    cloud: &GaussianCloud,
    path: &Path,
) -> Result<SemanticMap, IoError> {
    let header = of_save(bytes, state, path)?;
    let language = match header.encoder {
        None => None,
        Some(encoder) => Some(features(path, bytes, encoder, &header.identities)?),
    };
    let map = SemanticMap::restore(header.identities, header.seeds, cloud).ok_or_else(|| torn(path))?;
    let removed = removed::unpack(bytes, path)?.map(Arc::new);
    Ok(SemanticMap { language, prepared: header.prepared, findings: header.findings, removed, ..map })
}

/// Reads the names of objects removed for good from the scene in `folder`, and their Gaussians, if kept; empty if that
/// cannot be read.
pub(crate) fn removed_of(folder: &Path) -> (Vec<String>, Option<GaussianCloud>) {
    let path = folder.join(FILE);
    let read = files::read(&path, MAX_BYTES).and_then(|bytes| {
        let names = header(&path, &bytes)?.identities.removed;
        Ok((names, removed::unpack(&bytes, &path)?))
    });
    read.unwrap_or_default()
}

/// Checks that the bytes of a map are of the save `state`.
///
/// # Errors
/// If they are of another, or are no map.
pub(crate) fn belongs(bytes: &[u8], state: Option<&str>, path: &Path) -> Result<(), IoError> {
    of_save(bytes, state, path).map(drop)
}

fn of_save(bytes: &[u8], state: Option<&str>, path: &Path) -> Result<Header, IoError> {
    let header = header(path, bytes)?;
    if header.state.as_deref() == state { Ok(header) } else { Err(torn(path)) }
}

fn torn(path: &Path) -> IoError {
    let remedy = "put back the file that was, or find the objects anew with 'fmlgs preprocess'";
    IoError::Torn { path: path.into(), with: super::scene_files::CLOUD_FILE, remedy }
}

/// Packs the features of all identities; missing views are zeros.
fn packed(language: &LanguageFeatures, of: impl Fn(&ViewFeatures) -> &Vec<Vec<f32>>) -> Vec<f16> {
    let missing = vec![0.0; language.dimension];
    let view =
        |f: &ViewFeatures, k: usize| of(f).get(k).unwrap_or(&missing).iter().map(|v| f16::from_f32(*v)).collect();
    language.by_identity.iter().flat_map(|f| (0..MAX_VIEWS).flat_map(move |k| -> Vec<f16> { view(f, k) })).collect()
}

fn features(path: &Path, bytes: &[u8], encoder: String, identities: &Identities) -> Result<LanguageFeatures, IoError> {
    let broken = |place: &str, reason: &str| IoError::syntax(path, format!("tensor '{place}'"), reason);
    let file = SafeTensors::deserialize(bytes).map_err(|e| broken("", &e.to_string()))?;
    let tensor = |name: &str, dtype: Dtype| {
        let found = file.tensor(name).map_err(|e| broken(name, &e.to_string()))?;
        let fits = found.dtype() == dtype && found.shape().first() == Some(&identities.len());
        if fits { Ok(found) } else { Err(broken(name, "another type or number of identities than the header's")) }
    };
    let views = tensor("views", Dtype::U32)?;
    let views = views.data().chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let (raw, deviated) = (tensor("raw", Dtype::F16)?, tensor("deviated", Dtype::F16)?);
    let dimension = match raw.shape() {
        [_, MAX_VIEWS, dimension] if *dimension > 0 && deviated.shape() == raw.shape() => *dimension,
        _ => return Err(broken("raw", "its shape is not [identities, 4, dimension], or not that of 'deviated'")),
    };
    let number = |b: &[u8]| f16::from_le_bytes([b[0], b[1]]).to_f32();
    let rows = |data: &[u8], i: usize, n: usize| -> Vec<Vec<f32>> {
        let of_identity = data.chunks_exact(2 * dimension).skip(i * MAX_VIEWS).take(n.min(MAX_VIEWS));
        of_identity.map(|row| row.chunks_exact(2).map(number).collect()).collect()
    };
    let of = views
        .enumerate()
        .map(|(i, n)| ViewFeatures { raw: rows(raw.data(), i, n), deviated: rows(deviated.data(), i, n) })
        .collect();
    let language = LanguageFeatures { encoder, dimension, by_identity: of };
    if language.is_valid(identities) { Ok(language) } else { Err(broken("raw", "a value that is not a number")) }
}

fn header(path: &Path, bytes: &[u8]) -> Result<Header, IoError> {
    let broken = |reason: String| IoError::Syntax { path: path.into(), place: "header".into(), reason };
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(|e| broken(e.to_string()))?;
    parsed(path, metadata.metadata().as_ref().and_then(|m| m.get(KEY)).map(String::as_str))
}

/// Parses the header's text.
fn parsed(path: &Path, text: Option<&str>) -> Result<Header, IoError> {
    let broken = |reason: String| IoError::Syntax { path: path.into(), place: "header".into(), reason };
    let text = text.ok_or_else(|| broken(format!("no metadata '{KEY}': not a semantic map")))?;
    let value: serde_json::Value = serde_json::from_str(text).map_err(|e| broken(e.to_string()))?;
    let version = value["version"].as_u64().unwrap_or(0);
    if version == 0 || version > VERSION {
        return Err(IoError::Version { path: path.into(), found: version, supported: VERSION });
    }
    let header: Header = serde_json::from_value(value).map_err(|e| broken(e.to_string()))?;
    let bad = header.identities.iter().find(|(id, i)| i.parent >= *id || i.code.iter().any(|c| !c.is_finite()));
    match bad {
        Some((id, _)) => {
            Err(broken(format!("identity {id} has a parent that follows it, or a code that is not a number")))
        }
        None if header.findings.as_ref().is_some_and(|f| !f.is_valid(&header.identities)) => Err(broken(
            "its findings are of other identities or photos than are there; 'fmlgs preprocess' finds them again".into(),
        )),
        None => Ok(header),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::trained::{self, SceneInfo};
    use crate::scene::{Level, NO_IDENTITY};

    fn map() -> (SemanticMap, GaussianCloud) {
        let mut identities = Identities::default();
        let doll = identities.add(Level::Object, NO_IDENTITY, vec!["doll".into(), "人形".into()]);
        let eye = identities.add(Level::Part, doll, vec![]);
        let cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 2], 0.0, 0.0);
        let mut map =
            SemanticMap::from_identities(identities, vec![eye, NO_IDENTITY], vec![0.25, 0.0], vec!["a".into()]);
        let views = |raw: [f32; 2], deviated: [f32; 2]| ViewFeatures {
            raw: vec![raw.to_vec(); 2],
            deviated: vec![deviated.to_vec(); 2],
        };
        let of = vec![views([1.0, 0.0], [1.0, 0.0]), views([0.0, 1.0], [0.25, 0.75])];
        map.language = Some(LanguageFeatures { encoder: "test".into(), dimension: 2, by_identity: of });
        (map, cloud)
    }

    #[test]
    fn a_map_reads_back() {
        let folder = tempfile::tempdir().expect("folder");
        let (map, cloud) = map();
        assert_eq!(load(folder.path(), None, &cloud).expect("none"), None);
        let state = trained::save(folder.path(), &SceneInfo::default(), &cloud, Some(&map)).expect("save");
        let again = trained::load(folder.path()).expect("load").cloud;
        assert_eq!(load(folder.path(), Some(&state), &again).expect("load"), Some(map));
        let torn = |found| matches!(found, Err(IoError::Torn { .. }));
        assert!(torn(load(folder.path(), Some(&state), &GaussianCloud::default())), "other Gaussians");
        assert!(torn(load(folder.path(), Some("another save"), &again)) && torn(load(folder.path(), None, &again)));
    }

    #[test]
    fn broken_maps_are_named() {
        let folder = tempfile::tempdir().expect("folder");
        let (map, cloud) = map();
        let state = trained::save(folder.path(), &SceneInfo::default(), &cloud, Some(&map)).expect("save");
        let state = Some(state.as_str());
        let path = folder.path().join(FILE);
        let good = std::fs::read(&path).expect("read");
        for bytes in [&good[..good.len() / 2], &[0xff; 64][..], &[][..]] {
            std::fs::write(&path, bytes).expect("write");
            assert!(matches!(load(folder.path(), state, &cloud), Err(IoError::Syntax { .. })));
        }
        let newer = String::from_utf8_lossy(&good).replace("version\\\":1", "version\\\":9");
        std::fs::write(&path, newer.as_bytes()).expect("write");
        assert!(load(folder.path(), state, &cloud).is_err());
    }
}
