//! `fmlgs demo`: the whole way on the scene that ships with the program, with or without a window.

use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::DVec3;
use image::ColorType;
use serde::Serialize;

use super::progress::{Console, evaluation_line};
use super::train::TrainOverrides;
use super::{CliError, interrupt, output, synth};
use crate::io;
use crate::jobs::demo_questions::{self, DemoQueries};
use crate::jobs::evaluate::{self, EvaluateOptions, PhotoComparison};
use crate::jobs::open;
use crate::jobs::{Folders, demo as shipped, plan};
use crate::math::stats::median;
use crate::measure::studies::StudyInput;
use crate::measure::table::{markdown, rows};
use crate::measure::{ErrorKind, Measure, Report, Rule, Stage, StageName, SweepCase, Trial, computer};
use crate::pipeline::observer::{Evaluation, Observer, Severity, ViewScore};
use crate::pipeline::synth::demo;
use crate::pipeline::train::{self, TrainConfig, TrainEnd, TrainOutcome};
use crate::render::{Features, RenderSettings, Renderer};
use crate::scene::{Camera, Dataset, GaussianCloud, Machine};

/// Images of the flight around the scene.
const FLIGHT_PICTURES: usize = 24;

/// Show the program on the demo scene: make photos, train, look around
///
/// Opens the trained demo in the window. With --headless it needs no display: it asks the trained
/// demo for objects and parts; then it renders the demo scene's photos, trains on them, measures the
/// result on held-out photos, asks again, flies around the scene, and leaves images and a report in
/// the folder given by --out. Run again, it resumes where it was and reuses the photos.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs demo\n  \
    fmlgs demo --headless\n  \
    fmlgs demo --headless --steps 300 --out quick/      a first look in a fraction of the time\n  \
    fmlgs demo --make assets/demo/demo.zip --out work/  make the trained demo that ships with the program")]
pub(crate) struct DemoArgs {
    /// Do it without a window, and write images and a report
    #[arg(long)]
    pub(crate) headless: bool,
    /// Folder for everything the headless demo makes
    #[arg(long, default_value = "out/demo")]
    out: PathBuf,
    #[command(flatten)]
    settings: TrainOverrides,
    /// Make the trained demo that ships with the program, in the folder given by --out, and write it here
    #[arg(long, value_name = "ZIP", conflicts_with = "headless")]
    pub(crate) make: Option<PathBuf>,
    /// Print the report as one JSON document
    #[arg(long)]
    json: bool,
}

/// Settings of the demo's training: minutes on two cores.
fn config() -> TrainConfig {
    TrainConfig { steps: 1_500, max_side_px: 400, eval_every: 250, checkpoint_secs: 30.0, ..TrainConfig::default() }
}

/// What the demo found, as written to `report.json`: a report of training and queries, and more.
#[derive(Debug, Serialize)]
struct DemoReport {
    #[serde(flatten)]
    document: Report,
    machine: Machine,
    config: TrainConfig,
    photos: usize,
    held_out: usize,
    synth_secs: Option<f64>,
    train_secs: f64,
    steps: u64,
    gaussians: usize,
    psnr: f64,
    ssim: f64,
    views: Vec<ViewScore>,
    curve: Vec<Evaluation>,
    queries: DemoQueries,
    flight_pictures: usize,
    flight_ms_per_picture: f64,
    total_secs: f64,
}

