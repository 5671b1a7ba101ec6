//! The real binary from a glTF scene to a trained, measured, drawn and exported splat.

use std::path::Path;

use crate::cli_support::{first_version, fmlgs, folder, tiny_dataset, tiny_splat};
use fmlgs::io::splat_ply;
use fmlgs::jobs::find_objects::{FindRequest, FindSettings};
use fmlgs::jobs::workspace::{OpenedPath, Workspace};
use fmlgs::jobs::{self, Folders};
use fmlgs::pipeline::observer::Silent;
use fmlgs::pipeline::train::TrainConfig;
use fmlgs::scene::Camera;
use fmlgs::ui::viewport::eye::Eye;
use glam::DVec3;

#[test]
fn synth_train_eval_render_export() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let photos = photos.to_str().unwrap();

    let info = fmlgs(&["info", photos, "--json"]).ok().json();
    assert_eq!((&info["kind"], &info["photos"], &info["held_out"]), (&"dataset".into(), &16.into(), &2.into()));
    assert_eq!(info["cameras"].as_array().unwrap().len(), 16);

    // Few steps first, then many: training must help.
    let train = |out: &str, steps: &str| {
        let arguments = ["train", photos, "--out", out, "--steps", steps, "--backend", "cpu", "--eval-every", "0"];
        fmlgs(&[&arguments[..], &["--max-side", "64", "--json"]].concat()).ok().json()
    };
    let short = train(&at("short"), "5");
    let long = train(&at("scene"), "150");
    assert_eq!((&long["end"], &long["steps"]), (&"finished".into(), &150.into()));
    let psnr = |j: &serde_json::Value| j["evaluations"].as_array().unwrap().last().unwrap()["psnr"].as_f64().unwrap();
    assert!(psnr(&long) > psnr(&short) + 2.0, "{} dB after 150 steps, {} dB after 5", psnr(&long), psnr(&short));

    let eval = fmlgs(&["eval", &at("scene"), "--pictures", &at("compare"), "--json"]).ok().json();
    let (again, while_training) = (eval["psnr"].as_f64().unwrap(), psnr(&long));
    assert!((again - while_training).abs() < 0.05, "eval finds {again} dB, training found {while_training} dB");
    let views = eval["views"].as_array().unwrap();
    assert_eq!(views.len(), 2);
    let pictures: Vec<_> = std::fs::read_dir(at("compare")).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(pictures.len(), 2);
    assert_eq!(image::open(&pictures[0]).unwrap().to_rgb8().dimensions(), (3 * 64, 48));
    let table = fmlgs(&["eval", &at("scene")]).ok().stdout;
    assert!(table.contains("mean of 2"), "{table}");

    // A photo's camera by index and by its entry in the list of cameras gives the same picture.
    fmlgs(&["render", &at("scene"), "--camera", "3", "--out", &at("3.png")]).ok();
    std::fs::write(at("camera.json"), info["cameras"][3].to_string()).unwrap();
    fmlgs(&["render", &at("scene"), "--camera", &at("camera.json"), "--out", &at("json.png")]).ok();
    fmlgs(&["render", &at("scene"), "--camera", "4", "--out", &at("4.png")]).ok();
    let picture = |name: &str| image::open(at(name)).unwrap().to_rgb8();
    assert_eq!(picture("3.png"), picture("json.png"));
    assert_ne!(picture("3.png"), picture("4.png"));

    fmlgs(&["export", &at("scene"), "--out", &at("out.ply")]).ok();
    let info = fmlgs(&["info", &at("out.ply"), "--json"]).ok().json();
    assert_eq!(info["gaussians"], long["gaussians"]);
    let told = fmlgs(&["export", &at("scene"), "--html", &at("page.html"), "--out", &at("out.ply")]).ok().stdout;
    assert!(
        told.contains("out.ply: ") && told.contains("page.html: ") && Path::new(&at("page.html")).exists(),
        "{told}"
    );
    fmlgs(&["export", &at("scene")]).fails_with(2);
    let refused = fmlgs(&["export", &at("out.ply"), "--html", &at("out.ply")]).fails_with(2).stderr;
    assert!(refused.contains("must end in .html or .htm"), "{refused}");
    let info = fmlgs(&["info", &at("scene"), "--json"]).ok().json();
    assert_eq!((&info["kind"], &info["gaussians"]), (&"trained".into(), &long["gaussians"]));

    // The same command again has nothing left to do and says the same.
    let repeated = train(&at("scene"), "150");
    assert_eq!(repeated["steps"], 150);
    assert!((psnr(&repeated) - psnr(&long)).abs() < 1e-6);

    // Settings that cannot be read are not replaced by others: the picture would be another one.
    let file = at("scene/scene.json");
    let mut stored: serde_json::Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    stored["config"]["steps"] = "many".into();
    std::fs::write(&file, stored.to_string()).unwrap();
    for arguments in [&["render", &at("scene"), "--out", &at("5.png")][..], &["train", &at("scene"), "-q"]] {
        let refused = fmlgs(arguments).fails_with(1).stderr;
        assert!(refused.contains("scene.json") && refused.contains("'config'"), "{refused}");
    }
    assert!(!std::path::Path::new(&at("5.png")).exists());
}

