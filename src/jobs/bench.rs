//! Times of drawing, training and queries on this machine.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::JobError;
use super::select::{self, PrepareRequest, SelectFor, SelectRequest, SelectStep, Stroke};
use crate::io::results::{self, OPEN_CLIP, ResultOptions};
use crate::io::scene_files::SELECTION_FILE;
use crate::io::scene_files::is_scene;
use crate::io::splat_format::SplatFormat;
use crate::io::{self, Opened};
use crate::measure::StudyError;
use crate::measure::bench::made_up_results::{lang_splat, lang_splat_v2};
use crate::measure::bench::results::{self as asking, AskedResult, BenchPhrases};
use crate::measure::bench::{
    StageSample, StageValues, Timings, draw, label, masks, moving, one_core, query, questions, train, views_of,
};
use crate::models;
use crate::pipeline::observer::{Interrupted, Observer, Severity};
use crate::pipeline::semantics::lifting::network_segmenter::NetworkMasks;
use crate::pipeline::semantics::query::foreign::asked::ForeignScene;
use crate::pipeline::train::{TrainConfig, TrainView, load_views};
use crate::render::{Device, RenderSettings, Renderer};
use crate::scene::{Camera, Dataset, GaussianCloud, HomeView, Mask, MaskGrid, NO_IDENTITY, PhotoPixels};

/// Size in px of the queried view.
const QUERY_SIZE: [usize; 2] = [1_008, 567];
/// Size in px of the view in which strokes are drawn.
const STROKES_SIZE: [u32; 2] = [640, 480];
/// Half of a stroke's width, px.
const STROKE_RADIUS_PX: usize = 3;
/// Size in px of the views of a moving camera.
const MOVING_SIZE: [u32; 2] = [1_008, 567];
/// Size in px of the views in which results of other methods are asked, and the number of these views.
const RESULTS_SIZE: [u32; 2] = [1_008, 567];
const RESULTS_VIEWS: usize = 3;
/// Size in px of a synthetic photo.
const PHOTO_SIZE: [u32; 2] = [1_008, 756];

pub(crate) struct BenchRequest {
    /// Splats or trained scenes to draw, posed photos to train on.
    pub(crate) paths: Vec<PathBuf>,
    /// Sizes in px of the drawn images.
    pub(crate) sizes: Vec<[u32; 2]>,
    /// Longer side of the training images in px.
    pub(crate) max_side_px: u32,
    pub(crate) repeats: usize,
    /// True if the GPU is timed beside the CPU.
    pub(crate) gpu: bool,
    /// Number of timed queries, and number of objects and parts in their view.
    pub(crate) queries: Option<(usize, usize)>,
    /// Number of timed phrases asked of results of other methods, and number of Gaussians of those that are made up.
    pub(crate) results: Option<(usize, usize)>,
    /// Network whose masks of everything in a photo are timed, its grid, and the photo; `None` for a synthetic one.
    pub(crate) masks: Option<(String, MaskGrid, Option<PathBuf>)>,
    /// Number of timed selection strokes in each scene.
    pub(crate) strokes: Option<usize>,
    /// True if moving by levels of detail is timed in each cloud.
    pub(crate) moving: bool,
}

/// Returns whether a path may hold posed photos: it has no splat file's name and is no trained scene.
pub(crate) fn may_be_photos(path: &Path) -> bool {
    SplatFormat::of(path).is_none() && !is_scene(path)
}

