//! Writing SPZ, version 3.

use std::io::{self, Write};

use flate2::{Compression, GzBuilder};

use super::{ANTIALIASED, COLOR_SCALE, COMPONENT_MOST, HARMONIC_MIDDLE, MAGIC, MOST_STEPS, SCALE_FIRST, SCALE_STEP};
use super::{SHIFT, TURNED, columns};
use crate::io::atomic::WriteProgress;
use crate::io::quantized::{opacity_byte, to_byte, without_largest};
use crate::io::shift;
use crate::scene::{Axes, GaussianCloud, SplatRenderMode};

const VERSION: u32 = 3;
/// Gaussians between two progress reports.
const BLOCK: usize = 4096;
/// Steps of harmonics of the first band, and of higher ones; as in the reference encoder.
const HARMONIC_STEPS: [i32; 2] = [8, 16];

/// Writes the bytes of an SPZ file of a valid cloud, in its order, in the axes of the format.
///
/// # Errors
/// If the cloud exceeds the range of 24 bits, or cannot be written.
pub(in crate::io) fn encode(
    out: &mut dyn Write,
    cloud: &GaussianCloud,
    progress: &mut WriteProgress<'_>,
) -> io::Result<()> {
    let (near, shift) = shift::near_zero(cloud);
    let comment = shift.map_or_else(|| TURNED.to_owned(), |shift| format!("{TURNED}{SHIFT}{}", shift::text(shift)));
    let mut gzip = GzBuilder::new().comment(comment).write(out, Compression::default());
    let turned = near.into_owned().turned(&Axes::SPZ.scene_from_file().transpose(), true);
    gzip.write_all(&unpacked(&turned, progress)?)?;
    gzip.finish().map(drop)
}

/// Returns the uncompressed content of such a file, without a change of axes.
pub(in crate::io) fn unpacked(cloud: &GaussianCloud, progress: &mut WriteProgress<'_>) -> io::Result<Vec<u8>> {
    let fraction = fraction(cloud)?;
    let steps = f64::from(fraction).exp2();
    let stride = cloud.sh_stride();
    let mut all = columns(VERSION, cloud.sh_degree).map(|bytes| Vec::with_capacity(bytes * cloud.len()));
    for i in 0..cloud.len() {
        if i % BLOCK == 0 {
            progress(i)?;
        }
        let [positions, opacities, colors, scales, rotations, harmonics] = &mut all;
        for v in (cloud.world_position(i) * steps).round().to_array() {
            positions.extend_from_slice(&(v as i32).to_le_bytes()[..3]);
        }
        opacities.push(opacity_byte(cloud.opacity_logits[i]));
        let sh = &cloud.sh[i * stride..(i + 1) * stride];
        colors.extend(sh[0].map(|dc| to_byte(dc * COLOR_SCALE + 0.5)));
        scales.extend(cloud.log_scales[i].map(|s| ((s - SCALE_FIRST) / SCALE_STEP).round() as u8));
        rotations.extend(smallest_three(cloud.quaternions[i]).to_le_bytes());
        for (k, rgb) in sh.iter().enumerate().skip(1) {
            harmonics.extend(rgb.map(|v| harmonic(v, HARMONIC_STEPS[usize::from(k > 3)])));
        }
    }
    let flags = if cloud.render_mode == SplatRenderMode::Mip { ANTIALIASED } else { 0 };
    let count = u32::try_from(cloud.len()).map_err(io::Error::other)?;
    let head = [*MAGIC, VERSION.to_le_bytes(), count.to_le_bytes(), [cloud.sh_degree, fraction, flags, 0]];
    Ok(head.into_iter().flatten().chain(all.into_iter().flatten()).collect())
}

/// Returns the most fractional bits with which every coordinate fits.
fn fraction(cloud: &GaussianCloud) -> io::Result<u8> {
    let farthest = (0..cloud.len()).map(|i| cloud.world_position(i).abs().max_element()).fold(0.0, f64::max);
    super::fraction(farthest).ok_or_else(|| {
        let text = format!("SPZ holds coordinates up to {MOST_STEPS}, the scene reaches {farthest:.0}: use .ply");
        io::Error::new(io::ErrorKind::InvalidInput, text)
    })
}

fn smallest_three([w, x, y, z]: [f32; 4]) -> u32 {
    let (largest, rest) = without_largest([x, y, z, w]);
    let part = |t: f32| {
        let v = (2.0 * t - 1.0) * COMPONENT_MOST;
        (v.abs().round() as u32).min(COMPONENT_MOST as u32) | if v < 0.0 { 512 } else { 0 }
    };
    rest.into_iter().fold(largest as u32, |packed, t| packed << 10 | part(t))
}

/// Rounds a harmonic to a byte in multiples of `steps`.
fn harmonic(value: f32, steps: i32) -> u8 {
    let byte = (value * HARMONIC_MIDDLE).round() as i32 + HARMONIC_MIDDLE as i32;
    (byte.saturating_add(steps / 2).div_euclid(steps) * steps).clamp(0, 255) as u8
}
