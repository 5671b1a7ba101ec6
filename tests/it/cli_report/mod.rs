//! The real binary measures error against run time: every stage, stopped and resumed, refused
//! where it must be; and makes the paper's tables ([`reproduce`]).

mod layouts;
mod reproduce;

use crate::cli_support::{Done, command, folder, tiny_dataset};
use serde_json::Value;

#[test]
fn a_start_at_half_the_size_ends_nearly_as_well() {
    let folder = folder();
    let photos = folder.path().join("photos");
    let photos = photos.to_str().unwrap();
    // A scene with detail: plain boxes are nearly as good at half the size.
    let shelf = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/eval/shelf.glb");
    let size = ["--view-count", "16", "--size", "64x48", "--samples", "1", "--points", "500", "-q"];
    Done::from(command(&[&["synth", shelf, "--out", photos][..], &size[..]].concat()).output().unwrap()).ok();
    let psnr = |name: &str, more: &[&str]| -> f64 {
        let scene = folder.path().join(name);
        let scene = scene.to_str().unwrap();
        let train = ["train", photos, "--out", scene, "--steps", "500", "--backend", "cpu", "--eval-every", "0", "-q"];
        // The filter would make up for most of the difference of sizes.
        let train = [&train[..], &["--no-antialias"]].concat();
        Done::from(command(&[&train[..], more].concat()).output().unwrap()).ok();
        Done::from(command(&["eval", scene, "--json"]).output().unwrap()).ok().json()["psnr"].as_f64().unwrap()
    };
    let of = |share: &str| psnr(share, &["--coarse-share", share]);
    let (full, coarse, small) = (of("0"), of("0.5"), of("1"));
    assert!(coarse > full - 0.5, "{coarse} dB against {full} dB");
    // The control: half the size throughout shows.
    assert!(small < coarse - 1.0, "{small} dB against {coarse} dB");
    let wrong = command(&["train", photos, "--out", "x", "--coarse-share", "1.5"]).output().unwrap();
    Done::from(wrong).fails_with(2);
}

/// The points of a stage of a report.
fn points<'a>(report: &'a Value, stage: &str) -> &'a [Value] {
    let stages = report["stages"].as_array().unwrap();
    let found = stages.iter().find(|s| s["name"] == stage).unwrap_or_else(|| panic!("no stage {stage}"));
    found["points"].as_array().unwrap()
}

