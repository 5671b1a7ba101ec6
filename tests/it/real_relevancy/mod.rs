//! Relevancy and localization on real OpenCLIP embeddings of a LERF scene: 36 identities, seen once
//! and in many further views, and the scene's queries.

mod deviation;
mod teatime;

use fmlgs::math::stats;
use fmlgs::math::vector::{dot, unit};
use fmlgs::pipeline::semantics::query::by_embedding::EmbeddingScorer;
use fmlgs::pipeline::semantics::query::localize::{Answer, localize};
use fmlgs::pipeline::semantics::query::parse::ParsedQuery;
use fmlgs::pipeline::semantics::query::recipe::{QueryConfig, Rejection, Strategy};
use fmlgs::pipeline::semantics::relevancy::{deviate, score};
use fmlgs::scene::{
    Identities, IdentityId, LanguageFeatures, Level, LevelFilter, NO_IDENTITY, PART_WEIGHT, ViewFeatures,
};

use teatime::{ABSENT, QUERIES, Scene, load, plain};

#[test]
fn scores_spread_as_the_temperature_says() {
    let Some(scene) = load() else { return };
    let all: Vec<f32> = QUERIES.iter().flat_map(|q| scene.advantages(q)).collect();
    let range = |temperature| {
        let scores = all.iter().map(|d| score(*d, temperature));
        scores.fold((f32::INFINITY, 0.0_f32), |(l, h), s| (l.min(s), h.max(s)))
    };
    let (low, high) = range(1.0);
    assert!((low - 0.465).abs() < 1e-3 && (high - 0.527).abs() < 1e-3, "{low} {high}");
    let (low, high) = range(10.0);
    assert!((low - 0.196).abs() < 1e-3 && (high - 0.748).abs() < 1e-3, "{low} {high}");
    // The order does not depend on it.
    for query in QUERIES {
        let d = scene.advantages(query);
        let order = |t: f32| {
            let s: Vec<f32> = d.iter().map(|d| score(*d, t)).collect();
            let mut order: Vec<usize> = (0..s.len()).collect();
            order.sort_by(|&a, &b| s[b].total_cmp(&s[a]).then(a.cmp(&b)));
            order[0]
        };
        assert_eq!(order(1.0), order(10.0), "{query}");
    }
}

#[test]
fn different_words_for_a_thing_find_the_same_identity() {
    let Some(scene) = load() else { return };
    let same = [
        ("coffee", "coffee mug"),
        ("napkin", "paper napkin"),
        ("tea in a glass", "glass of water"),
        ("plate", "three cookies"),
    ];
    for (a, b) in same {
        assert_eq!(scene.best(a), scene.best(b), "{a}, {b}");
    }
    let things = [
        "apple",
        "bag of cookies",
        "bear nose",
        "coffee mug",
        "hooves",
        "paper napkin",
        "plate",
        "sheep",
        "spoon",
        "stuffed bear",
        "tea in a glass",
        "yellow pouf",
    ];
    let found: std::collections::BTreeSet<usize> = things.iter().map(|q| scene.best(q)).collect();
    assert_eq!(found.len(), things.len(), "things that differ are different identities");
    // Negative control: with the phrases one off, the pairs fall apart.
    let mut wrong = scene;
    let first = wrong.texts[0].1.clone();
    for i in 1..wrong.texts.len() {
        wrong.texts[i - 1].1 = wrong.texts[i].1.clone();
    }
    wrong.texts.last_mut().expect("texts").1 = first;
    assert!(same.iter().filter(|(a, b)| wrong.best(a) == wrong.best(b)).count() <= 1);
}

