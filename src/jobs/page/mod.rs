//! A scene as a web page: its Gaussians, objects and parts by name, and camera paths, in one HTML file.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use glam::DVec3;

use super::{JobError, Scene, export, video};
use crate::io::page::{Page, PageIdentity, PagePath, PageQuestions, PageScene, PageView, packed};
use crate::io::scene_files::CAMERA_PATH_FILE;
use crate::io::{IoError, files};
use crate::math::format::{self, things};
use crate::math::rotation::nearest_rotation;
use crate::models;
use crate::navigate::camera_spline::steps_of;
use crate::navigate::{CameraSpline, Pose, Speed};
use crate::pipeline::observer::{Observer, Ticker};
use crate::pipeline::semantics::query::language::portable::PortableScene;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{RenderSettings, Renderer};
use crate::scene::{
    Bounds, Camera, CameraPath, CropBox, GaussianCloud, HomeView, Identities, IdentityId, NO_IDENTITY, SemanticMap,
    text,
};

/// Name of the camera path that is kept with a scene.
pub(crate) const KEPT_PATH: &str = "Camera path";
/// Endings of the page's file name.
pub(crate) const ENDINGS: [&str; 2] = [".html", ".htm"];
/// Poses of a camera path per second, and at most; the page interpolates neighbors.
const FRAMES: (f64, f64) = (20.0, 2_000.0);
/// Number of photos that are searched for the best views of things, and their longer side in px.
const LOOKS: (usize, u32) = (32, 160);
/// Largest file beside a scene's files that may be a camera path, bytes.
const MAX_PATH_BYTES: u64 = 8 << 20;

/// Contents of a page, and its path.
#[derive(Clone, Debug)]
pub struct PageRequest {
    pub(crate) title: String,
    pub(crate) cloud: Arc<GaussianCloud>,
    /// Objects and parts, if they were found.
    pub(crate) map: Option<Arc<SemanticMap>>,
    /// The photos' cameras.
    pub(crate) cameras: Vec<Camera>,
    pub(crate) home: HomeView,
    /// Length of a scene unit in meters, if known.
    pub(crate) meters: Option<f64>,
    pub(crate) settings: RenderSettings,
    /// Camera paths by name.
    pub(crate) paths: Vec<(String, CameraPath)>,
    pub(crate) out: PathBuf,
}

impl PageRequest {
    /// Returns a page of a whole scene, with the camera paths in its folder.
    ///
    /// # Errors
    /// If its objects and parts cannot be read.
    pub(crate) fn of_scene(scene: &Scene, out: &Path) -> Result<Self, JobError> {
        let map = scene.known_semantics()?.map(Arc::new);
        Ok(Self {
            title: scene.name.clone(),
            cloud: Arc::clone(&scene.cloud),
            map,
            cameras: scene.views(),
            home: scene.home(),
            meters: scene.meters_per_unit,
            settings: scene.settings.clone(),
            paths: scene.folder.as_deref().map(paths_in).unwrap_or_default(),
            out: out.into(),
        })
    }

    /// Returns a line that counts the contents of the page.
    pub(crate) fn facts(&self) -> String {
        let mut facts = things(self.cloud.len(), "Gaussian");
        if let Some(all) = self.map.as_ref().map(|map| &map.identities).filter(|all| !all.is_empty()) {
            let objects = all.iter().filter(|(_, i)| i.parent == NO_IDENTITY).count();
            facts += &format!(" · {}", things(objects, "object"));
            if objects < all.len() {
                facts += &format!(" · {}", things(all.len() - objects, "part"));
            }
        }
        facts
    }

    /// Keeps only the Gaussians of a crop box.
    pub(crate) fn crop(&mut self, crop: &CropBox) {
        let kept = crop.kept(&self.cloud);
        self.cloud = Arc::new(self.cloud.select(&kept));
        self.map = self.map.take().map(|map| Arc::new(map.select(&kept)));
    }
}

