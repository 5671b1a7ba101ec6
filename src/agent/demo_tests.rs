//! Tests of queries and agent requests in the shipped demo scene, which holds embeddings of the small encoder
//! (`tests/data/demo_questions.toml`).

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::commands::Commands;
use super::event::AgentEvent;
use super::policy::Policy;
use super::refusal::RefusalKind;
use super::scene::{AgentScene, SceneWorld};
use super::session::{Awaited, Reply, Session};
use crate::jobs::{Folders, Scene, demo, open, query};
use crate::navigate::Pose;
use crate::pipeline::observer::Silent;
use crate::pipeline::semantics::query::answer::{Basis, Certainty};
use crate::pipeline::semantics::query::language::QueryPlace;
use crate::pipeline::semantics::query::localize::Answer;
use crate::pipeline::semantics::query::query_engine::QueryEngine;
use crate::pipeline::semantics::query::recipe::{MatchBy, QueryConfig, Rejection};
use crate::scene::{IdentityId, LevelFilter, SemanticMap};

fn rows(list: &str) -> Vec<[String; 3]> {
    let table: toml::Table = include_str!("../../tests/data/demo_questions.toml").parse().expect("sound TOML");
    let text = |row: &toml::Value, at: usize| row[at].as_str().expect("a text").to_owned();
    table[list].as_array().expect("a list").iter().map(|row| [0, 1, 2].map(|at| text(row, at))).collect()
}

fn opened() -> (tempfile::TempDir, Scene) {
    let data = tempfile::tempdir().expect("folder");
    let folder = demo::unpacked(&Folders { data: data.path().into() }, &mut Silent).expect("unpacked");
    let scene = open::scene(&folder.join("scene")).expect("opened");
    (data, scene)
}

/// Questions with a wrong answer under a recipe.
fn wrong(scene: &Scene, map: &SemanticMap, recipe: QueryConfig) -> Vec<String> {
    let mut engine = QueryEngine::new(map.language.as_ref(), recipe).expect("an engine");
    engine.place = query::seen_from(scene, None);
    let mut wrong = Vec::new();
    for [text, verdict, what] in rows("questions") {
        let reading = engine.read(&map.identities, &text).expect("words");
        let answered = engine.answer(map, &reading, LevelFilter::Auto).expect("encodes");
        let chosen = answered.chosen(1);
        let (ignored, unexplained) = engine.left_out(&map.identities, &reading, &answered);
        let told = match answered.answer {
            Answer::Found(_) => chosen.iter().map(|id| map.identities.full_name(*id)).collect::<Vec<_>>().join(" + "),
            Answer::Ambiguous(_) => chosen.len().to_string(),
            Answer::NotFound(_) => unexplained.join(" "),
        };
        if (verdict != "*" && answered.answer.verdict() != verdict)
            || (what != "*" && told != what)
            || !ignored.is_empty()
        {
            wrong.push(format!("'{text}': {}, {told}, ignored {ignored:?}", answered.answer.verdict()));
        }
    }
    wrong
}

#[test]
fn what_is_asked_of_the_demo_is_found_or_said_not_to_be_there() {
    let (_data, scene) = opened();
    let map = scene.semantics().expect("objects");
    assert!(map.language.is_some(), "an encoder has looked at it");
    for match_by in [MatchBy::Both, MatchBy::Names] {
        let wrong = wrong(&scene, &map, QueryConfig { match_by, ..QueryConfig::default() });
        assert!(wrong.is_empty(), "{match_by}:\n{}", wrong.join("\n"));
    }
    // Control: where an answer may leave words out and the small encoder answers by itself, much is wrong.
    let before = wrong(&scene, &map, QueryConfig { rejection: Rejection::Canonical, ..QueryConfig::default() });
    assert!(before.len() >= 20, "{}", before.join("\n"));
    // The best matches of the encoder are offered.
    let mut engine = QueryEngine::new(map.language.as_ref(), QueryConfig::default()).expect("an engine");
    let banana = engine.ask(&map, "banana", LevelFilter::Auto).expect("encodes").expect("words");
    assert!(!banana.offers(3)[1].is_empty() && banana.chosen(8).is_empty(), "{banana:?}");
}

