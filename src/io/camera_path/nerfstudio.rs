//! Camera paths of nerfstudio's viewer (`camera_paths/*.json`, the input of `ns-render camera-path`).
//!
//! Matrices are world_from_camera with OpenGL axes (x right, y up, z back), 16 numbers row by row;
//! `fov` is vertical, in degrees. The first viewer (before nerfstudio 1.0) wrote a keyframe's matrix
//! as a text of 16 numbers column by column; both are read.
//!
//! Positions are in nerfstudio's scene. If nerfstudio rotated or scaled the scene on loading (its
//! `dataparser_transforms.json`), they differ from the photos' poses.

use std::path::Path;

use glam::{DMat3, DMat4, DVec3};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::json;

use super::{error, members};
use crate::io::{IoError, atomic, files};
use crate::math::rotation::{nearest_rotation, rotation_error};
use crate::scene::{CameraPath, PathKey};

/// Fields of the file that are read. `camera_path` has the frames of the video, `keyframes` their source.
#[derive(Deserialize)]
struct File {
    camera_type: Option<String>,
    #[serde(default, deserialize_with = "keyframes")]
    keyframes: Vec<Keyframe>,
    #[serde(default, deserialize_with = "frames")]
    camera_path: Vec<Frame>,
    fps: Option<f64>,
    seconds: Option<f64>,
    is_cycle: Option<bool>,
    default_transition_sec: Option<f64>,
}

#[derive(Deserialize)]
struct Keyframe {
    matrix: Matrix,
    fov: f64,
    #[serde(default)]
    override_transition_enabled: Option<bool>,
    override_transition_sec: Option<f64>,
}

#[derive(Serialize, Deserialize)]
struct Frame {
    camera_to_world: [f64; 16],
    fov: f64,
    #[serde(default)]
    aspect: Option<f64>,
}

/// Matrix of a keyframe, as either viewer writes it.
#[derive(Deserialize)]
#[serde(untagged, expecting = "a matrix of 16 numbers")]
enum Matrix {
    Rows([f64; 16]),
    Columns(String),
}

fn keyframes<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Keyframe>, D::Error> {
    members(from, "keyframe")
}

fn frames<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Frame>, D::Error> {
    members(from, "frame")
}

/// Parses a path: its keyframes, or else every frame of the video as a key. Not all values are checked yet.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<CameraPath, IoError> {
    let file: File = files::json(bytes, path)?;
    if let Some(kind) = file.camera_type.as_deref().filter(|k| !k.eq_ignore_ascii_case("perspective")) {
        return Err(IoError::Unsupported {
            path: path.into(),
            what: format!("the camera type '{kind}'"),
            remedy: "choose the camera type 'perspective' in nerfstudio and export the path again",
        });
    }
    let fps = file.fps.unwrap_or(30.0);
    let closed = file.is_cycle.unwrap_or(false);
    let bad = |place: String| move |reason: String| IoError::Syntax { path: path.into(), place, reason };
    let mut keys = Vec::new();
    if file.keyframes.is_empty() {
        for (i, frame) in file.camera_path.iter().enumerate() {
            let mut key = key(&frame.camera_to_world, frame.fov).map_err(bad(format!("frame {i}")))?;
            key.time_secs = Some(i as f64 / fps);
            keys.push(key);
        }
    } else {
        // A transition leads to its keyframe; the first one's matters in closed paths only.
        let mut time = 0.0;
        for (i, frame) in file.keyframes.iter().enumerate() {
            let rows = frame.matrix.rows().map_err(bad(format!("keyframe {i}")))?;
            let mut key = key(&rows, frame.fov).map_err(bad(format!("keyframe {i}")))?;
            if i > 0 {
                time += frame.transition_secs(file.default_transition_sec).unwrap_or(0.0);
            }
            key.time_secs = file.default_transition_sec.map(|_| time);
            keys.push(key);
        }
    }
    let film = file.camera_path.len() as f64 / fps;
    Ok(CameraPath { keys, closed, fps, seconds: file.seconds.unwrap_or(film) })
}

