//! LangSplat, LangSplatV2, Occam's LGS and Dr.Splat: checkpoints whose tuple has language features at place 7, in one
//! file for each level.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::autoencoder;
use super::decoder::{Decoder, DecoderStep, LinearLayer};
use super::face::{EmbeddedLevel, LevelCodes, LevelValues, Method, MethodResult, ResultLevel};
use super::faiss;
use super::folder::ResultOptions;
use super::level_runs::LevelRuns;
use super::product::COARSE_BYTES;
use super::sparse::SparseRows;
use super::tensors::Tensors;
use crate::io::IoError;
use crate::scene::GaussianCloud;

/// Place of the language features in the tuple.
const FEATURES: &str = "0.7";
/// Place of LangSplatV2's codebook.
const CODEBOOK: &str = "0.8";
/// Numbers of an OpenCLIP embedding.
const CLIP: usize = 512;

/// Returns the method that wrote a checkpoint.
///
/// # Errors
/// If it holds something else; the error says what.
fn method(tensors: &Tensors<'_>, file: &Path) -> Result<Method, IoError> {
    let shape = tensors.shape(FEATURES).map(<[usize]>::to_vec);
    let (length, is_float) = (tensors.length("0"), tensors.is_float(FEATURES));
    match (length, shape.as_deref()) {
        (Some(14), Some([_, _])) if tensors.shape(CODEBOOK).is_some_and(|s| s.len() == 3) => Ok(Method::LangSplatV2),
        (Some(13), Some([_, 3])) if is_float => Ok(Method::LangSplat),
        (Some(13), Some([_, CLIP])) if is_float => Ok(Method::OccamsLgs),
        (Some(13), Some([_, bytes])) if !is_float && *bytes > COARSE_BYTES => Ok(Method::DrSplat),
        (Some(13), _) if tensors.shape("0.12").is_some_and(|s| s.len() == 3) => Err(IoError::Unsupported {
            path: file.into(),
            what: "a checkpoint of Feature 3DGS".into(),
            remedy: "open the folder of the run, whose point_cloud.ply has the same features",
        }),
        (Some(14), Some([_, 1])) => Err(IoError::Unsupported {
            path: file.into(),
            what: "a checkpoint of LEGaussians".into(),
            remedy: "open the folder of the run, whose point_cloud.ply has the same features",
        }),
        (Some(12), _) => Err(IoError::Unsupported {
            path: file.into(),
            what: "a training without language features (a tuple of 12 values)".into(),
            remedy: "open it as a splat",
        }),
        _ => {
            let what = match length {
                Some(n) => format!("a tuple of {n} values with {shape:?} at place 7"),
                None => "no tuple of a training".into(),
            };
            let remedy = "known are those of LangSplat, LangSplatV2, Occam's LGS and Dr.Splat";
            Err(IoError::Unsupported { path: file.into(), what, remedy })
        }
    }
}

/// Returns the method that wrote a checkpoint.
///
/// # Errors
/// As [`method()`], and if it is broken.
pub(super) fn method_of(file: &Path) -> Result<Method, IoError> {
    method(&Tensors::open(file)?, file)
}

/// Reads the levels of a result.
pub(super) fn read(runs: &LevelRuns, options: &ResultOptions) -> Result<MethodResult, IoError> {
    let mut kind = None;
    let mut levels: Vec<ResultLevel> = Vec::new();
    let mut decoder: Option<Decoder> = None;
    for run in &runs.levels {
        let file = run.checkpoint.as_path();
        let mut tensors = Tensors::open(file)?;
        let method = method(&tensors, file)?;
        if *kind.get_or_insert(method) != method {
            let what = format!("levels of different methods ({} here)", method.name());
            return Err(IoError::Unsupported { path: file.into(), what, remedy: "open one of its folders by itself" });
        }
        // Levels of LangSplat are trained on the same, unchanged Gaussians.
        let own = method == Method::OccamsLgs || levels.is_empty();
        let cloud = if own { None } else { levels.first().map(|l| l.cloud.clone()) };
        let cloud: Arc<GaussianCloud> = match cloud {
            Some(cloud) => cloud,
            None => Arc::new(tensors.cloud()?),
        };
        let level = match method {
            Method::LangSplatV2 => weights(&mut tensors, file, options)?,
            Method::OccamsLgs => EmbeddedLevel {
                codes: LevelCodes::Dense(tensors.half_rows(FEATURES)?),
                is_unit: false,
                decoder: Decoder::none(CLIP),
            },
            Method::DrSplat => product(&mut tensors, file, options)?,
            _ => {
                let codes = LevelCodes::Dense(tensors.rows(FEATURES)?);
                let decoder = match &mut decoder {
                    Some(decoder) => decoder.clone(),
                    none => none.insert(autoencoder::read(runs, options, codes.dim())?).clone(),
                };
                EmbeddedLevel { codes, is_unit: true, decoder }
            }
        };
        levels.push(ResultLevel { name: run.name.clone(), cloud, values: LevelValues::Embedded(level) });
    }
    let (Some(kind), Some(first)) = (kind, levels.first()) else {
        return Err(IoError::syntax(&runs.folder, "levels", "there are none"));
    };
    let cloud = first.cloud.clone();
    let beside: PathBuf = runs.levels[0].checkpoint.clone();
    MethodResult::new(kind, &beside, cloud, levels)
}

/// LangSplatV2's weights of a codebook.
fn weights(tensors: &mut Tensors<'_>, file: &Path, options: &ResultOptions) -> Result<EmbeddedLevel, IoError> {
    let shape = tensors.shape(CODEBOOK).unwrap_or_default().to_vec();
    let &[layers, entries, dim] = shape.as_slice() else {
        return Err(tensors.error(CODEBOOK, format!("has the shape {shape:?}")));
    };
    if layers != 1 {
        let what = format!("{layers} layers of codebooks, of which only one is read");
        return Err(IoError::Unsupported { path: file.into(), what, remedy: "train it with one (--vq_layer_num 1)" });
    }
    let logits = tensors.rows(FEATURES)?;
    if logits.dim() != entries || dim != CLIP {
        let reason = format!("has the shape {shape:?} for {} logits of each Gaussian", logits.dim());
        return Err(tensors.error(CODEBOOK, reason));
    }
    let weights = SparseRows::largest_shares(entries, &logits.to_vec(), options.top_k);
    let weights =
        weights.ok_or_else(|| tensors.error(FEATURES, format!("has no {} weights to keep", options.top_k)))?;
    let book = LinearLayer::of_codebook([entries, dim], &tensors.floats(CODEBOOK)?, file)?;
    let decoder = Decoder::new(entries, vec![DecoderStep::Linear(book)], file)?;
    Ok(EmbeddedLevel { codes: LevelCodes::Sparse(weights), is_unit: false, decoder })
}

/// Dr.Splat's numbers of entries of an index of FAISS.
fn product(tensors: &mut Tensors<'_>, file: &Path, options: &ResultOptions) -> Result<EmbeddedLevel, IoError> {
    let bytes: Vec<u8> = tensors.integers(FEATURES)?.into_iter().map(|v| v as u8).collect();
    let index = faiss::beside(file, options)?;
    let codes = LevelCodes::Product(index.codes(bytes)?);
    let decoder = Decoder::none(codes.dim());
    Ok(EmbeddedLevel { codes, is_unit: true, decoder })
}
