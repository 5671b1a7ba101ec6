//! Camera paths written, read again, and read from hostile files.

use std::path::Path;

use glam::{DMat4, DVec2, DVec3, DVec4};

use super::*;
use crate::math::rotation::rotation_error;
use crate::scene::{Camera, PathKey};

const P: &str = "flight.json";

fn key(at: f64) -> PathKey {
    let eye = DVec3::new(3.0 * at.cos(), 3.0 * at.sin(), 1.0 + 0.2 * at);
    let camera = Camera::look_at(eye, DVec3::new(0.1, 0.2, 0.3), DVec3::Z, 0.9, 640, 480).expect("valid");
    PathKey { roll_rad: 0.1 * at, fov_y_rad: 0.7 + 0.1 * at, ..PathKey::of_camera(&camera) }
}

fn path() -> CameraPath {
    let mut keys: Vec<PathKey> = [0.0, 0.5, 1.5].into_iter().map(key).collect();
    keys[1].dwell_secs = 1.5;
    keys[1].name = Some("the „red“ kettle".into());
    keys[2].time_secs = Some(1.0 / 3.0);
    CameraPath { keys, closed: true, fps: 29.97, seconds: 7.25 }
}

/// Path without the properties that nerfstudio cannot hold: no waits, no names, every key with its time.
fn plain() -> CameraPath {
    let mut path = path();
    for (i, key) in path.keys.iter_mut().enumerate() {
        (key.dwell_secs, key.name, key.time_secs) = (0.0, None, Some(2.0 * i as f64));
    }
    path
}

fn nerfstudio_json(path: &CameraPath, frames: &[PathKey]) -> serde_json::Value {
    let folder = tempfile::tempdir().expect("folder");
    let file = folder.path().join(P);
    nerfstudio::write(&file, path, frames, (640, 480)).expect("write");
    serde_json::from_slice(&std::fs::read(file).expect("read")).expect("JSON")
}

fn parse_json(value: &serde_json::Value) -> Result<CameraPath, IoError> {
    parse(value.to_string().as_bytes(), Path::new(P))
}

#[test]
fn the_own_format_keeps_every_bit() {
    let folder = tempfile::tempdir().expect("folder");
    let file = folder.path().join(P);
    write(&file, &path()).expect("write");
    assert_eq!(open(&file).expect("open"), path());
    let empty = CameraPath { keys: Vec::new(), ..path() };
    write(&file, &empty).expect("write");
    assert_eq!(open(&file).expect("open"), empty);
}

#[test]
fn a_path_that_breaks_a_rule_is_not_written() {
    let folder = tempfile::tempdir().expect("folder");
    let file = folder.path().join(P);
    let mut bad = path();
    bad.keys[1].fov_y_rad = f64::NAN;
    for e in [write(&file, &bad), nerfstudio::write(&file, &bad, &[], (64, 48))] {
        let text = e.expect_err("refused").to_string();
        assert!(text.contains(P) && text.contains("key 1 (") && text.contains("fov_y_rad"), "{text}");
    }
    assert!(!file.exists());
    let e = write(&folder.path().join("no/a.json"), &path()).expect_err("no folder");
    assert!(matches!(e, IoError::Write { .. }));
}

#[test]
fn nerfstudio_reads_back() {
    let path = plain();
    let again = parse_json(&nerfstudio_json(&path, &path.keys)).expect("read");
    assert_eq!((again.closed, again.fps, again.seconds), (path.closed, path.fps, path.seconds));
    assert_eq!(again.keys.len(), path.keys.len());
    for (a, b) in again.keys.iter().zip(&path.keys) {
        assert!((a.center - b.center).length() < 1e-12);
        assert!((a.rotation() - b.rotation()).to_cols_array().iter().all(|e| e.abs() < 1e-12));
        assert!((a.fov_y_rad - b.fov_y_rad).abs() < 1e-12);
        assert!((a.time_secs.expect("time") - b.time_secs.expect("time")).abs() < 1e-9);
    }
}

/// Projection of a point in a pinhole camera of nerfstudio (its `Cameras`, OpenGL axes).
fn seen_by_nerfstudio(rows: &[f64], fov_deg: f64, (width, height): (f64, f64), p: DVec3) -> Option<DVec2> {
    let world_from_camera = DMat4::from_cols_slice(rows).transpose();
    let q: DVec4 = world_from_camera.inverse() * p.extend(1.0);
    let focal = 0.5 * height / (0.5 * fov_deg.to_radians()).tan();
    (q.z < 0.0).then(|| DVec2::new(0.5 * width + focal * q.x / -q.z, 0.5 * height - focal * q.y / -q.z))
}

