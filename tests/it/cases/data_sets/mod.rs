//! Photos with poses: layouts, names, splits, poses.

mod beside_splats;
mod names;
mod pictures;
mod places;
mod splits;

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::cli_support::fmlgs;
use crate::common::case;

/// A copy of a case that may be changed.
pub struct Copy(tempfile::TempDir);

impl Copy {
    /// Of this case; `None` where the cases are absent.
    pub fn of(name: &str) -> Option<Self> {
        let copy = Self(tempfile::tempdir().expect("folder"));
        copy_all(&case(name)?, copy.path());
        Some(copy)
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.path().join(name)
    }

    pub fn rename(&self, from: &str, to: &str) {
        fs::create_dir_all(self.at(to).parent().expect("parent")).expect("create");
        fs::rename(self.at(from), self.at(to)).expect("rename");
    }

    /// Changes a text file.
    pub fn edit(&self, name: &str, change: impl Fn(&str) -> String) {
        let text = fs::read_to_string(self.at(name)).expect("read");
        let changed = change(&text);
        assert_ne!(text, changed, "{name} is as it was");
        fs::write(self.at(name), changed).expect("write");
    }

    /// Changes a JSON file.
    pub fn edit_json(&self, name: &str, change: impl Fn(&mut Value)) {
        self.edit(name, |text| {
            let mut json = serde_json::from_str(text).expect("JSON");
            change(&mut json);
            json.to_string()
        });
    }
}

fn copy_all(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("create");
    for entry in fs::read_dir(from).expect("list").flatten() {
        let target = to.join(entry.file_name());
        match entry.path().is_dir() {
            true => copy_all(&entry.path(), &target),
            // The originals may be read-only, which is copied by fs::copy.
            false => fs::write(target, fs::read(entry.path()).expect("read")).expect("write"),
        }
    }
}

/// Output of `fmlgs info --json`.
#[track_caller]
pub fn info(path: &Path) -> Value {
    fmlgs(&["info", path.to_str().expect("a name"), "--json"]).ok().json()
}

/// The error of `fmlgs info`.
#[track_caller]
pub fn refusal(path: &Path) -> String {
    fmlgs(&["info", path.to_str().expect("a name")]).fails_with(1).stderr
}

pub fn warnings(info: &Value) -> Vec<String> {
    info["warnings"].as_array().expect("a list").iter().map(|w| w.as_str().expect("text").to_owned()).collect()
}

/// The warnings that contain all of these words; there must be one.
#[track_caller]
pub fn warns(info: &Value, words: &[&str]) {
    let all = warnings(info);
    let fit = all.iter().filter(|w| words.iter().all(|word| w.contains(word))).count();
    assert_eq!(fit, 1, "one warning with {words:?} in {all:?}");
}

fn stem(name: &str) -> &str {
    let file = name.rsplit('/').next().unwrap_or(name);
    file.rsplit_once('.').map_or(file, |(stem, _)| stem)
}

/// Stems of the photos, sorted; those held out apart.
pub fn photos(info: &Value) -> (Vec<String>, Vec<String>) {
    let cameras = info["cameras"].as_array().expect("cameras");
    let named = |held_out: bool| {
        let of = cameras.iter().filter(|c| c["held_out"] == held_out);
        of.map(|c| stem(c["name"].as_str().expect("a name")).to_owned()).collect()
    };
    (named(false), named(true))
}

/// The right cameras of this many photos.
#[track_caller]
pub fn right(info: &Value, photos: usize) {
    let base = case("base_cameras.json").expect("beside the cases");
    let base: Value = serde_json::from_slice(&fs::read(base).expect("read")).expect("JSON");
    let cameras = info["cameras"].as_array().expect("cameras");
    assert_eq!(cameras.len(), photos, "{:?}", warnings(info));
    for c in cameras {
        let right = &base[stem(c["name"].as_str().expect("a name"))];
        assert!(right.is_object(), "{}", c["name"]);
        for key in ["center", "world_from_camera", "focal_px", "principal_px"] {
            let numbers = |v: &Value| -> Vec<f64> {
                v[key].as_array().expect(key).iter().map(|n| n.as_f64().expect("a number")).collect()
            };
            for (found, right) in numbers(&c["camera"]).iter().zip(numbers(right)) {
                assert!((found - right).abs() < 1e-5, "{} of {}: {found}, not {right}", key, c["name"]);
            }
        }
    }
}
