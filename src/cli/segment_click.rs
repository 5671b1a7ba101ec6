//! `fmlgs segment --click`: Gaussians by places in a view instead of words, and a name for them; or a correction of what
//! has a name.

use std::path::PathBuf;
use std::sync::Arc;

use super::export::MeasureArgs;
use super::progress::Console;
use super::{CliError, number, output, view};
use crate::io::scene_files::SELECTION_FILE;
use crate::jobs::edit::{self, EditRequest};
use crate::jobs::select::{self, PrepareRequest, SelectFor, SelectRequest, SelectStep, Selected, Stroke, kept_as};
use crate::jobs::{Scene, query};
use crate::math::format;
use crate::scene::{LevelFilter, Mask, NO_IDENTITY};

/// Radius of a click as a share of the view's width.
const CLICK: f32 = 0.006;

#[derive(Debug, clap::Args)]
pub(crate) struct ClickArgs {
    /// Select what is at this place of the view instead of asking in words: x,y in px of the photo; may be given again
    #[arg(long, value_parser = place, value_name = "X,Y", conflicts_with_all = ["text", "all", "rest"])]
    pub(crate) click: Vec<[f32; 2]>,
    /// Place in the view that does not belong to it: x,y in px of the photo; may be given again
    #[arg(long, value_parser = place, value_name = "X,Y", requires = "click")]
    click_out: Vec<[f32; 2]>,
    /// The view that is clicked in: an index, a photo's name or a camera file [default: the scene's first view]
    #[arg(long, requires = "click")]
    view: Option<String>,
    /// Width of a click, px of the view [default: 1.2 % of its width]
    #[arg(long, requires = "click", value_name = "PX", value_parser = number::within(1.0..=64.0_f32))]
    width: Option<f32>,
    /// Correct the object or part that this asks for, and keep it: clicks add to it, --click-out removes
    #[arg(long, requires = "click", value_name = "TEXT", conflicts_with_all = ["keep", "part_of"])]
    correct: Option<String>,
    /// Keep what is selected in the scene, as an object of this name
    #[arg(long, requires = "click")]
    keep: Option<String>,
    /// Keep it as a part of what this asks for
    #[arg(long, requires = "keep", value_name = "TEXT")]
    part_of: Option<String>,
}

fn place(text: &str) -> Result<[f32; 2], String> {
    let number = |s: &str| s.trim().parse::<f32>().ok().filter(|v| v.is_finite() && *v >= 0.0);
    let both = text.split_once(',').and_then(|(x, y)| Some([number(x)?, number(y)?]));
    both.ok_or_else(|| "two numbers are needed, for example 320,200".to_owned())
}

/// Selects what is clicked on, keeps it if that is wanted, and writes it to `out`.
pub(crate) fn run(
    scene: &Scene,
    args: &ClickArgs,
    measure: &MeasureArgs,
    out: Option<&PathBuf>,
    quiet: bool,
) -> Result<(), CliError> {
    let map = Arc::new(scene.known_semantics()?.unwrap_or_else(|| select::empty_map(&scene.cloud)));
    let whole = match &args.part_of {
        Some(text) => query::identities(&map, &query::seen_from(scene, None), text, LevelFilter::Auto, 1)?
            .first()
            .copied()
            .unwrap_or(NO_IDENTITY),
        None => NO_IDENTITY,
    };
    let purpose = match &args.correct {
        Some(text) => {
            let place = query::seen_from(scene, None);
            SelectFor::Extent(query::one_named(&map, &place, text, LevelFilter::Auto)?)
        }
        None => SelectFor::New(whole),
    };
    let full = view::choose(args.view.as_deref(), scene)?;
    let radius_px = args.width.map_or(CLICK * full.width_px as f32, |width| 0.5 * width);
    let camera = Stroke::view(&full, radius_px);
    let scale = camera.width_px as f32 / full.width_px as f32;
    let mut console = Console::new(quiet);
    let request = PrepareRequest {
        cloud: Arc::clone(&scene.cloud),
        settings: scene.settings.clone(),
        cameras: scene.views(),
        home: scene.home(),
        file: scene.folder.as_ref().map(|folder| folder.join(SELECTION_FILE)),
    };
    let prepared = Arc::new(select::prepare(&request, &mut console)?);
    let mut selected: Option<Arc<Selected>> = None;
    let clicks = args.click.iter().map(|at| (at, true)).chain(args.click_out.iter().map(|at| (at, false)));
    for (at, is_plus) in clicks {
        if at[0] >= full.width_px as f32 || at[1] >= full.height_px as f32 {
            let size = format!("{} x {} px", full.width_px, full.height_px);
            return Err(CliError::failed(format!("{},{} lies outside the view, which has {size}", at[0], at[1])));
        }
        let (w, h) = (camera.width_px as usize, camera.height_px as usize);
        let radius = (scale * radius_px).max(std::f32::consts::FRAC_1_SQRT_2);
        let near = |i: usize| {
            let [dx, dy] = [(i % w) as f32 + 0.5 - scale * at[0], (i / w) as f32 + 0.5 - scale * at[1]];
            dx.hypot(dy) <= radius
        };
        let stroke = Stroke { camera: camera.clone(), pixels: Mask::from_fn(w, h, near), is_plus };
        let request = SelectRequest {
            cloud: Arc::clone(&scene.cloud),
            settings: scene.settings.clone(),
            map: Arc::clone(&map),
            purpose: purpose.clone(),
            prepared: Some(Arc::clone(&prepared)),
            before: selected,
            step: SelectStep::Stroke(stroke),
        };
        selected = Some(Arc::new(select::run(&request, &mut console)?));
    }
    // Clears the progress bar before the result is printed.
    drop(console);
    let selected = selected.filter(|s| !s.gaussians.is_empty());
    let nothing = || match purpose {
        SelectFor::New(_) => CliError::failed("nothing is at the places that were clicked on"),
        SelectFor::Extent(id) => {
            CliError::failed(format!("nothing would be left of '{}'", map.identities.full_name(id)))
        }
    };
    let selected = selected.ok_or_else(nothing)?;
    let mut lines = Vec::new();
    let [count, all] = [selected.gaussians.len(), scene.cloud.len()].map(|n| format::count(n as u64));
    let count = format!("{count} of {all} Gaussians");
    if let Some(out) = out {
        let kept: Vec<usize> = selected.gaussians.iter().map(|i| *i as usize).collect();
        lines.push(count.clone());
        lines.extend(measure.write(scene.cloud.select(&kept), out, scene, quiet)?.lines());
    }
    if args.keep.is_some() || args.correct.is_some() {
        let folder = scene.folder.as_ref().ok_or_else(|| {
            CliError::failed(format!("{} is a bare splat: names are kept in trained scenes", scene.path.display()))
        })?;
        let name = args.keep.clone().unwrap_or_default();
        let request = EditRequest::Apply(kept_as(&purpose, name, selected.gaussians.clone()));
        let new = edit::apply(&scene.cloud, &map, &request)?;
        edit::store(folder, scene.state.as_deref(), &new, &scene.cloud)?;
        let (done, id) = match purpose {
            SelectFor::New(_) => ("kept as", new.identities.len() as crate::scene::IdentityId),
            SelectFor::Extent(id) => ("corrected", id),
        };
        let name = new.identities.full_name(id);
        lines.push(format!("{done} '{name}': {count}"));
        let emptied = edit::emptied(&map, &new);
        lines.extend(emptied.iter().map(|emptied| format!("left without Gaussians: '{emptied}'")));
    }
    output::print(&lines.join("\n"))
}
