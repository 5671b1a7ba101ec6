//! The page that `fmlgs export --html` writes, in a real browser: what it draws, what clicks do, what it asks for.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use crate::cli_support::{fmlgs, folder, tiny_splat};
use crate::page_browser::{Browser, ESCAPE};
use fmlgs::io::{SceneFolder, semantic_map, trained};
use image::{GrayImage, RgbImage};
use serde_json::{Value, json};

/// Size of the window in px.
const SIZE: [u32; 2] = [480, 360];
/// Hostile name of an object.
const HOSTILE: &str = "</script><img src=x onerror=\"window.broken = 1\"><b>kettle";
/// Least PSNR of the page's picture against this program's, dB, and how much less another camera's must have.
const PSNR_DB: (f64, f64) = (32.0, 10.0);
/// Least IoU of the highlighted pixels with the mask that this program draws, and the most with that of another object.
const IOU: (f64, f64) = (0.85, 0.1);
/// Least difference between channels of highlighted pixels; the rest is gray.
const CHROMA: u8 = 36;

/// The scene that ships with the program, its kettle called by something [`HOSTILE`].
fn demo_scene(folder: &Path) -> PathBuf {
    let bytes = include_bytes!("../../assets/demo/demo.zip");
    zip::ZipArchive::new(Cursor::new(bytes)).unwrap().extract(folder).unwrap();
    let scene = folder.join("scene");
    let read = trained::load(&scene).unwrap();
    let mut map = semantic_map::load(&scene, read.state.as_deref(), &read.cloud).unwrap().unwrap();
    let kettle = map.identities.iter().find(|(_, i)| i.names[0] == "kettle").unwrap().0;
    map.identities.get_mut(kettle).unwrap().names = vec![HOSTILE.to_owned()];
    SceneFolder::hold(&scene, "the test").unwrap().save(&read.info, &read.cloud, Some(&map)).unwrap();
    scene
}

/// A page and the scene that it shows.
struct Shown {
    browser: Browser,
    folder: tempfile::TempDir,
    scene: String,
}

impl Shown {
    /// The file `name` in the test's folder.
    fn at(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }

    /// The page's camera, as a file of it.
    fn camera(&self) -> String {
        let camera = self.browser.run("return window.fmlgs.camera()");
        std::fs::write(self.at("camera.json"), camera.to_string()).unwrap();
        self.at("camera.json")
    }

    /// Draws the scene with this program from a camera.
    fn drawn(&self, camera: &str) -> RgbImage {
        let (size, out) = (format!("{}x{}", SIZE[0], SIZE[1]), self.at("drawn.png"));
        fmlgs(&["render", &self.scene, "--camera", camera, "--size", &size, "--backend", "cpu", "--out", &out, "-q"])
            .ok();
        image::open(out).unwrap().to_rgb8()
    }

    /// The mask that this program finds from the page's camera.
    fn mask(&self, name: &str) -> GrayImage {
        let out = self.at("mask.png");
        fmlgs(&["query", &self.scene, name, "--camera", &self.camera(), "--mask", &out]).ok();
        image::open(out).unwrap().to_luma8()
    }

    /// Picture of the page without its controls.
    fn alone(&self) -> RgbImage {
        self.browser.rest();
        self.browser.picture()
    }

    fn text(&self, id: &str) -> Value {
        self.browser.run(&format!("return document.getElementById('{id}').textContent"))
    }
}

fn psnr(a: &RgbImage, b: &RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let sum: f64 = a.iter().zip(b.iter()).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
    10.0 * (255.0 * 255.0 * a.len() as f64 / sum).log10()
}

/// IoU of the highlighted pixels with a mask.
fn iou(picture: &RgbImage, mask: &GrayImage) -> f64 {
    assert_eq!(picture.dimensions(), mask.dimensions());
    let chroma = |p: &image::Rgb<u8>| p.0.iter().max().unwrap() - p.0.iter().min().unwrap();
    let (mut both, mut any) = (0.0, 0.0);
    for (p, m) in picture.pixels().zip(mask.pixels()) {
        let (lit, wanted) = (chroma(p) > CHROMA, m.0[0] > 127);
        both += f64::from(u8::from(lit && wanted));
        any += f64::from(u8::from(lit || wanted));
    }
    both / f64::max(any, 1.0)
}

