//! Measurements of a scene: kept with it, carried over to scenes that are made of it, and exported.

use std::collections::{BTreeSet, HashSet};
use std::path::Path;
use std::thread;
use std::time::Duration;

use glam::DVec3;
use rayon::prelude::*;
use serde_json::{Value, json};

use super::{JobError, export};
pub(crate) use crate::io::measurements::load;
use crate::io::{IoError, SceneFolder, trained};
use crate::pipeline::observer::{Observer, Severity};
use crate::scene::GaussianCloud;
use crate::scene::measurement::{MeasuredValue, Measurement, MeasurementKind, merged};
use crate::scene::upright_box::UprightBox;

/// Endings of exported files.
const ENDINGS: [&str; 2] = [".csv", ".json"];
/// Tries to hold a folder that another program holds for a moment.
const TRIES: usize = 10;
/// Share of the Gaussians in a box that must stay where they are for the box to stay true.
const UNCHANGED: f64 = 0.99;
/// Share of its edges by which a box may be left.
const BOX_MARGIN: f64 = 1e-3;

/// Measurements that are kept with the scene in `folder`; none, and a warning, if they cannot be read.
pub(crate) fn known(folder: &Path, observer: &mut dyn Observer) -> Vec<Measurement> {
    load(folder).unwrap_or_else(|e| {
        observer.note(Severity::Warning, format!("Measurements are not shown: {e}"));
        Vec::new()
    })
}

/// Stores what was changed from `base` to `ours` with the scene in `folder`; what others have stored since stays.
/// Returns whether there is a scene to store it with.
///
/// # Errors
/// If the stored measurements cannot be read or written; they are unchanged then.
pub(crate) fn store(folder: &Path, base: &[Measurement], ours: &[Measurement]) -> Result<bool, JobError> {
    if !trained::is_scene(folder) {
        return Ok(false);
    }
    let held = hold_soon(folder, "storing measurements")?;
    held.save_measurements(&merged(base, ours, &load(folder)?))?;
    Ok(true)
}

/// Holds a scene's folder, also if another program holds it for a moment.
pub(super) fn hold_soon(folder: &Path, what: &str) -> Result<SceneFolder, IoError> {
    let hold = || SceneFolder::hold(folder, what);
    let mut held = hold();
    for _ in 1..TRIES {
        if !matches!(held, Err(IoError::Busy { .. })) {
            break;
        }
        thread::sleep(Duration::from_millis(100));
        held = hold();
    }
    held
}

/// Copies measurements from the scene in `from` into a scene made of it, without those that no longer hold.
pub(super) fn carry_over(
    from: &Path,
    [before, after]: [&GaussianCloud; 2],
    into: &SceneFolder,
) -> Result<(), JobError> {
    // A scene is made of another one even if that one's measurements are damaged; they stay where they are.
    let Ok(mut all) = load(from) else { return Ok(()) };
    let stale = stale(&all, before, after);
    all.retain(|m| !stale.contains(&m.id));
    if !all.is_empty() {
        into.save_measurements(&all)?;
    }
    Ok(())
}

/// Ids of the measurements of `before` that do not hold in `after`: the Gaussian nearest to one of their points, or a
/// part of what is in their box, was moved or deleted.
pub(crate) fn stale(all: &[Measurement], before: &GaussianCloud, after: &GaussianCloud) -> BTreeSet<u32> {
    if all.is_empty() {
        return BTreeSet::new();
    }
    let bits = |p: DVec3| p.to_array().map(f64::to_bits);
    let places: HashSet<[u64; 3]> = (0..after.len()).map(|i| bits(after.world_position(i))).collect();
    let stays = |i: usize| places.contains(&bits(before.world_position(i)));
    let holds = |m: &Measurement| match (m.kind, m.points.as_slice()) {
        (MeasurementKind::Box, [corner, a, b, c, ..]) => {
            let of = UprightBox::of_ends([*corner, *a, *b, *c]);
            let inside =
                (0..before.len()).into_par_iter().filter(|i| of.contains(before.world_position(*i), BOX_MARGIN));
            let counts = inside.map(|i| [1_usize, usize::from(stays(i))]);
            let [all, stay] = counts.reduce(|| [0, 0], |[a, b], [c, d]| [a + c, b + d]);
            stay as f64 >= UNCHANGED * all as f64
        }
        (_, points) => points.iter().all(|p| nearest(before, *p).is_none_or(stays)),
    };
    all.iter().filter(|m| !holds(m)).map(|m| m.id).collect()
}

