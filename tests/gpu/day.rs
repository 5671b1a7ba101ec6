//! `tools/gpu_day.sh`, small, on whatever adapter there is: so that it works on the day when there is a GPU.

use std::path::Path;
use std::process::{Command, Output};

use fmlgs::pipeline::observer::Silent;
use fmlgs::pipeline::synth::{self, SynthOptions};

fn day(arguments: &[&Path]) -> Output {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new(root.join("tools/gpu_day.sh"));
    command.args(arguments).env("FMLGS", env!("CARGO_BIN_EXE_fmlgs"));
    command.output().expect("it starts")
}

#[test]
fn a_day_with_a_gpu_is_measured_on_the_adapter_that_is_here() {
    let python = Command::new("python3").arg("--version").output();
    if crate::gpu_common::adapter::context().is_none() || python.is_err() {
        println!("skipped: no adapter, or no Python");
        return;
    }
    let folder = tempfile::tempdir().expect("folder");
    let (photos, out) = (folder.path().join("photos"), folder.path().join("out"));
    let small = SynthOptions { views: 4, held_out: 1, width_px: 64, height_px: 48, points: 200, ..Default::default() };
    let glb = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/eval/desk.glb");
    synth::run(&glb, &small, &photos, &mut Silent).expect("photos");
    let splat = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/formats/few.ply");
    let small = [&out, Path::new("--small"), Path::new("--photos"), &photos, &splat];
    let done = day(&small);
    let said = format!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{said}");
    let document = std::fs::read(out.join("gpu_day.json")).expect("a document");
    let document: serde_json::Value = serde_json::from_slice(&document).expect("JSON");
    let image = document["images"]["samples"].as_array().into_iter().flatten().find(|s| s["stage"] == "image, GPU");
    assert!(document["adapter"].is_string() && image.is_some_and(|s| s["median"].as_f64() > Some(0.0)), "{document}");
    assert!(document["train_10"]["evaluations"][0]["psnr"].as_f64() > Some(0.0), "{document}");
    let table = std::fs::read_to_string(out.join("gpu_day.md")).expect("a table");
    assert!(table.contains("| image, GPU |") && table.contains("| training step, GPU |"), "{table}");
    // The control: a step that fails is told, and the others are measured.
    let (broken, other) = (folder.path().join("none.ply"), folder.path().join("other"));
    let done = day(&[&other, Path::new("--small"), &broken]);
    let said = String::from_utf8_lossy(&done.stdout);
    assert!(!done.status.success() && said.contains("images FAILED") && said.contains("**failed**"), "{said}");
    // What was measured is not written over.
    assert_eq!(day(&small).status.code(), Some(2));
}
