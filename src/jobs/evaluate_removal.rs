//! Removal of things from a scene of synthetic photos, compared with the truth behind them.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::evaluate::PhotoComparison;
use super::remove::{self, Paint, ReducedScene, RemovalOptions};
use super::{JobError, Scene, export, query};
use crate::io::files;
use crate::models::catalog::{self, ModelRole};
use crate::models::lama::LAMA;
use crate::pipeline::depth::{self, TrueDepth};
use crate::pipeline::metrics::planes;
use crate::pipeline::observer::{Observer, Ticker};
use crate::pipeline::removal::score::{RegionScore, RemovalRegion, Tally, flat_share, mark_shaded, regions};
use crate::pipeline::semantics::query::language::QueryPlace;
use crate::pipeline::synth::{SETTINGS, SynthOptions};
use crate::render::{Features, Frame, RenderSettings, Renderer};
use crate::scene::{Camera, LevelFilter, PhotoPixels, SemanticMap};

/// Compared ways: no fill, and each way to paint; LaMa, too, if it is installed, and the default one with the shadow
/// lifted.
const WAYS: [Option<Paint>; 5] =
    [None, Some(Paint::Nearest), Some(Paint::Telea), Some(Paint::Smooth), Some(Paint::Patches)];

/// A thing that was removed in one way.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct RemovalRow {
    pub(crate) name: String,
    /// Paint of its fill; `None` = no fill.
    pub(crate) paint: Option<Paint>,
    /// True if its shadow was lifted.
    pub(crate) lift_shadow: bool,
    pub(crate) uncovered: Option<RegionScore>,
    pub(crate) invented: Option<RegionScore>,
    /// Surfaces under its shadow and light, compared with the photos without it: before the removal and after.
    pub(crate) shaded: [Option<RegionScore>; 2],
    /// Everything else: before and after.
    pub(crate) outside: [Option<RegionScore>; 2],
    /// Share of the background behind it that is flat.
    pub(crate) flat: f64,
    pub(crate) gaussians_removed: usize,
    pub(crate) gaussians_invented: usize,
    pub(crate) secs: f64,
    /// True if its name still finds something.
    pub(crate) found_again: bool,
}

/// Ground truth of one view.
struct TrueView {
    camera: Camera,
    regions: Vec<RemovalRegion>,
    with: [Vec<f64>; 3],
    without: [Vec<f64>; 3],
    /// Depth without it, then with it.
    depth: TrueDepth,
    before: TrueDepth,
    /// The scene with it, as drawn.
    was: Frame<f32>,
    index: usize,
}

#[derive(Deserialize)]
struct Settings {
    options: SynthOptions,
}

/// Removes each thing in every way, if `truth` has views without it.
pub(crate) fn run(
    scene: &Scene,
    truth: &Path,
    comparison: &PhotoComparison,
    observer: &mut dyn Observer,
) -> Result<Vec<RemovalRow>, JobError> {
    let map = scene.semantics()?;
    let photos = photos(comparison)?;
    let has_lama = catalog::find(LAMA, ModelRole::Inpainter).is_ok();
    let mut rows = Vec::new();
    for folder in folders(truth)? {
        let (name, views) = views(scene, comparison, &folder, &photos)?;
        let ways = WAYS.into_iter().chain(has_lama.then_some(Some(Paint::Lama))).map(|paint| (paint, false));
        for (paint, lift_shadow) in ways.chain([(Some(Paint::default()), true)]) {
            rows.push(one(scene, &map, (&name, paint, lift_shadow), &views, comparison, observer)?);
        }
    }
    Ok(rows)
}

/// Returns the folder itself, or its subfolders, if they have views without a thing.
fn folders(truth: &Path) -> Result<Vec<PathBuf>, JobError> {
    let is_one = |path: &Path| path.join(SETTINGS).is_file();
    if is_one(truth) {
        return Ok(vec![truth.into()]);
    }
    let mut all: Vec<PathBuf> =
        std::fs::read_dir(truth).into_iter().flatten().flatten().map(|e| e.path()).filter(|p| is_one(p)).collect();
    all.sort();
    if all.is_empty() {
        let text = format!("{}: neither it nor a folder in it was made by 'fmlgs synth --without'", truth.display());
        return Err(JobError::Protocol(text));
    }
    Ok(all)
}

/// Returns the training cameras and their true depths.
fn photos(comparison: &PhotoComparison) -> Result<Vec<(Camera, TrueDepth)>, JobError> {
    let dataset = &comparison.dataset;
    let trained = (0..dataset.photos.len()).filter(|i| !comparison.views.contains(i));
    let one = |i: usize| {
        let photo = &dataset.photos[i];
        let camera = photo.camera.limited_to(comparison.max_side_px);
        let depth = depth::of_photo(&dataset.root, photo)?;
        Ok((camera.clone(), depth.resampled(camera.width_px as usize, camera.height_px as usize)))
    };
    trained.map(one).collect()
}

