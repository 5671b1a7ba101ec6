//! A camera in a JSON file: alone, or as an entry of the cameras in `scene.json` or `info --json`.

use std::path::Path;

use serde::Deserialize;

use super::{IoError, files};
use crate::scene::Camera;

const MAX_BYTES: u64 = 16 << 20;

#[derive(Deserialize)]
#[serde(untagged)]
enum CameraFile {
    Entry { camera: Camera },
    Alone(Camera),
}

/// Reads a camera.
pub fn read(path: &Path) -> Result<Camera, IoError> {
    let bytes = files::read(path, MAX_BYTES)?;
    let camera = match serde_json::from_slice(files::without_mark(&bytes, path)?) {
        Ok(CameraFile::Entry { camera } | CameraFile::Alone(camera)) => camera,
        Err(_) => {
            return Err(IoError::syntax(
                path,
                "camera",
                "this is no camera: width_px, height_px, focal_px [x, y], principal_px [x, y], \
                         world_from_camera (9 numbers, the right, down and forward axes) and center [x, y, z] are \
                         needed, as in the output of 'fmlgs info --json'",
            ));
        }
    };
    let named = |cause| IoError::Camera { path: path.into(), photo: "the camera".into(), cause };
    camera.believe().map_err(named)?;
    Ok(camera)
}
