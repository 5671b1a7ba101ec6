//! `measurements.json`: measurements that are kept with a scene.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::scene_files::MEASUREMENTS_FILE;
use super::{IoError, SceneFolder, files};
use crate::scene::measurement::{Measurement, MeasurementKind};
use crate::scene::text;

/// Version of the format that is written, and the highest that is read.
const VERSION: u64 = 1;
/// Most measurements of a scene.
const MOST: usize = 10_000;

#[derive(Deserialize)]
struct Versioned {
    version: u64,
}

#[derive(Deserialize)]
struct Content {
    measurements: Vec<Measurement>,
}

#[derive(Serialize)]
struct Written<'a> {
    version: u64,
    measurements: &'a [Measurement],
}

/// Reads the measurements of the scene in `folder`; none without a file.
pub(crate) fn load(folder: &Path) -> Result<Vec<Measurement>, IoError> {
    let path = folder.join(MEASUREMENTS_FILE);
    if !path.exists() {
        return Ok(Vec::new());
    }
    let bytes = files::read(&path, files::MAX_TEXT_BYTES)?;
    // The version first: the rest of a newer file may not parse.
    let Versioned { version } = files::json(&bytes, &path)?;
    if version == 0 || version > VERSION {
        return Err(IoError::Version { path, found: version, supported: VERSION });
    }
    let Content { mut measurements } = files::json(&bytes, &path)?;
    check(&measurements, &path)?;
    for m in &mut measurements {
        m.name = text::line(&m.name).into_owned();
    }
    Ok(measurements)
}

/// Refuses measurements with a wrong number of points, points that are not finite, or a number that two have.
fn check(all: &[Measurement], path: &Path) -> Result<(), IoError> {
    let wrong = |at: usize, why: &str| IoError::syntax(path, format!("measurements[{at}]"), why);
    if all.len() > MOST {
        return Err(IoError::syntax(path, "measurements", "there are more than 10,000"));
    }
    let mut ids = std::collections::BTreeSet::new();
    for (at, m) in all.iter().enumerate() {
        let (least, most) = m.kind.points();
        if !(least..=most).contains(&m.points.len()) {
            let most = MeasurementKind::MOST_POINTS;
            return Err(wrong(at, &format!("the kind needs {least} points or more, at most {most}")));
        }
        if !m.points.iter().all(|p| p.is_finite()) {
            return Err(wrong(at, "a coordinate is not finite"));
        }
        if !ids.insert(m.id) {
            return Err(wrong(at, "another measurement has the same id"));
        }
    }
    Ok(())
}

impl SceneFolder {
    /// Replaces the measurements of the scene.
    pub(crate) fn save_measurements(&self, all: &[Measurement]) -> Result<PathBuf, IoError> {
        let content = Written { version: VERSION, measurements: all };
        self.save_beside(MEASUREMENTS_FILE, |w| {
            serde_json::to_writer_pretty(&mut *w, &content)?;
            w.write_all(b"\n")
        })
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use glam::DVec3;

    use super::*;

    #[test]
    fn measurements_survive_and_bad_files_are_refused_with_their_place() {
        let folder = tempfile::tempdir().expect("folder");
        assert_eq!(load(folder.path()).expect("no file"), []);
        let points = vec![DVec3::new(0.1, 1.0 / 3.0, -2e-7), DVec3::X];
        let m = Measurement { id: 7, name: "edge".into(), kind: MeasurementKind::Length, points, hidden: true };
        let held = SceneFolder::hold(folder.path(), "test").expect("held");
        let path = held.save_measurements(std::slice::from_ref(&m)).expect("saved");
        assert_eq!(load(folder.path()).expect("read"), std::slice::from_ref(&m), "bit for bit");
        let good = fs::read_to_string(&path).expect("text");
        let spoiled = |from: &str, to: &str| {
            assert!(good.contains(from), "{good}");
            fs::write(&path, good.replacen(from, to, 1)).expect("written");
            load(folder.path()).map_err(|e| e.to_string())
        };
        assert!(!spoiled("edge", "ed\\u001bge").expect("read")[0].name.contains('\u{1b}'));
        for (from, to, says) in [
            ("\"version\": 1", "\"version\": 2", "2"),
            ("\"length\"", "\"angle\"", "measurements[0]"),
            ("1.0", "1e999", "measurements.json"),
            ("{", "[", "measurements.json"),
        ] {
            let e = spoiled(from, to).expect_err(to);
            assert!(e.contains(says), "{to}: {e}");
        }
        let twice = held.save_measurements(&[m.clone(), m]).and_then(|_| load(folder.path()));
        assert!(twice.expect_err("refused").to_string().contains("same id"));
    }
}
