//! What each command does: the only implementation of [`Jobs`] that ships.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::models::ModelList;
use super::places::Places;
use super::preview::{home_view, sparse_cloud};
use super::protocol::{Command, Failure, OpenedScene, Outcome, Stop};
use super::thread::Jobs;
use super::{edit, guide, machine, measure as measuring};
use crate::io::labels::Labels;
use crate::io::{self, IoError, OpenError, Opened, SceneFolder, TrainedScene, splat_ply, trained};
use crate::models;
use crate::models::catalogue::{self, InstallError, Role, SAM2};
use crate::models::fetch::{FetchError, Patience};
use crate::pipeline::evaluate::evaluate;
use crate::pipeline::observer::{Observer, Severity, Ticker};
use crate::pipeline::semantics::find::{Carry, FindOptions, Finding, Found, REGIONS, Tools, find_objects, segmenter};
use crate::pipeline::semantics::follow::Follower;
use crate::pipeline::semantics::portraits::portraits;
use crate::pipeline::synth::demo;
use crate::pipeline::train::checkpoint::CheckpointError;
use crate::pipeline::train::{self, TrainConfig, TrainEnd, TrainError};
use crate::render::RenderSettings;
use crate::scene::trace::{self, Sort};
use crate::scene::{Dataset, Facts, GaussianCloud, Machine, Photo, PhotoPixels, SemanticMap, plan};

/// Runs commands on the pipeline.
pub struct PipelineJobs {
    places: Places,
    machine: OnceLock<Machine>,
    /// In which state the window knows the scene in a folder: what somebody else saved there since is
    /// not written over.
    known: Mutex<HashMap<PathBuf, Option<String>>>,
}

impl PipelineJobs {
    /// Keeps what it makes in `places`.
    pub fn new(places: Places) -> Self {
        Self { places, machine: OnceLock::new(), known: Mutex::default() }
    }

