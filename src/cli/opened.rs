//! What the subcommands need of a path, whatever kind of thing it holds.

use std::path::{Path, PathBuf};

use super::CliError;
use crate::io::{self, Opened, trained::TrainedScene};
use crate::pipeline::train::TrainConfig;
use crate::render::RenderSettings;
use crate::scene::{Camera, Dataset, GaussianCloud};

/// A camera with the photo's name that it belongs to.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCamera {
    /// The photo's name.
    pub name: String,
    /// Its pinhole camera at full resolution.
    pub camera: Camera,
    /// Whether training did not see it.
    pub held_out: bool,
}

/// Gaussians that can be drawn, with the cameras that came with them.
pub struct DrawableScene {
    /// The Gaussians.
    pub cloud: GaussianCloud,
    /// Possibly none.
    pub cameras: Vec<NamedCamera>,
    /// Colour behind everything, antialiasing and so on, as the scene was trained.
    pub settings: RenderSettings,
    /// How it was trained; defaults where that is not known.
    pub config: TrainConfig,
    /// Where its photos are, if known.
    pub dataset_path: Option<PathBuf>,
    /// Length of a scene unit in metres, if known.
    pub metres_per_unit: Option<f64>,
    /// Id of the save that its files are of, if it has one.
    pub state: Option<String>,
}

impl DrawableScene {
    /// What was read to open it from `path`, which no result may replace.
    pub fn reads<'a>(&'a self, path: &'a Path) -> Vec<&'a Path> {
        std::iter::once(path).chain(self.dataset_path.as_deref()).collect()
    }
}

/// Opens a trained scene or a splat.
pub fn drawable(path: &Path) -> Result<DrawableScene, CliError> {
    match io::open(path)? {
        Opened::Trained(scene) => from_trained(scene),
        Opened::Cloud(cloud) => Ok(DrawableScene {
            cloud,
            cameras: Vec::new(),
            settings: RenderSettings::default(),
            config: TrainConfig::default(),
            dataset_path: None,
            metres_per_unit: None,
            state: None,
        }),
        Opened::Dataset(_) => Err(CliError::failed(format!(
            "{path} holds photos but no Gaussians yet: train them first, with 'fmlgs train {path} --out SCENE'",
            path = path.display()
        ))),
    }
}

/// Opens posed photos.
pub fn dataset(path: &Path) -> Result<Dataset, CliError> {
    match io::open(path)? {
        Opened::Dataset(dataset) => Ok(dataset),
        Opened::Trained(_) | Opened::Cloud(_) => Err(CliError::failed(format!(
            "{} holds Gaussians; a folder of posed photos is needed here",
            path.display()
        ))),
    }
}

/// The cameras of a dataset's photos, those that `every` holds out marked.
pub fn named_cameras(dataset: &Dataset, every: usize) -> Vec<NamedCamera> {
    let (_, held_out) = dataset.split(every);
    let named = |(i, p): (usize, &crate::scene::Photo)| NamedCamera {
        name: p.name.clone(),
        camera: p.camera.clone(),
        held_out: held_out.contains(&i),
    };
    dataset.photos.iter().enumerate().map(named).collect()
}

fn from_trained(scene: TrainedScene) -> Result<DrawableScene, CliError> {
    let dataset_path = scene.dataset_path();
    let info = scene.info;
    let config = TrainConfig::stored(&scene.folder, info.config)?;
    let settings = config.render_settings(info.background);
    let named = |c: io::trained::SceneCamera| NamedCamera { name: c.name, camera: c.camera, held_out: c.held_out };
    Ok(DrawableScene {
        cloud: scene.cloud,
        cameras: info.cameras.into_iter().map(named).collect(),
        settings,
        config,
        dataset_path,
        metres_per_unit: info.metres_per_unit.filter(|m| m.is_finite() && *m > 0.0),
        state: scene.state,
    })
}
