//! The whole pipeline from photos to part recall on the scenes of `assets/eval`, small enough for a test: photos are
//! made, Gaussians trained, objects found by both ways of lifting, and everything queried in held-out photos, by
//! names and by looks. The limits stand clear of the spread of seeds ([`spread`] prints it). Shuffled names, shuffled
//! looks and a deviation with exchanged weights must fail them.

mod controls;

use std::collections::HashMap;
use std::path::Path;

use self::controls::{Fault, with_fault};
use crate::io::{self, Opened, labels::Labels};
use crate::math::stats::mean;
use crate::models::{self, Encoder, ModelError};
use crate::pipeline::observer::Silent;
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::evaluation::part_recall::{self, Components};
use crate::pipeline::semantics::evaluation::recipes::Absent;
use crate::pipeline::semantics::evaluation::{AskedScene, Category, LabeledView, categories, masks};
use crate::pipeline::semantics::lifting::build_map::{FindOptions, SearchModels, find_objects};
use crate::pipeline::semantics::lifting::segmenter::{FileMasks, Segmenter};
use crate::pipeline::semantics::lifting::tracker::TrackOptions;
use crate::pipeline::semantics::query::answer::{Language, QueryAnswer, by_embedding};
use crate::pipeline::semantics::query::by_embedding::TextEmbeddings;
use crate::pipeline::semantics::query::language::QueryPlace;
use crate::pipeline::semantics::query::localize::Answer;
use crate::pipeline::semantics::query::names;
use crate::pipeline::semantics::query::parse::ParsedQuery;
use crate::pipeline::semantics::query::query_engine::ask_by_name;
use crate::pipeline::semantics::query::recipe::{PAPERS_PHRASES, QueryConfig, Rejection};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::pipeline::synth::{self, Rig, SynthOptions};
use crate::pipeline::train::{self, TrainConfig};
use crate::render::{BackendChoice, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, LanguageFeatures, Level, LevelFilter, Lifting, Photo, SemanticMap};

/// Names of the scenes.
const SCENES: [&str; 2] = ["desk", "kitchen"];
/// Photos of a scene.
const VIEWS: usize = 24;
/// Number of held-out photos.
const HELD_OUT: usize = 4;
/// Size of the photos, px; the encoder looks at that.
const SIZE_PX: [u32; 2] = [400, 300];
/// Longer side of the pictures that Gaussians are trained on, px.
const TRAIN_PX: u32 = 160;
/// Longer side of the masks that are compared, px.
const COMPARE_PX: u32 = 200;
const STEPS: u64 = 150;
const CODE_STEPS: u64 = 100;
/// Sparse points, each of which becomes a Gaussian.
const POINTS: usize = 16_000;
/// A trained scene with labeled photos.
struct Scene {
    cloud: GaussianCloud,
    settings: RenderSettings,
    training: Vec<Photo>,
    held: Vec<(String, Camera, Vec<Category>)>,
    masks: FileMasks,
}

/// Measured shares and mean IoUs of all scenes.
#[derive(Clone, Debug, Default)]
struct Figures {
    /// Objects and parts asked for by name, lifted by votes.
    votes: [f64; 2],
    /// The same, lifted by gradients alone.
    gradients: [f64; 2],
    /// Part recall of each of the ablation's rows, by looks.
    recall: [f64; 5],
    /// Mean IoU of objects asked for by looks, whatever the score.
    objects: f64,
    /// Share of names of present things that are answered at all, by looks.
    answered: f64,
    /// The same for absent things, and for things in a wrong color.
    false_finds: [f64; 2],
    /// The same by names.
    false_names: [f64; 2],
    /// Highest score of a thing in a wrong color, by names.
    wrong_color: f64,
}

