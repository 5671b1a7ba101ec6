//! The built-in networks give the outputs that they had after training, on either engine.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::*;
use crate::math::stats::{worst, worst_difference};
use crate::models::engine::library_in;
use crate::scene::Mask;

/// Expected embeddings, written by `tools/encoder/export.py`.
#[derive(Deserialize)]
struct Golden {
    text: BTreeMap<String, Vec<f32>>,
    image: BTreeMap<usize, Vec<f32>>,
    cut_16: Vec<f32>,
    cut_64: Vec<f32>,
    cut_rgb: Vec<u8>,
    cut_mask: String,
}

#[derive(Deserialize)]
struct HeldOut {
    side_px: usize,
    across: usize,
    tiles: Vec<Entry>,
}

#[derive(Deserialize)]
struct Entry {
    query: String,
    /// Index of a part's object.
    thing: Option<usize>,
}

fn data(file: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/models").join(file)).unwrap()
}

fn golden() -> Golden {
    serde_json::from_slice(&data("golden.json")).unwrap()
}

fn held_out() -> (HeldOut, Vec<IdentityCrop>) {
    let list: HeldOut = serde_json::from_slice(&data("held_out.json")).unwrap();
    let sheet = image::load_from_memory(&data("held_out.png")).unwrap().to_rgb8();
    let side = 2 * list.side_px;
    let cell = |k: usize| {
        let at = |i: usize| {
            let (x, y) = (k % list.across * list.side_px + i % side / 2, k / list.across * list.side_px + i / side / 2);
            sheet.get_pixel(x as u32, y as u32).0.map(|c| f32::from(c) / 255.0)
        };
        IdentityCrop { side_px: side, rgb: (0..side * side).map(at).collect() }
    };
    let tiles = (0..list.tiles.len()).map(cell).collect();
    (list, tiles)
}

fn cos(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[test]
fn vectors_are_those_of_training() {
    let mut encoder = DemoEncoder::new().unwrap();
    assert_eq!((encoder.name(), encoder.tile_side_px()), ("demo", Some(64)));
    let golden = golden();
    let (_, tiles) = held_out();
    assert!(golden.text.len() >= 3 && golden.image.len() >= 2);
    for (phrase, expected) in &golden.text {
        let got = encoder.text(phrase).unwrap();
        assert_eq!(got.len(), encoder.dimension());
        assert!((cos(&got, &got) - 1.0).abs() < 1e-5);
        assert!(worst_difference(&got, expected) < 1e-4, "{phrase}: {}", worst_difference(&got, expected));
    }
    for (k, expected) in &golden.image {
        let got = encoder.image(&tiles[*k]).unwrap();
        assert!(worst_difference(&got, expected) < 1e-4, "tile {k}: {}", worst_difference(&got, expected));
    }
    // Control: another tile, another phrase.
    assert!(worst_difference(&encoder.image(&tiles[5]).unwrap(), &golden.image[&0]) > 1e-2);
    assert!(worst_difference(&encoder.text("lamp").unwrap(), &golden.text["red mug"]) > 1e-2);
}

#[test]
fn another_of_its_make_is_named_by_its_word_list() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let list = at(WORDS.0);
    let path = list.to_str().unwrap();
    std::fs::write(&list, WORDS.1).unwrap();
    std::fs::write(at(IMAGE.0), IMAGE.1).unwrap();
    let missing = crate::models::encoder(path).err().unwrap().to_string();
    assert!(missing.contains(TEXT.0), "{missing}");
    // Two words exchanged, to see that this list is used.
    let swapped = WORDS.1.replace("\"mug\"", "\"_\"").replace("\"lamp\"", "\"mug\"").replace("\"_\"", "\"lamp\"");
    assert_ne!(swapped, WORDS.1);
    std::fs::write(&list, swapped).unwrap();
    std::fs::write(at(TEXT.0), TEXT.1).unwrap();
    let mut other = crate::models::encoder(path).unwrap();
    assert_eq!(other.name(), path);
    let mut own = DemoEncoder::new().unwrap();
    assert_eq!(other.text("red lamp").unwrap(), own.text("red mug").unwrap());
    assert_ne!(other.text("red mug").unwrap(), own.text("red mug").unwrap());
    std::fs::write(&list, "{").unwrap();
    assert!(matches!(crate::models::encoder(path).err().unwrap(), ModelError::Vocabulary { .. }));
}

