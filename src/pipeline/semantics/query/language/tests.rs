//! Compounds, slips and names by the words of the demo's scene.

use glam::DVec3;

use crate::pipeline::semantics::query::answer::QueryAnswer;
use crate::pipeline::semantics::query::language::QueryPlace;
use crate::pipeline::semantics::query::language::viewpoint::Viewpoint;
use crate::pipeline::semantics::query::localize::Answer;
use crate::pipeline::semantics::query::query_engine::ask_by_name;
use crate::pipeline::semantics::query::reading::QueryReading;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::scene::{Bounds, Identities, Level, LevelFilter, NO_IDENTITY};

/// Returns the demo's scene, and the lists of questions.
fn data() -> (Identities, toml::Table) {
    let table: toml::Table =
        include_str!("../../../../../tests/data/compounds_and_slips.toml").parse().expect("sound TOML");
    let mut all = Identities::default();
    for (object, parts) in table["scene"].as_table().expect("a table") {
        let id = all.add(Level::Object, NO_IDENTITY, vec![object.clone()]);
        for part in parts.as_array().expect("a list") {
            all.add(Level::Part, id, vec![part.as_str().expect("a name").into()]);
        }
    }
    (all, table)
}

fn rows<'a>(table: &'a toml::Table, list: &str) -> Vec<Vec<&'a str>> {
    let texts = |row: &'a toml::Value| {
        row.as_array().expect("a row").iter().map(|t| t.as_str().expect("a text")).collect::<Vec<_>>()
    };
    table[list].as_array().expect("a list").iter().map(texts).collect()
}

fn ask(all: &Identities, text: &str, level: LevelFilter) -> QueryAnswer {
    ask_by_name(all, text, (level, &QueryPlace::default()), &QueryConfig::default()).expect("words")
}

fn summary(all: &Identities, text: &str) -> String {
    told(all, ask(all, text, LevelFilter::Auto))
}

fn told(all: &Identities, answered: QueryAnswer) -> String {
    let first = answered.answer.hits().first().map(|h| all.full_name(h.identity)).unwrap_or_default();
    match answered.answer {
        Answer::Found(hits) if hits.len() > 1 => format!("all {} {first}", hits.len()),
        Answer::Found(_) => first,
        Answer::Ambiguous(_) => format!("ambiguous {first}"),
        Answer::NotFound(_) => "not found".into(),
    }
}

fn mended(all: &Identities, text: &str) -> Vec<(String, String)> {
    QueryReading::new(all, text, &QueryConfig::default()).expect("words").mended
}

#[test]
fn compounds_are_pieces_of_wholes_and_nothing_else_changes() {
    let (all, table) = data();
    let lists = [rows(&table, "compounds"), rows(&table, "kept")];
    assert!(lists[0].len() >= 40);
    let wrong = |row: &&Vec<&str>| summary(&all, row[0]) != row[1];
    let wrong: Vec<String> = lists
        .iter()
        .flatten()
        .filter(wrong)
        .map(|r| format!("{}: {}, not {}", r[0], summary(&all, r[0]), r[1]))
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // The level that is asked for is respected.
    assert!(ask(&all, "kettle spout", LevelFilter::Object).chosen(1).is_empty());
}

/// Words that make the grammar go astray.
const STRAY: &str = "the a all both every two second largest nearest closest left right of on in between and or , ? except but not that is \
    are which what how many there with without than taller over 20 cm it its one ones 's to from me most top red lamp kettle mug button \
    buttons controller whose color any either these just each belongs within at least no more farther away behind";

#[test]
fn any_words_in_any_order_are_read_in_no_time() {
    use rand::{RngExt, SeedableRng};
    let (all, _) = data();
    let words: Vec<&str> = STRAY.split_whitespace().collect();
    let mut rng = rand_pcg::Pcg32::seed_from_u64(41);
    for _ in 0..20_000 {
        let n = rng.random_range(1..14);
        let text = (0..n).map(|_| words[rng.random_range(0..words.len())]).collect::<Vec<_>>().join(" ");
        if let Some(answered) =
            ask_by_name(&all, &text, (LevelFilter::Auto, &QueryPlace::default()), &QueryConfig::default())
        {
            assert!(answered.chosen(1).iter().all(|id| all.get(*id).is_some()), "{text}");
        }
    }
}