    /// From now on the window knows the scene in `folder` in the state `state`.
    fn knows(&self, folder: &Path, state: Option<String>) {
        self.known.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.into(), state);
    }

    /// The state in which the window knows a scene.
    fn known(&self, scene: &SceneFolder) -> Option<String> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner).get(scene.path()).cloned().flatten()
    }

    /// The objects and parts stored with a trained scene; broken ones are told and left out.
    fn semantics_of(&self, scene: &TrainedScene, observer: &mut dyn Observer) -> Option<Arc<SemanticMap>> {
        self.knows(&scene.folder, scene.state.clone());
        match io::semantic_map::load(&scene.folder, scene.state.as_deref(), &scene.cloud) {
            Ok(map) => map.map(|map| {
                let what = format!("{} objects and parts", map.identities.len());
                trace::record(Sort::Objects, what, "the scene was opened", map.bytes());
                Arc::new(map)
            }),
            Err(e) => {
                observer.note(Severity::Warning, format!("Its objects cannot be shown: {e}"));
                None
            }
        }
    }

    /// What the machine offers, looked up once.
    fn machine(&self) -> &Machine {
        self.machine.get_or_init(machine::look)
    }

    fn open(&self, path: &Path, observer: &mut dyn Observer) -> Result<OpenedScene, Stop> {
        let path = &std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let mut scene = match io::open(path).map_err(|e| open_failure(&e))? {
            Opened::Dataset(dataset) => self.dataset_scene(dataset, observer),
            Opened::Cloud(cloud) => {
                let name = path.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                let (cloud, sh_stored) = compact(cloud);
                OpenedScene { name, cloud: Some(cloud), sh_stored, trained: true, ..OpenedScene::default() }
            }
            Opened::Trained(trained) => {
                let semantics = self.semantics_of(&trained, observer);
                OpenedScene { semantics, ..trained_scene(trained, observer) }
            }
        };
        scene.path.clone_from(path);
        let root = scene.dataset.as_ref().map(|d| d.root.clone());
        scene.masks = root.filter(|root| Labels::open(root).is_ok());
        scene.report_out = match scene.out.as_os_str().is_empty() {
            true => self.places.report(path),
            false => scene.out.join("report"),
        };
        scene.reports = measuring::known(path, &scene.report_out);
        let (dataset, cloud) = (scene.dataset.as_deref(), scene.cloud.as_deref());
        if scene.home.camera.is_none() {
            scene.home = home_view(dataset, cloud);
        }
        let cloud = cloud.filter(|_| scene.trained).map(|c| (c, scene.sh_stored));
        let facts = self.facts(dataset, cloud, &TrainConfig::default());
        scene.facts = facts.with_semantics(scene.semantics.as_deref());
        Ok(scene)
    }

    fn demo(&self, observer: &mut dyn Observer) -> Result<Outcome, Stop> {
        let out = self.places.demo();
        if !demo::demo_is_written(&out) {
            demo::write_demo(&out, observer)?;
        }
        Ok(Outcome::Opened(Box::new(self.open(&out, observer)?)))
    }

    fn train(
        &self,
        dataset: &Dataset,
        config: &TrainConfig,
        out: PathBuf,
        observer: &mut dyn Observer,
    ) -> Result<Outcome, Stop> {
        let (result, out) = match train::run(dataset, config, Some(&out), observer) {
            // Other settings are another training: it gets its own folder, the earlier one stays.
            Err(TrainError::Checkpoint(CheckpointError::OtherRun { .. } | CheckpointError::Missing { .. })) => {
                let fresh = self.places.fresh(&dataset.root);
                observer.note(
                    Severity::Info,
                    format!(
                        "The settings changed, so this is a new training; the earlier one stays in {}",
                        out.display()
                    ),
                );
                (train::run(dataset, config, Some(&fresh), observer), fresh)
            }
            result => (result, out),
        };
        let outcome = result?;
        // Its objects are carried over to Gaussians that went on, and have to be read with their state.
        let semantics = match trained::is_scene(&out) {
            true => {
                let state = splat_ply::state(&out.join(trained::CLOUD_FILE)).map_err(|e| io_failure(&e))?;
                let (folder, info) = (out.clone(), trained::SceneInfo::default());
                let scene = TrainedScene { folder, info, cloud: (*outcome.cloud).clone(), state };
                self.semantics_of(&scene, observer)
            }
            false => None,
        };
        if outcome.end == TrainEnd::Cancelled {
            if semantics.is_some() {
                let text =
                    "Its objects are stored with the Gaussians as they are now; open the scene again to see them";
                observer.note(Severity::Info, text.into());
            }
            return Err(Stop::Cancelled);
        }
        let cloud = &outcome.cloud;
        let facts = self.facts(Some(dataset), Some((cloud, cloud.sh_degree)), config);
        let facts = Box::new(facts.with_semantics(semantics.as_deref()));
        Ok(Outcome::Trained { evaluations: outcome.evaluations, out, semantics, facts })
    }

    /// Facts for a plan; a cloud comes with the degree of the harmonics in its file.
    fn facts(&self, dataset: Option<&Dataset>, cloud: Option<(&GaussianCloud, u8)>, config: &TrainConfig) -> Facts {
        let cameras = dataset.map(Dataset::cameras).unwrap_or_default();
        let facts = Facts::of(self.machine().clone(), config.limits()).with_photos(&cameras);
        match cloud {
            Some((cloud, sh_stored)) => facts.with_cloud(cloud, sh_stored, &cameras),
            None => facts,
        }
    }

    /// Objects and parts of `cloud`, stored in the trained scene `out`.
    fn find(
        &self,
        cloud: &GaussianCloud,
        photos: &[Photo],
        (settings, side_px): (&RenderSettings, u32),
        (masks, with): (Option<&Path>, &Finding),
        out: &Path,
        observer: &mut dyn Observer,
    ) -> Result<Outcome, Stop> {
        // Held from the beginning: nobody waits for masks that cannot be stored.
        let scene = SceneFolder::hold(out, "finding objects").map_err(|e| io_failure(&e))?;
        let network = match with.segmenter.as_deref() {
            Some(REGIONS) => None,
            Some(name) => Some(name.to_owned()),
            None => {
                let usable = catalogue::usable(Role::Segmenter, &mut |text| observer.note(Severity::Warning, text));
                usable?.into_iter().next()
            }
        };
        let found = segmenter(masks, cloud, settings, network.as_deref());
        let mut segmenter = found?;
        let mut follower = match with.carry {
            Carry::Gaussians => None,
            _ => {
                let opened = Follower::open(SAM2, Some(out.join("cache")));
                Some(opened?)
            }
        };
        // Without the encoder, names alone are understood.
        let encoder = match with.encoder.as_deref() {
            Some(name) => models::encoder(name),
            None => models::best_encoder(&mut |text| observer.note(Severity::Warning, text)),
        };
        let mut encoder = encoder
            .inspect_err(|e| observer.note(Severity::Warning, format!("Objects are found without their looks: {e}")))
            .ok();
        let mut options = FindOptions::default();
        options.track.veto = with.carry == Carry::Both;
        options.track.max_side_px = side_px;
        let found = {
            let (follower, encoder) = (follower.as_mut(), encoder.as_deref_mut());
            let tools = Tools { segmenter: &mut *segmenter, follower, encoder };
            find_objects(cloud, photos, settings, tools, &options, observer)
        };
        let Found { map, .. } = found?;
        let (kept, state) =
            scene.replace_map(self.known(&scene).as_deref(), &map, cloud).map_err(|e| io_failure(&e))?;
        self.knows(out, Some(state));
        if let Some(kept) = kept {
            observer.note(Severity::Info, format!("The objects and parts before are kept in {}", kept.display()));
        }
        Ok(Outcome::Objects(Arc::new(map)))
    }

    /// Photos, with the Gaussians that were trained on them before, if there are any.
    fn dataset_scene(&self, dataset: Dataset, observer: &mut dyn Observer) -> OpenedScene {
        let out = self.places.trained(&dataset.root);
        let before = trained::is_scene(&out).then(|| trained::load(&out)).and_then(|loaded| match loaded {
            Ok(scene) => Some(scene),
            Err(e) => {
                observer.note(Severity::Warning, format!("Earlier training of these photos cannot be shown: {e}"));
                None
            }
        });
        let name = dataset.name.clone();
        let background = dataset.background;
        let dataset = Some(Arc::new(dataset));
        match before {
            Some(scene) => {
                let semantics = self.semantics_of(&scene, observer);
                let TrainedScene { info, cloud, folder, .. } = scene;
                let render = config_of(&folder, info.config, observer).render_settings(background);
                let (cloud, sh_stored) = compact(cloud);
                OpenedScene {
                    name,
                    dataset,
                    cloud: Some(cloud),
                    sh_stored,
                    semantics,
                    trained: true,
                    out,
                    history: info.history,
                    metres_per_unit: info.metres_per_unit,
                    render,
                    ..OpenedScene::default()
                }
            }
            None => {
                let cloud = dataset.as_deref().and_then(sparse_cloud).map(Arc::new);
                let render = TrainConfig::default().render_settings(background);
                OpenedScene { name, dataset, cloud, out, render, ..OpenedScene::default() }
            }
        }
    }
}

