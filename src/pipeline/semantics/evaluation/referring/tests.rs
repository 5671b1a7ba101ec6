//! Truths of scenes with known boxes, and counts of sentences about the scenes of the project.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::Path;

use serde_json::{Value, json};

use super::clarity::Clarity;
use super::facts::{MeshFacts, TrueView};
use super::scope::TrueScope;
use super::*;
use crate::io::gltf_mesh::tests::{cubes, glb, real_scenes};
use crate::io::gltf_mesh::{self, MeshScene};

const EYE: [f64; 3] = [0.0, 1.5, 2.0];
const FORWARD: [f64; 3] = [0.0, -0.4, -1.0];
/// Names, middles, sizes and materials of boxes: a table and things on it, one of them on a book.
const ROOM: [(&str, [f64; 3], [f64; 3], usize); 7] = [
    ("table", [0.0, 0.7, 0.0], [1.6, 0.04, 1.0], 3),
    ("red mug", [-0.5, 0.77, 0.2], [0.1, 0.1, 0.1], 0),
    ("blue mug", [0.5, 0.77, 0.2], [0.1, 0.1, 0.1], 1),
    ("kettle", [0.0, 0.895, 0.2], [0.3, 0.35, 0.3], 2),
    ("book", [0.0, 0.74, -0.4], [0.3, 0.04, 0.15], 4),
    ("note", [0.0, 0.765, -0.4], [0.1, 0.01, 0.1], 4),
    ("lamp", [-0.5, 0.97, -0.4], [0.1, 0.5, 0.1], 4),
];
const TABLE: usize = 0;
const RED: usize = 1;
const BLUE: usize = 2;
const KETTLE: usize = 3;
const BOOK: usize = 4;
const NOTE: usize = 5;
const LAMP: usize = 6;

