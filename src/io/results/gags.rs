//! GAGS: `point_cloud.ply` with `semantic_0..15`, as Feature 3DGS writes it, and a decoder with skips in the folder of
//! the run.

use std::path::Path;

use super::decoder::{Decoder, DecoderStep};
use super::face::{EmbeddedLevel, LevelCodes, LevelValues, Method, MethodResult};
use super::feature_3dgs;
use super::folder::{self, ResultOptions};
use super::tensors::Tensors;
use crate::io::IoError;

/// Layers of the decoder, with a ReLU between.
const LAYERS: usize = 9;
/// Layers whose output skips the next two.
const SKIPPING: [usize; 2] = [0, 3];
/// Places of the layers in the decoder's file: in the checkpoint of a training, and in one of the network alone.
const PLACES: [&str; 2] = ["module_state_dict.decoder.", "decoder."];
/// Numbers of an OpenCLIP embedding.
const CLIP: usize = 512;

/// Returns whether the features of a splat are codes of this method: whether their decoder is its.
pub(super) fn is_result(splat: &Path, options: &ResultOptions) -> bool {
    let file = feature_3dgs::decoder_file(splat, options);
    file.is_some_and(|file| Tensors::open(&file).is_ok_and(|tensors| place(&tensors).is_some()))
}

/// Reads a result; `splat` has the properties.
pub(super) fn read(splat: &Path, options: &ResultOptions) -> Result<MethodResult, IoError> {
    let (cloud, codes) = feature_3dgs::with_features(splat)?;
    let what = "codes with a decoder (decoder_chkpnt<n>.pth in the folder of the run)";
    let file = folder::helper(None, feature_3dgs::decoder_file(splat, options), splat, what)?;
    let decoder = decoder(&file, codes.dim())?;
    if decoder.outputs() != CLIP {
        let what = format!(
            "embeddings of {} numbers, with which no phrase can be compared (CLIP's have {CLIP})",
            decoder.outputs()
        );
        return Err(IoError::Unsupported { path: file, what, remedy: "open its Gaussians alone" });
    }
    let level = EmbeddedLevel { codes: LevelCodes::Dense(codes), is_unit: false, decoder };
    MethodResult::of_one_cloud(Method::Gags, splat, cloud, vec![("features".into(), LevelValues::Embedded(level))])
}

/// Start of the layers' names in a decoder of this method.
fn place(tensors: &Tensors<'_>) -> Option<&'static str> {
    PLACES.into_iter().find(|place| tensors.shape(&format!("{place}0.weight")).is_some())
}

fn decoder(file: &Path, dim: usize) -> Result<Decoder, IoError> {
    let mut tensors = Tensors::open(file)?;
    let place = place(&tensors).unwrap_or(PLACES[0]);
    let count = tensors.names().filter(|n| n.starts_with(place) && n.ends_with(".weight")).count();
    if count != LAYERS {
        return Err(tensors.error(place, format!("has {count} layers; only the published decoder of {LAYERS} is read")));
    }
    let mut steps = Vec::new();
    for k in 0..LAYERS {
        // A ReLU lies between two layers, and has a number too.
        steps.push(DecoderStep::Linear(tensors.layer(&format!("{place}{}", 2 * k))?));
        if k + 1 < LAYERS {
            steps.push(DecoderStep::Relu);
        }
        if SKIPPING.contains(&k) {
            steps.push(DecoderStep::Keep);
        }
        if SKIPPING.iter().any(|from| from + 2 == k) {
            steps.push(DecoderStep::AddKept);
        }
    }
    Decoder::new(dim, steps, file)
}