#[test]
fn a_point_lands_on_the_same_pixel_in_nerfstudio() {
    let path = plain();
    let json = nerfstudio_json(&path, &path.keys);
    let size = (f64::from(json["render_width"].as_u64().expect("w") as u32), 480.0);
    for list in ["keyframes", "camera_path"] {
        let matrix = if list == "keyframes" { "matrix" } else { "camera_to_world" };
        for (key, frame) in path.keys.iter().zip(json[list].as_array().expect("list")) {
            let rows: Vec<f64> = frame[matrix].as_array().expect("rows").iter().filter_map(|v| v.as_f64()).collect();
            let fov = frame["fov"].as_f64().expect("fov");
            for p in [DVec3::ZERO, DVec3::new(0.4, -0.3, 0.2), DVec3::new(-0.2, 0.5, 0.7)] {
                let ours = key.camera(640, 480).project(p).expect("in front");
                let theirs = seen_by_nerfstudio(&rows, fov, size, p).expect("in front");
                assert!((ours - theirs).length() < 1e-8, "{list}: {ours} {theirs}");
                // Without the change of axes the point is elsewhere, or behind.
                let unturned = PathKey { roll_rad: key.roll_rad + 0.3, ..key.clone() };
                let off = unturned.camera(640, 480).project(p).expect("in front");
                assert!(p == DVec3::ZERO || (off - theirs).length() > 1.0);
            }
        }
    }
}

#[test]
fn both_viewers_of_nerfstudio_are_read() {
    // The camera sits at (1, 2, 3), looks along -x (OpenGL's back axis is +x), up is +z.
    let rows = [0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 2.0, 0.0, 1.0, 0.0, 3.0, 0.0, 0.0, 0.0, 1.0];
    let columns = "[0,1,0,0,0,0,1,0,1,0,0,0,1,2,3,1]";
    let new = serde_json::json!({"keyframes": [{"matrix": rows, "fov": 50, "aspect": 1.5}], "fps": 24, "seconds": 4,
        "render_height": 480, "render_width": 640, "camera_type": "perspective", "is_cycle": false,
        "smoothness_value": 0.5, "default_transition_sec": 2.0, "crop": null, "camera_path": []});
    let old = serde_json::json!({"keyframes": [{"matrix": columns, "fov": 50, "aspect": 1.5}], "fps": 24,
        "seconds": 4, "render_height": 480, "render_width": 640, "is_linear": true, "camera_path": []});
    let film = serde_json::json!({"camera_path": [{"camera_to_world": rows, "fov": 50}], "fps": 24});
    for (name, json) in [("new", &new), ("old", &old), ("film", &film)] {
        let path = parse_json(json).expect(name);
        let key = &path.keys[0];
        assert_eq!(key.center, DVec3::new(1.0, 2.0, 3.0), "{name}");
        assert!((key.world_from_camera.z_axis - DVec3::NEG_X).length() < 1e-12, "{name}: forward");
        assert!((key.world_from_camera.y_axis - DVec3::NEG_Z).length() < 1e-12, "{name}: down");
        assert!((key.fov_y_rad - 50.0_f64.to_radians()).abs() < 1e-12, "{name}");
        assert!(rotation_error(&key.world_from_camera) < 1e-12);
    }
    assert_eq!(parse_json(&film).expect("film").seconds, 1.0 / 24.0);
    let mut fisheye = new;
    fisheye["camera_type"] = "fisheye".into();
    assert!(matches!(parse_json(&fisheye), Err(IoError::Unsupported { .. })));
}

fn own_json() -> serde_json::Value {
    let folder = tempfile::tempdir().expect("folder");
    let file = folder.path().join(P);
    write(&file, &path()).expect("write");
    serde_json::from_slice(&std::fs::read(file).expect("read")).expect("JSON")
}

