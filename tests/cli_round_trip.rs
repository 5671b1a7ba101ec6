//! The real binary from a glTF scene to a trained, measured, drawn and exported splat.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "gpu_common/adapter.rs"]
mod adapter;
mod cli_support;

use cli_support::{fmlgs, folder, tiny_dataset};

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
    if adapter::context().is_none() {
        return;
    }
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let train = |backend: &str, seed: &str| {
        let out = folder.path().join(format!("{backend}{seed}"));
        let (photos, out) = (photos.to_str().unwrap(), out.to_str().unwrap());
        let arguments = ["train", photos, "--out", out, "--steps", "100", "--backend", backend, "--seed", seed];
        fmlgs(&[&arguments[..], &["--max-side", "48", "--random-points", "1500", "--json"]].concat()).ok().json()
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
