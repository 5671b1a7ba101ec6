//! Scenes that are compared: results of other methods and scenes of this program, behind one trait.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::vectors::KnownVectors;
use crate::io::IoError;
use crate::io::results::{Method, MethodResult, ResultOptions, open_result};
use crate::io::trained::{self, SceneCamera};
use crate::jobs::query::{QueryEngine, ViewMaps, seen_from};
use crate::jobs::{JobError, Scene, open};
use crate::pipeline::semantics::evaluation::langsplat;
use crate::pipeline::semantics::query::foreign::asked::{ForeignScene, ForeignView};
use crate::pipeline::semantics::query::foreign::own_rules::ForeignMask;
use crate::pipeline::semantics::query::foreign::{ForeignError, ForeignPhrase};
use crate::pipeline::semantics::query::recipe::{QueryConfig, TEMPERATURE};
use crate::pipeline::semantics::smoothing::{largest_level, peak};
use crate::render::{RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, LevelFilter, SemanticMap};

/// Own rule of this program in words.
const BY_IDENTITY: &str = "pixels of the object or part that is the answer";

/// Answers of a scene to phrases.
pub(crate) trait PhraseAnswers {
    /// Renders what phrases need of a view.
    fn look(&mut self, camera: &Camera) -> Result<(), JobError>;

    /// Encodes a phrase; returns the milliseconds that it takes.
    fn encode(&mut self, phrase: &str, vectors: &mut KnownVectors<'_>) -> Result<f64, JobError>;

    /// Relevancy of each level at each pixel of the view, row-major, 0 to 1.
    fn levels(&mut self, phrase: &str, vectors: &mut KnownVectors<'_>) -> Result<Vec<Vec<f32>>, JobError>;

    /// The mask by the scene's own rule, if it has one, from the relevancy of [`Self::levels`].
    fn own_mask(
        &mut self,
        phrase: &str,
        levels: &[Vec<f32>],
        vectors: &mut KnownVectors<'_>,
    ) -> Result<Option<ForeignMask>, JobError>;
}

/// A scene that is compared.
pub(crate) struct CompareSubject {
    /// Its method, made distinct from the others.
    pub(crate) name: String,
    pub(crate) path: PathBuf,
    /// Encoder of phrases; `None` if names alone are compared, or if it knows no language.
    pub(crate) encoder: Option<String>,
    /// The photos' cameras, possibly none.
    pub(crate) cameras: Vec<SceneCamera>,
    /// Path of its photos, if it is known and they exist.
    pub(crate) photos: Option<PathBuf>,
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) settings: RenderSettings,
    pub(crate) answers: Box<dyn PhraseAnswers>,
}

impl CompareSubject {
    /// Opens a scene of this program, or the result of another method.
    ///
    /// # Errors
    /// If it is neither, cannot be read, or is a scene without objects.
    pub(crate) fn open(path: &Path, options: &ResultOptions) -> Result<Self, JobError> {
        if is_own(path) {
            let scene = open::scene(path)?;
            let map = scene.semantics()?;
            return Self::own(scene, map);
        }
        Ok(Self::of_result(open_result(path, options)?, path))
    }

    /// Opens the result of another method; `None` if the path is none.
    ///
    /// # Errors
    /// If only a file that can be named is missing.
    pub(crate) fn of_another_method(path: &Path, options: &ResultOptions) -> Result<Option<Self>, JobError> {
        if is_own(path) || !path.exists() {
            return Ok(None);
        }
        match open_result(path, options) {
            Ok(result) => Ok(Some(Self::of_result(result, path))),
            Err(e @ IoError::Unsupported { remedy, .. }) if remedy.contains("--decoder") => Err(e.into()),
            Err(_) => Ok(None),
        }
    }

    /// The result of another method.
    pub(crate) fn of_result(result: MethodResult, path: &Path) -> Self {
        let (method, cloud) = (result.method, result.cloud.clone());
        let cameras = result.cameras.clone();
        let scene = ForeignScene::new(Arc::new(result));
        Self {
            name: method.name().into(),
            path: path.into(),
            encoder: method.encoder().map(str::to_owned),
            cameras,
            photos: None,
            settings: RenderSettings::of_mode(cloud.render_mode),
            cloud,
            answers: Box::new(ForeignAnswers { method, scene, renderer: Renderer::new(), view: None }),
        }
    }