/// Scene of boxes in the colors red, blue, green, brown and white.
fn boxes(nodes: Value, roots: Value) -> MeshScene {
    let colors = [[0.6, 0.02, 0.02], [0.02, 0.1, 0.6], [0.02, 0.3, 0.05], [0.17, 0.06, 0.02], [0.9, 0.9, 0.9]];
    let material = |[r, g, b]: [f64; 3]| json!({ "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0] } });
    let (mut root, bin) = cubes(nodes, roots, colors.map(material).to_vec().into());
    let primitive = |m: usize| json!({ "attributes": { "POSITION": 0 }, "indices": 1, "material": m });
    root["meshes"] = (0..colors.len()).map(|m| json!({ "primitives": [primitive(m)] })).collect();
    gltf_mesh::read_slice(&glb(&root, &bin), "boxes.glb").unwrap()
}

fn node(name: &str, middle: [f64; 3], size: [f64; 3], mesh: usize) -> Value {
    json!({ "name": name, "mesh": mesh, "translation": middle, "scale": size })
}

fn room() -> MeshScene {
    let nodes: Value = ROOM.iter().map(|(name, middle, size, mesh)| node(name, *middle, *size, *mesh)).collect();
    boxes(nodes, json!([0, 1, 2, 3, 4, 5, 6]))
}

fn scope_of(scene: &MeshScene, forward: [f64; 3]) -> TrueScope {
    let found = identities(scene, Levels::Nodes, "test").unwrap();
    let view = TrueView::new(EYE, forward).unwrap();
    TrueScope::new(&found.list, MeshFacts::of(&found.list, mesh::solids(scene, &found).unwrap(), view).unwrap())
}

#[test]
fn left_and_front_are_the_viewers() {
    let facts = scope_of(&room(), FORWARD).facts;
    assert_eq!([facts.left(RED, KETTLE), facts.left(BLUE, KETTLE)], [Clarity::Yes, Clarity::No]);
    assert_eq!([facts.right(RED, KETTLE), facts.right(BLUE, KETTLE)], [Clarity::No, Clarity::Yes]);
    assert_eq!([facts.front(KETTLE, BOOK), facts.behind(KETTLE, BOOK)], [Clarity::Yes, Clarity::No]);
    assert_eq!(facts.left(RED, LAMP), Clarity::Unclear, "in the picture it is, on the table it is in front");
    // Control: from the other side of the table, left is right.
    let found = identities(&room(), Levels::Nodes, "test").unwrap();
    let view = TrueView::new([0.0, 1.5, -2.0], [0.0, -0.4, 1.0]).unwrap();
    let facts = MeshFacts::of(&found.list, mesh::solids(&room(), &found).unwrap(), view).unwrap();
    assert_eq!([facts.left(RED, KETTLE), facts.right(RED, KETTLE)], [Clarity::No, Clarity::Yes]);
    assert_eq!([facts.front(KETTLE, BOOK), facts.behind(KETTLE, BOOK)], [Clarity::No, Clarity::Yes]);
}

#[test]
fn things_stand_on_what_is_right_below_them() {
    let facts = scope_of(&room(), FORWARD).facts;
    for thing in [RED, BLUE, KETTLE, BOOK, LAMP] {
        assert_eq!([facts.on(thing, TABLE), facts.on(TABLE, thing)], [Clarity::Yes, Clarity::No], "{}", ROOM[thing].0);
        assert_eq!(facts.under(TABLE, thing), Clarity::Yes);
    }
    assert_eq!(
        [facts.on(NOTE, BOOK), facts.on(BOOK, NOTE), facts.on(RED, BOOK)],
        [Clarity::Yes, Clarity::No, Clarity::No]
    );
    assert_eq!(facts.on(NOTE, TABLE), Clarity::Unclear, "a book is between them");
    assert_eq!([facts.touching(NOTE, BOOK), facts.touching(RED, KETTLE)], [Clarity::Yes, Clarity::No]);
    let carriers: Vec<usize> = (0..ROOM.len()).filter(|&i| facts.carriers()[i]).collect();
    assert_eq!(carriers, [TABLE]);
}

#[test]
fn sizes_and_distances_have_margins() {
    let facts = scope_of(&room(), FORWARD).facts;
    assert_eq!([facts.larger(KETTLE, RED), facts.larger(RED, KETTLE)], [Clarity::Yes, Clarity::No]);
    assert_eq!(facts.larger(RED, BLUE), Clarity::Unclear, "equally large");
    assert_eq!([facts.taller(LAMP, KETTLE), facts.taller(BOOK, RED)], [Clarity::Yes, Clarity::No]);
    assert_eq!([0.4, 0.49, 0.7].map(|h| facts.taller_than(LAMP, h)), [Clarity::Yes, Clarity::Unclear, Clarity::No]);
    assert_eq!(facts.between(KETTLE, RED, BLUE), Clarity::Yes);
    assert_eq!(facts.between(BOOK, RED, BLUE), Clarity::No);
    // The gap of 0.3 between mug and kettle is three mugs wide.
    assert_eq!(facts.beside(RED, KETTLE), Clarity::No);
    assert_eq!([0.7, 0.45, 0.2].map(|d| facts.within(RED, KETTLE, d)), [Clarity::Yes, Clarity::Unclear, Clarity::No]);
    assert!((facts.gap(RED, KETTLE).unwrap() - 0.3).abs() < 1e-6);
}

#[test]
fn colors_are_those_of_names_and_materials() {
    let scope = scope_of(&room(), FORWARD);
    let all: Vec<usize> = (0..ROOM.len()).collect();
    for (color, things) in [("red", vec![RED]), ("green", vec![KETTLE]), ("brown", vec![TABLE]), ("purple", vec![])] {
        let term = color::TERMS.iter().position(|t| t.name == color).unwrap();
        assert_eq!(scope.among(&all, |i| scope.colored(i, term)), Some(things), "{color}");
    }
}

/// Truths of all expressions about a scene, by text.
fn truths(scene: &MeshScene) -> HashMap<String, ReferringTruth> {
    let set = referring(scene, Levels::Nodes, "test", EYE, FORWARD, 1_000_000, 3).unwrap();
    set.expressions.into_iter().map(|e| (e.text, e.truth)).collect()
}

/// Truths of the wordings that are present: `{}` stands for a link.
fn of<'a>(truths: &'a HashMap<String, ReferringTruth>, wordings: &[&str]) -> Vec<&'a ReferringTruth> {
    let links = ["", "that is ", "which is ", "that are ", "which are "];
    wordings.iter().flat_map(|w| links.map(|link| w.replace("{}", link))).filter_map(|w| truths.get(&w)).collect()
}