#[test]
fn a_run_on_the_gpu_follows_the_one_on_the_cpu() {
    if crate::gpu_common::adapter::context().is_none() {
        return;
    }
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let train = |backend: &str, seed: &str| {
        let out = folder.path().join(format!("{backend}{seed}"));
        let (photos, out) = (photos.to_str().unwrap(), out.to_str().unwrap());
        let arguments = ["train", photos, "--out", out, "--steps", "100", "--backend", backend, "--seed", seed];
        fmlgs(&[&arguments[..], &["--max-side", "48", "--json"]].concat()).ok().json()
    };
    let (cpu, gpu, other) = (train("cpu", "0"), train("gpu", "0"), train("cpu", "1"));
    let psnr = |j: &serde_json::Value| j["evaluations"].as_array().unwrap().last().unwrap()["psnr"].as_f64().unwrap();
    let count = |j: &serde_json::Value| j["gaussians"].as_f64().unwrap();
    // Sums in another order: the runs drift apart, but not far, and density control (from step 50)
    // asks for nearly the same.
    assert!((psnr(&cpu) - psnr(&gpu)).abs() < 0.5, "{} dB on the CPU, {} on the GPU", psnr(&cpu), psnr(&gpu));
    assert!((count(&cpu) / count(&gpu) - 1.0).abs() < 0.03, "{} {}", count(&cpu), count(&gpu));
    assert_ne!(psnr(&cpu), psnr(&gpu), "the GPU did not train");
    assert_ne!(psnr(&cpu), psnr(&other), "another seed must give another run");
}

#[test]
fn the_window_and_the_command_line_do_the_same() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let workspace = Workspace::new(Folders { data: folder.path().join("data") });
    let open = |path: &str| match workspace.open(path.as_ref(), &mut Silent).unwrap() {
        OpenedPath::Scene(scene) => scene,
        other => panic!("{other:?}"),
    };
    let near = |a: &Camera, b: &Camera| {
        assert!((a.center - b.center).length() < 1e-9 && (a.fov_y_rad() - b.fov_y_rad()).abs() < 1e-9, "{a:?} {b:?}");
        assert!((a.world_from_camera.mul_vec3(DVec3::ONE) - b.world_from_camera.mul_vec3(DVec3::ONE)).length() < 1e-9);
    };
    let first_view = |path: &str| -> Camera {
        let drawn = fmlgs(&["render", path, "--out", &at("view.png"), "--json"]).ok().json();
        serde_json::from_value(drawn["camera"].clone()).unwrap()
    };

    // A bare splat is framed alike, whoever opens it.
    let splat = tiny_splat(&folder.path().join("a.ply"));
    let scene = open(splat.to_str().unwrap());
    let (shown, drawn) = (Eye::framing(&scene.home.bounds, scene.home.up), first_view(splat.to_str().unwrap()));
    near(&shown.camera(640, 480), &drawn);
    near(&scene.home.camera([640, 480]), &drawn);

    // A trained scene: its first view, its Gaussians, its quality and its objects.
    let photos = first_version(folder.path());
    let (photos, trained) = (photos.to_str().unwrap(), at("scene"));
    let scene = open(&trained);
    near(&scene.home.camera([640, 480]), &first_view(&trained));
    fmlgs(&["export", &trained, "--out", &at("out.ply")]).ok();
    let cloud = scene.cloud.clone();
    assert_eq!(splat_ply::read(Path::new(&at("out.ply"))).unwrap(), *cloud);

    let dataset = scene.dataset.clone().unwrap();
    let config = TrainConfig { max_side_px: 64, ..TrainConfig::default() };
    // Whatever is set for the next training: the scene knows what it has not seen.
    let config = TrainConfig { holdout_every: 3, ..config };
    let (out, settings) = (scene.out.clone(), scene.settings.clone());
    let (d, c) = (dataset.clone(), cloud.clone());
    let evaluation = workspace.evaluate(d, c, config.clone(), settings.clone(), &out, &mut Silent).unwrap();
    let eval = fmlgs(&["eval", &trained, "--json"]).ok().json();
    assert_eq!(eval["views"].as_array().unwrap().len(), evaluation.views.len());
    assert!((eval["psnr"].as_f64().unwrap() - evaluation.psnr).abs() < 1e-9, "{eval}");

    let with = FindSettings { encoder: Some("none".into()), ..FindSettings::default() };
    let holdout_every = config.holdout_every;
    let masks = Some(photos.into());
    let folder = out.clone();
    let request =
        FindRequest { folder, cloud, settings, dataset, holdout_every, masks, side_px: 64, known: None, with };
    let found = workspace.find_objects(&request, &mut Silent).unwrap();
    let told = fmlgs(&["preprocess", &trained, "--masks", photos, "--encoder", "none"]).ok();
    let stored = jobs::open::scene(&out).unwrap().semantics().unwrap();
    assert_eq!((&stored.identity_of, &stored.seeds), (&found.identity_of, &found.seeds), "{}", told.stderr);
}

