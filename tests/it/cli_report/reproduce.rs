//! `fmlgs reproduce` from photos to the table, on rendered scenes that are laid out like each data set.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::{Duration, Instant, SystemTime};

use serde_json::Value;

use super::layouts::Rendered;
use crate::cli_support::{Done, command, copy, folder};

/// Photos of a scene.
const VIEWS: usize = 24;
/// Photos with labels; the first one's are the masks.
const LABELED: [usize; 5] = [0, 5, 10, 15, 20];

/// The photos of one scene, rendered once for all tests.
fn desk() -> &'static Rendered {
    static DESK: OnceLock<(tempfile::TempDir, Rendered)> = OnceLock::new();
    let make = || {
        let folder = folder();
        let rendered = Rendered::new("desk", VIEWS, folder.path());
        (folder, rendered)
    };
    &DESK.get_or_init(make).1
}

struct Table<'a> {
    name: &'a str,
    data: &'a Path,
    out: PathBuf,
}

impl Table<'_> {
    fn arguments<'a>(&'a self, more: &[&'a str]) -> Vec<&'a str> {
        let mut all = vec!["reproduce", self.name, self.data.to_str().unwrap(), "--out", self.out.to_str().unwrap()];
        all.extend(["--encoder", "demo", "--max-side", "160", "-q"]);
        all.extend(more);
        all
    }

    fn run(&self, more: &[&str]) -> Done {
        run(&self.arguments(more))
    }

    fn scores(&self, document: &Value, row: &str, metric: &str) -> Vec<f64> {
        let scenes = document["scenes"].as_array().unwrap();
        let rows = scenes.iter().flat_map(|s| s["rows"].as_array().unwrap()).filter(|r| r["name"] == row);
        let scores = rows.flat_map(|r| r["scores"][metric].as_array().unwrap_or_else(|| panic!("{row}: {metric}")));
        scores.map(|v| v.as_f64().unwrap()).collect()
    }

    fn mean(&self, document: &Value, row: &str, metric: &str) -> f64 {
        let all = self.scores(document, row, metric);
        all.iter().sum::<f64>() / all.len() as f64
    }
}

/// Without any network beside the program's own.
fn run(arguments: &[&str]) -> Done {
    let mut command = command(arguments);
    command.env("FMLGS_ONNXRUNTIME", "none").env("FMLGS_MODELS", "/nonexistent");
    command.output().unwrap().into()
}

fn changed(file: &Path) -> SystemTime {
    fs::metadata(file).unwrap().modified().unwrap()
}

const MIOU: &str = "mean IoU, %";

