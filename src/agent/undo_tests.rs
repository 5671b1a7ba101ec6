//! Tests of the agent's undo beside edits of the user, and of its reports of written files.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

use glam::{DMat3, DVec3};

use super::commands::Commands;
use super::policy::Policy;
use super::scene::{AgentScene, Effect, SceneWorld};
use super::session::Session;
use super::world::World;
use crate::navigate::Pose;
use crate::pipeline::semantics::query::answer::Basis;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::render::RenderSettings;
use crate::scene::{GaussianCloud, Identities, Level, LevelFilter, NO_IDENTITY, SemanticMap};

const EYE: Pose = Pose { center: DVec3::ZERO, world_from_camera: DMat3::IDENTITY, fov_y_rad: 0.8 };

/// Map of one lamp, renamed if `name` is given.
fn map(name: Option<&str>) -> Arc<SemanticMap> {
    let mut identities = Identities::default();
    let lamp = identities.add(Level::Object, NO_IDENTITY, vec!["lamp".into()]);
    name.into_iter().for_each(|name| identities.rename(lamp, name));
    Arc::new(SemanticMap { identities, ..SemanticMap::default() })
}

/// Scene of this map without Gaussians, in this folder.
fn parts(map: Arc<SemanticMap>, folder: Option<PathBuf>) -> AgentScene {
    AgentScene {
        cloud: Arc::new(GaussianCloud::default()),
        settings: RenderSettings::default(),
        map,
        cameras: Vec::new(),
        up: DVec3::Z,
        meters: None,
        exports: PathBuf::new(),
        folder,
        recipe: Default::default(),
        explored: None,
    }
}

/// World of these parts, and the effects that it emits.
fn world(parts: AgentScene) -> (SceneWorld, Arc<Mutex<Vec<Effect>>>) {
    let effects = Arc::new(Mutex::new(Vec::new()));
    let said = Arc::clone(&effects);
    let emit = Box::new(move |effect| said.lock().expect("no panic").push(effect));
    (SceneWorld::new(parts, EYE, 1.0, emit).expect("no encoder is needed"), effects)
}

/// World in which the lamp was renamed to "torch", and the effects that it emits.
fn renamed() -> (SceneWorld, Arc<Mutex<Vec<Effect>>>) {
    let (mut world, effects) = world(parts(map(None), None));
    world.rename(1, "torch").expect("it is there");
    (world, effects)
}

#[test]
fn a_rename_is_undone_as_one_step_of_the_window() {
    let (mut world, effects) = renamed();
    // The window has applied the rename: the same names in another map.
    world.keep_up(EYE, 1.0, &[], &map(Some("torch")));
    world.undo().expect("there is something to undo");
    assert_eq!(world.identities().name(1), "lamp");
    let effects = effects.lock().expect("no panic");
    assert!(matches!(&effects[0], Effect::Renamed(1, name) if name == "torch"), "{effects:?}");
    let Effect::Undone(undone) = &effects[1] else { panic!("{effects:?}") };
    assert!(undone.hidden.is_none() && undone.names == [(1, "lamp".to_owned())], "{effects:?}");
}

#[test]
fn what_the_user_has_edited_since_is_not_undone() {
    let (mut world, effects) = renamed();
    world.keep_up(EYE, 1.0, &[], &map(Some("sun")));
    assert!(world.undo().is_err());
    assert_eq!((world.identities().name(1).as_str(), effects.lock().expect("no panic").len()), ("sun", 1));
}

#[test]
fn what_the_user_did_last_is_undone_by_the_window() {
    let (mut world, effects) = renamed();
    // The user has hidden the lamp since.
    world.keep_up(EYE, 1.0, &[1], &map(Some("torch")));
    world.undoable = Some("hid torch".into());
    assert_eq!(world.undo().expect("the user's"), "hid torch");
    assert!(matches!(effects.lock().expect("no panic").last(), Some(Effect::Undo)));
    assert!(world.undo().is_err(), "once");
}

