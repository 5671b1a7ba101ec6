//! `fmlgs export`: Gaussians as a file that other splat viewers open, and a scene as a page to show.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::progress::Console;
use super::scene_args::AxesArgs;
use super::{CliError, output};
use crate::jobs::export_splat::{self, ExportedSplat, LossViews};
use crate::jobs::page::{self, PageRequest};
use crate::jobs::{Scene, export};
use crate::math::format;
use crate::scene::{Bounds, CropBox, GaussianCloud};

/// Write the Gaussians of a scene for other splat viewers, or the scene as a page to show
///
/// The ending of --out chooses the format: .ply (3D Gaussian Splatting's own, without loss), .compressed.ply, .spz,
/// .sog, meta.json (a SOG as files in a folder), .splat, .glb or .gltf (KHR_gaussian_splatting). Reads whatever 'fmlgs
/// info' recognizes as Gaussians, .ksplat too. What was written is read back, and both are drawn from a few cameras:
/// PSNR between the pictures says what was lost. The page is one .html that opens in any browser without a server, with
/// the objects' names to click and camera paths: those given and those that lie in the scene's folder.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs export scene/ --out scene.ply\n  \
    fmlgs export scene/ --out scene.sog                        a tenth of the size\n  \
    fmlgs export scene/ --html page.html --title \"The workshop\"\n  \
    fmlgs export big.compressed.ply --out big.glb\n  \
    fmlgs export scene.ply --out flat.ply --sh-degree 0        smaller, same color from everywhere\n  \
    fmlgs export scene/ --out mug.ply --crop -1,-1,0,1,1,2     what is in a box, scene units")]
pub(crate) struct ExportArgs {
    /// Trained scene or splat file
    scene: PathBuf,
    /// File to write, in the format of its ending
    #[arg(long, required_unless_present = "html")]
    out: Option<PathBuf>,
    #[command(flatten)]
    axes: AxesArgs,
    #[command(flatten)]
    measure: MeasureArgs,
    /// The page (.html) to write
    #[arg(long)]
    html: Option<PathBuf>,
    /// The page's title [default: the scene's name]
    #[arg(long, requires = "html")]
    title: Option<String>,
    /// Camera path for the page to play; may be given several times
    #[arg(long, value_name = "FILE", requires = "html")]
    path: Vec<PathBuf>,
    /// Leave out spherical harmonics above this degree
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=3))]
    sh_degree: Option<u8>,
    /// Write only Gaussians whose centers are in this box, scene units
    #[arg(long, value_name = "MINX,MINY,MINZ,MAXX,MAXY,MAXZ", value_parser = parse_box, allow_hyphen_values = true)]
    crop: Option<Bounds>,
    /// Write what is outside of the box instead
    #[arg(long, requires = "crop")]
    outside: bool,
    /// Print one JSON document of what --out wrote
    #[arg(long, requires = "out", conflicts_with = "html")]
    json: bool,
}

/// Option to leave out measuring what was written.
#[derive(Debug, clap::Args)]
pub(crate) struct MeasureArgs {
    /// Do not draw what was written to measure what was lost
    #[arg(long)]
    no_measure: bool,
}

impl MeasureArgs {
    /// Writes Gaussians of a scene and says what came of it.
    pub(crate) fn write(
        &self,
        cloud: GaussianCloud,
        out: &Path,
        scene: &Scene,
        quiet: bool,
    ) -> Result<ExportedSplat, CliError> {
        let views = (!self.no_measure).then(|| LossViews::of(scene));
        let done = export_splat::run(&Arc::new(cloud), out, views.as_ref(), &mut Console::new(quiet));
        done.map_err(|e| CliError::of_work(e, "what was there before is unchanged"))
    }
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

pub(crate) fn run(args: ExportArgs, quiet: bool) -> Result<(), CliError> {
    let mut scene = args.axes.open(&args.scene)?;
    let reads: Vec<&Path> = scene.reads().into_iter().chain(args.path.iter().map(PathBuf::as_path)).collect();
    if let Some(out) = &args.out {
        export_splat::check(out, &reads)?;
    }
    if let Some(html) = &args.html {
        export::check(html, &page::ENDINGS, &reads)?;
    }
    if let Some(degree) = args.sh_degree {
        scene.cloud = Arc::new(Arc::unwrap_or_clone(scene.cloud).up_to_degree(degree));
    }
    let crop = args.crop.map(|bounds| CropBox { bounds, outside: args.outside });
    if let Some(out) = &args.out {
        let cloud = match &crop {
            Some(crop) => export::cropped(&scene.cloud, crop)?,
            None => (*scene.cloud).clone(),
        };
        let done = args.measure.write(cloud, out, &scene, quiet)?;
        match args.json {
            true => output::print_json(&done)?,
            false => output::print(&done.lines().join("\n"))?,
        }
    }
    match &args.html {
        Some(html) => write_page(html, &scene, crop.as_ref(), &args, quiet),
        None => Ok(()),
    }
}

fn write_page(
    html: &Path,
    scene: &Scene,
    crop: Option<&CropBox>,
    args: &ExportArgs,
    quiet: bool,
) -> Result<(), CliError> {
    let given = args.path.iter().map(|file| page::named_path(file)).collect::<Result<Vec<_>, _>>()?;
    let mut request = PageRequest::of_scene(scene, html)?;
    // A path that is given and lies in the scene's folder is one.
    request.paths.retain(|(_, path)| given.iter().all(|(_, other)| other != path));
    request.paths.splice(0..0, given);
    if let Some(title) = &args.title {
        request.title.clone_from(title);
    }
    if let Some(crop) = crop {
        request.crop(crop);
    }
    let bytes =
        page::run(&request, &mut Console::new(quiet)).map_err(|e| CliError::of_work(e, "nothing is written"))?;
    let (paths, size) = (format::things(request.paths.len(), "camera path"), format::bytes(bytes));
    output::print(&format!("{}: {}, {paths}, {size}", html.display(), request.facts()))
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