    /// A scene of this program.
    ///
    /// # Errors
    /// If the encoder of its objects is not here.
    pub(crate) fn own(scene: Scene, map: SemanticMap) -> Result<Self, JobError> {
        let recipe = QueryConfig::default();
        let engine = QueryEngine::new(map.language.as_ref(), recipe)?;
        Ok(Self {
            name: "FMLGS".into(),
            path: scene.path.clone(),
            encoder: map.language.as_ref().map(|language| language.encoder.clone()),
            cameras: scene.cameras.clone(),
            photos: scene.dataset_path.clone(),
            cloud: scene.cloud.clone(),
            settings: scene.settings.clone(),
            answers: Box::new(OwnAnswers { scene, map, engine, maps: None }),
        })
    }
}

/// Returns whether a path is a scene of this program.
fn is_own(path: &Path) -> bool {
    trained::is_scene(path) || path.is_file() && path.parent().is_some_and(trained::is_scene)
}

/// Makes names of equal methods distinct: by the folder, then by a number.
pub(crate) fn name_apart(scenes: &mut [CompareSubject]) {
    let is_again = |names: &[String], k: usize| names.iter().filter(|name| **name == names[k]).count() > 1;
    let methods: Vec<String> = scenes.iter().map(|s| s.name.clone()).collect();
    for (k, scene) in scenes.iter_mut().enumerate().filter(|(k, _)| is_again(&methods, *k)) {
        let folder = scene.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        scene.name = format!("{}, {folder}", methods[k]);
    }
    let names: Vec<String> = scenes.iter().map(|s| s.name.clone()).collect();
    for (k, scene) in scenes.iter_mut().enumerate().filter(|(k, _)| is_again(&names, *k)) {
        let before = names[..k].iter().filter(|name| **name == names[k]).count();
        scene.name = format!("{} ({})", names[k], before + 1);
    }
}

/// A result of another method with its view.
struct ForeignAnswers {
    method: Method,
    scene: ForeignScene,
    renderer: Renderer,
    view: Option<ForeignView>,
}

/// A phrase with all vectors that it is compared by.
struct EncodedPhrase {
    query: Vec<f32>,
    canonical: Vec<Vec<f32>>,
}

impl EncodedPhrase {
    fn new(method: Method, phrase: &str, vectors: &mut KnownVectors<'_>) -> Result<Self, JobError> {
        let encoder = method.encoder().ok_or(ForeignError::NoLanguage(method.name()))?;
        Ok(Self { query: vectors.get(encoder, phrase)?.0, canonical: vectors.canonical(encoder)? })
    }

    fn as_foreign(&self) -> ForeignPhrase<'_> {
        ForeignPhrase { query: &self.query, canonical: &self.canonical, temperature: TEMPERATURE }
    }
}

impl PhraseAnswers for ForeignAnswers {
    fn look(&mut self, camera: &Camera) -> Result<(), JobError> {
        self.view = Some(self.scene.look(&mut self.renderer, camera)?);
        Ok(())
    }

    fn encode(&mut self, phrase: &str, vectors: &mut KnownVectors<'_>) -> Result<f64, JobError> {
        let encoder = self.method.encoder().ok_or(ForeignError::NoLanguage(self.method.name()))?;
        vectors.canonical(encoder)?;
        Ok(vectors.get(encoder, phrase)?.1)
    }

    fn levels(&mut self, phrase: &str, vectors: &mut KnownVectors<'_>) -> Result<Vec<Vec<f32>>, JobError> {
        let encoded = EncodedPhrase::new(self.method, phrase, vectors)?;
        let Some(view) = &self.view else { return Ok(Vec::new()) };
        Ok(self.scene.relevancy(&mut self.renderer, view, encoded.as_foreign())?)
    }

    fn own_mask(
        &mut self,
        phrase: &str,
        levels: &[Vec<f32>],
        vectors: &mut KnownVectors<'_>,
    ) -> Result<Option<ForeignMask>, JobError> {
        let encoded = EncodedPhrase::new(self.method, phrase, vectors)?;
        let Some(view) = &self.view else { return Ok(None) };
        match self.scene.own_mask(&mut self.renderer, view, encoded.as_foreign(), levels) {
            Err(ForeignError::NoRule(_)) => Ok(None),
            found => Ok(Some(found?)),
        }
    }
}

/// A scene of this program with the maps of its view.
struct OwnAnswers {
    scene: Scene,
    map: SemanticMap,
    engine: QueryEngine,
    maps: Option<ViewMaps>,
}

impl PhraseAnswers for OwnAnswers {
    fn look(&mut self, camera: &Camera) -> Result<(), JobError> {
        let drawn = (&*self.scene.cloud, &self.scene.settings);
        let parts = self.map.has_parts();
        self.maps = Some(ViewMaps::draw(&mut Renderer::new(), drawn, &self.map, camera, true, parts)?);
        self.engine.place = seen_from(&self.scene, Some(camera));
        Ok(())
    }

    fn encode(&mut self, phrase: &str, _: &mut KnownVectors<'_>) -> Result<f64, JobError> {
        let answered = self.engine.ask(&self.map, phrase, LevelFilter::Auto)?;
        Ok(answered.map_or(0.0, |a| a.stages.encode))
    }

    fn levels(&mut self, phrase: &str, _: &mut KnownVectors<'_>) -> Result<Vec<Vec<f32>>, JobError> {
        let answered = self.engine.ask(&self.map, phrase, LevelFilter::Auto)?;
        let (Some(maps), Some(answered)) = (&self.maps, answered) else { return Ok(Vec::new()) };
        Ok(langsplat::levels(&answered, &maps.identities, &self.map.identities).into())
    }

    fn own_mask(
        &mut self,
        phrase: &str,
        levels: &[Vec<f32>],
        _: &mut KnownVectors<'_>,
    ) -> Result<Option<ForeignMask>, JobError> {
        let answered = self.engine.ask(&self.map, phrase, LevelFilter::Auto)?;
        let (Some(maps), Some(answered)) = (&self.maps, answered) else { return Ok(None) };
        let (mask, values) = (maps.of_answer(&self.map, &answered, 1), answered.heat(&maps.identities));
        let level = largest_level(levels).unwrap_or(0);
        let peak = peak(&values).filter(|at| values[*at] > 0.0);
        Ok(Some(ForeignMask { mask, level, values, peak, rule: BY_IDENTITY }))
    }
}
