//! SPZ, Niantic's packed splats: versions 1 to 4 are read; version 3 is written, which all current readers support.
//!
//! A header, then one column after another: positions (24-bit fixed point), opacities, colors, log-scales, rotations
//! and harmonics, mostly bytes. Up to version 3 all of it is one gzip stream; in version 4 the header is plain and each
//! column is a Zstandard stream of its own. The format's axes are right, up, back; see `axes` for those of a file.

mod axes;
mod decode;
mod header;
mod read;
mod write;

use crate::math::sh::coefficients;

pub use axes::SpzAxes;
pub use read::parse;
pub(crate) use read::{is_spz, parse_in, read};
pub(super) use write::{encode, unpacked};

/// First bytes of the header.
const MAGIC: &[u8; 4] = b"NGSP";
/// Flag: rendered with the filter of Mip-Splatting.
const ANTIALIASED: u8 = 1;
/// Flag: extension records follow.
const EXTENSIONS: u8 = 2;
/// Step of log-scales in bytes, and the value of byte 0.
const SCALE_STEP: f32 = 1.0 / 16.0;
const SCALE_FIRST: f32 = -10.0;
/// Factor of constant harmonics to colors around 0.5.
const COLOR_SCALE: f32 = 0.15;
/// Byte of a harmonic of 0, and the steps to 1.
const HARMONIC_MIDDLE: f32 = 128.0;
/// Value of a quaternion's component at 1/√2, in 9 bits.
const COMPONENT_MOST: f32 = 511.0;
/// Largest coordinate in steps: 24 bits with a sign.
const MOST_STEPS: f64 = 8_388_607.0;
/// Most fractional bits that are written: the format has 24 bits in all.
const MOST_FRACTION: u8 = 23;
/// Start of the gzip header's comment in files with axes turned to the format's. The shift of the positions may follow,
/// in the axes of the scene.
const TURNED: &str = "axes: right up back";
const SHIFT: &str = "; shift ";

/// Bytes per Gaussian in each column, in the order of the file.
fn columns(version: u32, degree: u8) -> [usize; 6] {
    let position = if version == 1 { 6 } else { 9 };
    let rotation = if version < 3 { 3 } else { 4 };
    [position, 1, 3, 3, rotation, 3 * (coefficients(degree) - 1)]
}

/// Returns the most fractional bits with which a coordinate so far from zero fits.
fn fraction(farthest: f64) -> Option<u8> {
    (0..=MOST_FRACTION).rev().find(|bits| farthest * f64::from(*bits).exp2() <= MOST_STEPS)
}

#[cfg(test)]
mod tests;
