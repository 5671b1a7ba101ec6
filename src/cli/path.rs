//! `fmlgs path`: a flight through a scene.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use serde_json::json;

use super::scene_args::open_scene;
use super::{CliError, number, output, view};
use crate::jobs::go_to::{self, ApproachRequest, Explored};
use crate::jobs::{Scene, export, query};
use crate::measure::survey::{self, smoothness};
use crate::measure::table::rows;
use crate::navigate::flight::Smoothness;
use crate::navigate::target::{Side, ViewPreference};
use crate::navigate::{CameraTrajectory, FRAMES, Pose};
use crate::scene::LevelFilter;

/// Find a way through a scene, to what is asked for or to a photo
///
/// The way leads over the photos' cameras and places around them, keeps clear of occupied space, and ends
/// where the target is seen best. Exit code 1 if there is none.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs path scene/ --to \"the handle of the kettle\" --side other --out path.json\n  \
    fmlgs path scene/ --from 0 --to-photo 24 --compare\n  \
    fmlgs path scene/ --survey 100 --cameras 50 --cameras 200\n  \
    fmlgs render scene/ --path path.json --out video.mp4")]
pub(crate) struct PathArgs {
    /// Trained scene
    scene: PathBuf,
    /// Photo to start from, by index or name, or a JSON camera file [default: the first photo]
    #[arg(long)]
    from: Option<String>,
    /// Text of the object or part to go to
    #[arg(long, required_unless_present_any = ["to_photo", "survey"])]
    to: Option<String>,
    /// Photo to go to, by index or name, or a JSON camera file
    #[arg(long, conflicts_with = "to")]
    to_photo: Option<String>,
    /// Side from which the target is seen
    #[arg(long, value_enum, default_value_t = Side::Best)]
    side: Side,
    /// Distance to the target as a multiple of the usual one
    #[arg(long, default_value_t = 1.0, value_parser = number::within(0.01..=100.0))]
    distance: f64,
    /// Width by height of the image
    #[arg(long, default_value_t = 16.0 / 9.0, value_parser = number::within(0.05..=20.0))]
    aspect: f64,
    /// Poses of the flight
    #[arg(long, default_value_t = FRAMES as u32, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    frames: u32,
    /// Fly between this many random pairs of keypoints instead, and sum up how that went
    #[arg(long, value_name = "FLIGHTS", conflicts_with_all = ["to", "to_photo", "out", "compare"],
        value_parser = number::within(1..=10_000_usize))]
    survey: Option<usize>,
    /// With this many cameras: some left out, or more added nearby; may be given several times
    #[arg(long, requires = "survey", value_parser = number::within(1..=10_000_u32))]
    cameras: Vec<u32>,
    /// Also evaluate the paper's interpolation, as printed and through all keypoints of the route
    #[arg(long)]
    compare: bool,
    /// Write the flight as a camera path: .json of this program, or .nerfstudio.json
    #[arg(long)]
    out: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Returns the free space and camera poses of a scene, for planning flights in it.
fn explored(scene: &Scene) -> Arc<Explored> {
    let home = scene.home();
    Arc::new(Explored::new(Arc::clone(&scene.cloud), &scene.views(), home.up))
}

pub(crate) fn run(args: PathArgs) -> Result<(), CliError> {
    let scene = open_scene(&args.scene)?;
    if let Some(out) = &args.out {
        export::check(out, &[".json"], &scene.reads())?;
    }
    if let Some(flights) = args.survey {
        let own = scene.views();
        let counts = if args.cameras.is_empty() { vec![own.len() as u32] } else { args.cameras };
        let frames = args.frames as usize;
        let found = go_to::survey(&scene, &counts, flights, frames);
        return match args.json {
            true => output::print_json(&survey::documents(&found)),
            false => output::print(&output::table(&survey::table(&found))),
        };
    }
    let start = Instant::now();
    let explored = explored(&scene);
    let navigator = &explored.navigator;
    let build_ms = start.elapsed().as_secs_f64() * 1e3;
    let from = Pose::of(&view::choose(args.from.as_deref(), &scene)?);
    let start = Instant::now();
    let (flight, what) = match (&args.to, &args.to_photo) {
        (Some(query), _) => to_target(&args, query, &scene, &explored, from)?,
        (None, photo) => {
            let to = Pose::of(&view::choose(photo.as_deref(), &scene)?);
            let flight = explored.fly(&from, &to, args.frames as usize);
            (flight.map_err(|e| CliError::failed(explored.no_route(&e)))?, "the photo".to_owned())
        }
    };
    let route_ms = start.elapsed().as_secs_f64() * 1e3;
    if let Some(out) = &args.out {
        export::camera_path(out, &flight.camera_path(), args.aspect)?;
    }
    let ours = flight.smoothness(&navigator.occupancy, navigator.clearance);
    let [paper, through] = if args.compare { explored.of_paper(&flight) } else { [None, None] };
    if args.json {
        return output::print_json(&json!({
            "target": what,
            "frames": flight.poses.len(),
            "seconds": flight.seconds,
            "length": flight.length,
            "sharp_corners": flight.sharp,
            "poses_repaired": flight.repaired,
            "clearance": navigator.clearance,
            "keypoints": navigator.graph.keypoints.len(),
            "keypoints_in_matter": navigator.in_occupied,
            "smoothness": smoothness(&ours),
            "paper": paper.as_ref().map(smoothness),
            "paper_through_keypoints": through.as_ref().map(smoothness),
            "build_ms": build_ms,
            "route_ms": route_ms,
            "out": args.out,
        }));
    }
    let kinds = [("this", Some(&ours)), ("paper", paper.as_ref()), ("paper, through keypoints", through.as_ref())];
    let body = kinds.into_iter().filter_map(|(name, s)| Some(row(name, s?)));
    let table = rows(&["way", "largest step", "largest turn", "least clearance", "poses too near"], body);
    output::print(&format!(
        "to {what}: {:.2} units in {:.1} s, {} poses\n{}\ngraph built in {build_ms:.0} ms, route found in {route_ms:.0} ms",
        flight.length,
        flight.seconds,
        flight.poses.len(),
        output::table(&table)
    ))
}

fn to_target(
    args: &PathArgs,
    query: &str,
    scene: &Scene,
    explored: &Arc<Explored>,
    from: Pose,
) -> Result<(CameraTrajectory, String), CliError> {
    let map = scene.semantics()?;
    let id = query::identities(&map, &query::seen_from(scene, None), query, LevelFilter::Auto, 1)?[0];
    let (_, visited) = go_to::visit(ApproachRequest {
        explored: Some(Arc::clone(explored)),
        cloud: Arc::clone(&scene.cloud),
        cameras: scene.views(),
        up: scene.home().up,
        settings: scene.settings.clone(),
        map: Arc::new(map),
        id,
        preference: ViewPreference { side: args.side, distance: args.distance },
        from,
        aspect: args.aspect,
        frames: args.frames as usize,
    });
    match (visited.problem, visited.flight) {
        (None, Some(visit)) => Ok((visit.flight, visited.name)),
        (problem, _) => Err(CliError::failed(format!("{}: {}", visited.name, problem.unwrap_or_default()))),
    }
}

fn row(name: &str, s: &Smoothness) -> Vec<String> {
    vec![
        name.to_owned(),
        format!("{:.4}", s.largest_step),
        format!("{:.2}\u{b0}", s.largest_turn.to_degrees()),
        format!("{:.4}", s.least_clearance),
        s.violations.to_string(),
    ]
}