#[test]
fn what_one_sentence_does_is_undone_by_one() {
    let mut identities = Identities::default();
    for name in ["lamp", "chair", "table"] {
        identities.add(Level::Object, NO_IDENTITY, vec![name.into()]);
    }
    let map = Arc::new(SemanticMap { identities, ..SemanticMap::default() });
    let (mut world, effects) = world(parts(map, None));
    let mut session = Session::new(Policy::off(), Box::new(Commands::default()));
    let mut say = |text: &str| {
        let reply = session.say(&mut world, text, &mut |_| (), &AtomicBool::new(false));
        assert!(reply.refused.is_none(), "{}", reply.text);
        let hidden = |effect: &Effect| match effect {
            Effect::Hidden(ids) => Some(ids.clone()),
            Effect::Undone(undone) => undone.hidden.clone(),
            _ => None,
        };
        (reply.text, effects.lock().expect("no panic").iter().rev().find_map(hidden))
    };
    assert_eq!(say("hide the lamp").1, Some(vec![1]));
    assert_eq!(say("show only the chair and the table").1, Some(vec![0, 1]));
    assert_eq!(say("undo"), ("Undone: showing only chair and table.".into(), Some(vec![1])));
    // The control: another sentence is another step.
    assert_eq!(say("undo"), ("Undone: hiding lamp.".into(), Some(vec![])));
    assert_eq!(say("hide the lamp and the chair").1, Some(vec![1, 2]));
    assert_eq!(say("undo"), ("Undone: hiding lamp and hiding chair.".into(), Some(vec![])));
}

#[test]
fn things_that_one_request_removes_go_into_one_scene() {
    let mut identities = Identities::default();
    for name in ["lamp", "chair", "table"] {
        identities.add(Level::Object, NO_IDENTITY, vec![name.into()]);
    }
    let map = Arc::new(SemanticMap { identities, ..SemanticMap::default() });
    let (mut world, effects) = world(parts(map, Some(PathBuf::from("scene"))));
    let mut session = Session::new(Policy::off(), Box::new(Commands::default()));
    for text in ["remove the lamp and the table", "remove the chair"] {
        let reply = session.say(&mut world, text, &mut |_| (), &AtomicBool::new(false));
        assert!(reply.refused.is_none(), "{}", reply.text);
    }
    let effects = effects.lock().expect("no panic");
    let removed: Vec<_> =
        effects.iter().filter_map(|e| if let Effect::Remove(ids) = e { Some(ids) } else { None }).collect();
    assert_eq!(removed, [&vec![1, 3], &vec![2]], "one scene for each request");
}

#[test]
fn what_is_exported_far_from_zero_says_what_it_is_relative_to() {
    let folder = tempfile::tempdir().expect("folder");
    let positions: Vec<[f32; 3]> = (0..60_u8).map(|i| [i % 5, i / 5 % 4, i / 20].map(f32::from)).collect();
    let lamp = SemanticMap { identity_of: vec![1; positions.len()], ..(*map(None)).clone() };
    for (origin, shift) in
        [(DVec3::ONE, None), (DVec3::new(456_789.0, 5_678_901.0, 312.0), Some("(456789, 5678901, 312)"))]
    {
        let cloud = Arc::new(GaussianCloud { origin, ..GaussianCloud::isotropic(positions.clone(), -3.0, 1.0) });
        let exports = folder.path().to_path_buf();
        let (mut world, _) = world(AgentScene { cloud, exports, ..parts(Arc::new(lamp.clone()), None) });
        let said = world.export(1).expect("written");
        assert!(said.starts_with(&folder.path().join("1-lamp.ply").display().to_string()), "{said}");
        assert_eq!(said.contains("shifted: places are relative to"), shift.is_some(), "{said}");
        assert!(shift.is_none_or(|shift| said.contains(shift)), "{said}");
    }
}

#[test]
fn the_agent_answers_by_the_recipe_of_its_scene() {
    let (mut world, _) = renamed();
    let mut basis = |recipe: Option<QueryConfig>| {
        recipe.iter().for_each(|recipe| world.answer_by(recipe).expect("no encoder is needed"));
        let answered = world.locate("torch", LevelFilter::Auto, &super::world::QueryPlace::default()).expect("asked");
        (answered.basis, answered.chosen(1), answered.recipe)
    };
    assert_eq!(basis(None), (Basis::Names, vec![1], QueryConfig::default()));
    assert_eq!(basis(Some(QueryConfig::paper())), (Basis::Embedding, vec![], QueryConfig::paper()));
}