#[test]
fn what_is_removed_is_gone_in_a_new_scene_and_the_old_one_stays() {
    let folder = folder();
    first_version(folder.path());
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (scene, out) = (at("scene"), at("less"));
    let read = |path: &str| ["point_cloud.ply", "scene.json"].map(|f| std::fs::read(Path::new(path).join(f)).unwrap());
    let before = read(&scene);

    let done = fmlgs(&["remove", &scene, "box 1", "--out", &out, "--json"]).ok().json();
    let count = |what: &str| done["report"][what].as_u64().unwrap();
    assert_eq!((&done["names"][0], count("removed")), (&"box 1".into(), 36));
    let left = 196 - count("removed") - count("fringes") - count("unseen") - count("left_over");
    let info = fmlgs(&["info", &out, "--json"]).ok().json();
    assert_eq!((&info["kind"], &info["gaussians"], &info["identities"]), (&"trained".into(), &left.into(), &2.into()));
    assert!(fmlgs(&["query", &out, "box 1"]).fails_with(1).stderr.contains("box 1"));
    fmlgs(&["query", &out, "box 2"]).ok();
    assert_eq!(read(&scene), before, "the scene itself is touched");

    // Again, onto itself and of what is not there: nothing is written over.
    let written = read(&out);
    assert!(
        fmlgs(&["remove", &scene, "box 2", "--out", &out]).fails_with(1).stderr.contains("holds something already")
    );
    fmlgs(&["remove", &scene, "box 2", "--out", &scene]).fails_with(1);
    fmlgs(&["remove", &scene, "giraffe", "--out", &at("none")]).fails_with(1);
    assert_eq!((read(&scene), read(&out), Path::new(&at("none")).exists()), (before, written, false));

    // The agent asks first, and chooses a folder itself.
    let agent = fmlgs(&["agent", &scene, "remove box 2", "yes"]).ok().stdout;
    assert!(agent.contains("(yes or no)") && agent.contains("scene-without-box-2"), "{agent}");
    fmlgs(&["query", &at("scene-without-box-2"), "box 2"]).fails_with(1);
}

