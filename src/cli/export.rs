//! `fmlgs export`: Gaussians as a `.ply` that other splat viewers open.

use std::path::PathBuf;
use std::sync::Arc;

use super::{CliError, output};
use crate::jobs::{export, open};
use crate::math::format;

/// Write the Gaussians of a scene as a .ply for other splat viewers
///
/// The layout is that of the original 3D Gaussian Splatting. Reads whatever 'fmlgs info' recognizes
/// as Gaussians, compressed formats too; properties that the program does not know are kept.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs export scene/ --out scene.ply\n  \
    fmlgs export big.compressed.ply --out big.ply\n  \
    fmlgs export scene.ply --out flat.ply --sh-degree 0      smaller, same color from everywhere")]
pub(crate) struct ExportArgs {
    /// Trained scene or splat file
    scene: PathBuf,
    /// The .ply to write
    #[arg(long)]
    out: PathBuf,
    /// Leave out spherical harmonics above this degree
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=3))]
    sh_degree: Option<u8>,
}

pub(crate) fn run(args: ExportArgs) -> Result<(), CliError> {
    let scene = open::scene(&args.scene)?;
    export::check(&args.out, &[".ply"], &scene.reads())?;
    let cloud = match args.sh_degree {
        Some(degree) => Arc::unwrap_or_clone(scene.cloud).up_to_degree(degree).into(),
        None => scene.cloud,
    };
    export::ply(&args.out, &cloud)?;
    let bytes = std::fs::metadata(&args.out).map_or(0, |m| m.len());
    let size = format::bytes(bytes);
    output::print(&format!("{}: {} Gaussians, SH degree {}, {size}", args.out.display(), cloud.len(), cloud.sh_degree))
}