fn open(name: &str, seed: u64, folder: &Path) -> Scene {
    let options = SynthOptions {
        views: VIEWS,
        held_out: HELD_OUT,
        width_px: SIZE_PX[0],
        height_px: SIZE_PX[1],
        samples: 2,
        rig: Rig::Survey,
        points: POINTS,
        seed,
        ..SynthOptions::default()
    };
    let glb = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("assets/eval/{name}.glb"));
    synth::run(&glb, &options, folder, &mut Silent).expect("photos");
    let Ok(Opened::Dataset(dataset)) = io::open(folder) else { panic!("photos") };
    let config = TrainConfig {
        steps: STEPS,
        max_side_px: TRAIN_PX,
        sh_degree: 0,
        densify: false,
        eval_every: 0,
        backend: BackendChoice::Cpu,
        seed,
        ..TrainConfig::default()
    };
    let trained = train::run(&dataset, &config, None, &mut Silent).expect("trained");
    let mut masks = FileMasks(Labels::open(folder).expect("labels"));
    let (training, held) = dataset.split(config.holdout_every);
    let of = |i: &usize| dataset.photos[*i].clone();
    let mut labeled = |photo: Photo| {
        let found = masks.segment(&photo, COMPARE_PX, &mut Silent).expect("labels");
        (photo.name.clone(), photo.camera.limited_to(COMPARE_PX), categories(&found))
    };
    Scene {
        settings: config.render_settings(dataset.background, dataset.camera_extent().1),
        training: training.iter().map(of).collect(),
        held: held.iter().map(of).map(&mut labeled).collect(),
        masks,
        cloud: std::sync::Arc::unwrap_or_clone(trained.cloud),
    }
}

impl Scene {
    fn find(&mut self, lifting: Lifting, encoder: Option<&mut (dyn Encoder + 'static)>) -> SemanticMap {
        let models = SearchModels { segmenter: &mut self.masks, follower: None, encoder };
        // Votes carry the masks of few photos on; codes are trained on those of all.
        let max_seeds = if lifting == Lifting::Votes { TrackOptions::default().max_seeds } else { VIEWS };
        let track = TrackOptions { max_seeds, ..TrackOptions::default() };
        let options = FindOptions { track, lifting, code_steps: CODE_STEPS, ..FindOptions::default() };
        let found = find_objects(&self.cloud, &self.training, &self.settings, models, &options, &mut Silent);
        found.expect("found").map
    }

    /// Views of the held-out photos by `map`, with their labels.
    fn drawn(&self, map: &SemanticMap) -> Vec<ViewMap> {
        let mut renderer = Renderer::new();
        let mut draw = |camera: &Camera| {
            let (cloud, settings) = (&self.cloud, &self.settings);
            ViewMap::render(&mut renderer, cloud, &map.identity_of, &map.identities, camera, settings).expect("drawn")
        };
        self.held.iter().map(|h| draw(&h.1)).collect()
    }

    fn views<'a>(&'a self, drawn: &'a [ViewMap], blended: &'a CodeMap) -> Vec<LabeledView<'a>> {
        let view = |((name, camera, categories), exact): (&'a (String, Camera, Vec<Category>), &'a ViewMap)| {
            LabeledView { name, camera, exact, blended, categories: categories.clone() }
        };
        self.held.iter().zip(drawn).map(view).collect()
    }
}

/// Mean IoU of objects and of parts asked for by name.
fn by_names(scene: &Scene, map: &SemanticMap) -> [f64; 2] {
    let drawn = scene.drawn(map);
    let blended = CodeMap::default();
    let mut ask =
        |text: &str| ask_by_name(&map.identities, text, (LevelFilter::Auto, &QueryPlace::default()), &plain());
    let mut asked = AskedScene { map, ask: &mut ask };
    let views = scene.views(&drawn, &blended);
    masks::by_level(&views.iter().flat_map(|v| masks::compare(&mut asked, v)).collect::<Vec<_>>())
}

/// Recipe without the rules that reject more than the scores do: the test measures scores.
fn plain() -> QueryConfig {
    QueryConfig { rejection: Rejection::Canonical, ..QueryConfig::default() }
}

/// Answers by looks alone; `None` if the encoder knows no word.
fn by_looks(
    map: &SemanticMap,
    features: &LanguageFeatures,
    book: &mut TextEmbeddings,
    encoder: &mut Known<'_>,
    text: &str,
) -> Option<QueryAnswer> {
    let phrase = ParsedQuery::parse(text)?;
    let recipe = plain();
    book.learn(&phrase, &recipe, &mut |p: &str| encoder.text(p)).ok()?;
    let language = Language { features, phrases: book, unknown: &[] };
    Some(by_embedding(&map.identities, &phrase, LevelFilter::Auto, &recipe, language))
}