/// A pixel of the mask that is as far from its border as any.
fn innermost(mask: &GrayImage) -> (u32, u32) {
    let [width, height] = SIZE.map(i64::from);
    let inside = |x: i64, y: i64| {
        (0..width).contains(&x) && (0..height).contains(&y) && mask.get_pixel(x as u32, y as u32).0[0] > 127
    };
    let room = |&(x, y): &(i64, i64)| {
        (1..60)
            .take_while(|r| [(*r, 0), (-r, 0), (0, *r), (0, -r)].iter().all(|(dx, dy)| inside(x + dx, y + dy)))
            .count()
    };
    let all = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).filter(|(x, y)| inside(*x, *y));
    all.max_by_key(room).map(|(x, y)| (x as u32, y as u32)).expect("it is seen")
}

#[test]
fn the_page_shows_selects_and_plays_what_the_program_draws() {
    let Some(browser) = Browser::open(SIZE[0], SIZE[1]) else { return };
    let folder = folder();
    let scene = demo_scene(folder.path()).to_str().unwrap().to_owned();
    let shown = Shown { browser, folder, scene };
    let Shown { browser, .. } = &shown;
    // From the first photo's camera to another one's, in a file whose name is markup as well.
    let info = fmlgs(&["info", &shown.scene, "--json"]).ok().json();
    let key = |k: usize| {
        let camera = &info["cameras"][k]["camera"];
        let m: Vec<f64> = serde_json::from_value(camera["world_from_camera"].clone()).unwrap();
        let rows: Vec<[f64; 3]> = (0..3).map(|r| [m[r], m[r + 3], m[r + 6]]).collect();
        json!({ "center": camera["center"], "world_from_camera": rows, "fov_y_rad": 0.7 })
    };
    let path = json!({ "format": "fmlgs-camera-path", "version": 1, "closed": false, "fps": 30.0, "seconds": 1.0,
        "keys": [key(0), key(9)] });
    let path_file = shown.at("<img src=x onerror='window.broken = 1'>.json");
    std::fs::write(&path_file, path.to_string()).unwrap();
    let page = shown.at("the page.html");
    let told = fmlgs(&["export", &shown.scene, "--html", &page, "--path", &path_file, "--title", HOSTILE, "-q"]).ok();
    assert!(told.stdout.contains("60,000 Gaussians · 16 objects · 102 parts, 1 camera path"), "{}", told.stdout);
    browser.load(Path::new(&page));

    // It starts as the first photo was taken, and draws what this program draws.
    browser.key("p");
    let picture = shown.alone();
    let camera = browser.run("return window.fmlgs.camera()");
    for (k, v) in info["cameras"][0]["camera"]["center"].as_array().unwrap().iter().enumerate() {
        assert!((camera["center"][k].as_f64().unwrap() - v.as_f64().unwrap()).abs() < 1e-6, "{camera}");
    }
    let (ours, other) = (psnr(&picture, &shown.drawn("0")), psnr(&picture, &shown.drawn("1")));
    println!("start view: {ours:.2} dB; another camera: {other:.2} dB");
    assert!(ours > PSNR_DB.0 && other < PSNR_DB.0 - PSNR_DB.1, "{ours} dB, another camera {other} dB");

    // A click on the picture selects the object there, another one its part.
    let (x, y) = innermost(&shown.mask("cookie jar"));
    browser.click_at(x, y);
    assert_eq!(shown.text("chosen-name"), "cookie jar");
    let picture = shown.alone();
    let (right, wrong) = (iou(&picture, &shown.mask("cookie jar")), iou(&picture, &shown.mask("teddy bear")));
    println!("clicked: IoU {right:.3}; another object: {wrong:.3}");
    assert!(right > IOU.0 && wrong < IOU.1, "IoU {right}, another object {wrong}");
    browser.click_at(x, y);
    let part = shown.text("chosen-name");
    assert!(part.as_str().unwrap().ends_with(" · cookie jar"), "{part}");
    browser.key(ESCAPE);
    browser.key(ESCAPE);
    assert_eq!(browser.run("return window.fmlgs.selected()"), json!([]));

    // A name in the list flies to its object and highlights it.
    browser.click("#list [title='teddy bear']");
    assert_eq!(shown.text("chosen-name"), "teddy bear");
    browser.key("p");
    let picture = shown.alone();
    let (right, wrong) = (iou(&picture, &shown.mask("teddy bear")), iou(&picture, &shown.mask("cookie jar")));
    println!("by name: IoU {right:.3}; another object: {wrong:.3}");
    assert!(right > IOU.0 && wrong < IOU.1, "IoU {right}, another object {wrong}");
    browser.key("p");

    // The search leaves what has a word that begins so, under what it is a part of.
    let found = "const words = document.getElementById('words'); words.value = 'ear'; words.oninput(); \
        const rows = [...document.querySelectorAll('#list .name')].filter((row) => row.offsetParent); \
        words.value = ''; words.oninput(); return rows.map((row) => row.title);";
    let ears = ["teddy bear", "left ear · teddy bear", "right ear · teddy bear"];
    assert_eq!(browser.run(found), json!(ears));

    // What is hidden is not drawn, and is shown again.
    browser.key("h");
    browser.key("p");
    let without = iou(&shown.alone(), &shown.mask("teddy bear"));
    println!("hidden: IoU {without:.3}");
    assert!(without < IOU.1, "IoU {without}");
    browser.key("h");
    let again = psnr(&shown.alone(), &picture);
    println!("shown again: {again:.2} dB");
    assert!(again > PSNR_DB.0, "{again} dB");
    browser.key("p");

    // The camera path ends at its last key.
    browser.key(ESCAPE);
    browser.click("#play");
    browser.wait("the path ends", "return document.getElementById('time').value", &json!("1"));
    browser.key("p");
    let picture = shown.alone();
    let (ours, other) = (psnr(&picture, &shown.drawn(&shown.camera())), psnr(&picture, &shown.drawn("0")));
    println!("end of the path: {ours:.2} dB; its start: {other:.2} dB");
    assert!(ours > PSNR_DB.0 && other < PSNR_DB.0 - PSNR_DB.1, "{ours} dB, its start {other} dB");
    let end = browser.run("return window.fmlgs.camera()");
    for (k, v) in info["cameras"][9]["camera"]["center"].as_array().unwrap().iter().enumerate() {
        assert!((end["center"][k].as_f64().unwrap() - v.as_f64().unwrap()).abs() < 1e-5, "{end}");
    }

    // Names are text, nothing was complained about, and nothing was asked of anybody.
    let list =
        browser.run("return document.getElementById('list').innerText || document.getElementById('list').textContent");
    assert!(list.as_str().unwrap().contains(HOSTILE), "{list}");
    asks_nobody(browser);
}

