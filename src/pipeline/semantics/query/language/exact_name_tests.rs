//! Every name in every scene, asked verbatim, finds its identity.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

use crate::io::gltf_mesh;
use crate::pipeline::semantics::query::answer::{Language, answer};
use crate::pipeline::semantics::query::by_embedding::TextEmbeddings;
use crate::pipeline::semantics::query::language::QueryPlace;
use crate::pipeline::semantics::query::localize::Answer;
use crate::pipeline::semantics::query::reading::QueryReading;
use crate::pipeline::semantics::query::recipe::{MatchBy, QueryConfig};
use crate::pipeline::synth::demo_glb;
use crate::pipeline::synth::levels::identities;
use crate::pipeline::synth::options::Levels;
use crate::scene::identity::whole_names::key;
use crate::scene::{Identities, IdentityId, LanguageFeatures, Level, LevelFilter, NO_IDENTITY, ViewFeatures};

/// Names that the grammar takes apart, or takes for something else.
const HARD: [(&str, &[&str]); 16] = [
    (
        "plush doll",
        &["pink bow on the plush doll's hood", "white fur end of the plush doll's twin tails", "hood", "fur"],
    ),
    ("doll's house", &["door of the doll's house", "eye of the needle", "left of the door", "on"]),
    ("set of cups", &["handle of the set of cups", "cup of", "of the", "top of the top"]),
    ("left of the lamp", &["button a of b", "button b of a", "b", "nearest to it"]),
    ("lamp left of the left lamp", &["lamp", "left lamp", "lamp left", "it"]),
    ("Levi's 501", &["501", "5.01", "No. 5", "20cm ruler", "#7"]),
    ("赤いコントローラーのボタン", &["手柄", "红色手柄的按钮", "ボタン", "的"]),
    ("Straße nach Süden", &["ÄPFEL", "ΟΔΟΣ", "İstanbul", "el botón del mando"]),
    ("what's left?", &["a, b and c", "(part) lid", "\"quoted\" rim", "C++", "C"]),
    ("the", &["a", "the a", "an", "?!", "-", "★"]),
    ("salt and pepper", &["salt", "pepper", "all of them", "everything"]),
    ("red", &["red red", "blue of the red", "red blue", "not red"]),
    ("ketle", &["teh", "kettel", "kettle spout", "spout kettle"]),
    ("thing", &["part", "object", "one", "other one"]),
    ("eye · plush doll", &["eye · face · doll", "·", "hood · plush doll"]),
    ("bows of the plush dolls hood", &["end of tails", "hood on bow", "hood of bow on plush"]),
];

/// The same words twice, and a thing whose name contains those of others.
fn hard() -> Identities {
    let mut all = Identities::default();
    for _ in 0..2 {
        for (object, parts) in HARD {
            let id = all.add(Level::Object, NO_IDENTITY, vec![object.into(), format!("another {object}")]);
            parts.iter().for_each(|part| {
                all.add(Level::Part, id, vec![(*part).into()]);
            });
        }
        all.add(Level::Object, NO_IDENTITY, vec![]);
    }
    all
}

/// Objects and parts of a glTF file.
fn of_meshes(bytes: &[u8], name: &str, path: Option<&Path>) -> Identities {
    let scene = path.map_or_else(|| gltf_mesh::read_slice(bytes, name), gltf_mesh::read).expect("a scene");
    let mut all = Identities::default();
    for one in identities(&scene, Levels::Nodes, name).expect("objects").list {
        all.add(one.level, one.parent.map_or(NO_IDENTITY, u32::from), vec![one.name]);
    }
    all
}

/// Categories of an ISAT file, wholes first; none if it is something else.
fn of_labels(path: &Path) -> Option<Identities> {
    let text = std::fs::read_to_string(path).expect("a text");
    let file: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let mut wholes = BTreeMap::new();
    for polygon in file["objects"].as_array()? {
        wholes.insert(polygon["category"].as_str()?.to_owned(), polygon["parent"].as_str().map(str::to_owned));
    }
    let (mut all, mut placed) = (Identities::default(), BTreeMap::new());
    while placed.len() < wholes.len() {
        let before = placed.len();
        for (name, whole) in &wholes {
            let of = whole.as_ref().map_or(Some(&NO_IDENTITY), |whole| placed.get(whole)).copied();
            if let Some(of) = of.filter(|_| !placed.contains_key(name)) {
                let level = if of == NO_IDENTITY { Level::Object } else { Level::Part };
                placed.insert(name.clone(), all.add(level, of, vec![name.clone()]));
            }
        }
        assert!(placed.len() > before, "{}: wholes that are not there", path.display());
    }
    Some(all)
}

