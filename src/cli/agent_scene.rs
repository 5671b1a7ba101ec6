//! Scene in which the agent acts, with the options that `fmlgs agent` and `fmlgs mcp` share.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::agent_work::SceneWork;
use super::recipe::RecipeArgs;
use super::scene_args::open_scene;
use super::{CliError, number, view};
use crate::agent::Policy;
use crate::agent::scene::{AgentScene, Effect, ScenePhotos, SceneWorld};
use crate::agent::transcript::Transcript;
use crate::io::trained::SceneCamera;
use crate::jobs::export;
use crate::jobs::locate::kept::PhotoLocator;
use crate::navigate::Pose;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::scene::Camera;

/// Options of the agent, whoever makes its plans.
#[derive(Debug, clap::Args)]
pub(super) struct AgentSceneArgs {
    /// Photo to start from, by index or name, or a JSON camera file [default: the first photo]
    #[arg(long)]
    from: Option<String>,
    /// Policy file, which says what may be done [default: FMLGS_POLICY, else the built-in one]
    #[arg(long)]
    policy: Option<PathBuf>,
    /// Length of a scene unit in meters [default: the scene's own, if that is known]
    #[arg(long, value_parser = number::within(1e-9..=1e9))]
    meters: Option<f64>,
    /// Write the whole conversation: .json, or .md to be read
    #[arg(long)]
    transcript: Option<PathBuf>,
    #[command(flatten)]
    recipe: RecipeArgs,
}

/// Opened scene: the agent's world, and the work that its effects make.
pub(super) struct AgentStage {
    pub(super) world: SceneWorld,
    work: Arc<Mutex<SceneWork>>,
    /// Camera of the first view.
    pub(super) camera: Camera,
    /// Cameras of the photos.
    pub(super) cameras: Vec<SceneCamera>,
    /// Lines on the recipe of queries, if one was asked for.
    pub(super) lines: Vec<String>,
}

impl AgentStage {
    /// Work of the effects so far.
    pub(super) fn work(&self) -> MutexGuard<'_, SceneWork> {
        self.work.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Camera of the current view, at the size of the first one.
    pub(super) fn eye(&self) -> Camera {
        self.world.eye().camera(self.camera.width_px, self.camera.height_px)
    }
}

impl AgentSceneArgs {
    pub(super) fn policy(&self) -> Result<Policy, CliError> {
        let policy = match &self.policy {
            Some(path) => Policy::load(path),
            None => Policy::from_environment(),
        };
        policy.map_err(|e| CliError::failed(e.to_string()))
    }

    pub(super) fn recipe(&self) -> QueryConfig {
        self.recipe.recipe()
    }

    /// Opens the scene in `folder`. A picture may be written to `view` later.
    pub(super) fn open(&self, folder: &Path, view: Option<&Path>) -> Result<AgentStage, CliError> {
        let scene = open_scene(folder)?;
        let outputs = [(view, &[".png"][..]), (self.transcript.as_deref(), &[".json", ".md"][..])];
        for (path, endings) in outputs.into_iter().filter_map(|(path, endings)| Some((path?, endings))) {
            export::check(path, endings, &scene.reads())?;
        }
        let map = scene.semantics()?;
        let lines = self.recipe.lines(&map);
        let camera = view::choose(self.from.as_deref(), &scene)?;
        let has_cameras = !scene.cameras.is_empty() || scene.dataset_path.is_some();
        let locator = has_cameras.then(|| PhotoLocator::new(scene.clone()));
        let parts = AgentScene {
            cameras: scene.views(),
            up: scene.home().up,
            cloud: scene.cloud,
            settings: scene.settings,
            map: Arc::new(map),
            meters: self.meters.or(scene.meters_per_unit),
            exports: folder.join("exports"),
            folder: scene.folder.clone(),
            recipe: self.recipe(),
            explored: None,
        };
        let work = Arc::new(Mutex::new(SceneWork::new(&parts, scene.state)));
        let emit = {
            let work = Arc::clone(&work);
            Box::new(move |effect: Effect| work.lock().unwrap_or_else(PoisonError::into_inner).carry_out(&effect))
        };
        let aspect = f64::from(camera.width_px) / f64::from(camera.height_px);
        let world = SceneWorld::new(parts, Pose::of(&camera), aspect, emit);
        let mut world = world.map_err(|e| CliError::failed(e.to_string()))?;
        world.photos = ScenePhotos { locator, ..ScenePhotos::default() };
        Ok(AgentStage { world, work, camera, cameras: scene.cameras, lines })
    }

    /// Writes the transcript, if one is asked for.
    pub(super) fn write(&self, transcript: &Transcript) -> Result<(), CliError> {
        let Some(path) = &self.transcript else { return Ok(()) };
        let json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        export::text(path, &if json { transcript.to_json() } else { transcript.to_markdown() })?;
        Ok(())
    }
}