#[test]
fn errors_name_the_file_and_the_key() {
    type Spoil = fn(&mut serde_json::Value);
    let own: [(Spoil, &str); 10] = [
        (|j| j["keys"][1]["center"][2] = "x".into(), "key 1"),
        (|j| j["keys"][2]["center"] = serde_json::json!([1, 2]), "key 2"),
        (|j| j["keys"][1]["fov_y_rad"] = 4.into(), "key 1 ('the „red“ kettle'): fov_y_rad"),
        (|j| j["keys"][0]["world_from_camera"][0][0] = 5.into(), "key 0: world_from_camera"),
        (|j| j["keys"][0]["dwell_secs"] = (-1).into(), "key 0: dwell_secs"),
        (|j| j["keys"][0]["fov_y_deg"] = 4.into(), "key 0: unknown field `fov_y_deg`"),
        (|j| j["keys"] = serde_json::json!({"a": 1}), "a list of keys"),
        (|j| j["fps"] = serde_json::Value::Null, "null"),
        (|j| j["version"] = 0.into(), "version"),
        (|j| j["format"] = "gif".into(), "'gif'"),
    ];
    for (spoil, named) in own {
        let mut json = own_json();
        spoil(&mut json);
        let text = parse_json(&json).expect_err(named).to_string();
        assert!(text.contains(named) && text.contains(P), "{named}: {text}");
    }
    let mut newer = own_json();
    newer["version"] = 9.into();
    assert!(matches!(parse_json(&newer), Err(IoError::Version { found: 9, .. })));
    let theirs: [(Spoil, &str); 5] = [
        (|j| j["keyframes"][1]["matrix"] = serde_json::json!([1, 2]), "keyframe 1"),
        (|j| j["keyframes"][1]["matrix"] = "[1, 2]".into(), "keyframe 1"),
        (|j| j["keyframes"][2]["matrix"][0] = 7.into(), "keyframe 2"),
        (|j| j["keyframes"][2]["fov"] = 180.into(), "keyframe 2"),
        (|j| j["keyframes"][0]["matrix"][15] = 2.into(), "keyframe 0"),
    ];
    for (spoil, named) in theirs {
        let mut json = nerfstudio_json(&plain(), &[]);
        spoil(&mut json);
        let text = parse_json(&json).expect_err(named).to_string();
        assert!(text.contains(named) && text.contains(P), "{named}: {text}");
    }
}

#[test]
fn hostile_files_are_refused_without_panics() {
    let texts = [own_json().to_string(), nerfstudio_json(&plain(), &plain().keys).to_string()];
    let mut random = 1_u64;
    for text in &texts {
        parse(text.as_bytes(), Path::new(P)).expect("valid before it is spoiled");
        for end in 0..text.len() {
            parse(&text.as_bytes()[..end], Path::new(P)).expect_err("truncated");
        }
        let values = ["NaN", "1e999", "-1e308", "null", "\"\"", "[]", "{}", "true", "18446744073709551616", "[[[["];
        for at in text.match_indices([':', ',', '[']).map(|(at, _)| at + 1) {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let value = values[(random >> 33) as usize % values.len()];
            let rest = text[at..].find([',', '}', ']']).map_or("", |end| &text[at + end..]);
            let spoiled = format!("{}{value}{rest}", &text[..at]);
            if let Ok(path) = parse(spoiled.as_bytes(), Path::new(P)) {
                path.validate().expect("what is accepted is valid");
            }
        }
    }
    for deep in ["[".repeat(100_000), "{\"keys\":".repeat(100_000)] {
        parse(deep.as_bytes(), Path::new(P)).expect_err("too deep");
    }
    for bytes in [&b""[..], b"\xff\xfe", b"null", b"[]", b"{}", b"{\"format\": 3}", b"{\"keyframes\": 3}"] {
        parse(bytes, Path::new(P)).expect_err("nothing of the kind");
    }
}

#[test]
fn too_many_keys_are_refused() {
    let one = own_json()["keys"][0].to_string();
    let list = vec![one.as_str(); CameraPath::MAX_KEYS + 1].join(",");
    let head = format!("{{\"format\": \"{FORMAT}\", \"version\": 1, \"closed\": false, \"fps\": 30, \"seconds\": 1");
    let text = parse(format!("{head}, \"keys\": [{list}]}}").as_bytes(), Path::new(P)).expect_err("many").to_string();
    assert!(text.contains("more than the 100000 keys"), "{text}");
    let fits = &list[..list.len() - one.len() - 1];
    let path = parse(format!("{head}, \"keys\": [{fits}]}}").as_bytes(), Path::new(P)).expect("fits");
    assert_eq!(path.keys.len(), CameraPath::MAX_KEYS);
}
