//! `recipes`: shares of questions found and rightly not found, recipe by recipe: names, embeddings and both, each
//! strategy, with deviation and without, and the rules of "not found".

use std::time::Instant;

use super::{Category, LabeledView};
use crate::math::stats::mean;
use crate::models::ModelError;
use crate::pipeline::semantics::evaluation::part_recall::HIT_IOU;
use crate::pipeline::semantics::query::colors;
use crate::pipeline::semantics::query::localize::Answer;
use crate::pipeline::semantics::query::query_engine::QueryEngine;
use crate::pipeline::semantics::query::recipe::{MatchBy, PartEmbedding, QueryConfig, Rejection, Strategy};
use crate::pipeline::semantics::query::timing::ms_since;
use crate::scene::identity::name_words::words;
use crate::scene::identity::whole_names::BETWEEN;
use crate::scene::{Identities, IdentityId, Level, LevelFilter, SemanticMap};

/// Things that may be absent, and parts of them. Things with words that a scene knows are not asked for.
const THINGS: &str = "toy car, rocket, house, boat, duck, pot plant, candle, umbrella, bag, teddy bear, alarm clock, smartphone, \
    headphones, green toy car, red rocket, brown house, white boat, yellow duck, turquoise bag, pink candle, \
    sail of the boat, hull of the boat, beak of the duck, wings of the duck, roof of the house, \
    chimney of the house, handle of the umbrella, canopy of the umbrella, buckle of the bag, flap of the bag, \
    wheels of the toy car, leaves of the pot plant";

/// Questions for absent things.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Absent {
    /// Things of another kind, and parts of them.
    pub(crate) kinds: Vec<String>,
    /// Present things, in colors that none of their kind has.
    pub(crate) colors: Vec<String>,
    /// Parts that other things have.
    pub(crate) parts: Vec<String>,
}

impl Absent {
    pub(crate) fn of(identities: &Identities) -> Self {
        Self { kinds: absent_kinds(identities), colors: wrong_colors(identities), parts: absent_parts(identities) }
    }
}

fn absent_kinds(identities: &Identities) -> Vec<String> {
    let objects = identities.iter().filter(|(_, i)| i.level == Level::Object).flat_map(|(_, i)| &i.names);
    let known: Vec<String> = objects.flat_map(|n| colors::without(n)).collect();
    let things = THINGS.split(", ").map(str::trim);
    // Of "roof of the house", the house must be absent.
    let thing = |text: &str| text.rsplit(" of the ").next().unwrap_or(text).to_owned();
    let absent = |text: &&str| !colors::without(&thing(text)).iter().any(|w| known.contains(w));
    things.filter(absent).map(str::to_owned).collect()
}

/// Returns the objects of the scene in colors that no object of their kind has.
fn wrong_colors(identities: &Identities) -> Vec<String> {
    let objects = identities.iter().filter(|(_, i)| i.level == Level::Object).flat_map(|(_, i)| &i.names);
    let names: Vec<&String> = objects.collect();
    let mut wrong = Vec::new();
    for (k, name) in names.iter().enumerate() {
        let others = colors::alternatives(name);
        let absent: Vec<&String> = others.iter().filter(|o| !names.iter().any(|n| words(n) == words(o))).collect();
        wrong.extend((0..3).filter_map(|j| absent.get((k + 4 * j) % absent.len().max(1))).map(|o| (*o).clone()));
    }
    wrong
}

/// Returns parts that a thing lacks and another one has, two of each thing.
fn absent_parts(identities: &Identities) -> Vec<String> {
    let name = |id: IdentityId| identities.get(id).and_then(|i| i.names.first());
    let parts_of = |id: IdentityId| {
        let inside = identities.descendants(id);
        identities.iter().filter(move |(p, i)| inside[*p as usize] && i.level == Level::Part).map(|(p, _)| p)
    };
    let mut all: Vec<&String> =
        identities.iter().filter(|(_, i)| i.level == Level::Part).filter_map(|(id, _)| name(id)).collect();
    all.sort();
    all.dedup();
    let mut absent = Vec::new();
    for (k, (id, _)) in identities.iter().filter(|(_, i)| i.level == Level::Object).enumerate() {
        let own: Vec<String> = parts_of(id).filter_map(name).flat_map(|n| words(n)).collect();
        let lacks = |n: &&&String| !words(n).iter().any(|w| own.contains(w));
        let others: Vec<&&String> = all.iter().filter(lacks).collect();
        let (Some(whole), false) = (name(id), own.is_empty() || others.is_empty()) else { continue };
        absent.extend((0..2).map(|j| format!("{} of the {whole}", others[(3 * k + 7 * j) % others.len()])));
    }
    absent
}

