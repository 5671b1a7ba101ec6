//! Plain mathematics with no knowledge of scenes: everything here is pure and total.

pub mod colormap;
mod fast_exp;
pub mod finite;
pub mod format;
pub mod grid;
pub mod lanes;
pub mod real;
pub mod resize;
pub mod rotation;
pub mod sh;
pub mod srgb;
pub mod stats;
pub mod vector;

pub use real::Real;
