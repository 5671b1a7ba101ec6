//! Scenes that are compared: results of other methods and scenes of this program, behind one trait.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::classes::ClassAnswers;
use super::phrase_answers::PhraseAnswers;
use super::vectors::KnownVectors;
use crate::io::IoError;
use crate::io::results::{Method, MethodKind, MethodResult, ResultOptions, open_result};
use crate::io::trained::{self, SceneCamera};
use crate::jobs::query::{BY_IDENTITY, QueryEngine, ViewMaps, seen_from};
use crate::jobs::{JobError, Scene, ask_result, open};
use crate::pipeline::semantics::evaluation::langsplat;
use crate::pipeline::semantics::query::foreign::asked::{ForeignScene, ForeignView};
use crate::pipeline::semantics::query::foreign::own_rules::ForeignMask;
use crate::pipeline::semantics::query::foreign::pointed::PointedPixel;
use crate::pipeline::semantics::query::foreign::{ForeignError, ForeignPhrase};
use crate::pipeline::semantics::query::recipe::{QueryConfig, TEMPERATURE};
use crate::pipeline::semantics::smoothing::{largest_level, peak};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, LevelFilter, Mask, NO_IDENTITY, SemanticMap};

/// Options in the remedies of errors that are about an option, not about the files.
const OF_OPTIONS: [&str; 2] = ["--decoder", "--encoder"];

/// A scene that is opened for questions once it is asked.
#[derive(Clone, Debug)]
pub(crate) enum AskableScene {
    /// A scene with objects.
    Own(Box<Scene>, Arc<SemanticMap>),
    /// A result of a method.
    Result(Box<Scene>, Method),
}

impl AskableScene {
    /// A scene with these objects; `None` if it answers nothing.
    pub(crate) fn of(scene: &Scene, map: Option<&Arc<SemanticMap>>) -> Option<Self> {
        let by_objects = || map.map(|map| Self::Own(Box::new(scene.clone()), Arc::clone(map)));
        let Some(method) = scene.method else { return by_objects() };
        let by_values = || Some(Self::Result(Box::new(scene.clone()), method));
        match method.kind() {
            MethodKind::Embeddings | MethodKind::Clusters => by_values(),
            MethodKind::Affinities => by_objects().or_else(by_values),
            MethodKind::Classes => by_objects(),
        }
    }

    /// Opens it; `encoder` encodes phrases for a result that knows language, in place of its authors'.
    ///
    /// # Errors
    /// If it cannot be read, or the encoder of its objects is not here.
    pub(crate) fn open(&self, encoder: Option<&str>) -> Result<CompareSubject, JobError> {
        match self {
            Self::Own(scene, map) => CompareSubject::own((**scene).clone(), Arc::clone(map)),
            Self::Result(scene, method) => {
                let encoder = encoder.filter(|_| method.encoder().is_some()).map(str::to_owned);
                let result = ask_result::read(scene, &ResultOptions { encoder, ..ResultOptions::default() })?;
                Ok(CompareSubject::of_result(result, &scene.path))
            }
        }
    }

    /// Text encoder of its authors, if it is a result that knows language.
    pub(crate) fn encoder(&self) -> Option<&'static str> {
        match self {
            Self::Own(..) => None,
            Self::Result(_, method) => method.encoder(),
        }
    }
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
            if *options != ResultOptions::default() {
                let text = "--decoder and --encoder are for results of other methods; this is a scene of this program";
                return Err(JobError::Output(format!("{}: {text}", path.display())));
            }
            let scene = open::scene(path)?;
            let map = scene.semantics()?;
            return Self::own(scene, map);
        }
        Ok(Self::of_result(open_result(path, options)?, path))
    }

    /// Opens the result of another method; `None` if the path is none.
    ///
    /// # Errors
    /// If only a file that can be named is missing, or an encoder is named for a result without language.
    pub(crate) fn of_another_method(path: &Path, options: &ResultOptions) -> Result<Option<Self>, JobError> {
        if is_own(path) || !path.exists() {
            return Ok(None);
        }
        match open_result(path, options) {
            Ok(result) => Ok(Some(Self::of_result(result, path))),
            Err(e @ IoError::Unsupported { remedy, .. }) if OF_OPTIONS.iter().any(|o| remedy.contains(o)) => {
                Err(e.into())
            }
            Err(_) => Ok(None),
        }
    }

    /// The result of another method.
    pub(crate) fn of_result(result: impl Into<Arc<MethodResult>>, path: &Path) -> Self {
        let result = result.into();
        let (name, encoder) = (result.method.name().to_owned(), result.encoder.clone());
        let (cameras, cloud) = (result.cameras.clone(), result.cloud.clone());
        let scene = ForeignScene::new(result);
        let answers: Box<dyn PhraseAnswers> = match scene.has_named_classes() {
            true => Box::new(ClassAnswers::new(scene)),
            false => Box::new(ForeignAnswers { scene, renderer: Renderer::new(), view: None }),
        };
        Self {
            name,
            path: path.into(),
            encoder,
            cameras,
            photos: None,
            settings: RenderSettings::of_mode(cloud.render_mode),
            cloud,
            answers,
        }
    }

    /// A scene of this program.
    ///
    /// # Errors
    /// If the encoder of its objects is not here.
    pub(crate) fn own(scene: Scene, map: impl Into<Arc<SemanticMap>>) -> Result<Self, JobError> {
        let map = map.into();
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
    fn new(result: &MethodResult, phrase: &str, vectors: &mut KnownVectors<'_>) -> Result<Self, JobError> {
        let encoder = encoder_of(result)?;
        Ok(Self { query: vectors.get(encoder, phrase)?.0, canonical: vectors.canonical(encoder)? })
    }

    fn as_foreign(&self) -> ForeignPhrase<'_> {
        ForeignPhrase { query: &self.query, canonical: &self.canonical, temperature: TEMPERATURE }
    }
}