/// Times each stage.
pub(crate) fn run(request: &BenchRequest, observer: &mut dyn Observer) -> Result<Timings, JobError> {
    let repeats = request.repeats;
    let device = request.gpu.then(Device::shared).transpose()?;
    let mut samples = one_core::limit();
    if let Some((count, identities)) = request.queries {
        samples.extend(questions::time(identities, count));
        let mut encoder = models::encoder(models::DEMO)?;
        samples.extend(query::time(encoder.as_mut(), identities, QUERY_SIZE, count)?);
    }
    if let Some((count, gaussians)) = request.results {
        samples.extend(made_up_results(count, gaussians, observer)?);
    }
    if let Some((model, grid, photo)) = &request.masks {
        observer.note(Severity::Info, format!("Finding everything in a photo with {model}"));
        let photo = photo.as_deref().map_or_else(|| Ok(checks()), io::photo::open)?;
        let mut network = NetworkMasks::open(model, *grid)?;
        let options = network.options;
        let timed = masks::time(&mut *network.network, &options, &photo, &mut || observer.proceed().is_ok())?;
        observer.proceed()?;
        samples.extend(timed);
    }
    for path in &request.paths {
        let name = label(path);
        if let Some((count, _)) = request.results
            && results::sniff(path).is_some()
        {
            let result = results::open_result(path, &ResultOptions::default())?;
            let phrases = BenchPhrases::random(&result, count);
            samples.extend(asked(&name, AskedResult { result, phrases }, observer)?);
            continue;
        }
        let (cloud, cameras) = match io::open(path)? {
            Opened::Dataset(dataset) => {
                let (config, views) = photos(&dataset, request.max_side_px, observer)?;
                samples.extend(train::steps(&dataset, &views, &config, repeats, device.as_ref())?);
                continue;
            }
            Opened::Cloud(cloud) => (Arc::new(cloud), Vec::new()),
            Opened::Trained(scene) => {
                (Arc::new(scene.cloud), scene.info.cameras.into_iter().map(|c| c.camera).collect())
            }
        };
        if let Some(count) = request.strokes {
            samples.extend(strokes(&name, &cloud, cameras, count, observer)?);
        }
        if request.moving {
            observer.note(Severity::Info, format!("Moving in {name}"));
            samples.extend(moving::time(&name, &cloud, MOVING_SIZE, repeats)?);
            observer.proceed()?;
            continue;
        }
        for &size in &request.sizes {
            observer.proceed()?;
            observer.note(Severity::Info, format!("Drawing {name} at {} x {}", size[0], size[1]));
            samples.extend(draw::render(Renderer::new(), &name, &cloud, size, repeats)?);
            if let Some(device) = &device {
                samples.extend(draw::render(Renderer::on_gpu(device)?, &name, &cloud, size, repeats)?);
            }
        }
    }
    Ok(Timings { gpu: device.as_ref().map(Device::describe), samples })
}

/// Times phrases asked of made-up results of LangSplatV2 and LangSplat, and their encoding if the encoder is here.
fn made_up_results(count: usize, gaussians: usize, observer: &mut dyn Observer) -> Result<Vec<StageSample>, JobError> {
    let mut samples = Vec::new();
    match models::encoder(OPEN_CLIP) {
        Ok(mut encoder) => samples.extend(asking::encoding(encoder.as_mut(), count)?),
        Err(e) => observer.note(Severity::Warning, format!("The encoding of phrases is not timed: {e}")),
    }
    samples.extend(asked("made-up LangSplatV2", lang_splat_v2(gaussians, count)?, observer)?);
    samples.extend(asked("made-up LangSplat", lang_splat(gaussians, count)?, observer)?);
    Ok(samples)
}

/// Times phrases asked of a result, in views of its cameras or around it.
fn asked(name: &str, of: AskedResult, observer: &mut dyn Observer) -> Result<Vec<StageSample>, JobError> {
    let AskedResult { result, phrases } = of;
    observer.note(Severity::Info, format!("Asking {name}"));
    let own = result.cameras.iter().take(RESULTS_VIEWS);
    let mut cameras: Vec<Camera> = own.map(|c| c.camera.limited_to(RESULTS_SIZE[0])).collect();
    if cameras.is_empty() {
        cameras = views_of(&result.cloud, RESULTS_SIZE[0], RESULTS_SIZE[1]);
    }
    let scene = ForeignScene::new(Arc::new(result));
    let timed = asking::time(name, &scene, &cameras, &phrases, &mut || observer.proceed().is_ok())?;
    observer.proceed()?;
    // The next result may take minutes.
    if let Some(phrase) = timed.iter().find(|sample| sample.stage == "phrase") {
        observer.note(Severity::Info, format!("A phrase takes {:.1} ms of {name} ({} asked)", phrase.median, phrase.n));
    }
    Ok(timed)
}