/// The settings of a training; where they cannot be read this is told, and the scene is drawn with the
/// defaults.
fn config_of(folder: &Path, config: serde_json::Value, observer: &mut dyn Observer) -> TrainConfig {
    TrainConfig::stored(folder, config).unwrap_or_else(|e| {
        observer.note(Severity::Warning, format!("It may not look as it was trained: {e}"));
        TrainConfig::default()
    })
}

/// A trained scene, with its photos if they are still where they were.
fn trained_scene(scene: TrainedScene, observer: &mut dyn Observer) -> OpenedScene {
    let photos = scene.dataset_path().map(|p| (io::open(&p), p));
    let dataset = match photos {
        Some((Ok(Opened::Dataset(d)), _)) => Some(Arc::new(d)),
        Some((Ok(_), p)) => {
            observer.note(
                Severity::Warning,
                format!("{} holds no photos any more; the scene opens without them", p.display()),
            );
            None
        }
        Some((Err(e), _)) => {
            observer.note(Severity::Warning, format!("The photos cannot be read, the scene opens without them: {e}"));
            None
        }
        None => {
            observer.note(Severity::Warning, "The photos are not where they were; the scene opens without them".into());
            None
        }
    };
    let TrainedScene { folder, info, cloud, .. } = scene;
    let render = config_of(&folder, info.config, observer).render_settings(info.background);
    let mut opened = OpenedScene {
        name: info.name,
        dataset,
        trained: true,
        out: folder,
        history: info.history,
        metres_per_unit: info.metres_per_unit,
        render,
        ..OpenedScene::default()
    };
    opened.home = home_view(opened.dataset.as_deref(), Some(&cloud));
    if let Some(first) = info.cameras.into_iter().next() {
        opened.home.camera = Some(first.camera);
    }
    let (cloud, sh_stored) = compact(cloud);
    (opened.cloud, opened.sh_stored) = (Some(cloud), sh_stored);
    opened
}