#[test]
fn lerf_scenes_become_a_table_that_resumes() {
    let folder = folder();
    let data = folder.path().join("lerf_ovs");
    desk().lerf_ovs(&data, "teatime", &LABELED);
    desk().lerf_ovs(&data, "my_desk", &LABELED[..3]);
    let table = Table { name: "lerf-ovs", data: &data, out: folder.path().join("out") };
    let how = ["--masks", "labels", "--steps", "150"];

    // Killed when the first scene was trained; then it goes on.
    let mut child = command(&table.arguments(&how)).env("FMLGS_ONNXRUNTIME", "none").spawn().unwrap();
    let first = table.out.join("my_desk/trained.json");
    let deadline = Instant::now() + Duration::from_secs(300);
    while !first.exists() && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let trained = changed(&first);
    let document = table.run(&[&how[..], &["--json"]].concat()).ok().json();
    assert_eq!(changed(&first), trained, "what was done is not done again");

    let ours = table.mean(&document, "this program", MIOU);
    let localized = table.mean(&document, "this program", "localization accuracy, %");
    println!("{}", fs::read_to_string(table.out.join("table.md")).unwrap());
    // The protocol smooths over 30 px, which is much of so small a photo.
    assert!(ours > 35.0 && localized > 20.0, "{ours} {localized}");
    let scenes = document["scenes"].as_array().unwrap();
    let views = |k: usize| scenes[k]["views"].as_array().unwrap().len();
    assert_eq!((scenes.len(), views(0), views(1)), (2, 2, 4), "the first labeled photo gave the masks");
    assert!(scenes.iter().all(|s| s["trained_on"] == false && s["found"]["map_bytes"].as_u64().unwrap() < 3_000_000));
    // The means of scenes and of queries are told apart.
    let metric = document["metrics"].as_array().unwrap().iter().find(|m| m["metric"] == MIOU).unwrap();
    let rows = metric["rows"].as_array().unwrap();
    let row = |name: &str| rows.iter().find(|r| r["name"] == name).unwrap();
    let (macro_mean, micro) = (&row("this program")["mean_of_scenes"], &row("this program")["mean_of_queries"]);
    assert!((micro.as_f64().unwrap() - ours).abs() < 1e-9 && micro != macro_mean);
    assert_eq!(
        (row("FMLGS")["printed"].as_bool(), row("FMLGS")["scenes"]["teatime"].as_f64()),
        (Some(true), Some(81.8))
    );
    let text = fs::read_to_string(table.out.join("table.md")).unwrap();
    for said in [
        "langsplat",
        "150 steps",
        "'demo' (knows made-up",
        "held out of training",
        "labeled photos that are not compared",
    ] {
        assert!(text.contains(said), "{said} in\n{text}");
    }

    // A label that is gone changes nothing for the others: they are matched by name, not by place.
    let again = |what: &str| {
        fs::remove_file(table.out.join(what).join("result.json")).unwrap();
        table.run(&[&how[..], &["--json"]].concat()).ok().json()
    };
    let name = |view: usize| data.join(format!("label/teatime/frame_{:05}.json", view + 1));
    let teatime = |document: &Value| {
        let scene = document["scenes"].as_array().unwrap().iter().find(|s| s["scene"] == "teatime").unwrap().clone();
        let row = scene["rows"].as_array().unwrap().iter().find(|r| r["name"] == "this program").unwrap().clone();
        row["scores"][MIOU].as_array().unwrap().clone()
    };
    let kept = fs::read(name(10)).unwrap();
    fs::remove_file(name(10)).unwrap();
    let (all, fewer) = (teatime(&document), teatime(&again("teatime")));
    let seen = |view: usize| desk().areas(view).values().filter(|n| **n > 0).count();
    assert!(seen(10) > 2 && all.len() <= LABELED[1..].iter().map(|v| seen(*v)).sum());
    let of_first = all.len() - fewer.len();
    assert!(
        of_first > 2
            && (0..=fewer.len()).any(|at| {
                let rest: Vec<&Value> = all[..at].iter().chain(&all[at + of_first..]).collect();
                rest.iter().zip(&fewer).all(|(a, b)| **a == *b)
            })
    );
    fs::write(name(10), kept).unwrap();

    // The control: labels of other photos.
    let label = |view: usize| -> Value { serde_json::from_slice(&fs::read(name(view)).unwrap()).unwrap() };
    let right = LABELED.map(label);
    for (k, view) in LABELED.into_iter().enumerate() {
        let mut wrong = right[(k + 1) % LABELED.len()].clone();
        wrong["info"]["name"] = right[k]["info"]["name"].clone();
        fs::write(name(view), wrong.to_string()).unwrap();
    }
    let mean = |values: &[Value]| values.iter().map(|v| v.as_f64().unwrap()).sum::<f64>() / values.len() as f64;
    let (right, wrong) = (mean(&all), mean(&teatime(&again("teatime"))));
    assert!(wrong < 0.6 * right, "labels of other photos: {wrong}, the photos' own: {right}");

    // What is there is never overwritten by other settings.
    let refused = table.run(&["--masks", "labels", "--steps", "151"]).fails_with(2);
    assert!(
        refused.stderr.contains("steps: 150 there, 151 now") && refused.stderr.contains("--out"),
        "{}",
        refused.stderr
    );
    let elsewhere = Table { out: data.clone(), ..table };
    assert!(elsewhere.run(&how).fails_with(2).stderr.contains("choose another name"));
}

