//! Output written file by file: all objects of a scene, and the demo as it is unpacked.

use super::*;
use crate::cli_support::files_in;

#[test]
fn all_objects_being_exported() {
    let folder = folder();
    first_version(folder.path());
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let export = |out: &str| command(&["segment", &at("scene"), "--all", "--out", &at(out), "-q"]);
    // The first run also reads the program from the disk.
    let longest = time(&mut export("first")).min(time(&mut export("whole")));
    let is_whole = || files_in(&folder.path().join("out")) == files_in(&folder.path().join("whole"));
    let mut start = |_| {
        // Where all is there already, there is nothing left to be killed at.
        if folder.path().join("out").is_dir() && is_whole() {
            std::fs::remove_dir_all(folder.path().join("out")).unwrap();
        }
        export("out")
    };
    kill_often("segment --all", longest, &mut start, &mut || ());
    Done::from(export("out").output().unwrap()).ok();
    assert_tidy(&folder.path().join("out"));
    let [whole, out] = ["whole", "out"].map(|name| files_in(&folder.path().join(name)));
    assert!(out == whole, "{:?} instead of {:?}", out.keys(), whole.keys());
}

#[test]
fn the_demo_being_unpacked() {
    let folder = folder();
    let (data, out) = (folder.path().join("data"), folder.path().join("out"));
    let demo = || {
        let mut demo = command(&["demo", "--headless", "--steps", "1", "--out", out.to_str().unwrap()]);
        demo.env("XDG_DATA_HOME", &data);
        demo
    };
    let unpacked = || -> Vec<PathBuf> {
        let folders = std::fs::read_dir(data.join("fmlgs")).into_iter().flatten().map(|e| e.unwrap().path());
        folders.filter(|p| p.file_name().unwrap().to_string_lossy().starts_with("demo-")).collect()
    };
    let mut there = 0;
    kill_often("demo", Duration::from_millis(400), &mut |_| demo(), &mut || {
        for folder in unpacked() {
            there += 1;
            assert_eq!(std::fs::read_dir(folder.join("photos/images")).unwrap().count(), 64);
            assert!(trained::load(&folder.join("scene")).is_ok());
            std::fs::remove_dir_all(folder).unwrap();
        }
    });
    println!("demo: unpacked {there} times");
    let mut last = demo().stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = std::io::BufReader::new(last.stderr.take().unwrap()).lines().map(Result::unwrap);
    assert!(lines.any(|line| line.contains("The trained demo: held-out PSNR 28.9")));
    last.kill().unwrap();
    last.wait().unwrap();
    assert_eq!(unpacked().len(), 1);
}
