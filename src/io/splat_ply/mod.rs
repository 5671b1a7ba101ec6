//! Finished splats as `.ply`, as the 3D Gaussian Splatting reference code writes them.
//!
//! One `vertex` per Gaussian: `x y z`, `nx ny nz` (unused, 0), `f_dc_0..2`, `f_rest_0..` (all red
//! coefficients, then green, then blue), `opacity` (before the sigmoid), `scale_0..2`
//! (logarithms), `rot_0..3` (w x y z). Properties may come in any order; further ones are kept in
//! [`GaussianCloud::extras`](crate::scene::GaussianCloud) and written back. Without `scale_2` they are the disks of 2D
//! Gaussian Splatting; without `f_dc_0..2`, `red green blue` are the color, as nerfstudio writes them.
//!
//! A cloud whose origin is not zero keeps its full precision in a way that other programs ignore: a comment
//! `fmlgs origin X Y Z` and properties `x_residual y_residual z_residual`, so that `world = x + x_residual`
//! in double precision. Exports for other programs are relative to a nearby point, stated in a comment
//! `fmlgs shift X Y Z`.

mod filter;
mod read;
mod stream;
mod write;

use std::path::Path;

use crate::io::{IoError, files};
use crate::scene::GaussianCloud;

pub(crate) use read::FLAT;
pub(crate) use stream::{state, state_in};
pub use write::{check, encode, write};
pub(crate) use write::{encode_near_zero, may_be_extra};

/// Properties of Gaussians, besides `f_rest_*`.
const STANDARD: [&str; 20] = [
    "x",
    "y",
    "z",
    "nx",
    "ny",
    "nz",
    "f_dc_0",
    "f_dc_1",
    "f_dc_2",
    "opacity",
    "scale_0",
    "scale_1",
    "scale_2",
    "rot_0",
    "rot_1",
    "rot_2",
    "rot_3",
    "x_residual",
    "y_residual",
    "z_residual",
];

/// Start of the comment that holds the cloud's origin.
const ORIGIN: &str = "fmlgs origin ";

/// Start of the comment with the id of the scene's state.
const STATE: &str = "fmlgs state ";

/// Returns whether a property is one that this module writes itself.
fn is_standard(name: &str) -> bool {
    STANDARD.contains(&name) || name.strip_prefix("f_rest_").is_some_and(|k| k.bytes().all(|b| b.is_ascii_digit()))
}

/// Reads a splat `.ply`, plain or compressed (PlayCanvas's `.compressed.ply`).
pub fn read(path: &Path) -> Result<GaussianCloud, IoError> {
    if let Some(cloud) = stream::read(path)? {
        return Ok(filter::applied(cloud));
    }
    parse(&files::read(path, u64::MAX)?, path)
}

/// Parses the Gaussians of a splat `.ply`; `path` is for errors.
pub fn parse(bytes: &[u8], path: &Path) -> Result<GaussianCloud, IoError> {
    read::parse(bytes, path).map(filter::applied)
}

#[cfg(test)]
mod tests;