#[test]
fn answers_say_when_nothing_or_several_fit() {
    let Some(scene) = load() else { return };
    let mut identities = Identities::default();
    let features = scene.single.iter().map(|f| ViewFeatures { raw: vec![f.clone()], deviated: vec![f.clone()] });
    let language = LanguageFeatures { encoder: "clip".into(), dimension: 512, by_identity: features.collect() };
    language.by_identity.iter().for_each(|_| {
        identities.add(Level::Object, NO_IDENTITY, Vec::new());
    });
    let recipe = QueryConfig { rejection: Rejection::Canonical, ..QueryConfig::default() };
    let phrases = scene.phrases(QUERIES, &recipe);
    let ask = |query: &str| {
        let mut scorer = EmbeddingScorer::new(&identities, &language, &phrases, &recipe);
        localize(&identities, &plain(query), LevelFilter::Auto, recipe.strategy, &mut scorer)
    };
    assert!(matches!(ask("dall-e brand"), Answer::NotFound(_)), "less relevant than a canonical phrase");
    assert!(matches!(ask("spoon"), Answer::Ambiguous(_)), "two within 0.005");
    for query in ["apple", "bag of cookies", "coffee mug", "hooves", "paper napkin", "sheep", "stuffed bear"] {
        let Answer::Found(hits) = ask(query) else { panic!("{query}") };
        assert_eq!(hits[0].identity, scene.best(query) as IdentityId + 1);
    }
}

#[test]
fn parts_are_moved_toward_their_whole_and_made_unit_again() {
    let Some(scene) = load() else { return };
    let (bear, nose) = (scene.best("stuffed bear"), scene.best("bear nose"));
    assert_ne!(bear, nose);
    let (whole, part) = (&scene.single[bear], &scene.single[nose]);
    let moved = deviate(part, whole, PART_WEIGHT).expect("a direction");
    // Where the paper's sum lies follows from the angle between the two alone.
    let cos = |a: &[f32], b: &[f32]| f64::from(dot(a, b));
    let (own, of_whole, c) = (f64::from(PART_WEIGHT), 1.0 - f64::from(PART_WEIGHT), cos(part, whole));
    let length = (own * own + of_whole * of_whole + 2.0 * own * of_whole * c).sqrt();
    let far = |v: &[f32]| {
        let wanted = [1.0, (own + of_whole * c) / length, (own * c + of_whole) / length];
        stats::worst_difference(&[cos(v, v), cos(v, part), cos(v, whole)], &wanted)
    };
    assert!(far(&moved) < 1e-3, "{}", far(&moved));
    assert!(cos(&moved, whole) > c + 0.1);
    // Controls: whole and part exchanged, and the part as it was.
    assert!(far(&deviate(whole, part, PART_WEIGHT).expect("a direction")) > 0.05);
    assert!(far(part) > 0.05);
}

#[test]
fn an_identity_counts_by_its_best_view() {
    let Some(scene) = load() else { return };
    let recipe = QueryConfig::default();
    let phrases = scene.phrases(QUERIES, &recipe);
    let identities = Identities::objects(scene.single.len());
    type Views = Vec<Vec<f32>>;
    let language = |views: &dyn Fn(&[Vec<f32>]) -> Views| {
        let of = scene.many.iter().map(|all| views(&all[..all.len().min(4)]));
        let of = of.map(|raw| ViewFeatures { deviated: raw.clone(), raw }).collect();
        LanguageFeatures { encoder: "clip".into(), dimension: 512, by_identity: of }
    };
    let mean = |views: &[Vec<f32>]| {
        let sum: Vec<f32> = (0..512).map(|c| views.iter().map(|v| v[c]).sum()).collect();
        unit(&sum).into_iter().collect()
    };
    let (all, first) = (language(&<[_]>::to_vec), language(&|v| v.iter().take(1).cloned().collect()));
    let mean = language(&mean);
    let advantage_of = |features: &LanguageFeatures, query: &str, target: usize| {
        EmbeddingScorer::new(&identities, features, &phrases, &recipe).advantages(query, None)[target]
    };
    let (mut compared, mut over_mean, mut over_first) = (0, 0, 0);
    for query in QUERIES {
        let target = scene.best(query);
        if scene.many[target].len() < 2 {
            continue;
        }
        let [all, first, mean] = [&all, &first, &mean].map(|f| advantage_of(f, query, target));
        assert!(all >= first, "{query}: another view can only add");
        compared += 1;
        over_mean += usize::from(all > mean);
        over_first += usize::from(all > first);
    }
    assert!(compared >= 12 && over_mean == compared, "{over_mean} of {compared}");
    // The control: one view is not all that there is.
    assert!(over_first >= 7, "{over_first} of {compared}");
}