/// Sentences of other tests, and relations between all sorts of objects.
fn sentences() -> Vec<String> {
    let told: toml::Value = toml::from_str(include_str!("../data/demo_questions.toml")).unwrap();
    let first = |row: &toml::Value| row[0].as_str().unwrap().to_owned();
    let mut all: Vec<String> = told["questions"].as_array().unwrap().iter().map(first).collect();
    let said = |line: &str| serde_json::from_str::<Value>(line).unwrap()["say"].as_str().unwrap().to_owned();
    all.extend(include_str!("../data/ordinary_sentences.jsonl").lines().map(said));
    let things = ["kettle", "mug", "lamp", "teddy bear", "green book", "camera", "toy car", "cookie jar"];
    for (i, a) in things.iter().enumerate() {
        let b = things[(i * 3 + 1) % things.len()];
        for relation in ["left of", "right of", "behind", "in front of", "next to", "on"] {
            all.push(format!("the thing {relation} the {a}"));
            all.push(format!("the {a} {relation} the {b}"));
        }
        all.extend([format!("everything but the {a}"), format!("the largest part of the {a}"), format!("{a} or {b}")]);
    }
    // A table of phrases has each once, without those that are remarks in it.
    let mut known = std::collections::HashSet::new();
    all.retain(|text| !text.trim().is_empty() && !text.starts_with('#') && known.insert(text.trim().to_lowercase()));
    all
}