fn encoder_of(result: &MethodResult) -> Result<&str, ForeignError> {
    result.encoder.as_deref().ok_or_else(|| ForeignError::of_silent(result.method))
}

impl PhraseAnswers for ForeignAnswers {
    fn look(&mut self, camera: &Camera) -> Result<(), JobError> {
        self.view = Some(self.scene.look(&mut self.renderer, camera)?);
        Ok(())
    }

    fn encode(&mut self, phrase: &str, vectors: &mut KnownVectors<'_>) -> Result<f64, JobError> {
        let encoder = encoder_of(&self.scene.result)?;
        vectors.canonical(encoder)?;
        Ok(vectors.get(encoder, phrase)?.1)
    }

    fn levels(&mut self, phrase: &str, vectors: &mut KnownVectors<'_>) -> Result<Vec<Vec<f32>>, JobError> {
        let encoded = EncodedPhrase::new(&self.scene.result, phrase, vectors)?;
        let Some(view) = &self.view else { return Ok(Vec::new()) };
        Ok(self.scene.relevancy(&mut self.renderer, view, encoded.as_foreign())?)
    }

    fn own_mask(
        &mut self,
        phrase: &str,
        levels: &[Vec<f32>],
        vectors: &mut KnownVectors<'_>,
    ) -> Result<Option<ForeignMask>, JobError> {
        let encoded = EncodedPhrase::new(&self.scene.result, phrase, vectors)?;
        let Some(view) = &self.view else { return Ok(None) };
        match self.scene.own_mask(&mut self.renderer, view, encoded.as_foreign(), levels) {
            Err(ForeignError::NoRule(_)) => Ok(None),
            found => Ok(Some(found?)),
        }
    }

    fn pointed(&mut self, pixel: PointedPixel) -> Result<Option<ForeignMask>, JobError> {
        let Some(view) = &self.view else { return Ok(None) };
        Ok(self.scene.pointed(view, pixel)?)
    }
}

/// A scene of this program with the maps of its view.
struct OwnAnswers {
    scene: Scene,
    map: Arc<SemanticMap>,
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

    fn pointed(
        &mut self,
        PointedPixel { at: [x, y], scale, .. }: PointedPixel,
    ) -> Result<Option<ForeignMask>, JobError> {
        let Some(maps) = &self.maps else { return Ok(None) };
        let ViewMap { width_px, height_px, identity, .. } = &maps.identities;
        let i = (x < *width_px && y < *height_px).then(|| y * width_px + x);
        let Some((i, id)) = i.and_then(|i| Some((i, *identity.get(i)?))) else { return Ok(None) };
        let all = &self.map.identities;
        if all.get(id).is_none() {
            return Ok(None);
        }
        // Details are the part, anything larger is the whole.
        let whole = all.get(id).map(|of| of.parent).filter(|parent| *parent != NO_IDENTITY && scale >= 0.5);
        let inside = all.descendants(whole.unwrap_or(id));
        let is_in = |i: usize| inside.get(identity[i] as usize) == Some(&true);
        let mask = Mask::from_fn(*width_px, *height_px, is_in);
        let values = (0..identity.len()).map(|i| f32::from(u8::from(is_in(i)))).collect();
        Ok(Some(ForeignMask { mask, level: usize::from(whole.is_some()), values, peak: Some(i), rule: BY_IDENTITY }))
    }
}
