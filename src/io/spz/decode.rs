//! Unpacked columns of an SPZ file, decoded to Gaussians.

use std::path::Path;

use half::f16;
use rayon::prelude::*;

use super::axes::{AxisMarks, SpzAxes};
use super::header::SpzHeader;
use super::{ANTIALIASED, COLOR_SCALE, COMPONENT_MOST, HARMONIC_MIDDLE, SCALE_FIRST, SCALE_STEP};
use crate::io::IoError;
use crate::io::finite::finite_only;
use crate::io::quantized::{logit, unit_quaternion, unorm};
use crate::math::sh::coefficients;
use crate::scene::{GaussianCloud, SplatRenderMode};

/// Highest degree of harmonics that is kept.
const MOST_BANDS: u8 = 3;
/// Flag: level of detail, coarser Gaussians among the others, as Spark writes them.
const LEVELS: u8 = 0x80;

/// Decodes the Gaussians in the scene's axes.
pub(super) fn cloud(
    header: &SpzHeader,
    columns: &[Vec<u8>],
    marks: &AxisMarks,
    known: SpzAxes,
    path: &Path,
) -> Result<GaussianCloud, IoError> {
    let [positions, opacities, colors, scales, rotations, harmonics] = columns else {
        return Ok(GaussianCloud::default());
    };
    let step = (-f32::from(header.fraction)).exp2();
    // The sign is in the third byte of four.
    let fixed = |b: &[u8]| i32::from_le_bytes([0, b[0], b[1], b[2]]) >> 8;
    let position = |bytes: &[u8]| match header.version {
        1 => [0, 2, 4].map(|k| f16::from_le_bytes([bytes[k], bytes[k + 1]]).to_f32()),
        _ => [0, 3, 6].map(|k| fixed(&bytes[k..]) as f32 * step),
    };
    let farthest = match header.version {
        1 => 0,
        _ => positions.par_chunks_exact(3).map(|b| fixed(b).abs()).max().unwrap_or(0),
    };
    let (axes, mut warnings) = marks.decide(known, header.version, header.fraction, farthest);
    let color = |byte: u8| (unorm(byte.into(), 8) - 0.5) / COLOR_SCALE;
    let degree = header.degree.min(MOST_BANDS);
    let (stride, stored) = (coefficients(degree), coefficients(header.degree));
    if degree < header.degree {
        warnings.push(format!("harmonics of degree {} are left out: up to {degree} can be drawn", header.degree));
    }
    if header.flags & LEVELS != 0 {
        warnings.push("it holds levels of detail, which are all drawn at once".into());
    }
    let mut sh = vec![[0.0; 3]; header.count * stride];
    sh.par_chunks_exact_mut(stride).enumerate().for_each(|(i, out)| {
        out[0] = [0, 1, 2].map(|k| color(colors[3 * i + k]));
        let rest = harmonics[3 * (stored - 1) * i..].as_chunks::<3>().0;
        out[1..].iter_mut().zip(rest).for_each(|(rgb, bytes)| {
            *rgb = bytes.map(|byte| (f32::from(byte) - HARMONIC_MIDDLE) / HARMONIC_MIDDLE);
        });
    });
    let antialiased = header.flags & ANTIALIASED != 0;
    let cloud = GaussianCloud {
        positions: positions.par_chunks_exact(super::columns(header.version, 0)[0]).map(position).collect(),
        log_scales: scales
            .as_chunks::<3>()
            .0
            .par_iter()
            .map(|s| s.map(|byte| f32::from(byte) * SCALE_STEP + SCALE_FIRST))
            .collect(),
        quaternions: match rotations.as_chunks::<4>() {
            (packed, _) if header.version >= 3 => {
                packed.par_iter().map(|bytes| smallest_three(u32::from_le_bytes(*bytes))).collect()
            }
            _ => rotations.as_chunks::<3>().0.par_iter().map(|bytes| first_three(*bytes)).collect(),
        },
        opacity_logits: opacities.par_iter().map(|byte| logit(unorm((*byte).into(), 8))).collect(),
        sh_degree: degree,
        sh,
        render_mode: if antialiased { SplatRenderMode::Mip } else { SplatRenderMode::Plain },
        warnings,
        ..GaussianCloud::default()
    };
    // Half floats may be infinite.
    let cloud = finite_only(cloud, path)?;
    let mut cloud = cloud.turned(&axes.scene_from_file(), true);
    cloud.origin = marks.shift();
    Ok(cloud)
}

/// Decodes versions 1 and 2: x, y and z; w is positive.
fn first_three(bytes: [u8; 3]) -> [f32; 4] {
    let [x, y, z] = bytes.map(|byte| f32::from(byte) / 127.5 - 1.0);
    [(1.0 - (x * x + y * y + z * z)).max(0.0).sqrt(), x, y, z]
}

/// Decodes versions 3 and 4: the index of the largest of x, y, z, w in 2 bits, a sign and 9 bits for each of the
/// others.
fn smallest_three(packed: u32) -> [f32; 4] {
    let part = |shift: u32| {
        let size = (packed >> shift & 511) as f32 / COMPONENT_MOST * 0.5;
        0.5 + if packed >> shift & 512 == 0 { size } else { -size }
    };
    let [x, y, z, w] = unit_quaternion((packed >> 30) as usize, [part(20), part(10), part(0)]);
    [w, x, y, z]
}
