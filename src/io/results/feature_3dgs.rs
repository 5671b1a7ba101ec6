//! Feature 3DGS: `point_cloud.ply` with `semantic_0..`, and with `--speedup` a decoder in the folder of the run.

use std::path::{Path, PathBuf};

use super::decoder::{Decoder, DecoderStep};
use super::face::{EmbeddedLevel, LevelCodes, LevelValues, Method, MethodResult};
use super::folder::{self, ResultOptions, number_in};
use super::rows::{self, FeatureRows};
use super::tensors::Tensors;
use crate::io::{IoError, files, splat_ply};
use crate::scene::GaussianCloud;

/// Start of the properties' names.
pub(super) const PREFIX: &str = "semantic_";
/// Numbers of LSeg's features, which are compared with texts.
const LSEG: usize = 512;

/// Reads a result; `splat` has the properties.
pub(super) fn read(splat: &Path, options: &ResultOptions) -> Result<MethodResult, IoError> {
    let run = folder::run_of(splat);
    let unsupported = |what: &str, remedy| IoError::Unsupported { path: splat.into(), what: what.into(), remedy };
    if run.join("feature_CLIP_pair.pt").is_file() {
        return Err(unsupported("COS3D's map from instances to language", "open its Gaussians alone"));
    }
    let (cloud, features) = with_features(splat)?;
    let dim = features.dim();
    let decoder = match dim {
        LSEG => Decoder::none(dim),
        _ => {
            let file = decoder_file(splat, options);
            if dim == 256 && file.is_none() {
                let remedy = "open its Gaussians alone; with --speedup, put decoder_chkpnt<n>.pth beside them";
                return Err(unsupported("features of SAM, with which no phrase can be compared", remedy));
            }
            let what =
                format!("features of {dim} numbers with a decoder (decoder_chkpnt<n>.pth in the folder of the run)");
            decoder(&folder::helper(None, file, splat, &what)?, dim)?
        }
    };
    if decoder.outputs() != LSEG {
        let what = format!(
            "features of {} numbers, with which no phrase can be compared (LSeg's have 512)",
            decoder.outputs()
        );
        return Err(unsupported(&what, "open its Gaussians alone"));
    }
    let codes = LevelCodes::Dense(features);
    let level = LevelValues::Embedded(EmbeddedLevel { codes, is_unit: false, decoder });
    MethodResult::of_one_cloud(Method::Feature3dgs, splat, cloud, vec![("features".into(), level)])
}

/// Reads the Gaussians and the features among their properties.
pub(super) fn with_features(splat: &Path) -> Result<(GaussianCloud, FeatureRows), IoError> {
    let mut cloud = splat_ply::read(splat)?;
    let names: Vec<String> = (0..rows::count(&cloud, PREFIX)).map(|k| format!("{PREFIX}{k}")).collect();
    let features = rows::take(&mut cloud, &names, splat)?;
    Ok((cloud, features))
}

/// The decoder that an option names, or that of the latest iteration.
pub(super) fn decoder_file(splat: &Path, options: &ResultOptions) -> Option<PathBuf> {
    let (run, here) = (folder::run_of(splat), files::folder_of(splat));
    let found = || folder::highest(&[run.as_path(), here], |n| number_in(n, "decoder_chkpnt", ".pth"));
    options.decoder.clone().or_else(found)
}

fn decoder(file: &Path, dim: usize) -> Result<Decoder, IoError> {
    let mut tensors = Tensors::open(file)?;
    Decoder::new(dim, vec![DecoderStep::Linear(tensors.layer("conv")?)], file)
}
