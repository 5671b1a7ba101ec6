//! The real binary: help, exit codes, and errors that name the file and the remedy.

use std::path::Path;

use crate::cli_support::{acts, first_version, fmlgs, folder, tiny_splat};

#[test]
fn help_and_version_are_no_failures() {
    let help = fmlgs(&["--help"]).ok();
    for word in ["train", "render", "eval", "synth", "demo", "export", "info", "bench", "Exit codes", "130"] {
        assert!(help.stdout.contains(word), "'{word}' is missing from the help:\n{}", help.stdout);
    }
    for command in ["info", "train", "render", "eval", "synth", "demo", "export", "bench"] {
        let help = fmlgs(&[command, "--help"]).ok();
        assert!(help.stdout.contains("Examples:"), "{command} shows no example");
    }
    assert!(fmlgs(&["--version"]).ok().stdout.contains(env!("CARGO_PKG_VERSION")));
}

/// `make run ARGS="..."` sources it with the program's arguments, as do other scripts with theirs.
#[cfg(unix)]
#[test]
fn a_script_that_looks_for_rust_may_have_arguments_of_its_own() {
    let done = std::process::Command::new("bash")
        .args(["-c", ". tools/rust.sh; echo \"found $#\"", "run.sh", "train", "--steps"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("bash");
    assert_eq!(String::from_utf8_lossy(&done.stdout).trim(), "found 2", "{done:?}");
}

#[test]
fn arguments_that_make_no_sense_exit_with_2() {
    let folder = folder();
    let splat = tiny_splat(&folder.path().join("a.ply"));
    let splat = splat.to_str().unwrap();
    for arguments in [
        &["train"][..],
        &["train", "x", "--steps", "0"],
        &["train", "x", "--sh-degree", "4"],
        &["render", splat, "--size", "0x3"],
        &["render", splat, "--out", "a.jpg"],
        &["render", splat, "--channel", "picture", "--out", "a.npy"],
        &["export", splat, "--out", "a.obj"],
        &["export", splat, "--out", "a.ply", "--crop", "0,0,0,1,1"],
        &["export", splat, "--out", "a.ply", "--crop", "1,0,0,0,1,1"],
        &["export", splat, "--out", "a.ply", "--outside"],
        &["synth", "a.glb", "--out", "x", "--view-count", "2", "--held-out", "2"],
        &["query", splat, "x", "--tolerance", "nan"],
        &["query", splat, "x", "--top", "0"],
        &["path", splat, "--survey", "18446744073709551615"],
        &["path", splat, "--to", "x", "--distance", "inf"],
        &["report", splat, "--budget", "nan"],
        &["agent", splat, "--meters", "0"],
        &["no-such-command"],
        &["--no-such-option"],
    ] {
        let done = fmlgs(arguments);
        assert_eq!(done.code, Some(2), "{arguments:?}: {}", done.stderr);
        assert!(done.stdout.is_empty(), "{arguments:?} printed a result");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn limits_of_the_system_and_files_without_an_end_are_told() {
    let folder = folder();
    let splat = tiny_splat(&folder.path().join("a.ply"));
    let out = folder.path().join("a.png");
    let (splat, out) = (splat.to_str().unwrap(), out.to_str().unwrap());
    for endless in [&["agent", splat, "closer", "--policy", "/dev/zero"][..], &["info", "/dev/zero"]] {
        let done = fmlgs(endless).fails_with(1);
        assert!(done.stderr.contains("/dev/zero"), "{endless:?}: {}", done.stderr);
    }
    let mut crowded = crate::cli_support::command(&["render", splat, "--size", "64x48", "--out", out]);
    let crowded = crowded.env("RAYON_NUM_THREADS", "100000").output().unwrap();
    assert!(crowded.status.success(), "{}", String::from_utf8_lossy(&crowded.stderr));
    let words = format!(
        "ulimit -v 3000000; exec '{}' render '{splat}' --size 16384x16384 --out '{out}'",
        env!("CARGO_BIN_EXE_fmlgs")
    );
    let limited = std::process::Command::new("sh").args(["-c", &words]).output().unwrap();
    let told = String::from_utf8_lossy(&limited.stderr);
    assert!(limited.status.code() == Some(1) && told.contains("drawing 16384 x 16384 px takes about"), "{told}");
}

#[test]
fn failures_exit_with_1_and_name_the_file() {
    let folder = folder();
    let junk = folder.path().join("junk.ply");
    std::fs::write(&junk, "not a splat").unwrap();
    let empty = folder.path().join("empty");
    std::fs::create_dir(&empty).unwrap();
    let (junk, empty) = (junk.to_str().unwrap(), empty.to_str().unwrap());
    for (arguments, named) in [
        (&["info", "no/such/folder"][..], "no/such/folder"),
        (&["info", junk], "junk.ply"),
        (&["info", empty], "transforms.json"),
        (&["train", empty], "empty"),
        (&["render", junk], "junk.ply"),
        (&["eval", junk], "junk.ply"),
        (&["synth", "missing.glb", "--out", empty], "missing.glb"),
        (&["export", junk, "--out", "x.ply"], "junk.ply"),
    ] {
        let done = fmlgs(arguments);
        assert_eq!(done.code, Some(1), "{arguments:?}: {}", done.stderr);
        assert!(done.stderr.starts_with("error: ") && done.stderr.contains(named), "{arguments:?}: {}", done.stderr);
        assert!(!done.stderr.contains("panicked"), "{}", done.stderr);
    }
}

#[test]
fn foreign_text_does_not_act_on_the_terminal() {
    let folder = folder();
    let evil = "\u{1b}]0;owned\u{7}\u{1b}[2J\u{9b}2J\u{202e}gnp\nerror: all is lost";
    let header = folder.path().join("header.ply");
    std::fs::write(&header, format!("ply\nformat {} 1.0\nend_header\n", evil.replace('\n', ""))).unwrap();
    let (missing, header) = (folder.path().join(evil), header.to_str().unwrap());
    for (arguments, shown) in [
        (&["info", missing.to_str().unwrap()][..], "2Jgnp"),
        (&["info", header], "2Jgnp"),
        (&["train", missing.to_str().unwrap(), "--out", "o"], "2Jgnp"),
        (&["info", header, "--\u{1b}[31m\u{202e}x"], "--x"),
    ] {
        let done = fmlgs(arguments);
        assert!(done.code == Some(1) || done.code == Some(2), "{arguments:?}: {:?}", done.code);
        assert!(done.stderr.contains(shown), "{:?}", done.stderr);
        assert!(!acts(&done.stderr) && !acts(&done.stdout), "{arguments:?}: {:?}", done.stderr);
        let forged = |line: &str| line.starts_with("error: all");
        assert!(!done.stderr.lines().any(forged), "{:?}", done.stderr);
    }
    // The control: the text that went in does act.
    assert!(acts(evil) && !acts("a\tb\n手柄"));
}

#[test]
fn the_wrong_kind_of_input_is_told_what_to_do() {
    let folder = folder();
    let splat = tiny_splat(&folder.path().join("a.ply"));
    let splat = splat.to_str().unwrap();
    let done = fmlgs(&["train", splat]).fails_with(1);
    assert!(done.stderr.contains("posed photos"), "{}", done.stderr);
    let done = fmlgs(&["eval", splat]).fails_with(1);
    assert!(done.stderr.contains("--photos"), "{}", done.stderr);
    let done = fmlgs(&["render", splat, "--camera", "nobody"]).fails_with(1);
    assert!(done.stderr.contains("nobody") && done.stderr.contains("--photos"), "{}", done.stderr);
}

#[test]
fn without_a_display_the_window_says_what_works() {
    let done = fmlgs(&[]).fails_with(1);
    assert!(done.stderr.contains("DISPLAY") && done.stderr.contains("demo --headless"), "{}", done.stderr);
}

#[test]
fn a_closed_pipe_is_no_failure() {
    let folder = folder();
    let splat = tiny_splat(&folder.path().join("a.ply"));
    let mut child = crate::cli_support::command(&["info", splat.to_str().unwrap(), "--json"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let done = child.wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success() && !stderr.contains("panicked"), "{stderr}");
}

#[test]
fn info_tells_people_and_scripts_the_same() {
    let folder = folder();
    let splat = tiny_splat(&folder.path().join("a.ply"));
    let path = splat.to_str().unwrap();
    let text = fmlgs(&["info", path]).ok().stdout;
    assert!(text.contains("Gaussian splat") && text.contains("Scene plan"), "{text}");
    let json = fmlgs(&["info", path, "--json"]).ok().json();
    assert_eq!(json["kind"], "splat");
    assert_eq!(json["gaussians"], 3);
    assert_eq!(json["sh_degree"], 0);
    assert!(json["plan"]["lines"].as_array().is_some_and(|l| !l.is_empty()));
}

#[test]
fn sides_of_training_images_are_for_photos() {
    let folder = folder();
    let splat = tiny_splat(&folder.path().join("a.ply"));
    let photos = first_version(folder.path());
    let (splat, photos, scene) = (splat.to_str().unwrap(), photos.to_str().unwrap(), folder.path().join("scene"));
    for command in ["info", "bench"] {
        let refused = fmlgs(&[command, splat, "--max-side", "64"]).fails_with(2).stderr;
        assert!(refused.contains("--max-side has no effect here"), "{command}: {refused}");
    }
    fmlgs(&["bench", scene.to_str().unwrap(), "--max-side", "64"]).fails_with(2);
    // The controls: photos are limited, and those of a trained scene are known.
    for path in [photos, scene.to_str().unwrap()] {
        let plan = fmlgs(&["info", path, "--max-side", "32"]).ok().stdout;
        assert!(plan.contains("32 x 24 px"), "{path}: {plan}");
        assert!(!fmlgs(&["info", path]).ok().stdout.contains("32 x 24 px"), "{path}");
    }
    let timed = fmlgs(&["bench", splat, photos, "--size", "32x24", "--max-side", "32", "--repeats", "1", "--json"]);
    let timed = timed.ok().json();
    let stages = timed["samples"].as_array().unwrap().iter().map(|s| s["stage"].as_str().unwrap());
    assert_eq!(stages.filter(|s| *s == "training step, CPU").count(), 1);
    // The help states the default.
    for command in ["info", "bench"] {
        let help = fmlgs(&[command, "--help"]).ok().stdout.split_whitespace().collect::<Vec<_>>().join(" ");
        let side = fmlgs::pipeline::train::TrainConfig::default().max_side_px;
        assert!(help.contains(&format!("[default: {side}]")), "{command}: {help}");
    }
}

#[test]
fn a_splat_is_drawn_and_exported_again() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let splat = tiny_splat(&folder.path().join("a.ply"));
    let splat = splat.to_str().unwrap();

    let done = fmlgs(&["render", splat, "--size", "64x48", "--out", &at("a.png"), "--json"]).ok().json();
    assert_eq!(done["size_px"], serde_json::json!([64, 48]));
    let picture = image::open(at("a.png")).unwrap().to_rgb8();
    assert_eq!(picture.dimensions(), (64, 48));
    let brightest = picture.pixels().map(|p| p.0.into_iter().max().unwrap()).max().unwrap();
    assert!(brightest > 100, "the picture is black");

    fmlgs(&["render", splat, "--size", "64x48", "--channel", "depth", "--out", &at("d.npy")]).ok();
    let bytes = std::fs::read(at("d.npy")).unwrap();
    let depth = npyz::NpyFile::new(&bytes[..]).unwrap();
    assert_eq!(depth.shape(), [48, 64]);
    let depth: Vec<f32> = depth.into_vec().unwrap();
    fmlgs(&["render", splat, "--size", "64x48", "--channel", "depth", "--out", &at("d.png"), "--json"]).ok();
    let coded = image::open(at("d.png")).unwrap().to_luma16().into_raw();
    let far = depth.iter().copied().fold(0.0, f32::max);
    assert!(far > 0.0);
    for (d, c) in depth.iter().zip(&coded) {
        assert!((d / far - f32::from(*c) / 65535.0).abs() < 1e-4);
    }
    fmlgs(&["render", splat, "--size", "64x48", "--channel", "expected-depth", "--out", &at("e.npy")]).ok();
    let bytes = std::fs::read(at("e.npy")).unwrap();
    let expected: Vec<f32> = npyz::NpyFile::new(&bytes[..]).unwrap().into_vec().unwrap();
    // Both have a depth at the same pixels, at nearly the same distance.
    assert!(depth.iter().zip(&expected).all(|(d, e)| (*d > 0.0) == (*e > 0.0) && (d - e).abs() < 0.5 * far));
    fmlgs(&["render", splat, "--size", "64x48", "--channel", "normals", "--out", &at("n.png")]).ok();
    let normals = image::open(at("n.png")).unwrap().to_rgb8();
    let length = |p: &image::Rgb<u8>| p.0.iter().map(|c| (f32::from(*c) / 127.5 - 1.0).powi(2)).sum::<f32>();
    let turned: Vec<f32> = normals.pixels().map(length).filter(|l| *l > 0.1).collect();
    assert!(!turned.is_empty() && turned.iter().all(|l| (l - 1.0).abs() < 0.05));
    fmlgs(&["render", splat, "--size", "64x48", "--channel", "normals", "--out", &at("n.npy")]).fails_with(2);
    fmlgs(&["render", splat, "--size", "64x48", "--channel", "alpha", "--out", &at("alpha.png")]).ok();
    assert!(image::open(at("alpha.png")).unwrap().to_luma8().pixels().any(|p| p.0[0] > 100));

    fmlgs(&["export", splat, "--out", &at("new/b.ply")]).ok();
    let again = fmlgs(&["info", &at("new/b.ply"), "--json"]).ok().json();
    assert_eq!(again["gaussians"], 3);
    fmlgs(&["render", &at("new/b.ply"), "--size", "64x48", "--out", &at("b.png")]).ok();
    assert_eq!(image::open(at("b.png")).unwrap().to_rgb8(), picture, "export changed the picture");

    // The three stand at x = -1, 0 and 1.
    let xs = |more: &[&str]| {
        fmlgs(&[&["export", splat, "--out", &at("cut.ply"), "--crop"], more].concat()).ok();
        let cut = fmlgs::io::splat_ply::read(Path::new(&at("cut.ply"))).unwrap();
        cut.positions.iter().map(|p| p[0]).collect::<Vec<_>>()
    };
    assert_eq!(xs(&["-1.5,-1,-1,0.5,1,1"]), [-1.0, 0.0]);
    assert_eq!(xs(&["-1.5,-1,-1,0.5,1,1", "--outside"]), [1.0]);
    let empty = ["export", splat, "--out", &at("none.ply"), "--crop", "5,5,5,6,6,6"];
    assert!(fmlgs(&empty).fails_with(1).stderr.contains("no Gaussian") && !Path::new(&at("none.ply")).exists());
}
