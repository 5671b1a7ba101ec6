//! The maker that is built in: SIFT features and incremental mapping by OpenMVG.
//!
//! All photos of one size share a lens. That makes its focal length certain: with a lens for each photo, as OpenMVG
//! assumes for photos without EXIF, poses drift. It starts from EXIF's focal length, else from the usual guess; where few
//! photos get a pose by that, others are tried, and the one with most photos, then most points, is kept.

mod model;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use openmvg::core::{RadialDistortion, TangentialDistortion};
use openmvg::sfm::config::IncrementalSfmConfig;
use openmvg::sfm::model::{ImageMeta, IntrinsicPrior};
use openmvg::sfm::progress::{SfmProgressSink, SfmProgressStage};
use openmvg::sfm::{
    Camera, Dataset, ExtractionMethod, Frontend, Incremental, IntrinsicId, SfmError, SfmOutput, ViewGraph, checkpoint,
};

use super::maker::{MakerKind, PoseMaker};
use super::{ENOUGH, IMAGES, MakerStep, PoseWork};
use crate::io::exif::{self, ExifFocal};
use crate::io::photo;
use crate::jobs::JobError;
use crate::math::stats::median;
use crate::pipeline::observer::{Observer, Severity, Ticker};

/// Focal length to start from where nothing is known, in longer sides of the photo, as COLMAP does.
const GUESS: f64 = 1.2;
/// Others to start from where that fails: a wide lens, a usual one and a telephoto.
const OTHERS: [f64; 3] = [0.55, 0.8, 2.0];
/// Longer side of photos in which features are found, px.
const FEATURES_PX: u32 = 1600;
/// File of features and matches in the folder of poses.
const GRAPH: &str = "matches.openmvg";

/// The maker that is built in.
pub(super) struct BuiltIn;

impl PoseMaker for BuiltIn {
    fn kind(&self) -> MakerKind {
        MakerKind::BuiltIn
    }

    fn name(&self) -> String {
        "the built-in maker (OpenMVG)".into()
    }

    fn steps(&self) -> &'static [MakerStep] {
        &[MakerStep::Matches, MakerStep::Mapping]
    }

    fn keeps(&self) -> &'static str {
        GRAPH
    }

    fn run(&self, step: MakerStep, work: &PoseWork<'_>, observer: &mut dyn Observer) -> Result<(), JobError> {
        let graph = work.at(GRAPH);
        match step {
            MakerStep::Features => Ok(()),
            MakerStep::Matches => {
                let photos = Photos::read(work)?;
                let start =
                    photos.stated_sides().map_or((GUESS, IntrinsicPrior::Guess), |s| (s, IntrinsicPrior::Trusted));
                let found = photos.graph(start, observer)?;
                checkpoint::write_view_graph(&found, &graph).map_err(|e| failed(&e))
            }
            MakerStep::Mapping => {
                let found = checkpoint::read_view_graph(&graph).map_err(|e| failed(&e))?;
                let output = best(map(found, observer), work, observer)?;
                model::write(output.reconstruction(), &work.at(IMAGES), &work.sparse.join("0"))
            }
        }
    }
}

/// The first result, or a better one from another focal length if few photos have a pose in it.
fn best(
    first: Result<SfmOutput, JobError>,
    work: &PoseWork<'_>,
    observer: &mut dyn Observer,
) -> Result<SfmOutput, JobError> {
    let score = |result: &Result<SfmOutput, JobError>| {
        let found = result.as_ref().ok().map(SfmOutput::reconstruction);
        found.map_or((0, 0), |found| (found.registered_view_count(), found.point_count()))
    };
    let is_enough = |result: &Result<SfmOutput, JobError>| score(result).0 as f64 >= ENOUGH * work.photos.len() as f64;
    let photos = Photos::read(work)?;
    let mut best = first;
    if is_enough(&best) || photos.stated_sides().is_some() {
        return best;
    }
    for sides in OTHERS {
        if best.as_ref().is_err_and(JobError::is_cancelled) {
            return best;
        }
        observer.note(Severity::Info, format!("Few photos have a pose; trying a focal length of {sides} longer sides"));
        let other = photos.graph((sides, IntrinsicPrior::Trusted), observer).and_then(|graph| map(graph, observer));
        if other.as_ref().is_err_and(JobError::is_cancelled) || score(&other) > score(&best) {
            best = other;
        }
        if is_enough(&best) {
            break;
        }
    }
    best
}

/// Photos with their sizes, px.
struct Photos {
    all: Vec<(PathBuf, (u32, u32))>,
}

impl Photos {
    fn read(work: &PoseWork<'_>) -> Result<Self, JobError> {
        let of = |name: &String| {
            let path = work.at(IMAGES).join(name);
            let size = photo::size(&path)?;
            Ok((path, size))
        };
        Ok(Self { all: work.photos.iter().map(of).collect::<Result<_, JobError>>()? })
    }

