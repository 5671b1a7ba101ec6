//! The whole pipeline on the scene that ships with the program: photos, training, scores, queries, a flight, a report.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;
use image::ColorType;
use serde::Serialize;

use super::demo::photograph;
use super::demo_questions::{self, DemoQueries};
use super::evaluate::EvaluateOptions;
use super::experiment::Experiment;
use super::train::IfChanged;
use super::{JobError, export, open, plan};
use crate::math::format::count;
use crate::math::stats::median;
use crate::measure::studies::StudyInput;
use crate::measure::table::{markdown, rows};
use crate::measure::{ErrorKind, Measure, Report, Rule, Stage, StageName, SweepCase, Trial, computer};
use crate::pipeline::observer::{Evaluation, Observer, Severity, ViewScore};
use crate::pipeline::synth::SynthReport;
use crate::pipeline::synth::demo::demo_options;
use crate::pipeline::train::{TrainConfig, TrainOutcome};
use crate::render::{Features, RenderSettings, Renderer};
use crate::scene::{Camera, Dataset, GaussianCloud, Machine};

/// Number of images of the flight around the scene.
const FLIGHT_PICTURES: usize = 24;

/// Settings of the demo's training: minutes on two cores.
pub(crate) fn config() -> TrainConfig {
    TrainConfig { steps: 1_500, max_side_px: 400, eval_every: 250, checkpoint_secs: 30.0, ..TrainConfig::default() }
}

/// Results of the demo as written to `report.json`: a report of training and queries, and more.
#[derive(Debug, Serialize)]
pub(crate) struct DemoReport {
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

/// Runs or resumes the tour in the folder `out`; `command` is the command line that asked for it.
///
/// # Errors
/// If something cannot be read, drawn or written, or the observer asks to stop.
pub(crate) fn run(
    out: &Path,
    config: TrainConfig,
    command: String,
    observer: &mut dyn Observer,
) -> Result<DemoReport, JobError> {
    let started = Instant::now();
    let [photos, scene, compare, queries, flight] =
        ["photos", "scene", "compare", "queries", "flight"].map(|f| out.join(f));

    let made = photograph(&photos, &demo_options(), observer)?;
    let reused = || format!("Using the photos in {}", photos.display());
    observer.note(Severity::Info, made.as_ref().map_or_else(reused, SynthReport::summary));
    let experiment = Experiment { dataset: Arc::new(open::dataset(&photos)?), folder: &scene };
    let done = experiment.train(&config, IfChanged::Ask, observer)?;
    if !done.is_finished() {
        observer.note(Severity::Info, format!("{} of {} steps are saved", done.outcome.steps, config.steps));
    }
    let outcome = done.finished()?;
    let options = EvaluateOptions { pictures: Some(compare), ..EvaluateOptions::default() };
    let (job, evaluation) = experiment.compare(&open::scene(&scene)?, options, observer)?;
    let Evaluation { psnr, ssim, views, .. } = evaluation;
    let queries = demo_questions::find_and_ask(&scene, &photos, &job, &queries, observer)?;
    let millis = fly(&job.cloud, &job.settings, &experiment.dataset, &flight, observer)?;

    let mut document = document(out, &outcome, [psnr, ssim], &queries);
    document.commands = vec![command];
    let report = DemoReport {
        document,
        machine: plan::machine(),
        photos: experiment.dataset.photos.len(),
        held_out: views.len(),
        synth_secs: made.map(|report| report.secs),
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
    write_report(&report, out)?;
    Ok(report)
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

/// Draws a circle around the photos' focus; returns the median milliseconds per image.
fn fly(
    cloud: &GaussianCloud,
    settings: &RenderSettings,
    dataset: &Dataset,
    folder: &Path,
    observer: &mut dyn Observer,
) -> Result<f64, JobError> {
    export::make_folder(folder)?;
    let mut renderer = Renderer::new();
    let mut millis = Vec::with_capacity(FLIGHT_PICTURES);
    for (i, camera) in circle(dataset).iter().enumerate() {
        observer.proceed()?;
        let start = Instant::now();
        let frame = renderer.render(cloud, Features::NONE, camera, settings)?;
        millis.push(start.elapsed().as_secs_f64() * 1e3);
        let path = folder.join(format!("{i:03}.png"));
        let size = [camera.width_px, camera.height_px];
        export::png(&path, frame.to_rgb8().as_flattened(), size, ColorType::Rgb8)?;
    }
    Ok(median(&millis))
}

/// Returns cameras on a circle around the focus, at the photos' median distance and height.
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

impl DemoReport {
    /// Returns the results in one line.
    pub(crate) fn summary(&self) -> String {
        format!(
            "{} steps in {:.0} s: {} Gaussians, held-out PSNR {:.2} dB, SSIM {:.3} over {} views; asked by name, objects \
             {:.3} and parts {:.3} mean IoU; {:.0} ms per image",
            self.steps,
            self.train_secs,
            count(self.gaussians as u64),
            self.psnr,
            self.ssim,
            self.held_out,
            self.queries.object_miou,
            self.queries.part_miou,
            self.flight_ms_per_picture
        )
    }
}

/// Writes `report.json`, and a readable `report.md`.
fn write_report(r: &DemoReport, folder: &Path) -> Result<(), JobError> {
    export::json(&folder.join("report.json"), r)?;
    let curve: String = r.curve.iter().map(|e| format!("* {}\n", e.line())).collect();
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
        r.summary(),
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
    Ok(export::text(&folder.join("report.md"), &text)?)
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::scene::Photo;

    #[test]
    fn the_flight_stays_with_the_photos() {
        let photo = |i: usize| {
            let (sin, cos) = (i as f64 * 0.7).sin_cos();
            let eye = DVec3::new(3.0 * cos, 3.0 * sin, 1.0);
            let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid");
            Photo::new(i.to_string(), PathBuf::new(), camera)
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