#[test]
fn tiles_are_cut_as_in_training() {
    let golden = golden();
    let (pixels, rest) = golden.cut_rgb.as_chunks::<3>();
    assert!(rest.is_empty());
    let rgb: Vec<[f32; 3]> = pixels.iter().map(|p| p.map(|c| f32::from(c) / 255.0)).collect();
    let inside = golden.cut_mask.as_bytes();
    let mask = Mask::from_fn(31, 23, |i| inside[i] == b'#');
    for (side_px, expected) in [(16, &golden.cut_16), (64, &golden.cut_64)] {
        let tile = IdentityCrop::cut(&rgb, &mask, side_px).unwrap();
        let got: Vec<f32> = tile.rgb.as_flattened().iter().step_by(37).copied().collect();
        assert_eq!(got.len(), expected.len());
        assert!(worst_difference(&got, expected) < 2e-5, "{side_px}: {}", worst_difference(&got, expected));
    }
}

#[test]
fn the_order_of_words_matters() {
    let mut encoder = DemoEncoder::new().unwrap();
    let mut v = |phrase: &str| encoder.text(phrase).unwrap();
    let (a, b) = (v("red button of the blue controller"), v("blue button of the red controller"));
    let same = v("the red button of the blue controller");
    assert!(cos(&a, &same) > 0.97, "an article changes little: {}", cos(&a, &same));
    assert!(cos(&a, &b) < cos(&a, &same) - 0.03, "{}", cos(&a, &b));
}

#[test]
fn what_cannot_be_encoded_is_refused() {
    let mut encoder = DemoEncoder::new().unwrap();
    assert_eq!(encoder.unknown_words("the red giraffe of 手柄"), ["giraffe", "手柄"]);
    assert!(matches!(encoder.text("giraffe"), Err(ModelError::NoKnownWord { unknown }) if unknown == ["giraffe"]));
    assert!(matches!(encoder.text(""), Err(ModelError::NoKnownWord { .. })));
    assert!(encoder.text(&"red mug ".repeat(1_250)).is_ok(), "10,000 characters");
    let black = IdentityCrop { side_px: 64, rgb: vec![[0.0; 3]; 64 * 64] };
    assert!(encoder.image(&black).is_ok());
    let small = IdentityCrop { side_px: 32, rgb: vec![[0.0; 3]; 32 * 32] };
    assert!(matches!(encoder.image(&small), Err(ModelError::TileSize { expected_px: 64, .. })));
    let mut poisoned = black;
    poisoned.rgb[7][1] = f32::NAN;
    assert!(matches!(encoder.image(&poisoned), Err(ModelError::TileColor { pixel: 7 })));
}

/// Share of the tiles whose query finds a tile with the same query: objects among objects, parts (their queries
/// shifted toward their objects) among parts.
fn top_1(list: &HeldOut, features: &[Vec<f32>], queries: &[Vec<f32>], parts: bool) -> f64 {
    let among: Vec<usize> = (0..list.tiles.len()).filter(|&k| list.tiles[k].thing.is_some() == parts).collect();
    let right = among.iter().filter(|&&k| {
        let score = |j: usize| cos(&queries[k], &features[j]);
        let best = among.iter().copied().max_by(|&a, &b| score(a).total_cmp(&score(b)));
        best.is_some_and(|b| list.tiles[b].query == list.tiles[k].query)
    });
    right.count() as f64 / among.len() as f64
}

#[test]
fn combinations_that_training_never_saw_are_found() {
    let mut encoder = DemoEncoder::new().unwrap();
    let (list, tiles) = held_out();
    let raw: Vec<Vec<f32>> = tiles.iter().map(|t| encoder.image(t).unwrap()).collect();
    let deviated = |k: usize| match list.tiles[k].thing {
        None => raw[k].clone(),
        Some(thing) => raw[thing].iter().zip(&raw[k]).map(|(whole, part)| 0.3 * whole + 0.7 * part).collect(),
    };
    let features: Vec<Vec<f32>> =
        (0..tiles.len()).map(deviated).map(|v| v.iter().map(|x| x / cos(&v, &v).sqrt()).collect()).collect();
    let queries: Vec<Vec<f32>> = list.tiles.iter().map(|e| encoder.text(&e.query).unwrap()).collect();
    let (things, parts) = (top_1(&list, &features, &queries, false), top_1(&list, &features, &queries, true));
    // Control: the queries of other tiles.
    let mut shuffled = queries.clone();
    shuffled.rotate_left(29);
    let control = top_1(&list, &features, &shuffled, true).max(top_1(&list, &features, &shuffled, false));
    assert!(things > THINGS && parts > PARTS && control < 0.15, "things {things}, parts {parts}, control {control}");
    // The query scores more than every canonical phrase.
    let canonical = ["object", "stuff", "texture", "things"].map(|c| encoder.text(c).unwrap());
    let margin = |q: &[f32], f: &[f32]| cos(q, f) - canonical.iter().map(|c| cos(c, f)).fold(-1.0, f32::max);
    let share = |q: &[Vec<f32>]| {
        let found = q.iter().zip(&features).filter(|(q, f)| margin(q, f) > 0.0).count();
        found as f64 / q.len() as f64
    };
    let (right, wrong) = (share(&queries), share(&shuffled));
    assert!(right > FOUND && wrong < 0.2, "above the canonical phrases: right {right}, wrong {wrong}");
}