/// Writes a path for nerfstudio: `keys` as keyframes, and `frames` (the interpolated video at the path's `fps`, which
/// `ns-render` renders) as `camera_path`, for pictures of `size_px`. Waits and names have no place in the format and
/// are left out; the roll goes into the matrices.
///
/// # Errors
/// [`IoError::Syntax`] names the key and field of a path that breaks a rule; [`IoError::Write`].
pub fn write(path: &Path, keys: &CameraPath, frames: &[PathKey], size_px: (u32, u32)) -> Result<(), IoError> {
    keys.validate().map_err(|e| error(path, &e))?;
    let film = CameraPath { keys: frames.to_vec(), ..keys.clone() };
    film.validate().map_err(|e| error(path, &e))?;
    let (width, height) = (size_px.0.max(1), size_px.1.max(1));
    let aspect = f64::from(width) / f64::from(height);
    let spans = spans(keys);
    let keyframe = |(key, secs): (&PathKey, &f64)| {
        json!({
            "matrix": matrix(key),
            "fov": key.fov_y_rad.to_degrees(),
            "aspect": aspect,
            "override_transition_enabled": true,
            "override_transition_sec": secs,
        })
    };
    let frame =
        |key: &PathKey| Frame { camera_to_world: matrix(key), fov: key.fov_y_rad.to_degrees(), aspect: Some(aspect) };
    let file = json!({
        "default_fov": keys.keys.first().map_or(50.0, |k| k.fov_y_rad.to_degrees()),
        "default_transition_sec": spans.first(),
        "keyframes": keys.keys.iter().zip(&spans).map(keyframe).collect::<Vec<_>>(),
        "camera_type": "perspective",
        "render_height": height,
        "render_width": width,
        "fps": keys.fps,
        "seconds": keys.seconds,
        "is_cycle": keys.closed,
        "smoothness_value": 0.0,
        "camera_path": frames.iter().map(frame).collect::<Vec<_>>(),
    });
    atomic::write(path, |out| {
        serde_json::to_writer(&mut *out, &file)?;
        out.write_all(b"\n")
    })
}

/// Seconds of the way to each key; the first value is the way back from the last key. Equal parts of the total unless
/// every key has its time.
fn spans(path: &CameraPath) -> Vec<f64> {
    /// The shortest transition of nerfstudio's viewer.
    const SHORTEST_SECS: f64 = 1e-3;
    let ways = if path.closed { path.keys.len() } else { path.keys.len().saturating_sub(1) }.max(1);
    let equal = path.seconds / ways as f64;
    let times: Option<Vec<f64>> = path.keys.iter().map(|k| k.time_secs).collect();
    let spans: Vec<f64> = match times {
        Some(times) => {
            let back = times.last().map_or(equal, |t| path.seconds - t);
            let first = if path.closed { back } else { equal };
            let ways = times.windows(2).map(|t| t[1] - t[0]);
            std::iter::once(first).chain(ways).take(times.len()).collect()
        }
        None => vec![equal; path.keys.len()],
    };
    spans.into_iter().map(|s| s.max(SHORTEST_SECS)).collect()
}

/// World_from_camera with OpenGL axes, row by row.
fn matrix(key: &PathKey) -> [f64; 16] {
    let r = key.rotation();
    let columns = [r.x_axis.extend(0.0), (-r.y_axis).extend(0.0), (-r.z_axis).extend(0.0), key.center.extend(1.0)];
    DMat4::from_cols(columns[0], columns[1], columns[2], columns[3]).transpose().to_cols_array()
}

/// Makes the key of a matrix (OpenGL axes, row by row) and a field of view in degrees.
fn key(rows: &[f64; 16], fov_deg: f64) -> Result<PathKey, String> {
    if rows.iter().any(|v| !v.is_finite()) {
        return Err("the matrix has a number that is not finite".into());
    }
    if rows[12..] != [0.0, 0.0, 0.0, 1.0] {
        return Err("the last row of the matrix is not 0 0 0 1".into());
    }
    let column = |c: usize| DVec3::new(rows[c], rows[4 + c], rows[8 + c]);
    let rotation = DMat3::from_cols(column(0), -column(1), -column(2));
    let deviation = rotation_error(&rotation);
    if !(deviation <= 1e-3) {
        return Err(format!("the matrix's 3x3 part is not a rotation (deviation {deviation:.2e})"));
    }
    if !(fov_deg > 0.0 && fov_deg < 180.0) {
        return Err(format!("fov = {fov_deg} is not between 0 and 180 degrees"));
    }
    Ok(PathKey::of_pose(column(3), nearest_rotation(&rotation), fov_deg.to_radians()))
}

impl Matrix {
    /// The 16 numbers row by row.
    fn rows(&self) -> Result<[f64; 16], String> {
        match self {
            Self::Rows(rows) => Ok(*rows),
            Self::Columns(text) => {
                let columns: [f64; 16] =
                    serde_json::from_str(text).map_err(|e| format!("the matrix's text is not 16 numbers: {e}"))?;
                Ok(DMat4::from_cols_array(&columns).transpose().to_cols_array())
            }
        }
    }
}

impl Keyframe {
    /// Seconds of the way to this keyframe.
    fn transition_secs(&self, default: Option<f64>) -> Option<f64> {
        let own = self.override_transition_enabled.unwrap_or(false);
        self.override_transition_sec.filter(|_| own).or(default)
    }
}