/// Times selections by strokes in the first view, three strokes each.
fn strokes(
    name: &str,
    cloud: &Arc<GaussianCloud>,
    cameras: Vec<Camera>,
    count: usize,
    observer: &mut dyn Observer,
) -> Result<Vec<StageSample>, JobError> {
    observer.note(Severity::Info, format!("Selecting in {name} by strokes"));
    let home = HomeView::new(&cameras, Some(cloud));
    let camera = home.camera(STROKES_SIZE).limited_to(STROKES_SIZE[0]);
    let map = Arc::new(select::empty_map(cloud));
    let mut values = StageValues::on_scene(name, cloud.len(), STROKES_SIZE);
    let settings = RenderSettings::default();
    let folder = tempfile::tempdir().map_err(|e| StudyError(format!("no temporary folder: {e}")))?;
    let (cloud, file) = (Arc::clone(cloud), Some(folder.path().join(SELECTION_FILE)));
    let request = PrepareRequest { cloud: Arc::clone(&cloud), settings: settings.clone(), cameras, home, file };
    values.time("prepare", || select::prepare(&request, observer))?;
    let prepared = Arc::new(values.time("prepare again", || select::prepare(&request, observer))?);
    let mut before = None;
    for k in 0..count {
        observer.proceed()?;
        let size = [camera.width_px as usize, camera.height_px as usize];
        // The third stroke of each selection takes away, the others add.
        let pixels = stroke(k, size);
        let request = SelectRequest {
            cloud: Arc::clone(&cloud),
            settings: settings.clone(),
            map: Arc::clone(&map),
            purpose: SelectFor::New(NO_IDENTITY),
            prepared: Some(Arc::clone(&prepared)),
            before: before.take(),
            step: SelectStep::Stroke(Stroke { camera: camera.clone(), pixels, is_plus: k % 3 != 2 }),
        };
        let selected = values.time("stroke", || select::run(&request, observer))?;
        before = (k % 3 != 2).then(|| Arc::new(selected));
    }
    Ok(values.samples())
}

/// The stroke number `k` in a view: level lines at changing places and of changing lengths.
fn stroke(k: usize, [w, h]: [usize; 2]) -> Mask {
    // Steps of the golden ratio spread evenly.
    let part = |step: f64| ((k + 1) as f64 * step).fract();
    let y = ((0.2 + 0.6 * part(0.618_034)) * h as f64) as usize;
    let x = ((0.2 + 0.5 * part(0.754_878)) * w as f64) as usize;
    let end = x + ((0.02 + 0.13 * part(0.569_84)) * w as f64) as usize;
    Mask::from_fn(w, h, |i| (x..=end).contains(&(i % w)) && (i / w).abs_diff(y) <= STROKE_RADIUS_PX)
}

/// Returns a synthetic photo of squares in many colors.
fn checks() -> PhotoPixels {
    let [width_px, height_px] = PHOTO_SIZE;
    let color = |i: u32| {
        let (x, y) = (i % width_px / 84, i / width_px / 84);
        [(x * 20) as u8, (y * 27) as u8, ((x * 7 + y * 13) % 16 * 16) as u8]
    };
    PhotoPixels {
        width_px,
        height_px,
        rgb: (0..width_px * height_px).map(color).collect(),
        coverage: None,
        alpha: None,
    }
}

/// Returns the training settings and the photos to train on.
fn photos(
    dataset: &Dataset,
    max_side_px: u32,
    observer: &mut dyn Observer,
) -> Result<(TrainConfig, Vec<TrainView>), JobError> {
    let config = TrainConfig { max_side_px, densify: false, ..TrainConfig::default() };
    let (indices, _) = dataset.split(config.holdout_every);
    let views = load_views(dataset, &indices, &config, "Loading photos", observer)?.ok_or(Interrupted)?;
    if views.is_empty() {
        return Err(StudyError(format!("{} has no photo to train on", dataset.root.display())).into());
    }
    observer.note(Severity::Info, format!("Training on {}", dataset.name));
    Ok((config, views))
}
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_lie_inside_and_apart() {
        let all: Vec<Mask> = (0..50).map(|k| stroke(k, [640, 480])).collect();
        assert!(all.iter().all(|m| (7 * 12..7 * 100).contains(&m.area())), "{:?}", all[0].area());
        assert!(all.windows(2).all(|two| two[0].iou(&two[1]) < 0.5));
    }
}