pub(crate) fn run(args: DemoArgs, quiet: bool) -> Result<(), CliError> {
    let mut console = Console::new(quiet);
    if let Some(file) = &args.make {
        return make(file, &args.out, console);
    }
    show_shipped(&args.out.join("shipped"), &mut console);
    let started = Instant::now();
    let config = args.settings.over(config());
    let [photos, scene, compare, queries, flight] =
        ["photos", "scene", "compare", "queries", "flight"].map(|f| args.out.join(f));

    let synth_secs = make_photos(&photos, &mut console)?;
    let dataset = open::dataset(&photos)?;
    let outcome = train::run(&dataset, &config, Some(&scene), &mut console)?;
    if outcome.end == TrainEnd::Cancelled {
        let (done, all) = (outcome.steps, config.steps);
        return Err(CliError::Cancelled(format!("{done} of {all} steps are saved; the same command resumes there")));
    }
    let options = EvaluateOptions { pictures: Some(compare), ..EvaluateOptions::default() };
    let job = PhotoComparison::new(open::scene(&scene)?, &photos, options)?;
    let Evaluation { psnr, ssim, views, .. } = evaluate::photometric(&job, &mut console).map_err(CliError::of_views)?;
    let queries = demo_questions::find_and_ask(&scene, &photos, &job, &queries, &mut console)
        .map_err(|e| CliError::of_work(e, "the trained scene is saved"))?;
    let millis = fly(&job.cloud, &job.settings, &dataset, &flight)?;

    let document = document(&args.out, &outcome, [psnr, ssim], &queries);
    let report = DemoReport {
        document,
        machine: plan::machine(),
        photos: dataset.photos.len(),
        held_out: views.len(),
        synth_secs,
        train_secs: outcome.secs,
        steps: outcome.steps,
        gaussians: outcome.cloud.len(),
        config,
        psnr,
        ssim,
        views,
        curve: outcome.evaluations,
        queries,
        flight_pictures: FLIGHT_PICTURES,
        flight_ms_per_picture: millis,
        total_secs: started.elapsed().as_secs_f64(),
    };
    drop(console);
    write_report(&report, &args.out)?;
    if args.json {
        return output::print_json(&report);
    }
    output::print(&format!("{}\nSee {}", summary(&report), args.out.join("report.md").display()))
}

/// Says what the trained demo answers, at once; without it the demo is trained all the same.
fn show_shipped(pictures: &Path, console: &mut Console) {
    match shipped::examine(&Folders::of_user(), pictures, console) {
        Ok(([psnr, ssim], queries)) => {
            let (objects, parts) = (queries.object_miou, queries.part_miou);
            console.note(
                Severity::Info,
                format!(
                    "The trained demo: held-out PSNR {psnr:.2} dB, SSIM {ssim:.3}; asked by name, objects {objects:.3} and \
                     parts {parts:.3} mean IoU; heat maps in {}",
                    pictures.display()
                ),
            );
            for q in &queries.asked {
                let answer = if q.answer.is_empty() { String::new() } else { format!(": {}", q.answer.join(", ")) };
                let text = format!("  {} - {}{answer} ({} px, {:.1} ms)", q.question, q.verdict, q.pixels, q.millis);
                console.note(Severity::Info, text);
            }
        }
        Err(e) => console.note(Severity::Warning, format!("The trained demo cannot be shown: {e}")),
    }
}

/// Makes the trained demo that ships with the program.
fn make(file: &Path, work: &Path, mut console: Console) -> Result<(), CliError> {
    let made = shipped::make(&shipped::DemoRecipe::shipped(), work, &mut console);
    let (bytes, record) = made.map_err(|e| CliError::of_work(e, "the same command resumes there"))?;
    drop(console);
    io::atomic::write(file, |w| w.write_all(&bytes))?;
    let sum = format!("{}  demo.zip\n", shipped::digest(&bytes));
    io::atomic::write(&file.with_extension("sha256"), |w| w.write_all(sum.as_bytes()))?;
    output::print(&format!(
        "{}: {:.1} MB, {} Gaussians, held-out PSNR {:.2} dB, SSIM {:.3}; asked by name, objects {:.3} and parts {:.3} mean IoU",
        file.display(),
        bytes.len() as f64 / 1e6,
        record.gaussians,
        record.psnr,
        record.ssim,
        record.object_miou,
        record.part_miou
    ))
}

