//! The semantic map's file: safetensors with a JSON header, so that Python reads it in two lines.
//!
//! | entry | what |
//! |---|---|
//! | metadata `fmlgs` | JSON: `version`, `seeds`, `identities` (`level`, `parent`, `names`, `code`) |
//! | tensor `codes` | `[identities, 3]` f32 |
//! | tensor `parents` | `[identities]` u32, 0 = none; identities count from 1 |
//!
//! Which Gaussian is whose is in `point_cloud.ply`, beside the Gaussians.

use std::collections::HashMap;
use std::path::Path;

use bytemuck::cast_slice;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};

use super::{IoError, atomic, files, splat_ply};
use crate::scene::{GaussianCloud, Identities, SemanticMap};

/// The file's name in a trained scene's folder.
pub const FILE: &str = "semantic_map.safetensors";
/// Version that this program writes, and the highest it reads.
const VERSION: u64 = 1;
/// Key of the metadata.
const KEY: &str = "fmlgs";
/// Largest file that is read.
const MAX_BYTES: u64 = 256 << 20;

#[derive(Serialize, Deserialize)]
struct Header {
    version: u64,
    #[serde(default)]
    seeds: Vec<String>,
    identities: Identities,
}

/// Writes the map into a trained scene's folder, and the Gaussians with it. `background` is the
/// code of what is nobody's.
///
/// # Errors
/// If a file cannot be written.
pub fn save(folder: &Path, map: &SemanticMap, cloud: &mut GaussianCloud, background: [f32; 3]) -> Result<(), IoError> {
    let header = Header { version: VERSION, seeds: map.seeds.clone(), identities: map.identities.clone() };
    let path = folder.join(FILE);
    let broken = |e: &dyn std::fmt::Display| IoError::Syntax {
        path: path.clone(),
        place: "semantic map".into(),
        reason: e.to_string(),
    };
    let text = serde_json::to_string(&header).map_err(|e| broken(&e))?;
    let codes: Vec<[f32; 3]> = map.identities.iter().map(|(_, i)| i.code).collect();
    let parents: Vec<u32> = map.identities.iter().map(|(_, i)| i.parent).collect();
    let view = |dtype, shape, bytes| TensorView::new(dtype, shape, bytes).map_err(|e| broken(&e));
    let n = map.identities.len();
    let tensors = [
        ("codes", view(Dtype::F32, vec![n, 3], cast_slice(&codes))?),
        ("parents", view(Dtype::U32, vec![n], cast_slice(&parents))?),
    ];
    let metadata = HashMap::from([(KEY.to_owned(), text)]);
    let bytes = safetensors::serialize(tensors, Some(metadata)).map_err(|e| broken(&e))?;
    map.store(cloud, background);
    splat_ply::write(&folder.join(super::trained::CLOUD_FILE), cloud)?;
    atomic::write(&path, |w| w.write_all(&bytes))
}

/// The map of a trained scene; `None` if it has none, or one of other Gaussians.
///
/// # Errors
/// If its file is broken.
pub fn load(folder: &Path, cloud: &GaussianCloud) -> Result<Option<SemanticMap>, IoError> {
    let path = folder.join(FILE);
    if !path.is_file() {
        return Ok(None);
    }
    let header = read(&path)?;
    Ok(SemanticMap::restore(header.identities, header.seeds, cloud))
}

fn read(path: &Path) -> Result<Header, IoError> {
    let bytes = files::read(path, MAX_BYTES)?;
    let broken = |reason: String| IoError::Syntax { path: path.into(), place: "header".into(), reason };
    let (_, metadata) = SafeTensors::read_metadata(&bytes).map_err(|e| broken(e.to_string()))?;
    let text = metadata.metadata().as_ref().and_then(|m| m.get(KEY));
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
            Err(broken(format!("identity {id} has a parent that follows it, or a code that is no number")))
        }
        None => Ok(header),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Level, NOBODY};

    fn map() -> (SemanticMap, GaussianCloud) {
        let mut identities = Identities::default();
        let doll = identities.add(Level::Object, NOBODY, vec!["doll".into(), "人形".into()]);
        let eye = identities.add(Level::Part, doll, vec![]);
        let cloud = GaussianCloud {
            positions: vec![[0.0; 3]; 2],
            log_scales: vec![[0.0; 3]; 2],
            quaternions: vec![[1.0, 0.0, 0.0, 0.0]; 2],
            opacity_logits: vec![0.0; 2],
            sh: vec![[0.0; 3]; 2],
            ..GaussianCloud::default()
        };
        (SemanticMap { identities, of: vec![eye, NOBODY], margin: vec![0.25, 0.0], seeds: vec!["a".into()] }, cloud)
    }

    #[test]
    fn a_map_reads_back() {
        let folder = tempfile::tempdir().expect("folder");
        let (map, mut cloud) = map();
        assert_eq!(load(folder.path(), &cloud).expect("none"), None);
        save(folder.path(), &map, &mut cloud, [0.5; 3]).expect("save");
        let again = splat_ply::read(&folder.path().join(super::super::trained::CLOUD_FILE)).expect("read");
        assert_eq!(load(folder.path(), &again).expect("load"), Some(map));
        assert_eq!(load(folder.path(), &GaussianCloud::default()).expect("load"), None, "other Gaussians");
    }

    #[test]
    fn broken_maps_are_named() {
        let folder = tempfile::tempdir().expect("folder");
        let (map, mut cloud) = map();
        save(folder.path(), &map, &mut cloud, [0.5; 3]).expect("save");
        let path = folder.path().join(FILE);
        let good = std::fs::read(&path).expect("read");
        for bytes in [&good[..good.len() / 2], &[0xff; 64][..], &[][..]] {
            std::fs::write(&path, bytes).expect("write");
            assert!(matches!(load(folder.path(), &cloud), Err(IoError::Syntax { .. })));
        }
        let newer = String::from_utf8_lossy(&good).replace("version\\\":1", "version\\\":9");
        std::fs::write(&path, newer.as_bytes()).expect("write");
        assert!(load(folder.path(), &cloud).is_err());
    }
}
