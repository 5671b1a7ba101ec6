//! Sniffing of a checkpoint by its keys; networks and radiance fields are refused by name.

use std::path::Path;

use crate::io::IoError;
use crate::io::torch::WeightFile;
use crate::scene::text::shortened;

/// Program that wrote a checkpoint of Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CheckpointKind {
    /// 3D Gaussian Splatting: a tuple, and the iteration.
    Inria,
    Gsplat,
    Nerfstudio,
}

/// Most keys named in an error.
const NAMED: usize = 6;

/// Tells the kind of a checkpoint.
///
/// # Errors
/// If it cannot be read, or holds no Gaussians.
pub(super) fn kind_of(path: &Path) -> Result<CheckpointKind, IoError> {
    let file = WeightFile::open(path).map_err(|e| e.of(path))?;
    let has = |name: &str| file.tensors.contains_key(name);
    if file.tree.length("0").is_some_and(|n| n >= super::inria::LEAST) && has("0.1") {
        return Ok(CheckpointKind::Inria);
    }
    if has("splats.means") || has("splats.means3d") {
        return Ok(CheckpointKind::Gsplat);
    }
    if super::nerfstudio::MODELS.iter().any(|model| has(&format!("{model}means"))) {
        return Ok(CheckpointKind::Nerfstudio);
    }
    let starts = |start: &str| file.tensors.keys().any(|key| key.starts_with(start));
    let what = if starts("pipeline._model.field") || starts("pipeline._model.proposal") {
        let fields = ["lerf", "clip", "instance", "grouping"];
        let semantic =
            fields.iter().any(|f| file.tensors.keys().any(|k| k.starts_with("pipeline._model.") && k.contains(f)));
        let which = if semantic { "as LERF and GARField train it" } else { "as nerfacto trains it" };
        format!("a radiance field (NeRF) {which}, which has no Gaussians")
    } else {
        let keys: Vec<&str> = file.tensors.keys().take(NAMED).map(String::as_str).collect();
        match (shortened(&keys.join(", "), 200), file.tensors.len() - keys.len()) {
            (keys, _) if keys.is_empty() => "a checkpoint without Gaussians and other tensors".into(),
            (keys, 0) => format!("a checkpoint without Gaussians (its tensors: {keys})"),
            (keys, more) => format!("a checkpoint without Gaussians (its tensors: {keys} and {more} more)"),
        }
    };
    Err(super::not_gaussians(path, what))
}