    /// Focal length in longer sides by EXIF, if most photos state one.
    fn stated_sides(&self) -> Option<f64> {
        let stated = |(path, size): &(PathBuf, (u32, u32))| match exif::focal(path, *size) {
            Ok(ExifFocal::Sides(sides)) => Some(sides),
            _ => None,
        };
        let known: Vec<f64> = self.all.iter().filter_map(stated).collect();
        (2 * known.len() >= self.all.len()).then(|| median(&known))
    }

    /// Features and matches, with this focal length in longer sides.
    fn graph(&self, (sides, prior): (f64, IntrinsicPrior), observer: &mut dyn Observer) -> Result<ViewGraph, JobError> {
        let mut sizes: Vec<(u32, u32)> = self.all.iter().map(|(_, size)| *size).collect();
        let of_photo = sizes.clone();
        sizes.sort_unstable();
        sizes.dedup();
        let camera = |&(w, h): &(u32, u32)| {
            let focal = sides * f64::from(w.max(h));
            let (k, p) = (RadialDistortion::K1(0.0), TangentialDistortion::None);
            Camera::try_brown_conrady(focal, focal, f64::from(w) / 2.0, f64::from(h) / 2.0, k, p)
        };
        let cameras = sizes.iter().map(camera).collect::<Result<Vec<_>, _>>().map_err(|e| failed(&e))?;
        let lens = |size: &(u32, u32)| IntrinsicId::new(sizes.binary_search(size).unwrap_or(0));
        let metas = self.all.iter().map(|(path, (w, h))| ImageMeta::path(path, *w, *h));
        let dataset = Dataset::builder()
            .image_meta(metas)
            .camera_models(cameras)
            .intrinsic_priors(vec![prior; sizes.len()])
            .view_intrinsics(of_photo.iter().map(lens).collect::<Vec<_>>())
            .build()
            .map_err(|e| failed(&e))?;
        let frontend =
            Frontend::default().with_extraction_method(ExtractionMethod::Sift).with_max_dimension(Some(FEATURES_PX));
        watched(observer, |sink| frontend.build_with_report(&dataset, sink).map(|(graph, _)| graph))
    }
}

/// Poses and points.
fn map(graph: ViewGraph, observer: &mut dyn Observer) -> Result<SfmOutput, JobError> {
    let engine = Incremental::new(IncrementalSfmConfig::default().with_self_calibrate_intrinsics(true));
    watched(observer, |sink| engine.runner().progress(sink).run_prepared_owned(graph))
}

fn failed(error: &dyn std::fmt::Display) -> JobError {
    JobError::BuiltInPoses(error.to_string())
}

/// Progress that threads of OpenMVG write and the observer's thread reads.
#[derive(Default)]
struct Sink {
    stage: AtomicUsize,
    done: AtomicUsize,
    total: AtomicUsize,
    is_canceled: AtomicBool,
}

/// Titles of its stages, of which the first is for those that are short.
const TITLES: [&str; 4] = ["", "Finding features", "Matching photos", "Finding camera poses"];

impl SfmProgressSink for Sink {
    fn begin(&self, stage: SfmProgressStage, total: usize) {
        let title = match stage {
            SfmProgressStage::FeatureExtraction => 1,
            SfmProgressStage::Matching | SfmProgressStage::Verification => 2,
            SfmProgressStage::Registration => 3,
            _ => return,
        };
        self.done.store(0, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
        self.stage.store(title, Ordering::Relaxed);
    }

    fn advance(&self, stage: SfmProgressStage, completed: usize) {
        use SfmProgressStage as S;
        if matches!(stage, S::FeatureExtraction | S::Matching | S::Verification | S::Registration) {
            self.done.fetch_add(completed, Ordering::Relaxed);
        }
    }

    fn is_canceled(&self) -> bool {
        self.is_canceled.load(Ordering::Relaxed)
    }
}

/// Runs `work` on a thread of its own, with progress and cancellation.
fn watched<T: Send>(
    observer: &mut dyn Observer,
    work: impl FnOnce(&Sink) -> Result<T, SfmError> + Send,
) -> Result<T, JobError> {
    /// Time between looks at the progress.
    const PATIENCE: std::time::Duration = std::time::Duration::from_millis(100);
    let sink = Sink::default();
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().name("poses".into()).spawn_scoped(scope, || work(&sink));
        let thread = thread.map_err(|e| failed(&e))?;
        let mut ticker = Ticker::new(TITLES[1], 0);
        let mut stopped = Ok(());
        while !thread.is_finished() {
            std::thread::sleep(PATIENCE);
            if stopped.is_err() {
                continue;
            }
            let [stage, done, total] = [&sink.stage, &sink.done, &sink.total].map(|v| v.load(Ordering::Relaxed));
            if stage > 0 {
                ticker.enter(TITLES[stage], 0, total as u64);
                ticker.report(done as u64, observer);
            }
            stopped = ticker.proceed(observer);
            if stopped.is_err() {
                sink.is_canceled.store(true, Ordering::Relaxed);
            }
        }
        let result = thread.join().map_err(|_| failed(&"it came to a sudden end"))?;
        stopped?;
        result.map_err(|e| failed(&e))
    })
}