/// Index of the Gaussian nearest to a point.
fn nearest(cloud: &GaussianCloud, to: DVec3) -> Option<usize> {
    let distances = (0..cloud.len()).into_par_iter().map(|i| (cloud.world_position(i).distance_squared(to), i));
    distances.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i)| i)
}

/// Writes measurements as `.csv`, a row for each number, or as `.json`.
///
/// # Errors
/// If the name has another ending, is that of a file of a scene, or the file cannot be written.
pub(crate) fn write(path: &Path, all: &[Measurement], meters_per_unit: Option<f64>) -> Result<(), JobError> {
    export::check(path, &ENDINGS, &[])?;
    let is_json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    match is_json {
        true => export::json(path, &as_json(all, meters_per_unit))?,
        false => export::text(path, &csv(all, meters_per_unit))?,
    }
    Ok(())
}

/// Numbers of a value: name, number and unit.
fn numbers(value: &MeasuredValue, meters_per_unit: Option<f64>) -> Vec<(&'static str, f64, &'static str)> {
    let scale = meters_per_unit.unwrap_or(1.0);
    let power = |name, value: f64, dimension: i32| {
        let units = if meters_per_unit.is_some() { ["m", "m2", "m3"] } else { ["units", "units2", "units3"] };
        (name, value * scale.powi(dimension), units[dimension as usize - 1])
    };
    match value {
        MeasuredValue::Length(length) => vec![power("length", *length, 1)],
        MeasuredValue::Angle(angle) => vec![("angle", angle.to_degrees(), "degrees")],
        MeasuredValue::Area(fit) => {
            vec![
                power("area", fit.area, 2),
                power("rms_off_plane", fit.rms, 1),
                power("most_off_plane", fit.farthest, 1),
            ]
        }
        MeasuredValue::Box([a, b, c]) => vec![
            power("box_length", *a, 1),
            power("box_width", *b, 1),
            power("box_height", *c, 1),
            power("box_volume", a * b * c, 3),
        ],
    }
}

fn csv(all: &[Measurement], meters_per_unit: Option<f64>) -> String {
    let mut out = "name,quantity,value,unit\n".to_owned();
    for m in all {
        let name = m.name.replace('"', "\"\"");
        for (quantity, value, unit) in m.value().iter().flat_map(|value| numbers(value, meters_per_unit)) {
            out.push_str(&format!("\"{name}\",{quantity},{value},{unit}\n"));
        }
    }
    out
}