#[test]
fn every_stage_is_measured_and_resumed() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let run = |arguments: &[&str]| -> Done {
        command(arguments).env("FMLGS_ONNXRUNTIME", "none").env("FMLGS_MODELS", at("models")).output().unwrap().into()
    };
    let (photos, scene, out) = (photos.to_str().unwrap(), at("scene"), at("report"));
    let train = ["train", photos, "--out", &scene, "--steps", "150", "--backend", "cpu", "--eval-every", "0"];
    run(&[&train[..], &["--max-side", "64", "-q"]].concat()).ok();
    run(&["preprocess", &scene, "--masks", photos, "--encoder", "demo", "-q"]).ok();

    // What is found but cannot be seen from a camera is told so; here one that looks the other way.
    let mut away = run(&["info", photos, "--json"]).ok().json()["cameras"][0].clone();
    let away = {
        let turn = away["camera"]["world_from_camera"].as_array_mut().unwrap();
        for k in [0, 1, 2, 6, 7, 8] {
            turn[k] = (-turn[k].as_f64().unwrap()).into();
        }
        std::fs::write(at("away.json"), away.to_string()).unwrap();
        at("away.json")
    };
    let asked = |camera: &str| run(&["query", &scene, "box 1", "--camera", camera, "--json"]).ok().json();
    let (here, there) = (asked("0"), asked(&away));
    assert_eq!((&here["answer"], &here["in_view"]), (&"found".into(), &true.into()), "{here}");
    assert_eq!((&there["answer"], &there["in_view"], &there["pixels"]), (&"found".into(), &false.into(), &0.into()));
    let told = run(&["query", &scene, "box 1", "--camera", &away]).ok().stdout;
    assert!(told.contains("not in this view") && told.contains("--camera"), "{told}");

    // A list of phrases over all photos: its masks are met by themselves, and by no others.
    std::fs::write(at("words.txt"), "box 1\n\ngiraffe\nbox 2\n").unwrap();
    let (words, masks) = (at("words.txt"), at("masks"));
    let list = ["query", &scene, "--phrases", &words, "--views", "all"];
    let told = run(&[&list[..], &["--export", &masks]].concat()).ok().stdout;
    assert!(told.contains("giraffe") && told.contains("coco.json"), "{told}");
    assert!(std::fs::read_to_string(at("masks/phrases.csv")).unwrap().lines().count() > 3);
    let truth = at("masks/masks");
    let compared = || run(&[&list[..], &["--truth", &truth, "--json"]].concat()).ok().json();
    assert_eq!(compared()["mean_iou"], 1.0);
    let view = std::fs::read_dir(&truth).unwrap().next().unwrap().unwrap().path();
    std::fs::copy(view.join("giraffe.png"), view.join("box_1.png")).unwrap();
    assert!(compared()["mean_iou"].as_f64().unwrap() < 1.0, "nothing is not the box");
    run(&["query", &scene, "box 1", "--phrases", &words]).fails_with(2);
    run(&["query", &scene, "--phrases", &at("none.txt")]).fails_with(1);

    recipes_are_passed_on_and_printed(&run, &scene, photos, &at("red.ply"));
    everything_is_exported(&run, &scene, &at("everything"));

    let wanted = ["report", &scene, "--masks", photos, "--max-side", "64", "--steps", "20", "--train-steps", "20"];
    let rest = ["--view-count", "1", "--stages", "render,train,features,query,path", "--out", &out, "-q"];
    let read = || -> Value { serde_json::from_slice(&std::fs::read(format!("{out}/report.json")).unwrap()).unwrap() };

    // No time at all still leaves a whole report behind, which says that it is not complete.
    run(&[&wanted[..], &rest, &["--repeats", "1", "--budget", "0.001"]].concat()).ok();
    assert_eq!(read()["version"], 2);
    assert_eq!(points(&read(), "train").len(), 0);

    run(&[&wanted[..], &rest, &["--repeats", "1"]].concat()).ok();
    let once = read();
    for stage in ["render", "train", "features", "query", "path"] {
        let points = points(&once, stage);
        assert_eq!(points.iter().filter(|p| p["default"] == true).count(), 1, "{stage}");
        assert!(points.len() > 4 && points.iter().all(|p| p["secs"]["median"].as_f64().unwrap() >= 0.0), "{stage}");
        let planned =
            once["stages"].as_array().unwrap().iter().find(|s| s["name"] == stage).unwrap()["planned"].clone();
        assert_eq!(planned, points.len(), "{stage} is complete");
    }
    // What must be: finer cut-offs are nearer to the exact picture, coarser ones farther.
    let rms = |setting: &str| {
        let all = points(&once, "render");
        let p = all.iter().find(|p| p["setting"] == setting || (setting == "default" && p["default"] == true)).unwrap();
        p["values"]["RMS error"]["median"].as_f64().unwrap()
    };
    assert!(rms("1e-4") < rms("default") && rms("default") < rms("1/32"), "cut-offs");
    for name in ["report.html", "report.csv", "render.svg", "train.svg"] {
        assert!(std::fs::metadata(format!("{out}/{name}")).unwrap().len() > 100, "{name}");
    }

    // A second repeat adds to what is there.
    let again = ["--max-side", "64", "--repeats", "2", "--stages", "path", "--out", &out, "-q"];
    run(&[&["report", &scene][..], &again].concat()).ok();
    let twice = read();
    let times = |r: &Value, stage: &str| points(r, stage)[0]["secs"]["each"].as_array().unwrap().len();
    assert_eq!((times(&twice, "path"), times(&twice, "render")), (2, 1));
    assert_eq!(points(&twice, "path")[0]["secs"]["each"][0], points(&once, "path")[0]["secs"]["each"][0]);

    // The page says of each stage how often it ran, and by which commands.
    let page = std::fs::read_to_string(format!("{out}/report.html")).unwrap();
    for said in ["each setting 2 times", "each setting once", "<small>one run</small>", "--repeats 2 --stages path"] {
        assert!(page.contains(said), "{said}");
    }
    let commands = twice["commands"].as_array().unwrap();
    assert!(commands.len() == 3 && commands.iter().all(|c| c.as_str().unwrap().starts_with("fmlgs report ")));

    // The table of defaults.
    let table = at("DEFAULTS.md");
    run(&["report", "--defaults", &table, "--from", &out]).ok();
    let text = std::fs::read_to_string(&table).unwrap();
    assert!(text.contains("| alpha cut-off |") && text.contains("| samples along a way | 2 |"), "{text}");

    // What cannot be: another scene's report, unknown stages, missing labels.
    let other = at("other");
    std::fs::create_dir(&other).unwrap();
    for entry in std::fs::read_dir(&scene).unwrap() {
        let entry = entry.unwrap();
        std::fs::copy(entry.path(), std::path::Path::new(&other).join(entry.file_name())).unwrap();
    }
    let refused = run(&["report", &other, "--stages", "path", "--out", &out]);
    assert!(refused.stderr.contains("another scene") && refused.stderr.contains("--fresh"), "{}", refused.stderr);
    refused.fails_with(1);
    let no_labels = run(&["report", &scene, "--stages", "query", "--out", &at("none")]);
    assert!(no_labels.stderr.contains("--masks"), "{}", no_labels.stderr);
    no_labels.fails_with(1);
    run(&["report", &scene, "--stages", "nonesuch"]).fails_with(2);
    run(&["report", "--defaults", &table, "--from", &at("nowhere")]).fails_with(1);
}