fn files_in(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        match entry.path() {
            path if path.is_dir() => files_in(&path, found),
            path => found.push(path),
        }
    }
}

/// All scenes that tests can have, and the missing ones.
fn scenes() -> (Vec<(String, Identities)>, Vec<&'static str>) {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let data = std::env::var_os("FMLGS_DATA").map(PathBuf::from);
    let mut scenes = vec![("hard names".into(), hard()), ("demo".into(), of_meshes(demo_glb(), "demo", None))];
    let mut missing = Vec::new();
    let sources = [
        ("rendered scenes", Some(here.join("assets/eval"))),
        ("labels drawn here", Some(here.join("tests/data/plush_labels"))),
        ("glTF models", data.as_ref().map(|data| data.join("gltf"))),
        ("labels of the plush", data.as_ref().map(|data| data.join("plush_labels"))),
        ("labels of lerf_ovs", data.as_ref().map(|data| data.join("formats/lerf_ovs_label_excerpt"))),
        ("vocabularies", data.as_ref().map(|data| data.join("clip"))),
    ];
    for (what, folder) in sources {
        let (mut files, before) = (Vec::new(), scenes.len());
        folder.iter().for_each(|folder| files_in(folder, &mut files));
        files.sort();
        for path in files {
            let name = path.file_name().expect("a file").to_string_lossy().into_owned();
            let found = match path.extension().and_then(|e| e.to_str()) {
                Some("glb" | "gltf") => Some(of_meshes(&[], &name, Some(&path))),
                Some("json") if !what.starts_with("glTF") => of_labels(&path),
                Some("txt") if name.ends_with("names.txt") => {
                    let text = std::fs::read_to_string(&path).expect("a text");
                    let mut all = Identities::default();
                    text.lines().filter(|l| !l.trim().is_empty()).for_each(|l| {
                        all.add(Level::Object, NO_IDENTITY, vec![l.to_owned()]);
                    });
                    Some(all)
                }
                _ => None,
            };
            scenes.extend(found.map(|all| (name, all)));
        }
        if scenes.len() == before {
            missing.push(what);
        }
    }
    (scenes, missing)
}

/// A scene's identities under one way of understanding.
struct Asked<'a> {
    all: &'a Identities,
    features: LanguageFeatures,
    recipe: QueryConfig,
}

impl<'a> Asked<'a> {
    /// To the encoder of `both`, everything looks like the last identity.
    fn new(all: &'a Identities, match_by: MatchBy) -> Self {
        let of = |last: bool| if last { vec![1.0, 0.0] } else { vec![0.0, 1.0] };
        let each = all
            .iter()
            .map(|(id, _)| of(id as usize == all.len()))
            .map(|v| ViewFeatures { raw: vec![v.clone()], deviated: vec![v] });
        let features = LanguageFeatures { encoder: "test".into(), dimension: 2, by_identity: each.collect() };
        Self { all, features, recipe: QueryConfig { match_by, ..QueryConfig::default() } }
    }

    fn answer(&self, reading: &QueryReading) -> (Answer, Vec<IdentityId>) {
        let mut phrases = TextEmbeddings::default();
        let phrase = &reading.phrase;
        let mut encode = |p: &str| Ok::<_, ()>(if *p == phrase.text { vec![1.0, 0.0] } else { vec![0.5, 0.5] });
        phrases.learn(phrase, &self.recipe, &mut encode).expect("encodes");
        let language = Language { features: &self.features, phrases: &phrases, unknown: &[] };
        let language = (self.recipe.match_by == MatchBy::Both).then_some(language);
        let answered = answer(self.all, reading, (LevelFilter::Auto, &QueryPlace::default()), &self.recipe, language);
        let chosen = answered.chosen(1);
        (answered.answer, chosen)
    }

    fn ask(&self, text: &str) -> (Answer, Vec<IdentityId>) {
        self.answer(&QueryReading::new(self.all, text, &self.recipe).expect("a question"))
    }

    /// Returns whether one of its names finds `id`, or a whole of it with the same name.
    fn is_meant(&self, id: IdentityId, name: &str, chosen: &[IdentityId]) -> bool {
        chosen.contains(&id)
            || self
                .all
                .ancestors(id)
                .skip(1)
                .any(|w| chosen.contains(&w) && self.all.called(name, LevelFilter::Auto).contains(&w))
    }
}