#[test]
fn cleaned_and_edited_scenes_are_new_ones_and_the_old_one_stays() {
    let folder = folder();
    first_version(folder.path());
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let scene = at("scene");
    let before = std::fs::read(Path::new(&scene).join("point_cloud.ply")).unwrap();
    let gaussians = |path: &str| fmlgs(&["info", path, "--json"]).ok().json()["gaussians"].as_u64().unwrap();

    // Counting writes nothing; what is written is without what was counted.
    let counted = fmlgs(&["clean", &scene, "--json"]).ok().json();
    assert_eq!((&counted["gaussians"], counted["rules"].as_array().unwrap().len()), (&196.into(), 5));
    assert!(fmlgs(&["clean", &scene]).ok().stdout.contains("Nothing was written"));
    let done = fmlgs(&["clean", &scene, "opacity<0.1", "size>0.5", "--out", &at("cleaned"), "--json"]).ok().json();
    let chosen = done["chosen"].as_u64().unwrap();
    assert!((1..196).contains(&chosen) && done["left"] == 196 - chosen, "{done}");
    assert_eq!(gaussians(&at("cleaned")), 196 - chosen);
    fmlgs(&["query", &at("cleaned"), "box 1"]).ok();
    fmlgs(&["clean", &scene, "opacity<0.1", "--out", &at("cleaned.ply")]).ok();
    assert!(gaussians(&at("cleaned.ply")) < 196);
    for (rules, out) in [("dust", "x"), ("opacity<2", "x"), ("faint", "scene"), ("faint", "cleaned")] {
        let code = if rules == "dust" { 2 } else { 1 };
        fmlgs(&["clean", &scene, rules, "--out", &at(out)]).fails_with(code);
    }
    // A bare splat has no photos, and so no weights in them.
    fmlgs(&["clean", &at("cleaned.ply")]).ok();
    assert!(fmlgs(&["clean", &at("cleaned.ply"), "photos<2"]).fails_with(1).stderr.contains("photos is not known"));

    let edit = |more: &[&str]| fmlgs(&[&["edit", &scene, "box 1"], more].concat());
    edit(&["--move", "0.5,0,-1", "--turn", "30", "--color", "#c02020", "--out", &at("moved")]).ok();
    assert_eq!(gaussians(&at("moved")), 196);
    fmlgs(&["query", &at("moved"), "box 1"]).ok();
    edit(&["--duplicate", "--move", "1,0,0", "--scale", "0.5", "--out", &at("two")]).ok();
    assert_eq!(gaussians(&at("two")), 196 + 36);
    assert_eq!(fmlgs(&["info", &at("two"), "--json"]).ok().json()["identities"], 4);
    edit(&["--out", &at("nothing")]).fails_with(2);
    edit(&["--scale", "0", "--out", &at("nothing")]).fails_with(1);
    edit(&["--scale", "2", "--out", &scene]).fails_with(1);
    assert!(!Path::new(&at("nothing")).exists());
    assert_eq!(std::fs::read(Path::new(&scene).join("point_cloud.ply")).unwrap(), before);
}

#[test]
fn what_is_behind_a_thing_is_rendered_without_it_from_the_same_cameras() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let glb = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/eval/desk.glb");
    let synth = |out: &str, more: &[&str]| {
        let all =
            ["synth", glb, "--out", out, "--view-count", "6", "--held-out", "2", "--size", "48x36", "--points", "0"];
        fmlgs(&[&all[..], more].concat())
    };
    synth(&at("with"), &[]).ok();
    synth(&at("without"), &["--without", "green lamp"]).ok();
    synth(&at("shadow"), &["--without", "green lamp", "--keep-shadow"]).ok();
    assert!(synth(&at("x"), &["--without", "giraffe"]).fails_with(1).stderr.contains("'green lamp'"));
    let pictures = |of: &str| {
        let mut all: Vec<_> = std::fs::read_dir(at(of) + "/images").unwrap().map(|e| e.unwrap().path()).collect();
        all.sort();
        all
    };
    let (with, without, shadow) = (pictures("with"), pictures("without"), pictures("shadow"));
    assert_eq!((with.len(), without.len(), shadow.len()), (6, 2, 2));
    let open = |path: &Path| image::open(path).unwrap().to_rgb8().into_raw();
    let mut darker = 0;
    for (bare, shaded) in without.iter().zip(&shadow) {
        let name = bare.file_name().unwrap();
        let thing = with.iter().find(|p| p.file_name() == Some(name)).unwrap();
        let [thing, bare, shaded] = [thing, bare, shaded].map(|p| open(p));
        assert_ne!(thing, bare);
        darker += bare.iter().zip(&shaded).filter(|(a, b)| a > b).count();
        // Most of the picture is the same: the cameras are.
        let same = thing.iter().zip(&shaded).filter(|(a, b)| a == b).count();
        assert!(same * 2 > thing.len(), "{same} of {}", thing.len());
    }
    assert!(darker > 0, "no shadow");
}
