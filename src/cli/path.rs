//! `fmlgs path`: a flight through a scene.

use std::path::PathBuf;
use std::time::Instant;

use glam::DVec3;
use serde_json::json;

use super::asking::{Asker, semantics};
use super::opened::DrawableScene;
use super::{CliError, number, opened, output, view};
use crate::io;
use crate::measure::survey::{self, smoothness};
use crate::measure::table::rows;
use crate::navigate::flight::Smoothness;
use crate::navigate::target::{Side, Wish};
use crate::navigate::visit::{NoVisit, Place};
use crate::navigate::{FRAMES, Flight, Navigator, NoWay, Pose, Speed};
use crate::pipeline::semantics::grammar::Kind;
use crate::scene::{Camera, CameraPath, PathKey};

/// Find a way through a scene, to what is asked for or to a photo
///
/// The way leads over the photos' cameras and places around them, keeps clear of matter, and ends
/// where the target is seen best. Exit code 1 if there is none.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs path scene/ --to \"the handle of the kettle\" --side other --out path.json\n  \
    fmlgs path scene/ --from 0 --to-photo 24 --compare\n  \
    fmlgs path scene/ --survey 100 --cameras 50 --cameras 200\n  \
    fmlgs render scene/ --path path.json --out film.mp4")]
pub struct Args {
    /// Trained scene
    scene: PathBuf,
    /// Photo to start from, by index or name, or a JSON camera file [default: the first photo]
    #[arg(long)]
    from: Option<String>,
    /// What to go to: an object or a part
    #[arg(long, required_unless_present_any = ["to_photo", "survey"])]
    to: Option<String>,
    /// Photo to go to, by index or name, or a JSON camera file
    #[arg(long, conflicts_with = "to")]
    to_photo: Option<String>,
    /// From which side the target is seen
    #[arg(long, value_enum, default_value_t = SideArg::Best)]
    side: SideArg,
    /// Distance to the target as a multiple of the usual one
    #[arg(long, default_value_t = 1.0, value_parser = number::within(0.01..=100.0))]
    distance: f64,
    /// Width by height of the picture
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
    /// Hold the paper's interpolation beside it, as it is printed and through all keypoints of the route
    #[arg(long)]
    compare: bool,
    /// Write the flight as a camera path: .json of this program, or .nerfstudio.json
    #[arg(long)]
    out: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum SideArg {
    /// Whichever shows it best
    Best,
    /// As it is seen now
    Same,
    /// The opposite
    Other,
    /// Its front
    Front,
    /// Its left, seen from the start
    Left,
    /// Its right, seen from the start
    Right,
    /// From above
    Above,
    /// From below
    Below,
}

impl From<SideArg> for Side {
    fn from(side: SideArg) -> Self {
        match side {
            SideArg::Best => Self::Best,
            SideArg::Same => Self::Same,
            SideArg::Other => Self::Other,
            SideArg::Front => Self::Front,
            SideArg::Left => Self::Left,
            SideArg::Right => Self::Right,
            SideArg::Above => Self::Above,
            SideArg::Below => Self::Below,
        }
    }
}

/// What moves about in a scene that was opened.
pub fn navigator(scene: &DrawableScene) -> Navigator {
    let cameras: Vec<Camera> = scene.cameras.iter().map(|c| c.camera.clone()).collect();
    Navigator::new(&scene.cloud, &cameras, up_of(&cameras))
}

/// Upwards for the cameras of a scene; as in files of splats where they do not tell.
pub fn up_of(cameras: &[Camera]) -> DVec3 {
    Camera::up_of(cameras.iter()).unwrap_or(DVec3::NEG_Y)
}

pub fn run(args: Args) -> Result<(), CliError> {
    let scene = opened::drawable(&args.scene)?;
    if let Some(out) = &args.out {
        output::check(out, &[".json"], &scene.reads(&args.scene))?;
    }
    if let Some(flights) = args.survey {
        let own: Vec<Camera> = scene.cameras.iter().map(|c| c.camera.clone()).collect();
        let counts = if args.cameras.is_empty() { vec![own.len() as u32] } else { args.cameras };
        let frames = args.frames as usize;
        let survey = |count: &u32| survey::surveyed(&scene.cloud, &own, *count as usize, flights, frames);
        let found: Vec<_> = counts.iter().map(survey).collect();
        return match args.json {
            true => output::print_json(&survey::documents(&found)),
            false => output::print(&output::table(&survey::table(&found))),
        };
    }
    let start = Instant::now();
    let navigator = navigator(&scene);
    let build_ms = start.elapsed().as_secs_f64() * 1e3;
    let from = Pose::of(&view::choose(args.from.as_deref(), &scene)?);
    let start = Instant::now();
    let (flight, what) = match (&args.to, &args.to_photo) {
        (Some(query), _) => to_target(&args, query, &scene, &navigator, &from)?,
        (None, photo) => {
            let to = Pose::of(&view::choose(photo.as_deref(), &scene)?);
            let flight = navigator.fly(&from, &to, None, args.frames as usize, Speed::Eased);
            (flight.map_err(|e| no_way(&e, &navigator))?, "the photo".to_owned())
        }
    };
    let route_ms = start.elapsed().as_secs_f64() * 1e3;
    if let Some(out) = &args.out {
        output::make_parent(out)?;
        let path = as_path(&flight);
        if out.to_string_lossy().ends_with(".nerfstudio.json") {
            io::camera_path::nerfstudio::write(out, &path, &path.keys, (1280, (1280.0 / args.aspect) as u32))?;
        } else {
            io::camera_path::write(out, &path)?;
        }
    }
    let ours = flight.smoothness(&navigator.matter, navigator.clearance);
    let [paper, through] = match (args.compare, flight.poses.as_slice()) {
        (true, [first, .., last]) => {
            let frames = args.frames as usize;
            let keys = navigator.keys(first, last).unwrap_or_default();
            [Flight::of_paper(&[*first, *last], frames), Flight::of_paper_through(&keys, frames)]
                .map(|p| p.map(|p| p.smoothness(&navigator.matter, navigator.clearance)))
        }
        _ => [None, None],
    };
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
            "keypoints_in_matter": navigator.in_matter,
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
        "to {what}: {:.2} units in {:.1} s, {} poses\n{}\nscene looked at in {build_ms:.0} ms, way found in {route_ms:.0} ms",
        flight.length,
        flight.seconds,
        flight.poses.len(),
        output::table(&table)
    ))
}