/// Returns the camera paths among the files of a scene's folder, by file name. Other files are skipped.
pub(crate) fn paths_in(folder: &Path) -> Vec<(String, CameraPath)> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_debris = |e: &std::fs::DirEntry| e.file_name().to_str().is_none_or(files::is_debris);
    let is_small = |e: &std::fs::DirEntry| e.metadata().is_ok_and(|m| m.is_file() && m.len() <= MAX_PATH_BYTES);
    let small = |e: &std::fs::DirEntry| is_small(e) && !is_debris(e);
    let mut files: Vec<PathBuf> = entries.filter(small).map(|e| e.path()).collect();
    files.sort();
    let json = files.iter().filter(|f| f.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")));
    json.filter_map(|file| named_path(file).ok()).collect()
}

/// Reads a camera path from a file, with the file's name.
pub(crate) fn named_path(file: &Path) -> Result<(String, CameraPath), IoError> {
    if file.file_name().is_some_and(|name| name == CAMERA_PATH_FILE) {
        return Ok((KEPT_PATH.to_owned(), video::camera_path(file)?));
    }
    let stem = file.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    Ok((stem.trim_end_matches(".nerfstudio").to_owned(), video::camera_path(file)?))
}

/// Writes the page and returns its size in bytes.
///
/// # Errors
/// If there are no Gaussians, something cannot be drawn or written, or the observer asks to stop.
pub(crate) fn run(request: &PageRequest, observer: &mut dyn Observer) -> Result<u64, JobError> {
    let page = page(request, observer)?;
    export::make_parent(&request.out)?;
    page.write(&request.out)?;
    Ok(std::fs::metadata(&request.out).map_or(0, |m| m.len()))
}

fn page(request: &PageRequest, observer: &mut dyn Observer) -> Result<Page, JobError> {
    let PageRequest { title, cloud, map, cameras, home, settings, paths, .. } = request;
    if cloud.is_empty() {
        return Err(JobError::NoGaussians);
    }
    let of = |p: DVec3| (p - cloud.origin).to_array();
    let best = match map {
        Some(map) => best_views(cloud, map, cameras, settings, observer)?,
        None => Vec::new(),
    };
    let identities = map.as_ref().map(|map| identities(cloud, map, &best)).unwrap_or_default();
    let asked = map.as_deref().filter(|map| !map.identities.is_empty()).map(|map| asked(request, map)).transpose()?;
    let view = home.camera([4, 3]);
    let focus = home.bounds.center();
    let around = (focus - view.center).dot(view.forward());
    // A camera that looks away from the scene's middle orbits a point before it.
    let distance = if around > 0.0 { around } else { home.bounds.radius() };
    let order = packed::order(cloud);
    let identity_of = map.as_ref().map_or_else(|| vec![NO_IDENTITY; cloud.len()], |map| map.identity_of.clone());
    Ok(Page {
        title: text::name(title),
        facts: request.facts(),
        date: format::date(SystemTime::now()),
        gaussians: packed::encode(cloud, &order, settings.antialias).map_err(|e| JobError::Output(e.to_string()))?,
        identities: packed::identities(&identity_of, &order),
        asked,
        scene: PageScene {
            identities,
            origin: cloud.origin.to_array(),
            view: PageView {
                center: of(view.center),
                rotation: rotation(&Pose::of(&view)),
                fov: view.fov_y_rad(),
                aspect: f64::from(view.width_px) / f64::from(view.height_px),
            },
            up: home.up.to_array(),
            focus: of(focus),
            distance,
            background: settings.background,
            antialias: settings.antialias,
            paths: paths.iter().filter_map(|(name, path)| frames(name, path, cloud.origin)).collect(),
        },
    })
}

/// Returns a path's poses at even times, if it has any.
fn frames(name: &str, path: &CameraPath, origin: DVec3) -> Option<PagePath> {
    let spline = CameraSpline::new(path, Speed::Constant)?;
    let flight = spline.flight(steps_of(spline.seconds(), FRAMES.0, FRAMES.1) + 1);
    let numbers = |pose: &Pose| {
        let center = (pose.center - origin).to_array();
        center.into_iter().chain(rotation(pose)).chain([pose.fov_y_rad]).map(|v| v as f32).collect::<Vec<_>>()
    };
    let frames = flight.poses.iter().flat_map(numbers).collect();
    Some(PagePath { name: text::name(name), seconds: spline.seconds(), frames })
}