/// Measurements as JSON: points in scene units, values in meters if the scale is known.
pub(crate) fn as_json(all: &[Measurement], meters_per_unit: Option<f64>) -> Value {
    let one = |m: &Measurement| {
        let mut values = serde_json::Map::new();
        for (name, value, _) in m.value().iter().flat_map(|value| numbers(value, meters_per_unit)) {
            values.insert(name.to_owned(), json!(value));
        }
        json!({ "name": m.name, "kind": m.kind, "values": values, "points": m.points })
    };
    json!({
        "unit": if meters_per_unit.is_some() { "m" } else { "scene units" },
        "meters_per_unit": meters_per_unit,
        "measurements": all.iter().map(one).collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::trained::SceneInfo;
    use crate::jobs::{derived, open};

    fn line(id: u32, name: &str, to: DVec3) -> Measurement {
        let points = vec![DVec3::ZERO, to];
        Measurement { id, name: name.into(), kind: MeasurementKind::Length, points, hidden: false }
    }

    fn names(folder: &Path) -> Vec<String> {
        load(folder).expect("read").into_iter().map(|m| m.name).collect()
    }

    #[test]
    fn two_windows_store_without_loss_and_a_bad_file_is_left_alone() {
        let folder = tempfile::tempdir().expect("folder");
        let scene = folder.path().join("scene");
        let [a, b] = [line(1, "a", DVec3::X), line(2, "b", DVec3::Y)];
        assert!(!store(&scene, &[], std::slice::from_ref(&a)).expect("no scene, no file") && !scene.exists());
        trained::save(&scene, &SceneInfo::default(), &GaussianCloud::default(), None).expect("saved");
        assert!(store(&scene, &[], std::slice::from_ref(&a)).expect("stored"));
        assert!(store(&scene, &[], std::slice::from_ref(&b)).expect("by another window"));
        assert_eq!(names(&scene), ["a", "b"]);
        store(&scene, std::slice::from_ref(&a), &[]).expect("deleted in the first window");
        assert_eq!(names(&scene), ["b"], "the other window's stays");
        let path = scene.join("measurements.json");
        std::fs::write(&path, "{\"version\": 9}").expect("written");
        let e = store(&scene, &[], &[a]).expect_err("refused").to_string();
        assert!(e.contains("measurements.json"), "{e}");
        assert_eq!(std::fs::read_to_string(path).expect("there"), "{\"version\": 9}");
    }

    #[test]
    fn a_derived_scene_keeps_what_still_holds() {
        let folder = tempfile::tempdir().expect("folder");
        let (scene, out) = (folder.path().join("scene"), folder.path().join("out"));
        let places: Vec<[f32; 3]> = (0..10).map(|i| [i as f32, 0.0, 0.0]).collect();
        let cloud = GaussianCloud::isotropic(places.clone(), -3.0, 1.0);
        trained::save(&scene, &SceneInfo::default(), &cloud, None).expect("saved");
        let cube = |id, name: &str, at: f64| {
            let corner = DVec3::new(at - 0.5, -0.5, -0.5);
            let points = [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y, DVec3::Z].map(|v| corner + v).to_vec();
            Measurement { kind: MeasurementKind::Box, points, ..line(id, name, DVec3::ZERO) }
        };
        let all = [
            line(1, "to 3", DVec3::X * 3.1),
            line(2, "to 8", DVec3::X * 8.1),
            cube(3, "box at 1", 1.0),
            cube(4, "box at 8", 8.0),
        ];
        store(&scene, &[], &all).expect("stored");
        // What was at 8 is moved away, 9 is deleted.
        let mut moved = places[..9].to_vec();
        moved[8][1] = 5.0;
        let edited = GaussianCloud::isotropic(moved, -3.0, 1.0);
        let from = open::scene(&scene).expect("opened");
        derived::store(&from, ("edited".into(), true), &edited, None, &out).expect("stored");
        assert_eq!(names(&out), ["to 3", "box at 1"]);
        assert_eq!(names(&scene).len(), 4, "those of the scene before stay");
        assert!(stale(&all, &cloud, &cloud).is_empty(), "control: nothing was moved");
    }

    #[test]
    fn exports_have_one_row_for_each_number_and_refuse_other_names() {
        let folder = tempfile::tempdir().expect("folder");
        let square = vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let area = Measurement { kind: MeasurementKind::Area, points: square, ..line(2, "desk, \"top\"", DVec3::X) };
        let all = [line(1, "edge", DVec3::X * 3.0), area];
        let at = |name: &str| folder.path().join(name);
        let read = |name: &str| std::fs::read_to_string(at(name)).expect("text");
        write(&at("a.csv"), &all, Some(0.5)).expect("written");
        let rows = read("a.csv");
        assert!(rows.starts_with("name,quantity,value,unit\n\"edge\",length,1.5,m\n"), "{rows}");
        assert!(rows.contains("\"desk, \"\"top\"\"\",area,0.25,m2\n") && rows.lines().count() == 5, "{rows}");
        write(&at("a.json"), &all, None).expect("written");
        let value: Value = serde_json::from_str(&read("a.json")).expect("JSON");
        assert_eq!(value["measurements"][0]["values"]["length"], json!(3.0));
        assert_eq!((&value["unit"], &value["meters_per_unit"]), (&json!("scene units"), &Value::Null));
        assert!(write(&at("a.txt"), &all, None).is_err(), "control: another ending");
    }
}
