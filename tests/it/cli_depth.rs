//! The real binary measures depth, trains surfels, and reports missing abilities.

use crate::cli_support::{fmlgs, folder, tiny_dataset};

#[test]
fn surfels_are_trained_and_depth_is_measured() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let train = |out: &str, more: &[&str]| {
        let arguments = ["train", photos.to_str().unwrap(), "--out", out, "--eval-every", "0", "--max-side", "64"];
        fmlgs(&[&arguments[..], &["--json"], more].concat())
    };
    let psnr = |j: &serde_json::Value| j["evaluations"].as_array().unwrap().last().unwrap()["psnr"].as_f64().unwrap();
    let short = train(&at("short"), &["--surfels", "--steps", "5"]).ok().json();
    let long = train(&at("scene"), &["--surfels", "--steps", "150"]).ok().json();
    assert!(psnr(&long) > psnr(&short) + 2.0, "{} dB after 150 steps, {} dB after 5", psnr(&long), psnr(&short));
    let again = fmlgs(&["eval", &at("scene"), "--json"]).ok().json();
    assert!((again["psnr"].as_f64().unwrap() - psnr(&long)).abs() < 0.05, "opened as surfels: {again}");

    let measure = || fmlgs(&["eval", &at("scene"), "--depth", "--json"]).ok().json();
    let rel = |j: &serde_json::Value, kind: &str| j["scores"][kind]["all"]["mean_rel"].as_f64().unwrap();
    let right = measure();
    assert_eq!((&right["surfels"], &right["views"]), (&true.into(), &2.into()));
    assert!(rel(&right, "median") < 0.1 && rel(&right, "expected") < 0.1, "{right}");
    let table = fmlgs(&["eval", &at("scene"), "--depth"]).ok().stdout;
    assert!(table.contains("median, edges") && table.contains("2 views"), "{table}");

    // Negative control: the depths of other photos.
    let depth = photos.join("depth");
    let mut files: Vec<_> = std::fs::read_dir(&depth).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    let held: Vec<Vec<u8>> = files.iter().map(|f| std::fs::read(f).unwrap()).collect();
    for (file, other) in files.iter().zip(held.iter().cycle().skip(5)) {
        std::fs::write(file, other).unwrap();
    }
    let wrong = measure();
    assert!(rel(&wrong, "median") > 1.5 * rel(&right, "median"), "{wrong}");
    // Damaged, then none at all.
    files.iter().for_each(|f| std::fs::write(f, b"junk").unwrap());
    let done = fmlgs(&["eval", &at("scene"), "--depth"]).fails_with(1);
    assert!(done.stderr.contains("npy"), "{}", done.stderr);
    std::fs::remove_dir_all(&depth).unwrap();
    let done = fmlgs(&["eval", &at("scene"), "--depth"]).fails_with(1);
    assert!(done.stderr.contains("fmlgs synth"), "{}", done.stderr);

    let done = train(&at("gpu"), &["--surfels", "--backend", "gpu"]).fails_with(1);
    assert!(done.stderr.contains("CPU"), "{}", done.stderr);
    fmlgs(&["train", "x", "--distortion-weight", "1"]).fails_with(2);
    fmlgs(&["eval", "x", "--depth", "--masks", "y"]).fails_with(2);
}

#[test]
fn gaussians_train_with_the_term_for_normals() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let train = |weight: &str| {
        let out = folder.path().join(weight);
        let (photos, out) = (photos.to_str().unwrap(), out.to_str().unwrap());
        let arguments = ["train", photos, "--out", out, "--steps", "60", "--eval-every", "0", "--backend", "cpu"];
        fmlgs(&[&arguments[..], &["--max-side", "64", "--json", "--normal-weight", weight]].concat()).ok().json()
    };
    let psnr = |j: &serde_json::Value| j["evaluations"].as_array().unwrap().last().unwrap()["psnr"].as_f64().unwrap();
    let (without, with) = (train("0"), train("0.05"));
    assert_ne!(psnr(&without), psnr(&with), "the term did nothing");
    assert!((psnr(&without) - psnr(&with)).abs() < 3.0);
}
