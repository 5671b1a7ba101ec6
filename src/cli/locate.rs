//! `fmlgs locate`: the poses of photos that nobody posed.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::progress::Console;
use super::scene_args::open_scene;
use super::{CliError, number, output};
use crate::jobs::Scene;
use crate::jobs::locate::check::{self, CheckSummary, CheckedChange, CheckedPicture, LocateCheck, LocateCheckOptions};
use crate::jobs::locate::{self, DEFAULT_PX, LocateOptions, LocatedPhoto, MOST_PX, write};
use crate::math::format;

/// Find where photos were taken that nobody posed
///
/// Each photo is compared with the scene from its training cameras; matching points give a pose, and the colors are
/// aligned. The focal length is that of the scene's photos of the same size, else EXIF's, else found with the pose.
/// Photos that do not show the scene are refused; if none is located, the exit code is 1.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs locate scene/ photo.jpg\n  \
    fmlgs locate scene/ new/*.jpg --out new/transforms.json\n  \
    fmlgs locate scene/ photo.jpg --focal-px 2950 --json\n  \
    fmlgs locate scene/ --check                     held-out photos, whose poses are hidden\n  \
    fmlgs locate scene/ --check --check-others fox/ none of which should be accepted")]
pub(crate) struct LocateArgs {
    /// Trained scene or splat file
    scene: PathBuf,
    /// Photos to locate
    #[arg(required_unless_present = "check", conflicts_with = "check")]
    files: Vec<PathBuf>,
    /// Focal length of the photos at full size, px
    #[arg(long, value_parser = number::within(1.0..=1e6))]
    focal_px: Option<f64>,
    /// Longer side of the pictures whose colors are aligned, px: larger is finer and slower
    #[arg(long, default_value_t = DEFAULT_PX, value_parser = clap::value_parser!(u32).range(96..=i64::from(MOST_PX)))]
    max_side: u32,
    /// Dataset with the scene's own photos [default: where the scene's photos are]
    #[arg(long)]
    photos: Option<PathBuf>,
    /// File for the poses that were found, as a transforms.json beside the photos
    #[arg(long)]
    out: Option<PathBuf>,
    /// Measure instead: locate the held-out photos of the scene and pictures of noise
    #[arg(long)]
    check: bool,
    /// Dataset of something else whose photos are located, too; none should be accepted
    #[arg(long, value_name = "PHOTOS")]
    check_others: Option<PathBuf>,
    /// Hide the focal lengths of the measured photos, too
    #[arg(long)]
    unknown_focal: bool,
    /// Locate changed copies, too: brighter, darker, in warmer light, blurred, partly hidden, and zoomed
    #[arg(long)]
    check_changes: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

impl LocateArgs {
    fn options(&self) -> LocateOptions {
        LocateOptions { focal_px: self.focal_px, finest_px: self.max_side, dataset: self.photos.clone() }
    }
}

pub(crate) fn run(args: &LocateArgs, quiet: bool) -> Result<(), CliError> {
    let scene = open_scene(&args.scene)?;
    let mut console = Console::new(quiet || args.json);
    if args.check {
        return measure(args, &scene, console);
    }
    if let Some(out) = &args.out {
        let reads: Vec<&Path> = scene.reads().into_iter().chain(args.files.iter().map(PathBuf::as_path)).collect();
        write::check(out, &args.files, &reads)?;
    }
    let (job, found) = locate::run(&scene, &args.files, &args.options(), &mut console)
        .map_err(|e| CliError::of_work(e, "no poses were written"))?;
    drop(console);
    let located = found.iter().filter(|f| f.located).count();
    if let Some(out) = args.out.as_ref().filter(|_| located > 0) {
        write::transforms(out, &found)?;
    }
    if args.json {
        output::print_json(&json!({
            "photos": found, "located": located, "radius": job.radius, "prepare_secs": job.prepare_secs,
            "out": args.out.as_ref().filter(|_| located > 0),
        }))?;
    } else {
        let mut text: Vec<String> = found.iter().map(|f| line(f, job.radius)).collect();
        if let Some(out) = args.out.as_ref().filter(|_| located > 0) {
            text.push(format!("wrote the poses of {} to {}", format::things(located, "photo"), out.display()));
        }
        output::print(&text.join("\n"))?;
    }
    match located {
        0 => Err(CliError::failed("no photo was located in this scene")),
        _ => Ok(()),
    }
}

/// A photo in words.
fn line(found: &LocatedPhoto, radius: f64) -> String {
    let name = found.photo.display();
    let Some(place) = found.place.as_ref().filter(|_| found.located) else {
        return format!("{name}: not located: {}", found.problem.as_deref().unwrap_or_default());
    };
    let (c, toward) = (place.camera.center, place.camera.world_from_camera.z_axis);
    let sure = match (place.center_deviation, place.rotation_deviation_deg) {
        (Some(center), Some(turn)) => {
            format!(" (\u{b1} {:.2} % of the radius, {turn:.2}\u{b0})", 100.0 * center / radius)
        }
        _ => String::new(),
    };
    format!(
        "{name}: at ({:.4}, {:.4}, {:.4}) toward ({:.3}, {:.3}, {:.3}){sure}, focal length {:.0} px; {:.0} % explained, \
         {} agree, {:.1} s",
        c.x,
        c.y,
        c.z,
        toward.x,
        toward.y,
        toward.z,
        place.camera.focal_px.x,
        100.0 * place.explained,
        format::things(place.agreeing, "place"),
        found.secs
    )
}

/// Locates held-out photos and pictures of other things.
fn measure(args: &LocateArgs, scene: &Scene, mut console: Console) -> Result<(), CliError> {
    let wanted = LocateCheckOptions {
        others: args.check_others.clone(),
        unknown_focal: args.unknown_focal,
        changes: args.check_changes,
    };
    let found = check::run(scene, &args.options(), &wanted, &mut console).map_err(CliError::of_views)?;
    drop(console);
    if args.json { output::print_json(&found) } else { output::print(&report(&found)) }
}

/// The measurement as a table and in words.
fn report(found: &LocateCheck) -> String {
    let head = ["photo", "center %", "degrees", "explained %", "correlation", "agree", "s", ""];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    let row = |p: &CheckedPicture, errors: [String; 2], remark: &str| {
        let [center, turn] = errors;
        let explained = format!("{:.0}", 100.0 * p.explained);
        let (correlation, secs) = (format!("{:.2}", p.correlation), format!("{:.1}", p.secs));
        vec![p.name.clone(), center, turn, explained, correlation, p.agreeing.to_string(), secs, remark.to_owned()]
    };
    rows.extend(found.photos.iter().map(|p| {
        let errors = [100.0 * p.center_error, p.rotation_error_deg].map(|error| format!("{error:.3}"));
        row(&p.picture, errors, if p.picture.accepted { "" } else { "refused" })
    }));
    let wrong = found.others.iter().chain(&found.noises).filter(|o| o.accepted);
    rows.extend(wrong.map(|o| row(o, Default::default(), "accepted wrongly")));
    let CheckSummary { photos, accepted, within_bounds: [good, right], accepted_wrongly, .. } = found.summary;
    let [center, turn, secs] = [found.summary.center_error, found.summary.rotation_error_deg, found.summary.secs];
    let mut text = output::table(&rows);
    text += &format!(
        "\n\n{accepted} of {photos} held-out photos accepted, {accepted_wrongly} of them wrongly; {good} within 0.5 % of the \
         radius and 0.3 degrees, {right} within 2 % and 1 degree\nmedian {:.3} % and {:.3} degrees, 95 % within {:.3} % \
         and {:.3} degrees; {:.1} s a photo (95 % within {:.1} s), after {:.1} s for the scene",
        100.0 * center[0],
        turn[0],
        100.0 * center[1],
        turn[1],
        secs[0],
        secs[1],
        found.prepare_secs
    );
    if !found.changes.is_empty() {
        let head = ["change", "accepted", "wrongly", "within 2 %, 1\u{b0}", "median %", "degrees", "s"];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        rows.extend(found.changes.iter().map(|CheckedChange { change, summary: s, .. }| {
            let of_all = |n: usize| format!("{n} of {}", s.photos);
            let [center, turn, secs] =
                [100.0 * s.center_error[0], s.rotation_error_deg[0], s.secs[0]].map(|v| format!("{v:.3}"));
            let wrongly = s.accepted_wrongly.to_string();
            vec![(*change).to_owned(), of_all(s.accepted), wrongly, of_all(s.within_bounds[1]), center, turn, secs]
        }));
        text += &format!("\n\n{}", output::table(&rows));
    }
    let CheckSummary { others, others_accepted, noises, noises_accepted, .. } = found.summary;
    text += &format!("\naccepted of noise: {noises_accepted} of {noises}");
    if others > 0 {
        text += &format!("; of other photos: {others_accepted} of {others}");
    }
    text
}