/// A comparison that removes nothing is still true: other readings in which words are missed do not outweigh it.
#[test]
fn a_comparison_that_all_meet_is_met() {
    let mut all = Identities::default();
    let mut boxes = vec![None];
    for (name, at, size) in [
        ("teddy bear", [0.0, 0.0, 0.0], [0.2, 0.2, 0.4]),
        ("toy car", [1.0, 0.0, 0.0], [0.3, 0.2, 0.1]),
        ("shelf", [4.0, 0.0, 0.0], [1.0, 0.4, 2.0]),
        ("box", [4.0, 0.0, 2.0], [0.3, 0.3, 0.3]),
    ] {
        all.add(Level::Object, NO_IDENTITY, vec![name.into()]);
        let min = DVec3::from(at);
        boxes.push(Some(Bounds { min, max: min + DVec3::from(size) }));
    }
    all.set_boxes(&boxes);
    let view = Viewpoint { eye: DVec3::new(2.0, -6.0, 1.0), forward: DVec3::Y, up: DVec3::Z };
    let place = QueryPlace { view: Some(view), meters: Some(1.0), ..QueryPlace::default() };
    for (text, wanted) in [
        ("the car at most 1.2 m from the bear", "toy car"),
        ("find the teddy bear that is within 90 centimetres of the car", "teddy bear"),
        ("the bear clearly taller than the car", "teddy bear"),
        ("the bear which is under 50 cm in height", "teddy bear"),
        ("the box on the shelf taller than 20 cm", "box"),
        ("the car at most 20 cm from the bear", "not found"),
        ("the car clearly taller than the bear", "not found"),
        ("the bear which is under 20 cm in height", "not found"),
        // Said of the box, not of the shelf, which is taller.
        ("the box on the shelf taller than a meter", "not found"),
    ] {
        let answered = ask_by_name(&all, text, (LevelFilter::Auto, &place), &QueryConfig::default()).expect("words");
        assert_eq!(told(&all, answered), wanted, "{text}");
    }
}

/// What a thing is compared with is not its own piece, and a comparison or color is said of the thing asked for.
#[test]
fn conditions_are_those_of_the_thing_that_is_asked_for() {
    let mut all = Identities::default();
    let mut boxes = vec![None];
    let parts = ["body", "roof", "bumpers", "knob"];
    for (name, x) in [("toy car", 0.0), ("truck", 5.0)] {
        let whole = all.add(Level::Object, NO_IDENTITY, vec![name.into()]);
        boxes.push(Some(Bounds { min: DVec3::new(x, 0.0, 0.0), max: DVec3::new(x + 1.0, 0.4, 0.5) }));
        for (part, (low, high)) in parts.into_iter().zip([(0.0, 1.0), (0.3, 0.6), (0.05, 0.95), (0.48, 0.52)]) {
            all.add(Level::Part, whole, vec![part.into()]);
            let z = if part == "knob" { [0.46, 0.5] } else { [0.1, 0.4] };
            boxes.push(Some(Bounds { min: DVec3::new(x + low, 0.0, z[0]), max: DVec3::new(x + high, 0.4, z[1]) }));
        }
    }
    all.set_boxes(&boxes);
    let view = Viewpoint { eye: DVec3::new(2.0, -9.0, 1.0), forward: DVec3::Y, up: DVec3::Z };
    let place = QueryPlace { view: Some(view), meters: Some(1.0), ..QueryPlace::default() };
    for (text, wanted) in [
        ("the roof of the toy car which is left of the bumpers", "not found"),
        ("the roof of the toy car which is right of the bumpers", "not found"),
        ("the knob of the car farther away than the bumpers", "not found"),
        ("the roof of the toy car which is left of the truck", "roof · toy car"),
        ("the roof of the truck which is right of the toy car", "roof · truck"),
        ("the knob of the toy car shorter than 10 cm", "knob · toy car"),
        ("the knob of the toy car taller than 10 cm", "not found"),
        ("the toy car or the truck", "ambiguous toy car"),
        ("the bumpers of the truck or the roof of the toy car", "ambiguous bumpers · truck"),
        ("cars or trucks", "all 2 toy car"),
        ("the toy car, just its bumpers", "bumpers · toy car"),
        ("is there a truck or a zebra", "truck"),
    ] {
        let answered = ask_by_name(&all, text, (LevelFilter::Auto, &place), &QueryConfig::default()).expect("words");
        assert_eq!(told(&all, answered), wanted, "{text}");
    }
}