/// A recipe with its results: shares of questions.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(crate) struct RecipeRow {
    pub(crate) title: String,
    pub(crate) recipe: QueryConfig,
    /// Answered with a mask of an IoU of a half or more: objects, parts, parts asked for as compounds ("mug handle").
    pub(crate) recall: [f64; 3],
    /// Rightly not found: other kinds, other colors, parts that a thing lacks.
    pub(crate) rejected: [f64; 3],
    /// Mean time of a question, its text's encoding left out, ms.
    pub(crate) mean_ms: f64,
}

/// The recipes that are compared, with their titles; all else is as `base` says.
pub(crate) fn compared(base: &QueryConfig) -> Vec<(String, QueryConfig)> {
    let mut all = Vec::new();
    let strategies = [Strategy::TwoSteps, Strategy::Joint, Strategy::OneStep];
    for strategy in strategies {
        let recipe = QueryConfig { match_by: MatchBy::Names, strategy, ..base.clone() };
        all.push((format!("names, {strategy}"), recipe));
    }
    for strategy in strategies {
        for parts in [PartEmbedding::Deviated, PartEmbedding::Raw] {
            let match_by = MatchBy::Embedding;
            let recipe = QueryConfig { match_by, strategy, parts, ..base.clone() };
            all.push((format!("embedding, {strategy}, deviation {parts}"), recipe));
        }
    }
    for rejection in [Rejection::Never, Rejection::Canonical, Rejection::Strict] {
        for (title, recipe) in [("default", QueryConfig::default()), ("paper", QueryConfig::paper())] {
            all.push((format!("recipe {title}, rejects {rejection}"), QueryConfig { rejection, ..recipe }));
        }
    }
    all
}