#[test]
fn the_page_answers_as_the_program_does() {
    let Some(browser) = Browser::open(SIZE[0], SIZE[1]) else { return };
    let folder = folder();
    let scene = demo_scene(folder.path()).to_str().unwrap().to_owned();
    let shown = Shown { browser, folder, scene };
    let browser = &shown.browser;
    let page = shown.at("page.html");
    fmlgs(&["export", &shown.scene, "--html", &page, "-q"]).ok();
    browser.load(Path::new(&page));
    browser.wait("it can be asked", "return typeof window.fmlgs.ask", &json!("function"));

    let all = sentences();
    std::fs::write(shown.at("phrases.txt"), all.join("\n")).unwrap();
    let by_program = |camera: &str| {
        let phrases = shown.at("phrases.txt");
        let table = fmlgs(&["query", &shown.scene, "--phrases", &phrases, "--camera", camera, "--json", "-q"]);
        let rows = table.json()["rows"].clone();
        let told =
            |row: &Value| (row["verdict"].as_str().unwrap().to_owned(), row["answer"].as_str().unwrap().to_owned());
        rows.as_array().unwrap().iter().map(told).collect::<Vec<_>>()
    };
    // In the page's words, what the program says of the same view.
    let by_page = |text: &String| {
        let answer = browser.run(&format!("return window.fmlgs.ask({})", json!(text)));
        let found = answer["found"].as_array().cloned().unwrap_or_default();
        let names = format!("return {}.map((id) => window.fmlgs.name(id)).join('; ')", json!(found));
        let verdict = if found.is_empty() {
            "not found"
        } else if answer["ambiguous"] == json!(true) {
            "ambiguous"
        } else {
            "found"
        };
        (verdict.to_owned(), browser.run(&names).as_str().unwrap().to_owned())
    };
    let (told, other) = (by_program(&shown.camera()), by_program("9"));
    let paged: Vec<_> = all.iter().map(by_page).collect();
    assert_eq!((told.len(), other.len()), (all.len(), all.len()));
    let differing = |program: &[(String, String)]| {
        let rows = all.iter().zip(program).zip(&paged);
        // What is not found has offers, which are no answers.
        let same = |a: &(String, String), b: &(String, String)| a.0 == b.0 && (a.0 == "not found" || a.1 == b.1);
        rows.filter(|((_, a), b)| !same(a, b)).map(|(text, b)| format!("{text:?}, page: {b:?}")).collect::<Vec<_>>()
    };
    println!("{} sentences, {} of another view differ", all.len(), differing(&other).len());
    assert!(all.len() > 150 && differing(&other).len() > 5, "{:#?}", differing(&other));
    assert_eq!(differing(&told), Vec::<String>::new());

    // What is typed is shown, with the words that are not understood underlined.
    let ask = |text: &str| {
        browser.run(&format!("words.value = {}; words.oninput();", json!(text)));
        browser
            .run("return document.getElementById('answer').hidden ? '' : document.getElementById('answer').innerText")
    };
    let told = ask("the smallest book on the table");
    assert!(told.as_str().unwrap().starts_with("orange book"), "{told}");
    assert_eq!(shown.text("chosen-name"), "orange book");
    assert!(ask("both books").as_str().unwrap().starts_with("2 things"));
    assert_eq!(browser.run("return window.fmlgs.selected().length"), 2);
    ask("the mug left of the zzyzx");
    assert_eq!(browser.run("return document.querySelector('#answer mark').textContent"), "zzyzx");
    assert_eq!(browser.run("return window.fmlgs.selected()"), json!([]));
    assert_eq!(ask("teddy be"), "", "beginnings of names are listed");
    asks_nobody(browser);
}

#[test]
fn a_page_of_a_bare_splat_says_that_it_has_no_objects() {
    let Some(browser) = Browser::open(SIZE[0], SIZE[1]) else { return };
    let folder = folder();
    let splat = tiny_splat(&folder.path().join("three.ply"));
    let (splat, page) = (splat.to_str().unwrap(), folder.path().join("three.html"));
    fmlgs(&["export", splat, "--html", page.to_str().unwrap(), "-q"]).ok();
    browser.load(&page);
    let text = |selector: &str| browser.run(&format!("return document.querySelector('{selector}').textContent"));
    assert!(text("#list").as_str().unwrap().starts_with("No objects in this scene"), "{}", text("#list"));
    assert_eq!((text("h1"), text("#facts")), (json!("three"), json!("3 Gaussians")));
    browser.key("p");
    browser.rest();
    let colors = |p: &image::Rgb<u8>| (0..3).find(|k| (0..3).all(|j| j == *k || p.0[*k] > p.0[j].saturating_add(60)));
    let mut seen = [0; 3];
    browser.picture().pixels().filter_map(colors).for_each(|k| seen[k] += 1);
    assert!(seen.iter().all(|n| *n > 300), "red, green and blue pixels: {seen:?}");
    asks_nobody(&browser);
}

/// Asserts that the page makes no outside request: it has requested only itself and what it made itself, names have run
/// no script, and its policy refuses other requests.
fn asks_nobody(browser: &Browser) {
    let (complaints, requests) = browser.complaints_and_requests();
    assert_eq!(complaints, Vec::<String>::new());
    let own = |address: &String| ["file:", "blob:", "data:"].iter().any(|own| address.starts_with(own));
    assert!(!requests.is_empty() && requests.iter().all(own), "{requests:?}");
    assert_eq!(requests.iter().filter(|a| a.starts_with("file:")).count(), 1, "the page alone: {requests:?}");
    let entries = browser.run("return performance.getEntriesByType('resource').map((e) => e.name)");
    let entries: Vec<String> = serde_json::from_value(entries).unwrap();
    assert!(entries.iter().all(own), "{entries:?}");
    assert_eq!(browser.run("return window.broken ?? null"), Value::Null, "a name ran a script");
    let refused = browser.run_async(
        "const done = arguments[0]; document.addEventListener('securitypolicyviolation', (e) => done(e.effectiveDirective), \
         { once: true }); fetch('http://127.0.0.1:9/').catch(() => {});",
    );
    assert_eq!(refused, "connect-src");
}