#[test]
fn sentences_have_the_truth_of_the_boxes() {
    let truths = truths(&room());
    let all = |things: &[usize]| ReferringTruth::All(things.iter().map(|&i| i as u16 + 1).collect());
    let (lefts, rights) = (
        ["left", "to the left", "on the left", "on the left-hand side"],
        ["right", "to the right", "on the right", "on the right-hand side"],
    );
    let about = |head: &str, sides: [&str; 4]| sides.map(|side| format!("{head} {{}}{side} of the kettle"));
    for (wordings, truth) in [
        (about("the mug", lefts), all(&[RED])),
        (about("the mug", rights), all(&[BLUE])),
        (about("the lamp", rights), ReferringTruth::Nothing),
        (about("the red mug", rights), ReferringTruth::Nothing),
    ] {
        let wordings: Vec<&str> = wordings.iter().map(String::as_str).collect();
        let found = of(&truths, &wordings);
        assert!(!found.is_empty() && found.iter().all(|t| **t == truth), "{wordings:?}: {found:?}");
    }
    for (wording, truth) in [
        ("the red mug", all(&[RED])),
        ("the mug", ReferringTruth::OneOf(vec![RED as u16 + 1, BLUE as u16 + 1])),
        ("all mugs", all(&[RED, BLUE])),
        ("the two mugs", all(&[RED, BLUE])),
        ("the four mugs", ReferringTruth::Nothing),
        ("the piano", ReferringTruth::Nothing),
        ("a red mug", all(&[RED])),
        ("show me the kettle", all(&[KETTLE])),
    ] {
        // Of some wordings only one is written for each number.
        if let Some(found) = truths.get(wording) {
            assert_eq!(*found, truth, "{wording}");
        } else {
            assert_eq!(wording, "the four mugs");
        }
    }
    let unclear = ["everything {}on the table", "everything {}standing on the table", "all things {}on the table"];
    assert!(of(&truths, &unclear).is_empty(), "the note is on it only to some");
    assert!(of(&truths, &["the largest thing", "the biggest thing"]).iter().all(|t| **t == all(&[KETTLE])));
    let tallest = of(&truths, &["the tallest thing", "the thing that is the tallest"]);
    assert!(!tallest.is_empty() && tallest.iter().all(|t| **t == all(&[LAMP])));
}

#[test]
fn parts_belong_to_their_wholes() {
    let part = |name: &str, middle, size| node(name, middle, size, 0);
    let scene = boxes(
        json!([
            { "name": "mug", "children": [1, 2] },
            part("body", [0.0, 0.05, 0.0], [0.1, 0.1, 0.1]),
            part("handle", [0.06, 0.05, 0.0], [0.02, 0.06, 0.02]),
            { "name": "kettle", "children": [4, 5, 6] },
            part("body", [0.6, 0.1, 0.0], [0.2, 0.2, 0.2]),
            part("lid", [0.6, 0.22, 0.0], [0.1, 0.04, 0.1]),
            part("knob", [0.6, 0.26, 0.0], [0.02, 0.04, 0.02]),
        ]),
        json!([0, 3]),
    );
    let truths = truths(&scene);
    // Objects are 1 and 2; parts follow: body 3, handle 4; body 5, lid 6, knob 7.
    let all = |ids: &[u16]| ReferringTruth::All(ids.to_vec());
    for (text, truth) in [
        ("the handle", all(&[4])),
        ("the body", ReferringTruth::OneOf(vec![3, 5])),
        ("all parts of the kettle", all(&[5, 6, 7])),
        ("the mug", all(&[1])),
    ] {
        assert_eq!(truths.get(text), Some(&truth), "{text}");
    }
    let above = ["the part of the kettle {}above the lid", "the part of the kettle {}over the lid"];
    assert!(of(&truths, &above).iter().all(|t| **t == all(&[7])));
    let nothing = truths.iter().filter(|(text, _)| text.contains("mug") && text.contains("keyboard"));
    assert!(nothing.clone().count() > 0 && nothing.into_iter().all(|(_, t)| *t == ReferringTruth::Nothing));
}