fn rotation(pose: &Pose) -> [f64; 4] {
    glam::DQuat::from_mat3(&nearest_rotation(&pose.world_from_camera)).to_array()
}

/// Returns the identities that have Gaussians; `best` are the cameras that see each best, by number.
fn identities(cloud: &GaussianCloud, map: &SemanticMap, best: &[Option<DVec3>]) -> Vec<PageIdentity> {
    let all = &map.identities;
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); all.len() + 1];
    for (i, &id) in map.identity_of.iter().enumerate() {
        all.ancestors(id).for_each(|whole| members[whole as usize].push(i));
    }
    let made = |(id, identity): (IdentityId, &crate::scene::Identity)| {
        let members = &members[id as usize];
        let bounds = Bounds::robust(members.iter().map(|&i| cloud.world_position(i)))?;
        let center = bounds.center();
        let from = best.get(id as usize).copied().flatten().and_then(|eye| (center - eye).try_normalize());
        Some(PageIdentity {
            id,
            parent: identity.parent,
            name: all.label(id),
            full: all.full_name(id),
            count: members.len(),
            color: identity.code.map(|v| (v * 255.0).round() as u8),
            center: (center - cloud.origin).to_array(),
            // A single Gaussian has its own size.
            radius: bounds.radius().max(members.iter().map(|&i| size(cloud, i)).fold(0.0, f64::max)),
            from: from.map(|v| v.to_array()),
        })
    };
    all.iter().filter_map(made).collect()
}

/// Returns what the page needs to answer questions.
fn asked(request: &PageRequest, map: &SemanticMap) -> Result<PageQuestions, JobError> {
    let mut map = map.clone();
    map.look_at(&request.cloud);
    let scene = PortableScene::new(&map.identities, request.cloud.origin, request.home.up, request.meters);
    let scene = serde_json::to_vec(&scene).map_err(|e| JobError::Output(e.to_string()))?;
    Ok(PageQuestions { scene, words: models::all_words().join(" ") })
}

fn size(cloud: &GaussianCloud, i: usize) -> f64 {
    cloud.log_scales[i].iter().fold(f64::NEG_INFINITY, |most, v| most.max(f64::from(*v))).exp()
}

/// Returns for each number the position of the photo that shows most of the identity, if one shows it.
fn best_views(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    cameras: &[Camera],
    settings: &RenderSettings,
    observer: &mut dyn Observer,
) -> Result<Vec<Option<DVec3>>, JobError> {
    let all: &Identities = &map.identities;
    let mut best: Vec<(usize, Option<DVec3>)> = vec![(0, None); all.len() + 1];
    let every = cameras.len().div_ceil(LOOKS.0).max(1);
    let looks: Vec<Camera> = cameras.iter().step_by(every).map(|c| c.limited_to(LOOKS.1)).collect();
    let mut renderer = Renderer::new();
    let mut ticker = Ticker::new("Looking for the best views", looks.len());
    for (k, camera) in looks.iter().enumerate() {
        ticker.tick(k, observer)?;
        let view = ViewMap::render(&mut renderer, cloud, &map.identity_of, all, camera, settings)?;
        let mut pixels = vec![0; all.len() + 1];
        for &id in &view.identity {
            all.ancestors(id).for_each(|whole| pixels[whole as usize] += 1);
        }
        for (best, pixels) in best.iter_mut().zip(pixels).filter(|(best, pixels)| pixels > &best.0) {
            *best = (pixels, Some(camera.center));
        }
    }
    ticker.tick(looks.len(), observer)?;
    Ok(best.into_iter().map(|(_, eye)| eye).collect())
}

#[cfg(test)]
mod tests;
