//! Writing splats as `.ply`.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;

use super::{ORIGIN, STATE, is_standard};
use crate::io::atomic::{self, WriteProgress};
use crate::io::{IoError, render_mode, shift, vertical};
use crate::scene::GaussianCloud;

/// Gaussians per block handed to the file.
const BLOCK: usize = 4096;

/// Writes a splat `.ply` (binary, little-endian), replacing the file atomically.
pub fn write(path: &Path, cloud: &GaussianCloud) -> Result<(), IoError> {
    check(path, cloud)?;
    atomic::write(path, |w| encode(w, cloud, None))
}

/// Refuses a cloud that a `.ply` cannot hold; `path` is for errors.
pub fn check(path: &Path, cloud: &GaussianCloud) -> Result<(), IoError> {
    cloud.validate().map_err(|cause| IoError::Cloud { path: path.into(), cause })?;
    if let Some(e) = cloud.extras.iter().find(|e| !may_be_extra(&e.name)) {
        return Err(IoError::syntax(
            path,
            format!("extra property '{}'", e.name),
            "its name is taken or is not one printable word; rename it",
        ));
    }
    Ok(())
}

/// Returns whether an extra property may have this name: valid in a PLY header, and not taken.
pub(crate) fn may_be_extra(name: &str) -> bool {
    !name.is_empty() && name.bytes().all(|b| b.is_ascii_graphic()) && !is_standard(name)
}

/// Writes the bytes of a splat `.ply` of a valid cloud, with the id of the scene's state that it belongs to.
pub fn encode(out: &mut dyn Write, cloud: &GaussianCloud, state: Option<&str>) -> io::Result<()> {
    encode_with_progress(out, cloud, state.map(|state| format!("{STATE}{state}")).as_slice(), &mut |_| Ok(()))
}

/// As [`encode`], for other programs and with progress: a cloud far from zero is written near zero, with a comment that
/// states the shift.
pub(crate) fn encode_near_zero(
    out: &mut dyn Write,
    cloud: &GaussianCloud,
    progress: &mut WriteProgress<'_>,
) -> io::Result<()> {
    let (near, shift) = shift::near_zero(cloud);
    encode_with_progress(out, &near, shift.map(shift::comment).as_slice(), progress)
}

fn encode_with_progress(
    out: &mut dyn Write,
    cloud: &GaussianCloud,
    comments: &[String],
    progress: &mut WriteProgress<'_>,
) -> io::Result<()> {
    progress(0)?;
    let shifted = cloud.origin != DVec3::ZERO;
    out.write_all(header(cloud, shifted, comments).as_bytes())?;
    let stride = cloud.sh_stride();
    let mut block = Vec::new();
    for i in 0..cloud.len() {
        let world = cloud.world_position(i);
        let stored = world.as_vec3();
        let mut put = |v: f32| block.extend_from_slice(&v.to_le_bytes());
        stored.to_array().into_iter().for_each(&mut put);
        [0.0; 3].into_iter().for_each(&mut put);
        let sh = &cloud.sh[i * stride..(i + 1) * stride];
        sh[0].into_iter().for_each(&mut put);
        for channel in 0..3 {
            sh[1..].iter().for_each(|rgb| put(rgb[channel]));
        }
        put(cloud.opacity_logits[i]);
        cloud.log_scales[i].into_iter().for_each(&mut put);
        cloud.quaternions[i].into_iter().for_each(&mut put);
        if shifted {
            (world - stored.as_dvec3()).as_vec3().to_array().into_iter().for_each(&mut put);
        }
        cloud.extras.iter().for_each(|e| put(e.values[i]));
        if (i + 1) % BLOCK == 0 {
            out.write_all(&block)?;
            block.clear();
            progress(i)?;
        }
    }
    out.write_all(&block)
}

fn header(cloud: &GaussianCloud, shifted: bool, comments: &[String]) -> String {
    let mut text = String::from("ply\nformat binary_little_endian 1.0\n");
    if shifted {
        let DVec3 { x, y, z } = cloud.origin;
        let _ = writeln!(text, "comment {ORIGIN}{x:?} {y:?} {z:?}");
    }
    let mode = render_mode::comment(cloud.render_mode).map(str::to_owned);
    for comment in comments.iter().cloned().chain(mode).chain(vertical::comment(cloud.up)) {
        let _ = writeln!(text, "comment {comment}");
    }
    let _ = writeln!(text, "element vertex {}", cloud.len());
    let mut property = |name: &str| {
        let _ = writeln!(text, "property float {name}");
    };
    ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"].into_iter().for_each(&mut property);
    for k in 0..3 * (cloud.sh_stride() - 1) {
        property(&format!("f_rest_{k}"));
    }
    ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
        .into_iter()
        .for_each(&mut property);
    if shifted {
        ["x_residual", "y_residual", "z_residual"].into_iter().for_each(&mut property);
    }
    cloud.extras.iter().for_each(|e| property(&e.name));
    text.push_str("end_header\n");
    text
}