#[test]
fn an_object_of_a_spin_nerf_scene_is_found_among_regions() {
    let folder = folder();
    let data = folder.path().join("spin");
    desk().spin_nerf(&data, "orange_controller", "orange controller");
    let table = Table { name: "spin-nerf", data: &data, out: folder.path().join("out") };
    let measure = || {
        // Labels have no names: the scene's is asked for.
        let document = table.run(&["--masks", "regions", "--steps", "150", "--json"]).ok().json();
        println!("{}", fs::read_to_string(table.out.join("table.md")).unwrap());
        assert_eq!(
            document["scenes"][0]["views"].as_array().unwrap().len(),
            VIEWS / 8,
            "of all with labels, an eighth"
        );
        [MIOU, "pixel accuracy, %"].map(|metric| table.mean(&document, "this program", metric))
    };
    let [iou, accuracy] = measure();
    assert!(iou > 20.0 && accuracy > 85.0, "{iou} {accuracy}");
    // The control: masks of another thing.
    fs::remove_file(table.out.join("orange_controller/result.json")).unwrap();
    desk().spin_labels(&data.join("orange_controller"), "white controller");
    let [wrong, _] = measure();
    assert!(wrong < 0.3 * iou, "masks of another thing: {wrong}, its own: {iou}");
}

#[test]
fn classes_of_a_3d_ovs_scene_are_told_apart() {
    let folder = folder();
    let data = folder.path().join("3dovs");
    desk().ovs_3d(&data, "bench", &LABELED);
    let table = Table { name: "3d-ovs", data: &data, out: folder.path().join("out") };
    let how = ["--masks", "labels", "--steps", "150", "--json"];
    // Poses alone tell of the same cameras.
    let bare = folder.path().join("bare");
    copy(&data.join("bench/images"), &bare.join("images"));
    fs::copy(data.join("bench/poses_bounds.npy"), bare.join("poses_bounds.npy")).unwrap();
    let cameras = |scene: &Path| {
        let info = run(&["info", scene.to_str().unwrap(), "--json"]).ok().json();
        let of = |c: &Value| {
            c["camera"]["world_from_camera"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
        };
        info["cameras"].as_array().unwrap().iter().flat_map(|c| -> Vec<f64> { of(c) }).collect::<Vec<f64>>()
    };
    let (poses, colmap) = (cameras(&bare), cameras(&data.join("bench")));
    assert!(poses.len() == 9 * VIEWS && poses.iter().zip(&colmap).all(|(a, b)| (a - b).abs() < 1e-6));
    let document = table.run(&how).ok().json();
    println!("{}", fs::read_to_string(table.out.join("table.md")).unwrap());
    let metrics = [MIOU, "mean IoU by arg-max over all classes, %"];
    let [own, winner] = metrics.map(|m| table.mean(&document, "this program", m));
    assert!(own > 20.0 && winner > 20.0, "{own} {winner}");

    // The control: masks under another class's name.
    let segments = data.join("bench/segmentations");
    for view in &LABELED[1..] {
        let folder = segments.join(format!("{view:02}"));
        let mut files: Vec<PathBuf> = fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path()).collect();
        files.sort();
        let masks: Vec<Vec<u8>> = files.iter().map(|f| fs::read(f).unwrap()).collect();
        files.iter().zip(masks.iter().cycle().skip(1)).for_each(|(f, mask)| fs::write(f, mask).unwrap());
    }
    fs::remove_file(table.out.join("bench/result.json")).unwrap();
    let document = table.run(&how).ok().json();
    let wrong = table.mean(&document, "this program", MIOU);
    assert!(wrong < 0.4 * own, "classes exchanged: {wrong}, right: {own}");
}