#[test]
fn all_things_of_a_color_are_a_list() {
    let mut all = Identities::default();
    for name in ["red controller", "blue controller", "red apple"] {
        all.add(Level::Object, NO_IDENTITY, vec![name.into()]);
    }
    for text in ["all red things", "all red objects", "all the red things", "every red thing", "everything red"] {
        assert_eq!(summary(&all, text), "all 2 red controller", "{text}");
    }
    assert_eq!(summary(&all, "all blue things"), "blue controller");
    // The control: one thing is asked for, and two fit.
    assert_eq!(summary(&all, "the red thing"), "ambiguous red controller");
}

#[test]
fn slips_are_mended_word_by_word_and_words_of_their_own_are_not() {
    let (all, table) = data();
    let (slips, own) = (rows(&table, "slips"), rows(&table, "own_words"));
    assert!(slips.len() >= 40);
    let mut wrong = Vec::new();
    for row in &slips {
        let said: Vec<String> = mended(&all, row[0]).iter().map(|(a, b)| format!("{a}={b}")).collect();
        let mut wanted: Vec<&str> =
            row[2].split(' ').filter(|w| !w.starts_with("teh=") && !w.starts_with("hte=")).collect();
        wanted.sort_by_key(|w| row[0].find(w.split('=').next().unwrap_or_default()));
        if (said.join(" "), summary(&all, row[0])) != (wanted.join(" "), row[1].into()) {
            wrong.push(format!("{}: {}, {}, not {row:?}", row[0], said.join(" "), summary(&all, row[0])));
        }
    }
    for row in &own {
        if !mended(&all, row[0]).is_empty() || summary(&all, row[0]) == row[1] {
            wrong.push(format!("{}: mended {:?}, found {}", row[0], mended(&all, row[0]), summary(&all, row[0])));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(rows(&table, "compounds").iter().all(|row| mended(&all, row[0]).is_empty()));
}

#[test]
fn a_name_with_its_words_in_another_order_goes_before_an_order() {
    // From the eye, the nearest wheel is the back one.
    let mut all = Identities::default();
    let motorcycle = all.add(Level::Object, NO_IDENTITY, vec!["motorcycle".into()]);
    let back = all.add(Level::Part, motorcycle, vec!["wheel-back".into()]);
    let front = all.add(Level::Part, motorcycle, vec!["wheel-front".into()]);
    let cube = |z: f64| Some(Bounds { min: DVec3::new(-0.1, -0.1, z), max: DVec3::new(0.1, 0.1, z + 0.2) });
    all.set_boxes(&[None, Some(Bounds { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) }), cube(-1.0), cube(0.8)]);
    let view = Viewpoint { eye: DVec3::new(0.0, 0.0, -6.0), forward: DVec3::Z, up: -DVec3::Y };
    let place = QueryPlace { view: Some(view), ..QueryPlace::default() };
    let found = |text: &str| {
        let answered = ask_by_name(&all, text, (LevelFilter::Auto, &place), &QueryConfig::default()).expect("words");
        let mut ids = answered.chosen(1);
        ids.sort_unstable();
        ids
    };
    for text in [
        "the back wheel and the front wheel of the motorcycle",
        "the back wheel together with the front wheel of the motorcycle",
        "the back wheel as well as the front wheel of the motorcycle",
        "the front wheel or the back wheel of the motorcycle",
        "back wheel and front wheel",
    ] {
        assert_eq!(found(text), [back, front], "{text}");
    }
    assert_eq!((found("the front wheel of the motorcycle"), found("the front wheel")), (vec![front], vec![front]));
    assert_eq!(found("the nearest wheel"), [back], "an order that no name says");
}