/// The Gaussians without bands of harmonics that are zero, and the degree that they came with.
fn compact(cloud: GaussianCloud) -> (Arc<GaussianCloud>, u8) {
    let stored = cloud.sh_degree;
    let used = plan::used_degree(&cloud);
    let cloud = cloud.up_to_degree(used);
    trace::record(Sort::Gaussians, format!("{} Gaussians", cloud.len()), "the scene was opened", cloud.bytes());
    (Arc::new(cloud), stored)
}

impl Jobs for PipelineJobs {
    fn run(&self, command: Command, observer: &mut dyn Observer) -> Result<Outcome, Stop> {
        match command {
            Command::Open { path } => Ok(Outcome::Opened(Box::new(self.open(&path, observer)?))),
            Command::Demo => self.demo(observer),
            Command::Train { dataset, config, out } => self.train(&dataset, &config, out, observer),
            Command::Evaluate { dataset, cloud, config } => measure(&dataset, &cloud, &config, observer),
            Command::FindObjects { dataset, cloud, holdout_every, settings, side_px, masks, with, out } => {
                let (training, _) = dataset.split(holdout_every);
                let photos: Vec<Photo> = training.iter().map(|&i| dataset.photos[i].clone()).collect();
                self.find(&cloud, &photos, (&settings, side_px), (masks.as_deref(), &with), &out, observer)
            }
            Command::EditObjects { cloud, map, settings, request, out } => {
                let new = edit::run(&cloud, &map, &settings, &request)?;
                if trained::is_scene(&out) {
                    let state = SceneFolder::hold(&out, "storing an edit")
                        .and_then(|scene| scene.save_map(self.known(&scene).as_deref(), &new, &cloud))
                        .map_err(|e| Stop::Failed(Failure::of(&e, "The change is not stored.")))?;
                    self.knows(&out, Some(state));
                }
                Ok(Outcome::Edited(new))
            }
            Command::Export { cloud, path } => export(&cloud, &path),
            Command::Photo { index, photo, max_side_px } => {
                let pixels = io::photo::load(&photo, max_side_px).map_err(|e| io_failure(&e))?;
                Ok(Outcome::Photo { index, max_side_px, pixels: Arc::new(pixels) })
            }
            Command::Picture { pixels, path } => save_picture(&pixels, &path),
            Command::ListModels => Ok(Outcome::Models(Arc::new(ModelList::look()))),
            Command::InstallModel { id, brought } => install(&id, brought.as_deref(), observer),
            Command::Visit(request) => guide::visit(*request),
            Command::Explore { cloud, cameras, up } => {
                Ok(Outcome::Explored(Arc::new(guide::Explored::new(cloud, &cameras, up))))
            }
            Command::Film(request) => guide::film(*request, observer),
            Command::Measure(request) => measuring::run(*request, observer),
            Command::ReadReport { path, second } => measuring::read(path, second),
            Command::Portraits { cloud, map, settings, home } => {
                let from = home.camera.as_ref().map_or(home.bounds.center() + home.up, |c| c.center);
                trace::record(Sort::Portraits, "portraits of objects and parts", "a list of them is shown", 0);
                let drawn = portraits(&cloud, &map, &settings, from, home.up);
                Ok(Outcome::Portraits(map, drawn?))
            }
        }
    }
}

