//! Opens a scene: the contents of a path, of any kind, for the window and the command line.

use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::held_out::held_out;
use super::runs::{self, RunSummary};
use super::sparse_cloud::sparse_cloud;
use super::{Folders, JobError, camera_path, measurements, plan};
use crate::io::gs_output::GsOutput;
use crate::io::labels::Labels;
use crate::io::results::{Method, MethodResult};
use crate::io::scene_files::CHECKPOINT_FILE;
use crate::io::trained::{self, History, SceneCamera};
use crate::io::{self, Opened, TrainedScene, files};
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::semantics::query::foreign::identities::{USUAL_SCALE, semantic_map};
use crate::pipeline::train::TrainConfig;
use crate::render::RenderSettings;
use crate::scene::measurement::Measurement;
use crate::scene::{Axes, Camera, Dataset, GaussianCloud, HomeView, Machine, SceneFacts, SemanticMap};

mod beside;
mod drawn;
mod method;
mod received;
mod tolerant;

use drawn::{compact, near_without_cameras};
pub use received::Origin;
pub(crate) use received::received;
pub(crate) use tolerant::known_objects;
use tolerant::{objects_elsewhere, photos_of, tolerant};

/// Gaussians that can be drawn, and data that belongs to them.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    pub(crate) path: PathBuf,
    /// Folder of the trained scene, if it is one.
    pub(crate) folder: Option<PathBuf>,
    /// Short name for titles.
    pub name: String,
    /// The Gaussians, without zero bands of spherical harmonics.
    pub cloud: Arc<GaussianCloud>,
    /// Degree of the spherical harmonics in its file.
    pub(crate) sh_stored: u8,
    /// The photos' cameras, possibly none.
    pub(crate) cameras: Vec<SceneCamera>,
    /// Render settings: background, filter and so on, as in training.
    pub settings: RenderSettings,
    /// True if it has its own background: a splat file does not.
    pub(crate) says_background: bool,
    /// Training settings; defaults if they are unknown.
    pub(crate) config: TrainConfig,
    pub(crate) history: History,
    pub(crate) photos: Option<PathBuf>,
    /// Path of its photos, if they still exist.
    pub(crate) dataset_path: Option<PathBuf>,
    pub(crate) meters_per_unit: Option<f64>,
    /// Id of the save that its files belong to, if it has one.
    pub(crate) state: Option<String>,
    /// Folder beside a splat that its cameras are from.
    pub(crate) cameras_from: Option<PathBuf>,
    /// Warnings about its files and the files beside them.
    pub(crate) warnings: Vec<String>,
    /// True if its Gaussians were edited since training.
    pub(crate) edited: bool,
    /// Method that made it, if it is a result of another one.
    pub(crate) method: Option<Method>,
    /// Classes or clusters of such a result, with the same Gaussians.
    pub(crate) result: Option<Arc<MethodResult>>,
}

impl Scene {
    /// Returns the paths it was read from, which no result may replace.
    pub(crate) fn reads(&self) -> Vec<&Path> {
        std::iter::once(self.path.as_path()).chain(self.dataset_path.as_deref()).collect()
    }

    pub(crate) fn views(&self) -> Vec<Camera> {
        self.cameras.iter().map(|c| c.camera.clone()).collect()
    }

    /// Returns its first view.
    pub(crate) fn home(&self) -> HomeView {
        HomeView::new(&self.views(), Some(&self.cloud))
    }

    /// Returns the render settings to compare with these photos: with their background, unless the scene has its own.
    pub(crate) fn settings_beside(&self, dataset: &Dataset) -> RenderSettings {
        let background = dataset.background.filter(|_| !self.says_background);
        RenderSettings { background: background.unwrap_or(self.settings.background), ..self.settings.clone() }
    }

    /// Loads its objects and parts.
    pub fn semantics(&self) -> Result<SemanticMap, JobError> {
        let map = match (&self.folder, &self.result) {
            (Some(folder), _) => io::semantic_map::load(folder, self.state.as_deref(), &self.cloud)?,
            (None, Some(result)) => Some(semantic_map(result, USUAL_SCALE)?),
            (None, None) => None,
        };
        map.ok_or_else(|| match self.method.filter(|_| self.folder.is_none()) {
            Some(method) => JobError::NotGrouped { path: self.path.clone(), method },
            None => JobError::NoObjects(self.path.clone()),
        })
    }