/// Asks by one recipe for everything in the `views`, and for absent things.
pub(crate) fn row(
    (title, recipe): (String, QueryConfig),
    map: &SemanticMap,
    engine: &mut QueryEngine,
    views: &[LabeledView<'_>],
    absent: &Absent,
) -> Result<RecipeRow, ModelError> {
    engine.answer_by(recipe.clone());
    let mut ms = Vec::new();
    let mut recall = [const { Vec::new() }; 3];
    for view in views {
        for category in &view.categories {
            let questions = [Some(category.name.clone()), compound(category)];
            for (k, question) in questions.into_iter().enumerate() {
                let Some(question) = question else { continue };
                let start = Instant::now();
                let answered = engine.ask(map, &question, LevelFilter::Auto)?;
                let encoded = answered.as_ref().map_or(0.0, |a| a.stages.encode);
                let mask = answered.map(|a| a.mask(view.exact, Some(view.blended), &map.identities, 1));
                ms.push(ms_since(start) - encoded);
                let level = usize::from(category.level == Level::Part);
                recall[level + k].push(f64::from(mask.is_some_and(|m| m.iou(&category.mask) >= HIT_IOU)));
            }
        }
    }
    let mut rejected = [0.0; 3];
    for (share, questions) in rejected.iter_mut().zip([&absent.kinds, &absent.colors, &absent.parts]) {
        let mut right = Vec::with_capacity(questions.len());
        for question in questions {
            let answered = engine.ask(map, question, LevelFilter::Auto)?;
            right.push(f64::from(u8::from(answered.is_none_or(|a| matches!(a.answer, Answer::NotFound(_))))));
        }
        *share = mean(&right);
    }
    Ok(RecipeRow { title, recipe, recall: recall.map(|r| mean(&r)), rejected, mean_ms: mean(&ms) })
}

/// "handle · mug" as "mug handle".
fn compound(category: &Category) -> Option<String> {
    let mut line = category.name.split(BETWEEN).filter(|_| category.level == Level::Part);
    let (part, whole) = (line.next()?, line.next()?);
    Some(format!("{whole} {part}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::semantics::code_map::CodeMap;
    use crate::pipeline::semantics::view_map::ViewMap;
    use crate::scene::{Camera, NO_IDENTITY};
    use glam::DVec3;

    fn scene() -> SemanticMap {
        let mut all = Identities::default();
        let mug = all.add(Level::Object, NO_IDENTITY, vec!["red mug".into()]);
        all.add(Level::Part, mug, vec!["handle".into()]);
        let lamp = all.add(Level::Object, NO_IDENTITY, vec!["white lamp".into()]);
        all.add(Level::Part, lamp, vec!["shade".into()]);
        SemanticMap::from_identities(all, vec![1, 2, 3, 4], vec![1.0; 4], vec![])
    }

    #[test]
    fn what_is_absent_is_of_another_kind_color_or_whole() {
        let map = scene();
        let absent = Absent::of(&map.identities);
        assert!(absent.kinds.contains(&"duck".into()) && absent.kinds.contains(&"roof of the house".into()));
        assert_eq!(absent.colors.len(), 6);
        assert!(absent.colors.iter().all(|c| c.ends_with(" mug") || c.ends_with(" lamp")), "{absent:?}");
        assert!(!absent.colors.contains(&"red mug".into()) && !absent.colors.contains(&"white lamp".into()));
        let mut parts = absent.parts.clone();
        parts.dedup();
        assert_eq!(parts, ["shade of the red mug", "handle of the white lamp"]);
        let mut ducks = Identities::default();
        ducks.add(Level::Object, NO_IDENTITY, vec!["white duck".into()]);
        assert!(!absent_kinds(&ducks).iter().any(|k| k.contains("duck")));
    }

    #[test]
    fn rows_differ_by_what_they_find_and_reject() {
        let map = scene();
        let exact = ViewMap::certain(8, vec![1, 1, 2, 2, 3, 3, 4, 4]);
        let category = |name: &str, level, ids: [u32; 2]| {
            let mask = crate::scene::Mask::from_fn(8, 1, |i| ids.contains(&exact.identity[i]));
            Category { name: name.into(), level, boxes: vec![], mask }
        };
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 8, 1).expect("valid");
        let categories = vec![
            category("red mug", Level::Object, [1, 2]),
            category("handle · red mug", Level::Part, [2, 2]),
            category("white lamp", Level::Object, [3, 4]),
            // Its label is wrong: the answer misses it.
            category("shade · white lamp", Level::Part, [1, 1]),
        ];
        let blended = CodeMap::default();
        let views = [LabeledView { name: "v", camera: &camera, exact: &exact, blended: &blended, categories }];
        let absent = Absent::of(&map.identities);
        let mut engine = QueryEngine::default();
        let mut row_of = |recipe: QueryConfig| {
            row((String::new(), recipe), &map, &mut engine, &views, &absent).expect("names need no encoder")
        };
        let names = |strategy, rejection| QueryConfig {
            match_by: MatchBy::Names,
            strategy,
            rejection,
            ..QueryConfig::default()
        };
        let strict = row_of(names(Strategy::Joint, Rejection::Strict));
        assert_eq!((strict.recall, strict.rejected), ([1.0, 0.5, 0.5], [1.0; 3]));
        // Names are no matter of strategy or rejection: each word has its place.
        for other in [names(Strategy::OneStep, Rejection::Strict), names(Strategy::Joint, Rejection::Canonical)] {
            let row = row_of(other);
            assert_eq!((row.recall, row.rejected), (strict.recall, strict.rejected));
        }
        let titles: Vec<String> = compared(&QueryConfig::default()).into_iter().map(|r| r.0).collect();
        let mut different = titles.clone();
        different.sort();
        different.dedup();
        assert_eq!((titles.len(), different.len()), (15, 15));
    }
}
