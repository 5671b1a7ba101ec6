//! The real binary puts results of other methods side by side, and says what it lacks for that.

use std::path::Path;

use crate::cli_support::{Done, command, folder};

/// A sample of a method.
fn sample(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/results").join(name);
    path.to_str().unwrap().to_owned()
}

/// Runs the binary on a computer without networks.
fn bare(models: &Path, arguments: &[&str]) -> Done {
    let mut command = command(arguments);
    command.env("FMLGS_MODELS", models).env("FMLGS_ONNXRUNTIME", "none").output().expect("runs").into()
}

#[test]
fn methods_without_language_are_shown_and_a_missing_encoder_is_named() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(at("words.txt"), "kettle\nred mug\n").unwrap();
    std::fs::create_dir(at("models")).unwrap();
    let run = |scenes: [&str; 2], more: &[&str]| {
        let (scenes, words) = (scenes.map(sample), at("words.txt"));
        let all = [&["compare", &*scenes[0], &*scenes[1], "--phrases", &words][..], more].concat();
        bare(&folder.path().join("models"), &all)
    };
    let silent = ["gaussian_grouping", "saga"];
    let done = run(silent, &["--views", "0,view_1", "--out", &at("side")]).ok();
    for wanted in ["Gaussian Grouping", "SAGA", "knows no language", "view_1", "red mug", "compare.html"] {
        assert!(done.stdout.contains(wanted), "{wanted}: {}", done.stdout);
    }
    for file in ["compare.json", "compare.csv", "compare.png", "compare.html"] {
        assert!(folder.path().join("side").join(file).is_file(), "{file}");
    }
    let json = run(silent, &["--json"]).ok().json();
    assert_eq!(json["cells"].as_array().unwrap().len(), 2 * 2);
    assert!(json["cells"][0]["own"].is_null() && json["cells"][0]["problem"].is_string());
    let again = run(silent, &["--out", &at("side")]).fails_with(2);
    assert!(again.stderr.contains("is there already"), "{}", again.stderr);
    // The control: a method that knows a language needs its encoder.
    let done = run(["langsplat_v2/output", "saga"], &[]).fails_with(1);
    assert!(done.stderr.contains("clip-vit-b16") && done.stderr.contains("fmlgs models fetch"), "{}", done.stderr);
    for option in ["--decoder", "--encoder"] {
        let done = run(silent, &[option, "other=file"]).fails_with(2);
        assert!(done.stderr.contains("'other'") && done.stderr.contains(option), "{}", done.stderr);
    }
    // Another encoder is taken by name; its vectors have another width.
    let other = format!("{}=demo", sample("langsplat_v2/output"));
    let done = run(["langsplat_v2/output", "saga"], &["--encoder", &other]).ok();
    for wanted in ["demo has 128 numbers", "compares 512", "--encoder"] {
        assert!(done.stdout.contains(wanted), "{wanted}: {}", done.stdout);
    }
    let done = run(silent, &["--encoder", &format!("{}=demo", sample("saga"))]).fails_with(1);
    assert!(done.stderr.contains("knows no language") && done.stderr.contains("--encoder"), "{}", done.stderr);
    let done = run(["gaussian_grouping", "nowhere"], &[]).fails_with(1);
    assert!(done.stderr.contains("nowhere"), "{}", done.stderr);
    run(silent, &["--arrays"]).fails_with(2);
}

#[test]
fn results_are_not_measured_by_what_they_cannot_do() {
    let folder = folder();
    let run = |more: &[&str]| {
        let scene = sample("saga");
        let labels = folder.path().to_str().unwrap();
        bare(folder.path(), &[&["eval", &*scene, "--masks", labels][..], more].concat()).fails_with(1).stderr
    };
    let protocol = run(&["--protocol", "strokes"]);
    assert!(protocol.contains("strokes") && protocol.contains("3d-ovs"), "{protocol}");
    // Labels are looked for first.
    let labels = run(&[]);
    assert!(labels.contains(folder.path().to_str().unwrap()), "{labels}");
}