    /// Loads its objects and parts, if there are any.
    pub(crate) fn known_semantics(&self) -> Result<Option<SemanticMap>, JobError> {
        match self.semantics() {
            Err(JobError::NoObjects(_) | JobError::NotGrouped { .. }) => Ok(None),
            map => map.map(Some),
        }
    }

    /// Returns the path of its photos, or `elsewhere` if given.
    pub(crate) fn photos(&self, elsewhere: Option<&Path>) -> Result<PathBuf, JobError> {
        let known = elsewhere.map(Path::to_path_buf).or_else(|| self.dataset_path.clone());
        known.ok_or_else(|| JobError::PhotosGone(self.path.clone()))
    }

    fn bare(path: &Path, mut cloud: GaussianCloud, training: Option<GsOutput>) -> Self {
        let name = path.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let warnings = std::mem::take(&mut cloud.warnings);
        let near = near_without_cameras(&cloud);
        let settings = RenderSettings { near, ..RenderSettings::of_mode(cloud.render_mode) };
        let (cloud, sh_stored) = compact(cloud);
        let mut scene = Self { path: path.into(), name, cloud, sh_stored, settings, warnings, ..Self::default() };
        beside::add_to(&mut scene, training);
        scene
    }

    fn trained(path: &Path, scene: TrainedScene, config: TrainConfig) -> Self {
        let dataset_path = scene.dataset_path();
        let name = scene.info.name_in(&scene.folder);
        let TrainedScene { folder, info, mut cloud, state } = scene;
        let (_, extent) = Camera::extent_of(info.cameras.iter().map(|c| &c.camera));
        // Cloud files of earlier versions do not say it.
        cloud.render_mode = config.render_mode();
        let warnings = std::mem::take(&mut cloud.warnings);
        let mut settings = config.render_settings(info.background, extent);
        if info.cameras.is_empty() {
            settings.near = near_without_cameras(&cloud);
        }
        let (cloud, sh_stored) = compact(cloud);
        Self {
            path: path.into(),
            folder: Some(folder),
            name,
            cloud,
            sh_stored,
            cameras: info.cameras,
            settings,
            says_background: true,
            config,
            history: info.history,
            photos: info.dataset.map(|d| d.path),
            dataset_path,
            meters_per_unit: info.meters_per_unit.filter(|m| m.is_finite() && *m > 0.0),
            edited: info.edited,
            state,
            warnings,
            ..Self::default()
        }
    }
}

/// Contents of a path.
// One value exists per opening; a box would not help the reader.
#[allow(clippy::large_enum_variant)]
#[derive(Debug)]
pub(crate) enum Contents {
    Photos(Dataset),
    Scene(Scene),
}

/// Reads the contents of `path`; a splat with these axes, if given.
pub(crate) fn contents(path: &Path, axes: Option<Axes>) -> Result<Contents, JobError> {
    if let Some(scene) = method::scene(path, axes)? {
        return Ok(Contents::Scene(scene));
    }
    let path = &*beside::splat_of(path);
    let (opened, training) = io::open_beside(path, axes)?;
    Ok(match opened {
        Opened::Dataset(dataset) => Contents::Photos(dataset),
        Opened::Cloud(cloud) => Contents::Scene(Scene::bare(path, cloud, training)),
        Opened::Trained(scene) => {
            let config = TrainConfig::stored(&scene.folder, scene.info.config.clone())?;
            Contents::Scene(Scene::trained(path, scene, config))
        }
    })
}

/// Reads a trained scene or a splat.
pub fn scene(path: &Path) -> Result<Scene, JobError> {
    scene_in(path, None)
}

/// Reads the same; a splat with these axes, if given.
pub(crate) fn scene_in(path: &Path, axes: Option<Axes>) -> Result<Scene, JobError> {
    match contents(path, axes)? {
        Contents::Scene(scene) => Ok(scene),
        Contents::Photos(_) => Err(JobError::NotTrained(path.into())),
    }
}

pub(crate) fn dataset(path: &Path) -> Result<Dataset, JobError> {
    match io::open(path)? {
        Opened::Dataset(dataset) => Ok(dataset),
        Opened::Trained(_) | Opened::Cloud(_) => Err(JobError::NoPhotos(path.into())),
    }
}

