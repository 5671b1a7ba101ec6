//! Quality of the built-in segmenter against pictures whose objects and parts are known, and
//! against hand-drawn labels of a real photo. The bars are modest: regions are rough.

use std::path::Path;

use crate::common::data;
use fmlgs::io::labels::{Labels, Region};
use fmlgs::io::{self, Opened};
use fmlgs::pipeline::observer::Silent;
use fmlgs::pipeline::semantics::lifting::regions::Regions;
use fmlgs::pipeline::semantics::lifting::regions::segment::Picture;
use fmlgs::pipeline::semantics::lifting::segmenter::{FoundMask, Segmenter};
use fmlgs::pipeline::synth::{self, SynthOptions};
use fmlgs::scene::{Dataset, Level};

/// Smaller ones are not asked for, px.
const LEAST_PX: usize = 60;

fn dataset(path: &Path) -> Dataset {
    match io::open(path).expect("open") {
        Opened::Dataset(d) => d,
        other => panic!("{} is {other:?}", path.display()),
    }
}

/// Share of the labeled objects, and of the parts, with which some region has an IoU of 0.5.
fn recall(found: &[FoundMask], labels: &[Region]) -> [f64; 2] {
    [Level::Object, Level::Part].map(|level| {
        let asked = labels.iter().filter(|l| l.level == Some(level) && l.mask.area() >= LEAST_PX);
        let hits: Vec<bool> = asked.map(|l| found.iter().any(|f| f.mask.iou(&l.mask) >= 0.5)).collect();
        hits.iter().filter(|h| **h).count() as f64 / hits.len().max(1) as f64
    })
}

#[test]
fn objects_and_parts_of_the_demo_scene() {
    let folder = tempfile::tempdir().expect("folder");
    let options = SynthOptions {
        views: 1,
        held_out: 0,
        width_px: 504,
        height_px: 378,
        samples: 2,
        points: 0,
        ..Default::default()
    };
    let glb = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/demo.glb");
    synth::run(&glb, &options, folder.path(), &mut Silent).expect("render");
    let photo = &dataset(folder.path()).photos[0];
    let labels = Labels::open(folder.path()).expect("labels").of(photo, 504).expect("labels");
    let found = Regions::default().segment(photo, 504, &mut Silent).expect("regions");
    let [objects, parts] = recall(&found, &labels);
    println!("demo: objects {objects:.2}, parts {parts:.2}, {} regions", found.len());
    assert!(objects >= 0.5 && parts >= 0.35, "objects {objects:.2}, parts {parts:.2}");
    // Control: the same pixels in another order are no picture of these objects.
    let pixels = io::photo::load(photo, 504).expect("photo");
    let n = pixels.rgb.len();
    let rgb: Vec<[u8; 3]> = (0..n).map(|i| pixels.rgb[i * 7919 % n]).collect();
    let found = Regions::default().find(&Picture { width: 504, rgb: &rgb, coverage: None, ends: None });
    let [objects, parts] = recall(&found, &labels);
    assert!(objects < 0.1 && parts < 0.1, "shuffled: objects {objects:.2}, parts {parts:.2}");
}

#[test]
fn objects_and_parts_of_the_plush_doll() {
    let (Some(path), Some(drawn)) = (data("plush"), data("plush_labels")) else { return };
    let photos = dataset(&path).photos;
    for view in ["seed", "check"] {
        let labels = Labels::open(&drawn.join(view)).expect("labels");
        let photo = photos.iter().find(|p| labels.has(p)).expect("photo");
        let start = std::time::Instant::now();
        let found = Regions::default().segment(photo, 1024, &mut Silent).expect("regions");
        let secs = start.elapsed().as_secs_f64();
        let [objects, parts] = recall(&found, &labels.of(photo, 1024).expect("labels"));
        println!("{view}: objects {objects:.2}, parts {parts:.2}, {} regions, {secs:.2} s", found.len());
        assert!(objects >= 0.6 && parts >= 0.5, "{view}: objects {objects:.2}, parts {parts:.2}");
    }
}

fn run(arguments: &[&dyn AsRef<std::ffi::OsStr>]) -> Vec<u8> {
    let out = std::process::Command::new(env!("CARGO_BIN_EXE_fmlgs"))
        .args(arguments.iter().map(|a| a.as_ref()))
        .output()
        .expect("it runs");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    out.stdout
}

/// Masks of seven photos that were drawn by hand, all of what they show, and the masks of one other photo.
#[test]
#[ignore = "trains on real photos for ten minutes"]
fn the_masks_of_one_photo_of_the_plush_carry_to_seven_others() {
    let (Some(photos), Some(seed)) = (data("plush"), data("plush_labels/seed")) else { return };
    let folder = tempfile::tempdir().expect("folder");
    let scene = folder.path().join("scene");
    run(&[&"train", &photos, &"--out", &scene, &"--steps", &"2000", &"--max-side", &"504"]);
    run(&[&"preprocess", &scene, &"--masks", &seed, &"--max-seeds", &"1", &"--encoder", &"none"]);
    let drawn = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/plush_labels");
    let mut of: [Vec<f64>; 2] = Default::default();
    for file in std::fs::read_dir(drawn).expect("labels").map(|f| f.expect("a file").path()) {
        if file.extension().is_none_or(|e| e != "json") {
            continue;
        }
        // One folder each: of several photos only those that were held out would count.
        let labels = tempfile::tempdir().expect("folder");
        std::fs::copy(&file, labels.path().join(file.file_name().expect("a name"))).expect("copied");
        let json = run(&[&"eval", &scene, &"--masks", &labels.path(), &"--json"]);
        let json: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
        for unit in json["units"].as_array().expect("queries") {
            of[usize::from(unit["level"] == "part")].push(unit["iou"].as_f64().expect("a number"));
        }
    }
    let [objects, parts] = of.map(|ious| ious.iter().sum::<f64>() / ious.len() as f64);
    println!("mean IoU: objects {objects:.3}, parts {parts:.3}");
    assert!(objects >= 0.85 && parts >= 0.75, "{objects} {parts}");
}