/// Returns a question in several letter cases, with and without "the".
fn spellings(name: &str) -> Vec<String> {
    let cases = [name.to_owned(), name.to_uppercase(), name.to_lowercase(), format!(" {name}\t")];
    let with = |article: &str| cases.iter().map(|c| format!("{article}{c}")).collect::<Vec<_>>();
    ["", "the ", "THE  "].into_iter().flat_map(with).collect()
}

/// Asks every name of a scene; returns the number of questions, and the failures.
fn ask_all(scene: &str, all: &Identities) -> (usize, Vec<String>) {
    let (mut asked, mut wrong) = (0, Vec::new());
    for match_by in [MatchBy::Names, MatchBy::Both] {
        let how = Asked::new(all, match_by);
        // Every word of every name is compared, so of long lists only some names are asked.
        let is_long = all.len() >= 200;
        for (id, identity) in all.iter().filter(|(id, _)| match_by == MatchBy::Names || !is_long || id % 200 == 0) {
            let is_full = !is_long || id % 200 == 0;
            let full = all.full_name(id);
            for text in identity.names.iter().chain([&full]).flat_map(|name| spellings(name)) {
                asked += 1;
                let called = all.called(&text, LevelFilter::Auto);
                let is_exact = key(&text) == key(&full);
                let (answer, chosen) = if is_full { how.ask(&text) } else { (Answer::Found(vec![]), called.clone()) };
                let is_right = called.contains(&id) && how.is_meant(id, &text, &chosen);
                let exactly =
                    is_full && matches!(answer, Answer::Found(_)) && chosen == [id] || !is_full && chosen[0] == id;
                if !is_right || is_exact && !exactly {
                    wrong.push(format!("{scene}, {match_by:?}: {text:?} is {id} and finds {chosen:?}"));
                }
            }
        }
    }
    (asked, wrong)
}

#[test]
fn every_name_in_every_scene_asked_verbatim_finds_its_identity() {
    let (scenes, missing) = scenes();
    let (mut asked, mut names, mut wrong) = (0, 0, Vec::new());
    for (scene, all) in &scenes {
        let (n, lost) = ask_all(scene, all);
        println!("{scene}: {} identities, {} not found", all.len(), lost.len());
        names += all.iter().flat_map(|(_, i)| &i.names).count();
        asked += n;
        wrong.extend(lost);
    }
    println!("{names} names of {} scenes, {asked} questions; left out: {missing:?}", scenes.len());
    assert!(wrong.is_empty(), "{} of {asked}:\n{}", wrong.len(), wrong[..wrong.len().min(40)].join("\n"));
}

#[test]
fn names_of_any_words_are_found_in_random_trees() {
    const WORDS: [&str; 44] = [
        "of",
        "on",
        "from",
        "the",
        "a",
        "an",
        "'s",
        "s'",
        "de",
        "von",
        "的",
        "の",
        "left",
        "right",
        "left of",
        "in front of",
        "nearest",
        "it",
        "all",
        "and",
        "not",
        "?",
        "(x)",
        "\"q\"",
        "·",
        " · ",
        "#3",
        "#",
        "2",
        "手柄",
        "button",
        "lamp",
        "red",
        "doll's",
        "eye",
        "Ünï",
        "ß",
        "İ",
        "ﬁ",
        "C++",
        "THE",
        "  ",
        "Σ",
        "ketle",
    ];
    let mut rng = Pcg32::seed_from_u64(18);
    for tree in 0..60 {
        let mut all = Identities::default();
        for _ in 0..rng.random_range(1..24) {
            let whole = rng.random_range(0..=all.len() as u32);
            let level = if whole == NO_IDENTITY { Level::Object } else { Level::Part };
            let name = |rng: &mut Pcg32| {
                let words: Vec<&str> =
                    (0..rng.random_range(1..5)).map(|_| WORDS[rng.random_range(0..WORDS.len())]).collect();
                words.join(if rng.random_range(0..4) == 0 { "" } else { " " })
            };
            let names = (0..rng.random_range(0..3)).map(|_| name(&mut rng)).collect();
            all.add(level, whole, names);
        }
        let how = Asked::new(&all, MatchBy::Both);
        for (id, identity) in all.iter() {
            let full = all.full_name(id);
            assert_eq!(how.ask(&full).1, [id], "tree {tree}: {full:?} of {all:?}");
            for name in identity.names.iter().filter(|name| !key(name).is_empty()) {
                let chosen = how.ask(name).1;
                assert!(
                    how.is_meant(id, name, &chosen),
                    "tree {tree}: {name:?} is {id} and finds {chosen:?} of {all:?}"
                );
            }
        }
    }
}