/// Returns the cameras of a dataset's photos, with every `every`-th marked as held out.
pub(crate) fn cameras(dataset: &Dataset, every: usize) -> Vec<SceneCamera> {
    let (_, held_out) = dataset.split(every);
    trained::SceneInfo::of(dataset, &held_out, Path::new("")).cameras
}

/// A scene with all its data, as the user views and edits it.
#[derive(Clone, Debug, Default)]
pub struct OpenedScene {
    /// The Gaussians and what belongs to them; of untrained photos, the sparse points as small Gaussians, if any.
    pub scene: Scene,
    /// Posed photos, if it has any.
    pub dataset: Option<Arc<Dataset>>,
    /// Indices of held-out photos, if they are known.
    pub(crate) known_held_out: Option<Vec<usize>>,
    /// True if the Gaussians are a result, not just sparse points.
    pub(crate) trained: bool,
    /// Objects and parts, if they were found before.
    pub semantics: Option<Arc<SemanticMap>>,
    /// Path of its photos' masks, if they came with the photos.
    pub(crate) masks: Option<PathBuf>,
    /// Folder in which training keeps its results and checkpoints.
    pub out: PathBuf,
    /// Measurements that are kept with it.
    pub measurements: Vec<Measurement>,
    /// Camera path that is kept with it.
    pub(crate) camera_path: Option<crate::scene::CameraPath>,
    /// The first view.
    pub home: HomeView,
    pub(crate) facts: SceneFacts,
    /// True if the training run in `out` can be resumed.
    pub(crate) can_resume: bool,
    /// All training runs of its photos that this program keeps, itself included.
    pub runs: Vec<RunSummary>,
    pub(crate) reports: Vec<PathBuf>,
    pub(crate) report_out: PathBuf,
    /// True if edits of Gaussians created it, and are stored in it.
    pub(crate) is_edited: bool,
    /// Its computer, if that is another one.
    pub remote: Option<Origin>,
}

impl Deref for OpenedScene {
    type Target = Scene;

    fn deref(&self) -> &Scene {
        &self.scene
    }
}

impl OpenedScene {
    /// Returns the drawn Gaussians, if there are any.
    pub fn gaussians(&self) -> Option<&Arc<GaussianCloud>> {
        Some(&self.scene.cloud).filter(|cloud| !cloud.is_empty())
    }

    /// Returns the path of its Gaussians: the folder of a trained scene, or a file.
    pub(crate) fn stored(&self) -> &Path {
        if self.is_stored() { &self.out } else { &self.path }
    }

    /// Returns the scene after training into `out`: other settings are another training run, in its own folder. A scene
    /// on another computer keeps its results there.
    pub(crate) fn trained_in(&self, out: &Path) -> Self {
        let out = if self.remote.is_some() { &self.out } else { out };
        Self { out: out.into(), known_held_out: None, ..self.clone() }
    }

    /// Returns whether both are of the same photos on this computer.
    pub(crate) fn has_photos_of(&self, other: &Self) -> bool {
        let place =
            |scene: &Self| Some(files::real(scene.dataset.as_ref().filter(|_| scene.remote.is_none())?.source()));
        place(self).is_some_and(|own| place(other) == Some(own))
    }

    /// Length of a unit in meters, if it is known of the scene or of its photos.
    pub(crate) fn meters_per_unit(&self) -> Option<f64> {
        self.scene.meters_per_unit.or_else(|| self.dataset.as_ref().and_then(|d| d.meters_per_unit))
    }

    /// Returns the indices of its held-out photos; if they are unknown, every `every`-th.
    pub(crate) fn held_out(&self, every: usize) -> Vec<usize> {
        let split = || self.dataset.as_ref().map(|d| d.split(every).1);
        self.known_held_out.clone().or_else(split).unwrap_or_default()
    }