/// Every object and part is exported, and its masks are read back as drawn.
fn everything_is_exported(run: &dyn Fn(&[&str]) -> Done, scene: &str, out: &str) {
    let told = run(&["segment", scene, "--all", "--out", out, "-q"]).ok().stdout;
    assert!(told.contains("objects and parts as .ply") && told.contains("masks of "), "{told}");
    for labels in ["isat", "ids"] {
        let masks = format!("{out}/{labels}");
        let scores = run(&["eval", scene, "--masks", &masks, "--json"]).ok().json();
        assert!(scores["views"].as_u64() > Some(0) && scores["miou"].as_f64() > Some(0.9), "{labels}: {scores}");
    }
    let packed =
        ["segment", scene, "--all", "--out", &format!("{out}_spz"), "--format", "spz", "--views", "none", "-q"];
    assert!(run(&packed).ok().stdout.contains("objects and parts as .spz"));
    let files = std::fs::read_dir(format!("{out}_spz/gaussians")).unwrap();
    assert!(files.map(|f| f.unwrap().file_name()).all(|name| name.to_string_lossy().ends_with(".spz")));
    // Again over itself, not over what is somebody's.
    run(&["segment", scene, "--all", "--out", out, "--masks", "coco", "--views", "none", "-q"]).ok();
    assert_eq!(std::fs::read_dir(format!("{out}/isat")).unwrap().count(), 0, "of the export before");
    std::fs::write(format!("{out}/coco.json"), "mine").unwrap();
    run(&["segment", scene, "--all", "--out", out, "-q"]).fails_with(2);
    run(&["segment", scene, "--all", "--out", scene]).fails_with(1);
    run(&["segment", scene, "--out", out]).fails_with(2);
    run(&["segment", scene, "box 1", "--all", "--out", out]).fails_with(2);
    run(&["segment", scene, "box 1", "--masks", "coco", "--out", out]).fails_with(2);
}

/// Every front end answers by the recipe that it is given, and says which.
fn recipes_are_passed_on_and_printed(run: &dyn Fn(&[&str]) -> Done, scene: &str, photos: &str, out: &str) {
    let asked = |text: &str, flags: &[&str]| run(&[&["query", scene, text, "--json"], flags].concat()).ok().json();
    let (usual, paper) = (asked("box 1", &[]), asked("red", &["--recipe", "paper"]));
    assert_eq!((&usual["basis"], &usual["recipe"]["strategy"]), (&"names".into(), &"joint".into()));
    assert_eq!((&paper["basis"], &paper["recipe"]["strategy"]), (&"looks".into(), &"two-steps".into()));
    assert_eq!((&usual["unmet"], &paper["unmet"].as_array().unwrap().len()), (&Value::Array(vec![]), &2), "{paper}");
    // Names know the box, the encoder does not; what is printed is what was asked by.
    run(&["query", scene, "box 1", "--by", "embedding"]).fails_with(1);
    let told = run(&["query", scene, "red", "--recipe", "paper", "--temperature", "3"]).ok().stdout;
    assert!(
        told.starts_with("recipe own: by embedding, strategy two-steps") && told.contains("temperature 3,"),
        "{told}"
    );
    assert!(told.contains("prepared with lifting votes, the recipe says paper"), "{told}");
    assert!(!run(&["query", scene, "box 1"]).ok().stdout.contains("recipe"));
    run(&["query", scene, "box 1", "--strategy", "magic"]).fails_with(2);
    let by_codes = asked("box 1", &["--match", "codes", "--tolerance", "0"]);
    assert!(by_codes["pixels"].as_u64() < usual["pixels"].as_u64(), "{by_codes}");

    let told = run(&["segment", scene, "red", "--recipe", "paper", "--out", out]).ok().stdout;
    assert!(told.starts_with("recipe paper: by embedding"), "{told}");
    let talk = run(&["agent", scene, "where is the box 1?", "--recipe", "default", "--json"]).ok().json();
    assert_eq!(talk["recipe"], usual["recipe"]);
    run(&["agent", scene, "where is the box 1?", "--by", "embedding", "--json"]).fails_with(1);

    let eval = |flags: &[&str]| run(&[&["eval", scene, "--masks", photos, "--json"], flags].concat()).ok().json();
    let by_embedding = eval(&["--by", "embedding"]);
    assert!(by_embedding["miou"].as_f64() < eval(&[])["miou"].as_f64(), "names are not looked at");
    assert_eq!(by_embedding["recipe"]["understanding"], "embedding");
    let table = eval(&["--protocol", "recipes"]);
    let rows = table["rows"].as_array().unwrap();
    let recall = |title: &str| rows.iter().find(|r| r["title"] == title).unwrap()["recall"][0].as_f64().unwrap();
    assert!(rows.len() == 15 && recall("names, joint") > recall("embedding, joint, deviation on"), "{table}");
}
