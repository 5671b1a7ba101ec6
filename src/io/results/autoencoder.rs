//! The decoder of LangSplat's autoencoder, from three numbers to an embedding.

use std::path::{Path, PathBuf};

use super::decoder::{Decoder, DecoderStep};
use super::folder::{self, ResultOptions};
use super::level_runs::LevelRuns;
use super::tensors::Tensors;
use crate::io::IoError;

const FILE: &str = "best_ckpt.pth";
/// Start of the names of the decoder's layers; the encoder's are not needed.
const LAYERS: &str = "decoder.";
/// Folders above the run in which the autoencoder is looked for.
const ABOVE: usize = 3;

/// Reads the decoder of a result with codes of `dim` numbers.
pub(super) fn read(runs: &LevelRuns, options: &ResultOptions, dim: usize) -> Result<Decoder, IoError> {
    let what = format!("codes of {dim} numbers with an autoencoder (autoencoder/ckpt/{}/best_ckpt.pth)", runs.scene);
    let found = find(&runs.scene, &runs.folder);
    load(&folder::helper(options.decoder.as_deref(), found, &runs.folder, &what)?, dim)
}

/// Loads the decoder of codes of `dim` numbers from a checkpoint of the autoencoder.
pub(in crate::io) fn load(file: &Path, dim: usize) -> Result<Decoder, IoError> {
    let mut tensors = Tensors::open(file)?;
    let number = |name: &str| name.strip_prefix(LAYERS)?.strip_suffix(".weight")?.parse::<usize>().ok();
    let mut layers: Vec<usize> = tensors.names().filter_map(number).collect();
    layers.sort_unstable();
    let mut steps = Vec::new();
    for layer in layers {
        if !steps.is_empty() {
            steps.push(DecoderStep::Relu);
        }
        steps.push(DecoderStep::Linear(tensors.layer(&format!("{LAYERS}{layer}"))?));
    }
    let decoder = Decoder::new(dim, steps, file)?;
    match decoder.split() {
        (_, Some(_)) => Ok(decoder),
        _ => {
            Err(IoError::syntax(file, "decoder", "no tensors 'decoder.<n>.weight'; it is no autoencoder of LangSplat"))
        }
    }
}

/// Looks for the autoencoder of a scene in a folder and those around it.
pub(in crate::io) fn find(scene: &str, folder: &Path) -> Option<PathBuf> {
    let places = [
        format!("autoencoder/ckpt/{scene}"),
        format!("ckpt/{scene}"),
        format!("{scene}/ae_ckpt"),
        format!("ae_ckpt/{scene}"),
        "ae_ckpt".to_owned(),
        "autoencoder".to_owned(),
        String::new(),
    ];
    let folders = std::iter::successors(Some(folder), |f| f.parent()).take(ABOVE + 1);
    let at = |folder: &Path| places.iter().map(|p| folder.join(p).join(FILE)).find(|file| file.is_file());
    folders.into_iter().find_map(at)
}