#[test]
fn views_and_scenes_without_sense_are_refused() {
    let down = referring(&room(), Levels::Nodes, "test", EYE, [0.0, -1.0, 0.0], 10, 0);
    assert!(down.unwrap_err().to_string().contains("horizon"));
    assert!(referring(&room(), Levels::Nodes, "test", [f64::NAN; 3], FORWARD, 10, 0).is_err());
    assert!(matches!(
        referring(&MeshScene::default(), Levels::Nodes, "test", EYE, FORWARD, 10, 0),
        Err(SynthError::Empty)
    ));
}

/// Checks counts, kinds, ids and texts of the expressions about a scene, and returns them.
fn checked(path: &Path, eye: [f64; 3], least: usize, kinds: usize) -> ReferringSet {
    let scene = gltf_mesh::read(path).unwrap();
    let set = referring(&scene, Levels::Nodes, "scene", eye, [-eye[0], -0.2, -eye[2]], 600, 7).unwrap();
    let name = path.display();
    let texts: HashSet<String> = set.expressions.iter().map(|e| e.text.to_lowercase()).collect();
    assert_eq!(texts.len(), set.expressions.len(), "{name}: a text with two truths, or twice");
    assert!(texts.len() >= least, "{name}: {}", texts.len());
    let nothing = set.expressions.iter().filter(|e| e.truth == ReferringTruth::Nothing).count();
    assert!(5 * nothing >= texts.len() && 2 * nothing <= texts.len(), "{name}: {nothing} name nothing");
    let found: BTreeSet<ReferringKind> = set.expressions.iter().map(|e| e.kind).collect();
    assert!(found.len() >= kinds, "{name}: {found:?}");
    let known = 1..=set.identities.len();
    for e in &set.expressions {
        assert!(!e.text.contains(['{', '}']) && !e.text.contains("  "), "{}", e.text);
        match &e.truth {
            ReferringTruth::All(ids) => {
                assert!(!ids.is_empty() && ids.iter().all(|i| known.contains(&usize::from(*i))))
            }
            ReferringTruth::OneOf(ids) => {
                assert!(ids.len() > 1 && ids.iter().all(|i| known.contains(&usize::from(*i))))
            }
            ReferringTruth::Nothing => {}
        }
    }
    set
}

#[test]
fn the_scenes_of_the_project_have_hundreds_of_expressions() {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    for file in ["demo.glb", "eval/desk.glb", "eval/kitchen.glb", "eval/shelf.glb", "eval/unseen.glb"] {
        let set = checked(&assets.join(file), [1.5, 1.2, -0.1], 500, 30);
        assert!(set.skipped_borderline > 0, "{file}: nothing is unclear");
        let counts = set.expressions.iter().fold(HashMap::new(), |mut counts: HashMap<_, usize>, e| {
            *counts.entry(format!("{:?}", e.kind)).or_default() += 1;
            counts
        });
        assert!(counts.values().all(|n| *n <= 120), "{file}: one kind has too many: {counts:?}");
        let changed = controls::exchanged(&set.expressions);
        assert!(5 * changed.len() > set.expressions.len(), "{file}: {} are exchanged", changed.len());
    }
}

#[test]
fn the_seed_decides() {
    let scene = room();
    let set = |seed| referring(&scene, Levels::Nodes, "test", EYE, FORWARD, 400, seed).unwrap();
    let first = set(1);
    assert_eq!(first, set(1));
    assert_ne!(first.expressions, set(2).expressions);
    // Texts in common have the same truth.
    let truths: HashMap<&str, &ReferringTruth> = first.expressions.iter().map(|e| (&e.text[..], &e.truth)).collect();
    let other = referring(&scene, Levels::Nodes, "test", EYE, FORWARD, 20_000, 2).unwrap();
    let common: Vec<_> = other.expressions.iter().filter(|e| truths.contains_key(&e.text[..])).collect();
    assert!(!common.is_empty() && common.iter().all(|e| *truths[&e.text[..]] == e.truth));
}

#[test]
fn scenes_of_parts_alone_have_a_hundred() {
    let Some(folder) = real_scenes() else { return };
    for (file, eye) in [
        ("CesiumMilkTruck/CesiumMilkTruck.glb", [7.0, 3.0, 5.0]),
        ("kenney_vehicles/vehicle-motorcycle.glb", [3.0, 1.5, -0.2]),
    ] {
        checked(&folder.join(file), eye, 100, 8);
    }
}