#[test]
fn sentences_of_a_ref_lerf_scene_find_their_objects() {
    let folder = folder();
    let data = folder.path().join("ref_lerf");
    desk().ref_lerf(&data, "teatime", &LABELED);
    let table = Table { name: "ref-lerf", data: &data, out: folder.path().join("out") };
    let how = ["--masks", "labels", "--steps", "150", "--json"];
    let document = table.run(&how).ok().json();
    let text = fs::read_to_string(table.out.join("table.md")).unwrap();
    println!("{text}");
    let scene = &document["scenes"][0];
    let views: Vec<&str> = scene["views"].as_array().unwrap().iter().map(|v| v.as_str().unwrap()).collect();
    let is_test = |(name, view): (&&str, &usize)| name.ends_with(&format!("frame_{view:05}.jpg"));
    assert!(views.len() == 4 && views.iter().zip(&LABELED[1..]).all(is_test), "{views:?}");
    assert_eq!(scene["trained_on"], false);
    let ious = table.scores(&document, "this program", MIOU);
    let right = table.mean(&document, "this program", MIOU);
    // A thing of a few pixels has none at the size that is compared, and then is not asked for.
    let asked: usize = LABELED[1..].iter().map(|v| 2 * desk().areas(*v).values().filter(|n| **n > 0).count()).sum();
    assert!(ious.len() <= asked && 2 * ious.len() > asked, "{} of {asked}", ious.len());
    assert!(right > 30.0, "{right}");
    for (least, metric) in [(25.0, "sentences with IoU over 0.25, %"), (50.0, "sentences with IoU over 0.5, %")] {
        let over = table.scores(&document, "this program", metric);
        assert_eq!(over.len(), ious.len());
        assert!(ious.iter().zip(&over).all(|(iou, over)| (*iou > least) == (*over > 50.0)), "{ious:?} {over:?}");
    }
    let miou = document["metrics"].as_array().unwrap().iter().find(|m| m["metric"] == MIOU).unwrap();
    let printed = miou["rows"].as_array().unwrap().iter().find(|r| r["name"] == "ReferSplat").unwrap();
    assert_eq!((&printed["printed"], &printed["scenes"]["teatime"]), (&true.into(), &31.3.into()));
    assert!(text.contains("the real data set was never tried"), "{text}");

    // The control: each sentence under another object. Training is not repeated.
    let trained = changed(&table.out.join("teatime/trained.json"));
    fs::remove_file(table.out.join("teatime/result.json")).unwrap();
    desk().ref_lerf_lists(&data.join("teatime"), &LABELED, 1);
    let wrong = table.mean(&table.run(&how).ok().json(), "this program", MIOU);
    assert!(wrong < 0.3 * right, "sentences exchanged: {wrong}, right: {right}");
    assert_eq!(changed(&table.out.join("teatime/trained.json")), trained);
}

#[test]
fn the_ablation_of_parts_has_all_its_rows() {
    let folder = folder();
    let data = folder.path().join("parts");
    fs::create_dir_all(&data).unwrap();
    copy(&desk().folder, &data.join("desk"));
    let table = Table { name: "part-ablation", data: &data, out: folder.path().join("out") };
    let how = ["--masks", "labels", "--steps", "200", "--json"];
    let document = table.run(&how).ok().json();
    println!("{}", fs::read_to_string(table.out.join("table.md")).unwrap());
    let rows = ["none", "ME", "ME + SD", "ME + SD + ML", "ME + SD + part and whole at once (this program)"];
    let recall = rows.map(|row| table.mean(&document, row, "recall of parts, %"));
    println!("{recall:?}");
    assert!(recall[0] < recall[1] && recall[4] > recall[0] + 5.0, "{recall:?}");
    let metric = document["metrics"].as_array().unwrap().iter().find(|m| m["metric"] == "recall of parts, %").unwrap();
    let printed: Vec<f64> = metric["rows"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|r| r["printed"] == true)
        .map(|r| r["mean_of_scenes"].as_f64().unwrap())
        .collect();
    assert_eq!(printed, [1.1, 5.3, 41.6, 66.7]);
}