fn measure(seed: u64, faults: &[Fault]) -> Vec<Figures> {
    let mut encoder = models::encoder(models::DEMO).expect("comes with the program");
    let mut all = vec![Vec::new(); faults.len()];
    let mut texts = HashMap::new();
    for name in SCENES {
        let folder = tempfile::tempdir().expect("a folder");
        let mut scene = open(name, seed, folder.path());
        let map = scene.find(Lifting::Votes, Some(&mut *encoder));
        let trained = scene.find(Lifting::Paper, None);
        for (fault, all) in faults.iter().zip(&mut all) {
            let mut encoder = Known { encoder: &mut *encoder, texts: &mut texts, fault: *fault };
            all.push(figures(&scene, &with_fault(&map, *fault), &with_fault(&trained, *fault), &mut encoder));
        }
    }
    all.iter().map(|each| over_scenes(each)).collect()
}

fn over_scenes(each: &[Figures]) -> Figures {
    let of = |f: &dyn Fn(&Figures) -> f64| mean(&each.iter().map(f).collect::<Vec<_>>());
    Figures {
        votes: std::array::from_fn(|k| of(&|f| f.votes[k])),
        gradients: std::array::from_fn(|k| of(&|f| f.gradients[k])),
        recall: std::array::from_fn(|k| of(&|f| f.recall[k])),
        objects: of(&|f| f.objects),
        answered: of(&|f| f.answered),
        false_finds: std::array::from_fn(|k| of(&|f| f.false_finds[k])),
        false_names: std::array::from_fn(|k| of(&|f| f.false_names[k])),
        wrong_color: each.iter().map(|f| f.wrong_color).fold(0.0, f64::max),
    }
}

/// Phrases encoded once each.
struct Known<'a> {
    encoder: &'a mut dyn Encoder,
    texts: &'a mut HashMap<String, Vec<f32>>,
    fault: Fault,
}

impl Known<'_> {
    fn text(&mut self, phrase: &str) -> Result<Vec<f32>, ModelError> {
        if self.fault == Fault::Canonical && PAPERS_PHRASES.contains(&phrase) {
            return Ok(vec![0.0; self.encoder.dimension()]);
        }
        if !self.texts.contains_key(phrase) {
            self.texts.insert(phrase.into(), self.encoder.text(phrase)?);
        }
        Ok(self.texts[phrase].clone())
    }
}

fn figures(scene: &Scene, map: &SemanticMap, trained: &SemanticMap, encoder: &mut Known<'_>) -> Figures {
    let features = map.language.as_ref().expect("looked at");
    let (drawn, blended) = (scene.drawn(map), CodeMap::default());
    let views = scene.views(&drawn, &blended);
    let recall = Components::ROWS.map(|row| {
        part_recall::row((row, &QueryConfig::default()), map, features, &views, &mut |p: &str| encoder.text(p))
            .expect("encodes")
            .recall
    });
    let mut book = TextEmbeddings::default();
    let (mut objects, mut present) = (Vec::new(), Vec::new());
    for view in &views {
        for category in &view.categories {
            let answered = by_looks(map, features, &mut book, encoder, &category.name).expect("its words are known");
            present.push(!matches!(answered.answer, Answer::NotFound(_)));
            if category.level == Level::Object {
                let best = answered.answer.hits()[0].identity;
                objects.push(view.exact.mask(&map.identities, best).iou(&category.mask));
            }
        }
    }
    let share = |list: &[bool]| list.iter().filter(|found| **found).count() as f64 / list.len() as f64;
    let absent = Absent::of(&map.identities);
    let not_there = [absent.kinds, absent.colors];
    let is_found = |answered: QueryAnswer| !matches!(answered.answer, Answer::NotFound(_));
    let mut seen = |name: &String| by_looks(map, features, &mut book, encoder, name).map(is_found);
    let named = |name: &String| {
        ask_by_name(&map.identities, name, (LevelFilter::Auto, &QueryPlace::default()), &plain()).map(is_found)
    };
    let found = |list: &Vec<String>, ask: &mut dyn FnMut(&String) -> Option<bool>| {
        share(&list.iter().map(|name| ask(name).expect("its words are known")).collect::<Vec<_>>())
    };
    Figures {
        votes: by_names(scene, map),
        gradients: by_names(scene, trained),
        recall,
        objects: mean(&objects),
        answered: share(&present),
        false_finds: not_there.each_ref().map(|list| found(list, &mut seen)),
        false_names: not_there.each_ref().map(|list| found(list, &mut { named })),
        wrong_color: not_there[1]
            .iter()
            .flat_map(|name| names::scores(&map.identities, name))
            .fold(0.0, f32::max)
            .into(),
    }
}

