//! `fmlgs import`: what another program trained becomes a scene of this one.

use std::path::PathBuf;

use super::progress::Console;
use super::result_args::ResultArgs;
use super::{CliError, number, output};
use crate::jobs::import::{self, ImportRequest, ImportedScene};
use crate::math::format::things;

/// Make a scene of what another program trained
///
/// Keeps the Gaussians, the cameras and the photos' place, and what a method found: classes of Gaussian Grouping and
/// Gaga, clusters of OpenGaussian, objects and parts of THGS and LaGa, and objects that HDBSCAN finds among the features
/// of SAGA and OmniSeg3D-GS, besides SAGA's saved selections with their names. The scene can be asked, edited and
/// exported like any other, and 'fmlgs preprocess' finds objects in one without. Embeddings of single Gaussians are not
/// kept: 'fmlgs query' asks the result itself. The result stays as it is.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs import gaussian-grouping/output/kitchen --out kitchen/\n  \
    fmlgs import saga/output/garden --scale 0.8 --out garden/\n  \
    fmlgs query kitchen/ \"class 3\" --mask mask.png")]
pub(crate) struct ImportArgs {
    /// Folder of the result or training, or one of its files
    result: PathBuf,
    /// Folder for the new scene
    #[arg(long)]
    out: PathBuf,
    /// Scale of SAGA's objects, from 0 (details) to 1 (the largest things) [default: 0.5]
    #[arg(long, value_parser = number::within(0.0..=1.0_f32))]
    scale: Option<f32>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    files: ResultArgs,
}

pub(crate) fn run(args: ImportArgs, quiet: bool) -> Result<(), CliError> {
    let options = args.files.options();
    let request = ImportRequest { path: args.result, out: args.out, scale: args.scale, options };
    let done = import::run(&request, &mut Console::new(quiet || args.json));
    let done =
        done.map_err(|e| if e.is_cancelled() { CliError::Cancelled("nothing was written".into()) } else { e.into() })?;
    if args.json {
        return output::print_json(&done);
    }
    output::print(&in_words(&done))
}

fn in_words(done: &ImportedScene) -> String {
    let mut text = format!("{}: {}", done.scene.display(), things(done.gaussians, "Gaussian"));
    if let Some(method) = done.method {
        text += &format!(" of {method}");
    }
    if done.objects > 0 {
        text += &format!(", {}", things(done.objects, "object"));
    }
    if done.parts > 0 {
        text += &format!(", {}", things(done.parts, "part"));
    }
    if done.cameras > 0 {
        text += &format!(", {}", things(done.cameras, "camera"));
    }
    if let Some(photos) = &done.photos {
        text += &format!("\nphotos: {}", photos.display());
    }
    if let Some(left_out) = &done.left_out {
        text += &format!("\nnot kept: {left_out}");
    }
    text
}