/// The demo as a report that the window opens: training and queries, each with the one setting that it ran.
fn document(out: &Path, outcome: &TrainOutcome, [psnr, ssim]: [f64; 2], queries: &DemoQueries) -> Report {
    let share = |name: &str, meaning: &str| Measure::new(name, "", ErrorKind::Share, meaning);
    let decibels = Measure::new("PSNR", "dB", ErrorKind::Decibels, "peak signal to noise ratio in held-out photos");
    let labels = "labels of held-out photos, asked for by name";
    let curve = outcome.evaluations.iter().map(|e| [e.secs, e.psnr]).collect();
    let stage = |name, words, measures: Vec<Measure>, trial: &Trial| {
        let rule = Rule::new(&measures[0].name, 1.0, 0.0, 0.0);
        let mut stage = Stage { planned: 1, ..Stage::new(name, words, (StudyInput::new(), 1), rule, measures) };
        stage.add(&SweepCase::default("the demo's settings"), trial);
        stage
    };
    let trained = Trial { secs: outcome.secs, values: vec![("PSNR", psnr), ("SSIM", ssim)], curve };
    let millis: Vec<f64> = queries.asked.iter().map(|q| q.millis).collect();
    let values = vec![("object mIoU", queries.object_miou), ("part mIoU", queries.part_miou)];
    let asked = Trial { secs: 1e-3 * median(&millis), values, curve: Vec::new() };
    let mut report = Report::empty(&out.display().to_string(), &computer::look());
    let words = ["training, evaluation left out", "photos that training did not see"];
    report.put(stage(StageName::Train, words, vec![decibels, share("SSIM", "structural similarity")], &trained));
    let overlaps = vec![share("object mIoU", "mean overlap of objects"), share("part mIoU", "mean overlap of parts")];
    report.put(stage(StageName::Query, ["one query, from the text to the mask", labels], overlaps, &asked));
    report
}

/// Renders the photos unless they are there; returns the seconds it took.
fn make_photos(folder: &Path, console: &mut Console) -> Result<Option<f64>, CliError> {
    if demo::demo_is_written(folder, &demo::demo_options()) {
        console.note(Severity::Info, format!("Using the photos in {}", folder.display()));
        return Ok(None);
    }
    let report = demo::write_demo(folder, &demo::demo_options(), console).map_err(|e| synth::failure(e.into()))?;
    console.note(Severity::Info, synth::summary(&report));
    Ok(Some(report.secs))
}

/// Draws a circle around what the photos look at; returns the median milliseconds per image.
fn fly(cloud: &GaussianCloud, settings: &RenderSettings, dataset: &Dataset, folder: &Path) -> Result<f64, CliError> {
    output::make_folder(folder)?;
    let mut renderer = Renderer::new();
    let mut millis = Vec::with_capacity(FLIGHT_PICTURES);
    for (i, camera) in circle(dataset).iter().enumerate() {
        if interrupt::asked_to_stop() {
            return Err(CliError::Cancelled(format!("{i} of {FLIGHT_PICTURES} images of the flight were drawn")));
        }
        let start = Instant::now();
        let frame = renderer.render(cloud, Features::NONE, camera, settings)?;
        millis.push(start.elapsed().as_secs_f64() * 1e3);
        let path = folder.join(format!("{i:03}.png"));
        let size = [camera.width_px, camera.height_px];
        output::write_png(&path, frame.to_rgb8().as_flattened(), size, ColorType::Rgb8)?;
    }
    Ok(median(&millis))
}

/// Cameras on a circle around the focus, as far from it and as high over it as the photos are.
fn circle(dataset: &Dataset) -> Vec<Camera> {
    let Some(first) = dataset.photos.first() else { return Vec::new() };
    let (focus, up) = (dataset.focus(), dataset.up());
    let offsets: Vec<DVec3> = dataset.photos.iter().map(|p| p.camera.center - focus).collect();
    let height = median(&offsets.iter().map(|o| o.dot(up)).collect::<Vec<_>>());
    let radius = median(&offsets.iter().map(|o| o.reject_from(up).length()).collect::<Vec<_>>());
    let side = up.any_orthonormal_vector();
    let (width_px, height_px) = (first.camera.width_px, first.camera.height_px);
    let fov_y_rad = first.camera.fov_y_rad();
    let at = |i: usize| {
        let (sin, cos) = (i as f64 / FLIGHT_PICTURES as f64 * std::f64::consts::TAU).sin_cos();
        let eye = focus + up * height + (side * cos + up.cross(side) * sin) * radius;
        Camera::look_at(eye, focus, up, fov_y_rad, width_px, height_px)
    };
    (0..FLIGHT_PICTURES).filter_map(at).collect()
}