#[test]
fn folders_that_are_not_laid_out_so_are_told_with_what_is_missing() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let told = |table: &str, data: &Path, more: &[&str]| -> String {
        let table = Table { name: table, data, out: at("out") };
        let done = table.run(&[&["--masks", "labels"], more].concat()).fails_with(1);
        assert!(!at("out").exists(), "nothing is made");
        done.stderr
    };
    let expect = |text: String, parts: &[&str]| parts.iter().for_each(|p| assert!(text.contains(p), "{p} in {text}"));
    expect(told("lerf-ovs", &at("none"), &[]), &["none: no such folder", "DATA/label/SCENE/frame_00001.json"]);
    fs::create_dir_all(at("lerf/teatime/images")).unwrap();
    expect(told("lerf-ovs", &at("lerf"), &[]), &["lerf/label: no such folder", "sparse/0"]);
    fs::create_dir_all(at("lerf/label/ramen")).unwrap();
    expect(told("lerf-ovs", &at("lerf"), &[]), &["lerf/ramen: no such folder, but labels"]);
    fs::create_dir_all(at("lerf/label/teatime")).unwrap();
    expect(told("lerf-ovs", &at("lerf"), &["--scene", "kitchen"]), &["kitchen", "there are ramen, teatime"]);
    fs::create_dir_all(at("spin/fork/images_4/label")).unwrap();
    expect(told("spin-nerf", &at("spin"), &[]), &["fork/poses_bounds.npy: no such file", "images_4/label"]);
    expect(told("spin-nerf", &at("spin/fork"), &[]), &["it holds no scene with labels"]);
    fs::create_dir_all(at("ovs/bed/segmentations")).unwrap();
    fs::write(at("ovs/bed/poses_bounds.npy"), "").unwrap();
    expect(told("3d-ovs", &at("ovs"), &[]), &["bed/segmentations/classes.txt: no such file"]);
    expect(told("part-ablation", &at("ovs"), &[]), &["name wholes and parts"]);
    fs::create_dir_all(at("ref/ramen/images")).unwrap();
    expect(told("ref-lerf", &at("ref"), &[]), &["it holds no scene with labels", "json/test_json"]);
    let lists = at("ref/ramen/json/test_json");
    fs::create_dir_all(&lists).unwrap();
    expect(told("ref-lerf", &at("ref"), &[]), &["ref/ramen: it has no sentences of a test photo", "DATA/SCENE/mask"]);
    let object = r#"{"object": [{"category": "egg", "segmentation": "egg.png", "sentence": ["an egg"]}]}"#;
    fs::write(lists.join("frame_00006.json"), object).unwrap();
    expect(
        told("ref-lerf", &at("ref"), &[]),
        &["frame_00006.json, object[0].segmentation", "egg.png", "copy the masks"],
    );
    fs::write(lists.join("frame_00006.json"), object.replace("sentence", "words")).unwrap();
    expect(told("ref-lerf", &at("ref"), &[]), &["frame_00006.json, line 1", "missing field `sentence`", "looks like"]);

    // Networks that are not here are told before anything is done.
    fs::create_dir_all(at("ovs/bed/images")).unwrap();
    fs::write(at("ovs/bed/segmentations/classes.txt"), "cup\n").unwrap();
    let (data, out) = (at("ovs"), at("out"));
    let with = |more: &[&str]| {
        let all = ["reproduce", "3d-ovs", data.to_str().unwrap(), "--out", out.to_str().unwrap()];
        run(&[&all[..], more].concat()).fails_with(1).stderr
    };
    expect(with(&["--masks", "labels"]), &["clip-vit-b16", "fmlgs models fetch", "--encoder demo"]);
    expect(with(&["--encoder", "demo"]), &["no network that finds masks", "--masks regions"]);
    expect(with(&["--encoder", "demo", "--masks", "sam2.1-tiny"]), &["sam2.1-tiny", "fmlgs models fetch"]);
    assert!(!at("out").exists());
    let wrong = run(&["reproduce", "lerf-ovs", "x", "--out", "y", "--query", "lamp"]).fails_with(2);
    assert!(wrong.stderr.contains("SCENE=TEXT"), "{}", wrong.stderr);
}
