//! A scene received over the network: the same as one opened here, except for data without files here.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::super::{Folders, JobError, plan};
use super::{OpenedScene, Scene, compact, near_without_cameras};
use crate::io::scene_info;
use crate::io::trained::SceneInfo;
use crate::pipeline::observer::Silent;
use crate::pipeline::train::TrainConfig;
use crate::render::RenderSettings;
use crate::scene::{Camera, Dataset, GaussianCloud, Machine, Photo, SemanticMap};

/// The computer that a scene is on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// Address for display: `127.0.0.1:7070`.
    pub host: String,
    /// True if objects and parts may be changed from here.
    pub allow_edit: bool,
    /// True if it sends photos.
    pub photos: bool,
}

/// Builds the scene that `info` describes, with the Gaussians received.
///
/// # Errors
/// If its cameras or settings are invalid.
pub(crate) fn received(
    info: SceneInfo,
    sent: Option<(GaussianCloud, Option<SemanticMap>)>,
    is_result: bool,
    origin: Origin,
    folders: &Folders,
    machine: &Machine,
) -> Result<OpenedScene, JobError> {
    let path = PathBuf::from(&origin.host);
    scene_info::check(&info, &path)?;
    let config = TrainConfig::stored(&path, info.config.clone())?;
    let (mut cloud, map) = sent.map_or((None, None), |(cloud, map)| (Some(cloud), map));
    let (_, extent) = Camera::extent_of(info.cameras.iter().map(|c| &c.camera));
    let mut settings = match &mut cloud {
        Some(cloud) if info.config.is_null() => RenderSettings::of_mode(cloud.render_mode),
        Some(cloud) => {
            cloud.render_mode = config.render_mode();
            config.render_settings(info.background, extent)
        }
        None => config.render_settings(info.background, extent),
    };
    let (cloud, sh_stored) = compact(cloud.unwrap_or_default());
    if info.cameras.is_empty() {
        settings.near = near_without_cameras(&cloud);
    }
    let dataset = (!info.cameras.is_empty()).then(|| Arc::new(photos(&info, &origin)));
    let scene = Scene {
        name: info.name,
        path,
        cloud,
        sh_stored,
        cameras: info.cameras,
        settings,
        config,
        history: info.history,
        meters_per_unit: info.meters_per_unit.filter(|m| m.is_finite() && *m > 0.0),
        ..Scene::default()
    };
    let known = is_result.then_some((&*scene.cloud, sh_stored));
    let facts = plan::facts(machine, dataset.as_deref(), known, &TrainConfig::default());
    let out = folders.of_remote(&origin.host);
    Ok(OpenedScene {
        facts: facts.with_semantics(map.as_ref()),
        semantics: map.map(Arc::new),
        trained: is_result,
        report_out: out.join("report"),
        out,
        remote: Some(origin),
        ..OpenedScene::of(scene, dataset, &mut Silent)
    })
}

/// Returns photos with known cameras. Available ones are at the other computer; the others have no place.
fn photos(info: &SceneInfo, origin: &Origin) -> Dataset {
    let place = Path::new(if origin.photos { &*origin.host } else { "" });
    Dataset {
        name: info.name.clone(),
        format: "another computer".into(),
        photos: info.cameras.iter().map(|c| Photo::new(&*c.name, place, c.camera.clone())).collect(),
        background: info.background,
        meters_per_unit: info.meters_per_unit,
        ..Dataset::default()
    }
}
