//! `fmlgs export`: Gaussians as a `.ply` that other splat viewers open.

use std::path::PathBuf;

use super::{CliError, opened, output};
use crate::io::splat_ply;
use crate::math::sh;
use crate::scene::GaussianCloud;

/// Write the Gaussians of a scene as a .ply for other splat viewers
///
/// The layout is that of the original 3D Gaussian Splatting. Reads whatever 'fmlgs info' recognises
/// as Gaussians, compressed formats too; properties that the program does not know are kept.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs export scene/ --out scene.ply\n  \
    fmlgs export big.compressed.ply --out big.ply\n  \
    fmlgs export scene.ply --out flat.ply --sh-degree 0      smaller, same colour from everywhere")]
pub struct Args {
    /// Trained scene or splat file
    scene: PathBuf,
    /// The .ply to write
    #[arg(long)]
    out: PathBuf,
    /// Leave out spherical harmonics above this degree
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=3))]
    sh_degree: Option<u8>,
}

pub fn run(args: Args) -> Result<(), CliError> {
    let scene = opened::drawable(&args.scene)?;
    output::check(&args.out, &[".ply"], &scene.reads(&args.scene))?;
    let mut cloud = scene.cloud;
    if let Some(degree) = args.sh_degree {
        limit_degree(&mut cloud, degree);
    }
    output::make_parent(&args.out)?;
    splat_ply::write(&args.out, &cloud)?;
    let bytes = std::fs::metadata(&args.out).map_or(0, |m| m.len());
    let size = indicatif::HumanBytes(bytes);
    output::print(&format!("{}: {} Gaussians, SH degree {}, {size}", args.out.display(), cloud.len(), cloud.sh_degree))
}

/// Drops the bands above `degree`.
fn limit_degree(cloud: &mut GaussianCloud, degree: u8) {
    if degree >= cloud.sh_degree {
        return;
    }
    let (stride, kept) = (cloud.sh_stride(), sh::coefficients(degree));
    cloud.sh = cloud.sh.chunks_exact(stride).flat_map(|one| &one[..kept]).copied().collect();
    cloud.sh_degree = degree;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lower_bands_survive() {
        let mut cloud = GaussianCloud {
            positions: vec![[0.0; 3]; 2],
            sh_degree: 1,
            sh: (0..8).map(|i| [i as f32; 3]).collect(),
            ..GaussianCloud::default()
        };
        limit_degree(&mut cloud, 2);
        assert_eq!(cloud.sh.len(), 8);
        limit_degree(&mut cloud, 0);
        assert_eq!(cloud.sh, [[0.0; 3], [4.0; 3]]);
        assert_eq!(cloud.sh_degree, 0);
    }
}
