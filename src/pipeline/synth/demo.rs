//! Built-in demo scene.

use std::path::Path;

use glam::DVec3;

use super::options::{Rig, SynthOptions};
use super::write::{SETTINGS, TRANSFORMS};
use super::{SynthError, SynthReport, render_scene};
use crate::io::{files, gltf_mesh};
use crate::pipeline::observer::Observer;

/// Demo scene (glTF): objects with parts on a table, made by `tools/demo_scene`.
pub fn demo_glb() -> &'static [u8] {
    include_bytes!("../../../assets/demo.glb")
}

/// Settings of the demo's photos: small enough for live training on two cores.
pub(crate) fn demo_options() -> SynthOptions {
    SynthOptions {
        views: 64,
        held_out: 8,
        width_px: 400,
        height_px: 300,
        samples: 3,
        rig: Rig::Survey,
        focus: Some(DVec3::new(0.0, 0.82, 0.0)),
        radius: Some(0.57),
        points: 12_000,
        ..SynthOptions::default()
    }
}

/// Returns whether `out` already holds the photos that [`write_demo`] would write.
pub(crate) fn demo_is_written(out: &Path, options: &SynthOptions) -> bool {
    let expected = serde_json::json!({ "version": 1, "scene": fingerprint(), "options": options });
    let settings = files::read(&out.join(SETTINGS), files::MAX_TEXT_BYTES).ok();
    let found: Option<serde_json::Value> = settings.and_then(|bytes| serde_json::from_slice(&bytes).ok());
    found == Some(expected) && out.join(TRANSFORMS).is_file()
}

/// Renders photos of the demo scene into the folder `out`.
pub(crate) fn write_demo(
    out: &Path,
    options: &SynthOptions,
    observer: &mut dyn Observer,
) -> Result<SynthReport, SynthError> {
    let scene = gltf_mesh::read_slice(demo_glb(), "demo.glb")?;
    render_scene(&scene, "demo", Some(fingerprint()), options, out, observer)
}

/// FNV-1a of the scene's bytes.
pub(crate) fn fingerprint() -> u64 {
    demo_glb().iter().fold(0xcbf2_9ce4_8422_2325, |h, &b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
}