#[test]
fn phrases_together_are_as_alone() {
    let mut encoder = DemoEncoder::new().unwrap();
    let phrases = ["red mug", "the wheel of the green toy car", "giraffe", "things", "red mug", "button"];
    let together = encoder.texts(&phrases);
    assert_eq!(together.len(), phrases.len());
    for (phrase, got) in phrases.iter().zip(&together) {
        match (got, encoder.text(phrase)) {
            (Ok(got), Ok(alone)) => assert!(worst_difference(got, &alone) < 1e-6, "{phrase}"),
            (Err(ModelError::NoKnownWord { .. }), Err(ModelError::NoKnownWord { .. })) => {
                assert_eq!(*phrase, "giraffe")
            }
            other => panic!("{phrase}: {other:?}"),
        }
    }
    assert!(encoder.texts(&["giraffe"])[0].is_err() && encoder.texts(&[]).is_empty());
    // Extra padding, as for networks of fixed shapes, changes nothing.
    let row = encoder.words.encode("red mug").unwrap();
    let tokens = Tensor::new(&[1, row.len()], row);
    let network = encoder.text.ready().unwrap();
    let whole = network.unit_rows(vec![("tokens", tokens.into())], "embedding", encoder.words.dimension).unwrap();
    assert!(worst_difference(together[0].as_ref().unwrap(), &whole[0]) < 1e-6);
}

/// Embeddings of the golden phrases and tiles by this process's engine.
fn embeddings() -> Vec<Vec<f32>> {
    let mut encoder = DemoEncoder::new().unwrap();
    let (_, tiles) = held_out();
    let texts: Vec<Vec<f32>> = golden().text.keys().map(|p| encoder.text(p).unwrap()).collect();
    texts.into_iter().chain(tiles[..12].iter().map(|t| encoder.image(t).unwrap())).collect()
}

/// Path of an ONNX Runtime library: the one that is set, or that of the wheel that `tools/setup.sh test` fetches.
fn runtime_library() -> Option<PathBuf> {
    let mut named = ["FMLGS_ONNXRUNTIME", "ORT_DYLIB_PATH"].into_iter().filter_map(std::env::var_os).map(PathBuf::from);
    let fetched = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/onnxruntime/onnxruntime/capi");
    named.find(|p| p.is_file()).or_else(|| library_in(&fetched))
}

/// A process has one engine, so each engine runs in a process of its own: this test again, which then prints.
#[test]
fn both_engines_agree() {
    const PRINTS: &str = "FMLGS_TEST_PRINTS_EMBEDDINGS";
    const MARK: &str = "embeddings: ";
    if std::env::var_os(PRINTS).is_some() {
        println!("\n{MARK}{}", serde_json::to_string(&(engine().unwrap().name(), embeddings())).unwrap());
        return;
    }
    let Some(library) = runtime_library() else {
        println!("skipped: no ONNX Runtime library; name one in FMLGS_ONNXRUNTIME, or install pip");
        return;
    };
    let of = |library: &OsStr| -> (String, Vec<Vec<f32>>) {
        let mut child = std::process::Command::new(std::env::current_exe().unwrap());
        child.args(["--exact", "--nocapture", "models::demo::tests::both_engines_agree"]).env(PRINTS, "1");
        let output = child.env("FMLGS_ONNXRUNTIME", library).env("FMLGS_DEVICE", "cpu").output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        let json = text.lines().find_map(|line| line.strip_prefix(MARK)).unwrap_or_else(|| panic!("{text}"));
        serde_json::from_str(json).unwrap()
    };
    let ((built_in, a), (runtime, b)) = (of("none".as_ref()), of(library.as_os_str()));
    assert!(built_in.starts_with("RTen") && runtime.starts_with("ONNX Runtime"), "{built_in}, {runtime}");
    let largest = |b: &[Vec<f32>]| worst(a.iter().zip(b).map(|(a, b)| worst_difference(a, b)));
    println!("{runtime} against {built_in}: {:e}", largest(&b));
    assert!(a.len() == b.len() && largest(&b) < 1e-4, "{:e}", largest(&b));
    // Control: vectors of other inputs.
    let mut others = b;
    others.rotate_left(1);
    assert!(largest(&others) > 1e-2);
}

/// Thresholds, a little below the values measured after training.
const THINGS: f64 = 0.75;
const PARTS: f64 = 0.68;
const FOUND: f64 = 0.5;