#[test]
fn where_nothing_has_a_name_the_small_encoder_guesses_and_nothing_is_changed_for_it() {
    let (_data, scene) = opened();
    let mut map = scene.semantics().expect("objects");
    assert_eq!(query::named(&map, &QueryPlace::default(), "kettle", LevelFilter::Auto, 1).expect("by name").len(), 1);
    for id in 1..=map.identities.len() as IdentityId {
        map.identities.get_mut(id).expect("there").names.clear();
    }
    let mut engine = QueryEngine::new(map.language.as_ref(), QueryConfig::default()).expect("an engine");
    let answered = engine.ask(&map, "teddy bear", LevelFilter::Auto).expect("encodes").expect("words");
    assert_eq!((answered.basis, answered.certainty(&[])), (Basis::Embedding, Certainty::Guess), "{answered:?}");
    let id = answered.chosen(1)[0];
    let refused = query::named(&map, &QueryPlace::default(), "teddy bear", LevelFilter::Auto, 1)
        .expect_err("only by its looks")
        .to_string();
    assert!(refused.contains(&format!("ask for '#{id}'")), "{refused}");
    // The number in the refusal is enough to find it.
    assert_eq!(
        query::named(&map, &QueryPlace::default(), &format!("#{id}"), LevelFilter::Auto, 1).expect("by number"),
        [id]
    );
}

fn ends(reply: &Reply) -> &'static str {
    match (reply.pending, reply.refused.as_ref().map(|r| r.kind)) {
        (Some(Awaited::Confirmation), _) => "confirm",
        (Some(Awaited::Choice), _) => "ask",
        (None, None) => "done",
        (None, Some(RefusalKind::NotFound)) => "not found",
        (None, Some(RefusalKind::Conflict)) => "conflict",
        (None, Some(RefusalKind::Unclear)) => "not understood",
        (None, Some(_)) => "another refusal",
    }
}

#[test]
fn what_is_said_of_the_demo_is_done_or_refused() {
    let (_data, scene) = opened();
    let map = Arc::new(scene.semantics().expect("objects"));
    for match_by in [MatchBy::Both, MatchBy::Names] {
        let parts = AgentScene {
            cameras: scene.views(),
            up: scene.home().up,
            cloud: Arc::clone(&scene.cloud),
            settings: scene.settings.clone(),
            map: Arc::clone(&map),
            meters: scene.meters_per_unit,
            exports: PathBuf::new(),
            folder: scene.folder.clone(),
            recipe: QueryConfig { match_by, ..QueryConfig::default() },
            explored: None,
        };
        let eye = Pose::of(&scene.views()[0]);
        let mut world = SceneWorld::new(parts, eye, 1.5, Box::new(|_| {})).expect("a world");
        let policy = Policy::built_in().expect("policy");
        let mut session = Session::new(policy, Box::new(Commands::default()));
        let mut wrong = Vec::new();
        for [text, calls, end] in rows("sentences") {
            let mut done = Vec::new();
            let mut on = |event| {
                if let AgentEvent::Call { line, .. } = event {
                    done.push(line);
                }
            };
            let reply = session.say(&mut world, &text, &mut on, &AtomicBool::new(false));
            if (done.join("; "), ends(&reply)) != (calls.clone(), end.as_str()) {
                wrong.push(format!("'{text}': {done:?}, {}: {}", ends(&reply), reply.text));
            }
        }
        assert!(wrong.is_empty(), "{match_by}:\n{}", wrong.join("\n"));
        // Several things become one sentence on the final state.
        for (text, what) in [
            ("hide everything except the two controllers", "the red controller and the blue controller are"),
            ("show only the mug", "the mug is"),
        ] {
            let reply = session.say(&mut world, text, &mut |_| {}, &AtomicBool::new(false));
            assert_eq!(reply.text, format!("Only {what} drawn now; say 'show everything' for the rest."), "{match_by}");
        }
        // What is asked is answered first; without a question of that kind the thing is described alone.
        for (text, begin) in [
            ("which book is the largest?", "The green book is the largest book. It is an object"),
            ("describe the green book", "The green book is an object"),
        ] {
            let reply = session.say(&mut world, text, &mut |_| {}, &AtomicBool::new(false));
            assert!(reply.text.starts_with(begin), "{match_by}: {}", reply.text);
        }
    }
}
