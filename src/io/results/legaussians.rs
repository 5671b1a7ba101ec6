//! LEGaussians: `point_cloud.ply` with `clip_f_indices_0..7`, the decoder of these numbers in the folder of the run, and
//! the codebook of embeddings, which lies in the folder of the photos.

use std::path::{Path, PathBuf};

use super::decoder::{Decoder, DecoderStep, LinearLayer};
use super::face::{EmbeddedLevel, LevelCodes, LevelValues, Method, MethodResult};
use super::folder::{self, ResultOptions, number_in};
use super::rows;
use super::tensors::Tensors;
use crate::io::{IoError, files, gs_output, splat_ply};

/// Start of the properties' names.
pub(super) const PREFIX: &str = "clip_f_indices_";
/// Property beside them.
pub(super) const UNCERTAINTY: &str = "uncertainty";
/// Columns of the codebook that are CLIP's; DINO's follow.
const CLIP: usize = 512;

/// Reads a result; `splat` has the properties.
pub(super) fn read(splat: &Path, options: &ResultOptions) -> Result<MethodResult, IoError> {
    let mut cloud = splat_ply::read(splat)?;
    let names: Vec<String> = (0..rows::count(&cloud, PREFIX)).map(|k| format!("{PREFIX}{k}")).collect();
    let codes = rows::take(&mut cloud, &names, splat)?;
    rows::drop_extras(&mut cloud, |e| e.name == UNCERTAINTY);
    let run = folder::run_of(splat);
    let here = files::folder_of(splat);
    let found = folder::highest(&[run.as_path(), here], |n| number_in(n, "index_decoder_chkpnt", ".pth"));
    let what = "numbers of embeddings with a decoder (index_decoder_chkpnt<n>.pth in the folder of the run)";
    let file = folder::helper(None, found, splat, what)?;
    let what = "embeddings in a codebook (<name>_codebook.pt, in the folder of the run or of the photos)";
    let book = folder::helper(options.decoder.as_deref(), codebook(&run, splat), splat, what)?;
    let mut tensors = Tensors::open(&file)?;
    let [first, second, third] = ["conv1", "conv2", "conv3"].map(|name| tensors.layer(name));
    let linear = |layer| DecoderStep::Linear(layer);
    let steps = vec![
        DecoderStep::Unit,
        linear(first?),
        DecoderStep::Relu,
        linear(second?),
        DecoderStep::Relu,
        linear(third?),
        DecoderStep::Softmax,
        linear(entries(&book)?),
    ];
    let decoder = Decoder::new(codes.dim(), steps, &file)?;
    let level = EmbeddedLevel { codes: LevelCodes::Dense(codes), is_unit: false, decoder };
    let levels = vec![("features".into(), LevelValues::Embedded(level))];
    MethodResult::of_one_cloud(Method::LeGaussians, splat, cloud, levels)
}

/// CLIP's part of the entries.
fn entries(file: &Path) -> Result<LinearLayer, IoError> {
    let mut tensors = Tensors::open(file)?;
    let book = tensors.rows("embedding.weight")?;
    if book.dim() < CLIP {
        return Err(tensors.error("embedding.weight", format!("has {} columns, expected {CLIP} or more", book.dim())));
    }
    let mut clip = vec![0.0; book.len() * CLIP];
    clip.chunks_exact_mut(CLIP).enumerate().for_each(|(k, row)| book.copy(k, 0, row));
    LinearLayer::of_codebook([book.len(), CLIP], &clip, file)
}

fn codebook(run: &Path, splat: &Path) -> Option<PathBuf> {
    let source = gs_output::beside(splat).and_then(|beside| beside.source).and_then(|source| source.found);
    let photos = source.into_iter().flat_map(|s| [s.join("images"), s]);
    let folders = std::iter::once(run.to_owned()).chain(photos);
    let is = |name: &String| name.ends_with("_codebook.pt");
    folders.into_iter().find_map(|f| files::names_in(&f).ok()?.into_iter().find(is).map(|name| f.join(name)))
}
