//! The program's own JSON for camera paths.
//!
//! Poses as in [`PathKey`]: `world_from_camera` row by row, its columns right, down and forward.

use std::io::{self, Write};
use std::path::Path;

use glam::{DMat3, DVec3};
use serde::{Deserialize, Deserializer, Serialize};

use super::{error, members};
use crate::io::{IoError, atomic, files};
use crate::scene::{CameraPath, PathKey, text};

/// Value of `format` in a file.
pub const FORMAT: &str = "fmlgs-camera-path";
/// Version that is written, and the highest that is read.
pub const VERSION: u64 = 1;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    version: u64,
    closed: bool,
    fps: f64,
    seconds: f64,
    #[serde(deserialize_with = "keys")]
    keys: Vec<Key>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Key {
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "text::read_optional_name")]
    name: Option<String>,
    center: [f64; 3],
    world_from_camera: [[f64; 3]; 3],
    fov_y_rad: f64,
    #[serde(default)]
    roll_rad: f64,
    #[serde(default)]
    dwell_secs: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    time_secs: Option<f64>,
}

fn keys<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Key>, D::Error> {
    members(from, "key")
}

/// Writes a valid camera path atomically.
///
/// # Errors
/// [`IoError::Syntax`] names the key and field of a path that breaks a rule; [`IoError::Write`].
pub fn write(path: &Path, camera_path: &CameraPath) -> Result<(), IoError> {
    camera_path.validate().map_err(|e| error(path, &e))?;
    atomic::write(path, |out| encode(out, camera_path))
}

/// Encodes a valid camera path.
pub(super) fn encode(out: &mut dyn Write, camera_path: &CameraPath) -> io::Result<()> {
    let file = File {
        format: FORMAT.into(),
        version: VERSION,
        closed: camera_path.closed,
        fps: camera_path.fps,
        seconds: camera_path.seconds,
        keys: camera_path.keys.iter().map(Key::from).collect(),
    };
    serde_json::to_writer_pretty(&mut *out, &file)?;
    out.write_all(b"\n")
}

/// Parses a path with the `version` of its head; its values are not checked yet.
pub(crate) fn parse(bytes: &[u8], version: Option<u64>, path: &Path) -> Result<CameraPath, IoError> {
    match version {
        Some(VERSION) => {}
        Some(found) if found > VERSION => {
            return Err(IoError::Version { path: path.into(), found, supported: VERSION });
        }
        _ => {
            let reason = format!("version is missing or 0; this program writes {VERSION}");
            return Err(IoError::Syntax { path: path.into(), place: "the head".into(), reason });
        }
    }
    let file: File = files::json(bytes, path)?;
    Ok(CameraPath {
        keys: file.keys.into_iter().map(PathKey::from).collect(),
        closed: file.closed,
        fps: file.fps,
        seconds: file.seconds,
    })
}

impl From<&PathKey> for Key {
    fn from(key: &PathKey) -> Self {
        Self {
            name: key.name.clone(),
            center: key.center.to_array(),
            world_from_camera: key.world_from_camera.transpose().to_cols_array_2d(),
            fov_y_rad: key.fov_y_rad,
            roll_rad: key.roll_rad,
            dwell_secs: key.dwell_secs,
            time_secs: key.time_secs,
        }
    }
}

impl From<Key> for PathKey {
    fn from(key: Key) -> Self {
        Self {
            center: DVec3::from_array(key.center),
            world_from_camera: DMat3::from_cols_array_2d(&key.world_from_camera).transpose(),
            fov_y_rad: key.fov_y_rad,
            roll_rad: key.roll_rad,
            dwell_secs: key.dwell_secs,
            time_secs: key.time_secs,
            name: key.name,
        }
    }
}