fn to_target(
    args: &Args,
    query: &str,
    scene: &DrawableScene,
    navigator: &Navigator,
    from: &Pose,
) -> Result<(Flight, String), CliError> {
    let map = semantics(&args.scene, scene.state.as_deref(), &scene.cloud)?;
    let answered = Asker::new(&map)?.ask(query, Kind::Auto)?;
    let id = answered.as_ref().and_then(|a| a.chosen(1).first().copied());
    let id = id.ok_or_else(|| CliError::failed(format!("nothing here fits '{query}'; see 'fmlgs query'")))?;
    if !(args.distance.is_finite() && args.distance > 0.0 && args.aspect.is_finite() && args.aspect > 0.0) {
        return Err(CliError::Usage("--distance and --aspect have to be over 0".into()));
    }
    let wish = Wish { side: args.side.into(), distance: args.distance };
    let place = Place { cloud: &scene.cloud, settings: &scene.settings, map: &map };
    let name = map.identities.full_name(id);
    match navigator.visit(place, id, wish, from, args.aspect, args.frames as usize) {
        Ok(visit) => Ok((visit.flight, name)),
        Err(NoVisit::NoWay { why, .. }) => Err(no_way(&why, navigator)),
        Err(e) => Err(CliError::failed(format!("{name}: {e}"))),
    }
}

/// Why there is no way, with how much of the scene hangs together.
fn no_way(why: &NoWay, navigator: &Navigator) -> CliError {
    let parts = navigator.graph.parts(&navigator.matter);
    let count = parts.iter().max().map_or(0, |m| m + 1);
    CliError::failed(format!("{why} ({} keypoints in {count} parts that are not connected)", parts.len()))
}

/// The flight as a path with a key per pose.
fn as_path(flight: &Flight) -> CameraPath {
    let last = (flight.poses.len() - 1).max(1) as f64;
    let time = |i: usize| Some(flight.seconds * i as f64 / last);
    let key = |(i, p): (usize, &Pose)| PathKey { time_secs: time(i), ..p.key() };
    let keys = flight.poses.iter().enumerate().map(key).collect();
    CameraPath { keys, closed: false, fps: last / flight.seconds.max(1e-3), seconds: flight.seconds }
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