fn summary(r: &DemoReport) -> String {
    format!(
        "{} steps in {:.0} s: {} Gaussians, held-out PSNR {:.2} dB, SSIM {:.3} over {} views; asked by name, objects \
         {:.3} and parts {:.3} mean IoU; {:.0} ms per image",
        r.steps,
        r.train_secs,
        r.gaussians,
        r.psnr,
        r.ssim,
        r.held_out,
        r.queries.object_miou,
        r.queries.part_miou,
        r.flight_ms_per_picture
    )
}

/// Writes `report.json`, and `report.md` to be read.
fn write_report(r: &DemoReport, folder: &Path) -> Result<(), CliError> {
    let json = serde_json::to_vec_pretty(r)?;
    io::atomic::write(&folder.join("report.json"), |w| w.write_all(&json))?;
    let curve: String = r.curve.iter().map(|e| format!("* {}\n", evaluation_line(e))).collect();
    let view = |s: &ViewScore| vec![s.name.clone(), format!("{:.2}", s.psnr), format!("{:.4}", s.ssim)];
    let views = rows(&["view", "PSNR dB", "SSIM"], r.views.iter().map(view));
    let asked = r.queries.asked.iter().map(|q| {
        let answer = q.answer.join(", ");
        let verdict = match (q.verdict, q.pixels) {
            ("found", 0) => "found, not in this view",
            (verdict, _) => verdict,
        };
        vec![q.question.clone(), verdict.into(), answer, q.pixels.to_string(), format!("{:.1}", q.millis)]
    });
    let asked = rows(&["question", "verdict", "answer", "px", "ms"], asked);
    let synth = r.synth_secs.map_or("reused".to_owned(), |s| format!("made in {s:.1} s"));
    let text = format!(
        "# Demo\n\n{}.\n\n* Machine: {}\n* Photos: {}, {synth}\n* In all: {:.0} s\n\n## While training\n\n\
         {curve}\n## Held-out views\n\n`compare/` holds photo, render and difference (x 4) side by side.\n\n{}\n\
         ## Questions\n\n`queries/` holds relevancy maps in a held-out view. Objects were found in {:.0} s from the masks of \
         {}.\n\n{}\n\
         ## Flight\n\n`flight/` holds {} images on a circle around the scene, {:.0} ms each.\n\n\
         ## To look at it\n\n`scene/` is a trained scene: `fmlgs scene`, or open `scene/point_cloud.ply` in any splat viewer.\n",
        summary(r),
        r.document.computer.words(),
        r.photos,
        r.total_secs,
        markdown(&views),
        r.queries.find_secs,
        r.queries.seeds.join(", "),
        markdown(&asked),
        r.flight_pictures,
        r.flight_ms_per_picture,
    );
    Ok(io::atomic::write(&folder.join("report.md"), |w| w.write_all(text.as_bytes()))?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Photo;

    #[test]
    fn the_flight_stays_with_the_photos() {
        let photo = |i: usize| {
            let (sin, cos) = (i as f64 * 0.7).sin_cos();
            Photo {
                name: i.to_string(),
                path: PathBuf::new(),
                camera: Camera::look_at(DVec3::new(3.0 * cos, 3.0 * sin, 1.0), DVec3::ZERO, DVec3::Z, 0.8, 64, 48)
                    .expect("valid"),
                distortion: None,
                background: None,
                test_split: false,
            }
        };
        let dataset = Dataset { photos: (0..9).map(photo).collect(), ..Dataset::default() };
        let cameras = circle(&dataset);
        assert_eq!(cameras.len(), FLIGHT_PICTURES);
        for c in cameras {
            assert!((c.center.length() - 10.0_f64.sqrt()).abs() < 0.05, "{}", c.center);
            assert!((c.project(DVec3::ZERO).expect("in front") - glam::DVec2::new(32.0, 24.0)).length() < 1.0);
        }
        assert!(circle(&Dataset::default()).is_empty());
    }
}