/// Returns the thing's name and its views.
fn views(
    scene: &Scene,
    comparison: &PhotoComparison,
    folder: &Path,
    photos: &[(Camera, TrueDepth)],
) -> Result<(String, Vec<TrueView>), JobError> {
    let wrong = |what: &str| JobError::Protocol(format!("{}: {what}", folder.display()));
    let settings: Settings = files::read_json(&folder.join(SETTINGS))?;
    let name = settings.options.without.ok_or_else(|| wrong("nothing was left out of these photos"))?;
    let mut views = Vec::new();
    let mut renderer = Renderer::new();
    for &index in &comparison.views {
        let photo = &comparison.dataset.photos[index];
        let mut bare = photo.clone();
        bare.path = folder.join(&photo.name);
        if !bare.path.is_file() {
            return Err(wrong("the photos are not the held-out ones of the scene"));
        }
        let with = comparison.view(index)?;
        let pixels = crate::io::photo::load(&bare, comparison.max_side_px)?;
        let size = [with.camera.width_px as usize, with.camera.height_px as usize];
        let depths = [&comparison.dataset.root, folder].map(|root: &Path| depth::of_photo(root, photo));
        let [before, depth] = depths.map(|d| Ok::<_, JobError>(d?.resampled(size[0], size[1])));
        let (before, depth) = (before?, depth?);
        let mut regions = regions(&with.camera, (&before, &depth), photos);
        if regions.iter().any(|r| *r != RemovalRegion::Outside) {
            let (with_planes, without) = (planes(&with.pixels), planes(&pixels));
            mark_shaded(&mut regions, &with_planes, &without);
            let was = renderer.render(&scene.cloud, Features::NONE, &with.camera, &scene.settings)?;
            views.push(TrueView {
                camera: with.camera,
                regions,
                with: with_planes,
                without,
                depth,
                before,
                was,
                index,
            });
        }
    }
    if views.is_empty() {
        return Err(wrong("no view shows it"));
    }
    Ok((name, views))
}

fn one(
    scene: &Scene,
    map: &SemanticMap,
    (name, paint, lift_shadow): (&str, Option<Paint>, bool),
    views: &[TrueView],
    comparison: &PhotoComparison,
    observer: &mut dyn Observer,
) -> Result<RemovalRow, JobError> {
    let ids = query::identities(map, &QueryPlace::default(), name, LevelFilter::Auto, 1)?;
    let start = std::time::Instant::now();
    let options = RemovalOptions { ids, halo: true, lift_shadow, paint, seed: 0 };
    let ReducedScene { cloud, map: left, report } = remove::run(scene, map, &options, observer)?;
    let secs = start.elapsed().as_secs_f64();
    let found_again = match query::identities(&left, &QueryPlace::default(), name, LevelFilter::Auto, 1) {
        Err(JobError::NoMatch(_)) => false,
        found => !found?.is_empty(),
    };
    let mut renderer = Renderer::new();
    let settings = RenderSettings { depth: true, ..scene.settings.clone() };
    let [mut uncovered, mut invented, mut before, mut after] = [(); 4].map(|()| Tally::default());
    let mut shaded = [(); 2].map(|()| Tally::default());
    let mut ticker = Ticker::new(format!("Comparing without {name}"), views.len());
    for (k, view) in views.iter().enumerate() {
        ticker.tick(k, observer)?;
        let was = &view.was;
        let is = renderer.render(&cloud, Features::NONE, &view.camera, &settings)?;
        uncovered.add(&is, &view.without, Some(&view.depth), &view.regions, RemovalRegion::Uncovered);
        invented.add(&is, &view.without, Some(&view.depth), &view.regions, RemovalRegion::Invented);
        shaded[0].add(was, &view.without, None, &view.regions, RemovalRegion::Shaded);
        shaded[1].add(&is, &view.without, None, &view.regions, RemovalRegion::Shaded);
        before.add(was, &view.with, None, &view.regions, RemovalRegion::Outside);
        after.add(&is, &view.with, None, &view.regions, RemovalRegion::Outside);
        if let (Some(folder), true) = (&comparison.pictures, paint != Some(Paint::Nearest)) {
            let way = paint.map_or("none".into(), |p| format!("{p:?}").to_lowercase());
            let way = if lift_shadow { way + "_lifted" } else { way };
            let file = format!("{}_{way}_{:03}.png", name.replace(|c: char| !c.is_alphanumeric(), "-"), view.index);
            picture(&folder.join(file), view, [&was.to_rgb8(), &is.to_rgb8()])?;
        }
    }
    Ok(RemovalRow {
        name: name.into(),
        paint,
        lift_shadow,
        uncovered: uncovered.score(),
        invented: invented.score(),
        shaded: shaded.each_ref().map(Tally::score),
        outside: [before.score(), after.score()],
        flat: flat_share(views.iter().map(|v| (&v.camera, v.regions.as_slice(), &v.before, &v.depth))),
        gaussians_removed: report.taken(),
        gaussians_invented: report.invented(),
        secs,
        found_again,
    })
}

/// Writes the view before, after, the truth without the thing, and the regions: uncovered blue, invented red, shaded
/// green.
fn picture(path: &Path, view: &TrueView, drawn: [&[[u8; 3]]; 2]) -> Result<(), JobError> {
    let (w, h) = (view.camera.width_px as usize, view.camera.height_px as usize);
    let truth: Vec<[u8; 3]> = (0..w * h).map(|i| std::array::from_fn(|c| (255.0 * view.without[c][i]) as u8)).collect();
    let tint = |i: usize| match view.regions[i] {
        RemovalRegion::Outside | RemovalRegion::Rim => truth[i].map(|c| c / 2 + 100),
        RemovalRegion::Shaded => [truth[i][0], truth[i][1] / 2 + 100, truth[i][2] / 2],
        RemovalRegion::Uncovered => [40, 110, 230],
        RemovalRegion::Invented => [230, 60, 40],
    };
    let regions: Vec<[u8; 3]> = (0..w * h).map(tint).collect();
    let rows = (0..h).flat_map(|y| [drawn[0], drawn[1], &truth, &regions].map(|p| &p[y * w..(y + 1) * w]));
    let rgb = rows.flatten().copied().collect();
    export::make_parent(path)?;
    Ok(export::picture(
        path,
        &PhotoPixels { width_px: 4 * w as u32, height_px: h as u32, rgb, coverage: None, alpha: None },
    )?)
}
