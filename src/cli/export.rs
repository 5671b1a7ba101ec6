//! `fmlgs export`: Gaussians as a `.ply` that other splat viewers open.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

use super::{CliError, output};
use crate::jobs::{export, open};
use crate::math::format;
use crate::scene::{Bounds, CropBox};

/// Write the Gaussians of a scene as a .ply for other splat viewers
///
/// The layout is that of the original 3D Gaussian Splatting. Reads whatever 'fmlgs info' recognizes
/// as Gaussians, compressed formats too; properties that the program does not know are kept.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs export scene/ --out scene.ply\n  \
    fmlgs export big.compressed.ply --out big.ply\n  \
    fmlgs export scene.ply --out flat.ply --sh-degree 0      smaller, same color from everywhere\n  \
    fmlgs export scene/ --out mug.ply --crop -1,-1,0,1,1,2     what is in a box, scene units")]
pub(crate) struct ExportArgs {
    /// Trained scene or splat file
    scene: PathBuf,
    /// The .ply to write
    #[arg(long)]
    out: PathBuf,
    /// Leave out spherical harmonics above this degree
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=3))]
    sh_degree: Option<u8>,
    /// Write only Gaussians whose centers are in this box, scene units
    #[arg(long, value_name = "MINX,MINY,MINZ,MAXX,MAXY,MAXZ", value_parser = parse_box, allow_hyphen_values = true)]
    crop: Option<Bounds>,
    /// Write what is outside of the box instead
    #[arg(long, requires = "crop")]
    outside: bool,
}

/// Two corners of a box, the smaller numbers first.
fn parse_box(text: &str) -> Result<Bounds, String> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|v| v.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    let Some(Ok([a, b, c, d, e, f])) = numbers.map(<[f64; 6]>::try_from) else {
        return Err("six numbers are needed: MINX,MINY,MINZ,MAXX,MAXY,MAXZ".into());
    };
    let (min, max) = (DVec3::new(a, b, c), DVec3::new(d, e, f));
    match min.cmple(max).all() {
        true => Ok(Bounds { min, max }),
        false => Err(format!("the box is empty: ({a}, {b}, {c}) is not below ({d}, {e}, {f})")),
    }
}

pub(crate) fn run(args: ExportArgs) -> Result<(), CliError> {
    let scene = open::scene(&args.scene)?;
    export::check(&args.out, &[".ply"], &scene.reads())?;
    let cloud = match args.crop {
        Some(bounds) => export::cropped(&scene.cloud, &CropBox { bounds, outside: args.outside })?.into(),
        None => scene.cloud,
    };
    let cloud = match args.sh_degree {
        Some(degree) => Arc::unwrap_or_clone(cloud).up_to_degree(degree).into(),
        None => cloud,
    };
    export::ply(&args.out, &cloud)?;
    let bytes = std::fs::metadata(&args.out).map_or(0, |m| m.len());
    let size = format::bytes(bytes);
    output::print(&format!("{}: {} Gaussians, SH degree {}, {size}", args.out.display(), cloud.len(), cloud.sh_degree))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_two_corners() {
        let parsed = parse_box("-1, 0,2.5,1,0,1e2").map(|b| (b.min, b.max));
        assert_eq!(parsed, Ok((DVec3::new(-1.0, 0.0, 2.5), DVec3::new(1.0, 0.0, 100.0))));
        for bad in ["", "1,2,3,4,5", "1,2,3,4,5,6,7", "a,0,0,1,1,1", "nan,0,0,1,1,1", "0,0,0,inf,1,1", "2,0,0,1,1,1"] {
            assert!(parse_box(bad).is_err(), "{bad}");
        }
    }
}