/// Number of the questions that this recipe answers.
fn answered(scene: &Scene, recipe: &QueryConfig, questions: &[&str]) -> usize {
    let (identities, language) = scene.language(recipe.preparation.part_weight);
    let phrases = scene.phrases(questions.iter().copied(), recipe);
    let is_found = |question: &&&str| {
        let mut scorer = EmbeddingScorer::new(&identities, &language, &phrases, recipe);
        let answer = localize(&identities, &plain(question), LevelFilter::Auto, recipe.strategy, &mut scorer);
        !matches!(answer, Answer::NotFound(_))
    };
    questions.iter().filter(is_found).count()
}

#[test]
fn most_of_what_is_absent_is_rejected_by_confidence_and_little_by_canonical_phrases() {
    let Some(scene) = load() else { return };
    let absent: Vec<&str> = ABSENT.split(", ").map(str::trim).collect();
    let of = |recipe: &QueryConfig| [answered(&scene, recipe, &QUERIES), answered(&scene, recipe, &absent)];
    let by = |rejection| of(&QueryConfig { rejection, ..QueryConfig::default() });
    let paper = of(&QueryConfig::paper());
    let [never, canonical, strict] = [Rejection::Never, Rejection::Canonical, Rejection::Strict].map(by);
    println!("answered of {} there and {} absent: paper {paper:?}, never {never:?}", QUERIES.len(), absent.len());
    println!("canonical {canonical:?}, strict {strict:?}");
    assert_eq!((paper, never), ([QUERIES.len(), absent.len()], [QUERIES.len(), absent.len()]));
    assert!(canonical[0] == QUERIES.len() && canonical[1] > 35, "{canonical:?}");
    assert!(strict[0] >= 13 && strict[1] <= 10, "{strict:?}");
}

#[test]
fn deviation_helps_a_part_that_is_asked_for_with_its_whole_and_the_second_step_finds_it() {
    let Some(scene) = load() else { return };
    let advantage = |question: &str, weight: f32, id: usize| {
        let (identities, language) = scene.language(weight);
        let recipe = QueryConfig::paper();
        let phrases = scene.phrases([question], &recipe);
        EmbeddingScorer::new(&identities, &language, &phrases, &recipe).advantages(question, None)[id - 1]
    };
    let (bear, nose) = (advantage("bear nose", 1.0, 1), advantage("bear nose", 1.0, 2));
    let deviated = advantage("bear nose", PART_WEIGHT, 2);
    println!("\"bear nose\": bear {bear:.4}, nose {nose:.4}, nose deviated {deviated:.4}");
    assert!(deviated > nose + 0.005 && bear > deviated, "{deviated} {nose} {bear}");
    // Without its whole in the words, deviation costs a part what it says of itself.
    let hooves = |weight: f32| {
        let (whole, part) = (&scene.single[scene.best("sheep")], &scene.single[scene.best("hooves")]);
        let v = deviate(part, whole, weight).expect("a direction");
        fmlgs::pipeline::semantics::relevancy::advantage(&v, &scene.text("hooves"), &scene.canonical())
    };
    println!("\"hooves\": hooves {:.4}, deviated {:.4}", hooves(1.0), hooves(PART_WEIGHT));
    assert!(hooves(PART_WEIGHT) < hooves(1.0));
    // The bear wins the first step; the second one finds its nose, by grammar or because a part is asked for.
    let ask = |strategy, whole: Option<&str>, level| {
        let recipe = QueryConfig { strategy, ..QueryConfig::paper() };
        let (identities, language) = scene.language(PART_WEIGHT);
        let phrases = scene.phrases(["bear nose", "stuffed bear"], &recipe);
        let question = ParsedQuery { whole: whole.map(str::to_owned), ..plain("bear nose") };
        let mut scorer = EmbeddingScorer::new(&identities, &language, &phrases, &recipe);
        localize(&identities, &question, level, strategy, &mut scorer).hits()[0].identity
    };
    let (bear, nose) = (1, 2);
    assert_eq!(ask(Strategy::OneStep, Some("stuffed bear"), LevelFilter::Auto), bear);
    assert_eq!(ask(Strategy::TwoSteps, Some("stuffed bear"), LevelFilter::Auto), nose);
    assert_eq!(ask(Strategy::TwoSteps, None, LevelFilter::Part), nose);
    assert_eq!(ask(Strategy::TwoSteps, Some("stuffed bear"), LevelFilter::Object), bear);
}
