//! Splats as PlayCanvas's and SuperSplat's `.compressed.ply`: 16 bytes a Gaussian, quantized
//! within chunks of 256 whose bounds come first, and harmonics of 8 bits a coefficient.

mod decode;
mod encode;

pub(super) use decode::decode;
pub(super) use encode::encode;

/// Gaussians that share their bounds.
const CHUNK: usize = 256;
/// Width of the range, centered on 0, of harmonics in bytes.
const HARMONICS: f32 = 8.0;
/// Names of a chunk's bounds, groups of six: of position, log-scale and color.
const BOUNDS: [[&str; 6]; 3] = [
    ["min_x", "min_y", "min_z", "max_x", "max_y", "max_z"],
    ["min_scale_x", "min_scale_y", "min_scale_z", "max_scale_x", "max_scale_y", "max_scale_z"],
    ["min_r", "min_g", "min_b", "max_r", "max_g", "max_b"],
];
/// Names of the packed properties of a Gaussian.
const PACKED: [&str; 4] = ["packed_position", "packed_rotation", "packed_scale", "packed_color"];

#[cfg(test)]
mod tests;