impl Figures {
    /// Returns the limits that are missed. Floors are the least of three seeds less their spread, ceilings the most
    /// plus their spread, rounded away from the measured values.
    fn missed(&self) -> Vec<String> {
        let floors = [
            ("objects by name, votes", self.votes[0], 0.71),
            ("parts by name, votes", self.votes[1], 0.46),
            ("objects by name, gradients", self.gradients[0], 0.74),
            ("parts by name, gradients", self.gradients[1], 0.49),
            ("objects by looks", self.objects, 0.64),
            ("recall of parts, objects alone", self.recall[0], 0.10),
            ("recall of parts, multilevel", self.recall[1], 0.30),
            ("recall of parts, deviation", self.recall[2], 0.36),
            ("recall of parts, two steps", self.recall[3], 0.34),
            ("recall of parts, joint", self.recall[4], 0.46),
            ("order: multilevel over objects alone", self.recall[1] - self.recall[0], 0.14),
            ("order: deviation over multilevel", self.recall[2] - self.recall[1], 0.02),
            // 0.000, 0.020 and 0.006 with seeds 0 to 2: one training decides.
            ("order: two steps over deviation", self.recall[3] - self.recall[2], -0.02),
            ("order: joint over deviation", self.recall[4] - self.recall[2], 0.01),
            ("order: joint over two steps", self.recall[4] - self.recall[3], 0.0),
            ("answers for what is there", self.answered, 0.59),
        ];
        let ceilings = [
            ("answers for what is absent, by looks", self.false_finds[0], 0.47),
            ("answers in a wrong color, by looks", self.false_finds[1], 0.54),
            ("answers for what is absent, by name", self.false_names[0], 0.08),
            // Half of the words fit, and "gray" is spelled much like "green": always answered, never in full.
            ("score of a wrong color, by name", self.wrong_color, 0.67),
        ];
        let low = floors.into_iter().filter(|(_, v, bar)| !(v >= bar));
        let high = ceilings.into_iter().filter(|(_, v, bar)| !(v <= bar));
        low.chain(high).map(|(what, v, bar)| format!("{what}: {v:.3}, bar {bar}")).collect()
    }
}

#[test]
fn photos_become_parts_that_are_found() {
    let faults = [Fault::Nothing, Fault::Names, Fault::Looks, Fault::Deviation, Fault::Canonical];
    let figures = measure(0, &faults);
    let [right, names, looks, deviation, canonical] = &figures[..] else { panic!("{figures:?}") };
    assert_eq!(right.missed(), [""; 0], "{right:?}");
    let fails = |figures: &Figures, bars: &[&str]| {
        let missed = figures.missed();
        let all = bars.iter().all(|bar| missed.iter().any(|m| m.starts_with(bar)));
        assert!(all, "{bars:?} among {missed:?}");
    };
    // Controls: each fault must show in the figures that measure it.
    fails(names, &["objects by name, votes", "parts by name, votes", "objects by name, g", "parts by name, g"]);
    fails(looks, &["objects by looks", "recall of parts, mul", "recall of parts, d", "recall of parts, t"]);
    fails(looks, &["recall of parts, joint", "order"]);
    fails(deviation, &["order: deviation over multilevel"]);
    fails(canonical, &["answers for what is absent, by looks", "answers in a wrong color, by looks"]);
}

/// Prints the figures that the limits are derived from.
#[test]
#[ignore = "prints the spread of three seeds; about three minutes"]
fn spread() {
    for seed in 0..3 {
        let start = std::time::Instant::now();
        let faults = [Fault::Nothing, Fault::Names, Fault::Looks, Fault::Deviation, Fault::Canonical];
        for (fault, figures) in faults.iter().zip(measure(seed, &faults)) {
            println!("seed {seed}, {fault:?}: {figures:.3?}");
        }
        println!("seed {seed}: {:.1} s", start.elapsed().as_secs_f64());
    }
}