    fn of(scene: Scene, dataset: Option<Arc<Dataset>>, observer: &mut dyn Observer) -> Self {
        scene.warnings.iter().for_each(|warning| observer.note(Severity::Warning, warning.clone()));
        let without = |d: &Arc<Dataset>| held_out(d, &scene.cameras, None, scene.config.holdout_every);
        let known_held_out = dataset.as_ref().filter(|_| !scene.cameras.is_empty()).map(without);
        let home = match &dataset {
            Some(dataset) if scene.cameras.is_empty() => HomeView::new(&dataset.cameras(), Some(&scene.cloud)),
            _ => scene.home(),
        };
        let has_checkpoint = scene.folder.as_ref().is_some_and(|f| f.join(CHECKPOINT_FILE).is_file());
        let may_have = scene.folder.is_some() || scene.result.is_some();
        let semantics = may_have.then(|| known_objects(&scene, observer)).flatten();
        Self {
            dataset,
            known_held_out,
            trained: true,
            semantics,
            measurements: scene.folder.as_deref().map_or_else(Vec::new, |folder| measurements::known(folder, observer)),
            camera_path: scene.folder.as_deref().and_then(|folder| camera_path::known(folder, observer)),
            out: scene.folder.clone().unwrap_or_default(),
            home,
            can_resume: has_checkpoint,
            scene,
            ..Self::default()
        }
    }
}

/// Opens a path with all its data: photos with the Gaussians that were trained on them before, a trained scene with its
/// photos. Missing or broken files beside the scene itself are reported and left out.
pub(crate) fn open(
    path: &Path,
    folders: &Folders,
    machine: &Machine,
    observer: &mut dyn Observer,
) -> Result<OpenedScene, JobError> {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let of_method = method::scene(&path, None)?;
    let path = &if of_method.is_some() { path } else { beside::splat_of(&path) };
    let mut at = path.clone();
    let mut opened = match of_method {
        Some(scene) => beside::with_photos(scene, observer),
        None => match io::open_beside(path, None)? {
            (Opened::Dataset(dataset), _) => photos(named(dataset, folders), folders, observer),
            (Opened::Cloud(cloud), training) => beside::with_photos(Scene::bare(path, cloud, training), observer),
            (Opened::Trained(trained), _) => {
                let scene = tolerant(path, trained, observer);
                let dataset = photos_of(&scene, observer).map(|dataset| Arc::new(named(dataset, folders)));
                if let Some(dataset) = dataset.as_ref().filter(|_| folders.is_training(path)) {
                    // One of several training runs of these photos, by which the user knows it.
                    at = dataset.source().to_path_buf();
                }
                OpenedScene::of(scene, dataset, observer)
            }
        },
    };
    opened.scene.path = at;
    opened.runs = opened.dataset.as_ref().map_or_else(Vec::new, |d| runs::list(folders, d.source()));
    if let Some(text) = objects_elsewhere(&opened) {
        observer.note(Severity::Warning, text);
    }
    opened.masks = opened.dataset.as_ref().map(|d| d.root.clone()).filter(|root| Labels::open(root).is_ok());
    opened.report_out = match opened.out.as_os_str().is_empty() {
        true => folders.report(path),
        false => opened.out.join("report"),
    };
    let cloud = opened.trained.then_some((&*opened.cloud, opened.sh_stored));
    let facts = plan::facts(machine, opened.dataset.as_deref(), cloud, &TrainConfig::default());
    opened.facts = facts.with_semantics(opened.semantics.as_deref());
    Ok(opened)
}

/// Gives photos the name by which they are shown.
fn named(dataset: Dataset, folders: &Folders) -> Dataset {
    Dataset { name: folders.name_of_photos(&dataset.root), ..dataset }
}

/// Opens photos, with the Gaussians that were trained on them before, if there are any.
fn photos(dataset: Dataset, folders: &Folders, observer: &mut dyn Observer) -> OpenedScene {
    let out = folders.trained(dataset.source());
    let before = trained::is_scene(&out).then(|| trained::load(&out)).and_then(|loaded| match loaded {
        Ok(scene) => Some(scene),
        Err(e) => {
            observer.note(Severity::Warning, format!("Earlier training of these photos not shown: {e}. Train again"));
            None
        }
    });
    let (name, background) = (dataset.name.clone(), dataset.background);
    let dataset = Arc::new(dataset);
    if let Some(before) = before {
        let scene = tolerant(&out, before, observer);
        return OpenedScene::of(Scene { name, ..scene }, Some(dataset), observer);
    }
    let cloud = sparse_cloud(&dataset).map(Arc::new);
    let settings = TrainConfig::default().render_settings(background, dataset.camera_extent().1);
    let home = HomeView::new(&dataset.cameras(), cloud.as_deref());
    let scene = Scene { name, cloud: cloud.unwrap_or_default(), settings, ..Scene::default() };
    OpenedScene { scene, dataset: Some(dataset), out, home, ..OpenedScene::default() }
}
