//! Feature 3DGS: `point_cloud.ply` with `semantic_0..`, and with `--speedup` a decoder in the folder of the run.

use std::path::Path;

use super::decoder::{Decoder, DecoderStep};
use super::face::{EmbeddedLevel, LevelCodes, LevelValues, Method, MethodResult};
use super::folder::{self, ResultOptions, number_in};
use super::rows;
use super::tensors::Tensors;
use crate::io::{IoError, files, splat_ply};

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
    let mut cloud = splat_ply::read(splat)?;
    let names: Vec<String> = (0..rows::count(&cloud, PREFIX)).map(|k| format!("{PREFIX}{k}")).collect();
    let features = rows::take(&mut cloud, &names, splat)?;
    let dim = features.dim();
    let decoder = match dim {
        LSEG => Decoder::none(dim),
        _ => {
            let here = files::folder_of(splat);
            let found = folder::highest(&[run.as_path(), here], |n| number_in(n, "decoder_chkpnt", ".pth"));
            if dim == 256 && found.is_none() && options.decoder.is_none() {
                let remedy = "open its Gaussians alone; with --speedup, put decoder_chkpnt<n>.pth beside them";
                return Err(unsupported("features of SAM, with which no phrase can be compared", remedy));
            }
            let what =
                format!("features of {dim} numbers with a decoder (decoder_chkpnt<n>.pth in the folder of the run)");
            decoder(&folder::helper(options.decoder.as_deref(), found, splat, &what)?, dim)?
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

fn decoder(file: &Path, dim: usize) -> Result<Decoder, IoError> {
    let mut tensors = Tensors::open(file)?;
    if tensors.names().any(|n| n.starts_with("module_state_dict")) {
        let what = "GAGS's decoder with skipped layers".into();
        return Err(IoError::Unsupported { path: file.into(), what, remedy: "open its Gaussians alone" });
    }
    Decoder::new(dim, vec![DecoderStep::Linear(tensors.layer("conv")?)], file)
}