/// Held-out quality of `cloud`.
fn measure(
    dataset: &Dataset,
    cloud: &GaussianCloud,
    config: &TrainConfig,
    observer: &mut dyn Observer,
) -> Result<Outcome, Stop> {
    let (_, held) = dataset.split(config.holdout_every);
    if held.is_empty() {
        let message = "No photo is held out, so there is nothing to measure on".into();
        return Err(Stop::Failed(Failure {
            message,
            remedy: "Choose how many to hold out in the Training pane.".into(),
        }));
    }
    let views = train::load_views(dataset, &held, config, "Loading held-out photos", observer);
    let views = views?.ok_or(Stop::Cancelled)?;
    let settings = config.render_settings(dataset.background);
    let evaluation = evaluate(cloud, &views, &settings, 0, 0.0)?;
    Ok(Outcome::Evaluated(evaluation))
}

/// Puts a model in place.
fn install(id: &str, brought: Option<&Path>, observer: &mut dyn Observer) -> Result<Outcome, Stop> {
    let folder = catalogue::folder();
    let mut ticker = Ticker::new("", 0);
    let done = catalogue::entry(id).and_then(|entry| match brought {
        Some(brought) => entry.add(&folder, brought),
        None => entry.fetch(&folder, None, Patience::default(), &mut |name, there, all| {
            ticker.enter(format!("Fetching {name} (kB)"), all.unwrap_or(there) / 1000);
            ticker.tick((there / 1000) as usize, observer).is_ok()
        }),
    });
    match done {
        Ok(()) => Ok(Outcome::ModelInstalled(id.to_owned())),
        Err(InstallError::Fetch(FetchError::Cancelled { .. })) => Err(Stop::Cancelled),
        Err(e) => Err(Stop::Failed(Failure::of(&e, ""))),
    }
}

fn export(cloud: &GaussianCloud, path: &Path) -> Result<Outcome, Stop> {
    io::splat_ply::write(path, cloud).map_err(|e| io_failure(&e))?;
    Ok(Outcome::Written(path.to_path_buf()))
}

fn save_picture(pixels: &PhotoPixels, path: &Path) -> Result<Outcome, Stop> {
    let bytes: Vec<u8> = pixels.rgb.iter().flatten().copied().collect();
    io::atomic::write(path, |w| {
        use image::ImageEncoder;
        let png = image::codecs::png::PngEncoder::new(w);
        png.write_image(&bytes, pixels.width_px, pixels.height_px, image::ExtendedColorType::Rgb8)
            .map_err(std::io::Error::other)
    })
    .map_err(|e| io_failure(&e))?;
    Ok(Outcome::Written(path.to_path_buf()))
}

fn io_failure(error: &IoError) -> Stop {
    // These errors name the file, the place and the remedy themselves.
    Stop::Failed(Failure::of(error, ""))
}

fn open_failure(error: &OpenError) -> Stop {
    let remedy = match error {
        OpenError::NotFound { .. } => "Check the path: the file may have been moved or renamed.",
        OpenError::Unrecognised { .. } => "Open the folder that holds the photos and their poses, or a splat .ply.",
        OpenError::Io(_) => "",
    };
    Stop::Failed(Failure::of(error, remedy))
}
