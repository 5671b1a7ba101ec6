//! Plain mathematics with no knowledge of scenes: everything here is pure and total.

pub(crate) mod blur;
pub(crate) mod cholesky;
pub(crate) mod colormap;
pub(crate) mod disjoint;
pub(crate) mod distance;
pub(crate) mod eigen;
mod fast_exp;
mod fast_ln;
pub(crate) mod finite;
pub(crate) mod format;
pub mod geometry;
pub(crate) mod grid;
pub(crate) mod lanes;
pub(crate) mod morton;
pub(crate) mod number;
pub(crate) mod prefetch;
pub(crate) mod real;
pub mod resize;
pub mod rotation;
pub mod sh;
pub(crate) mod srgb;
pub mod stats;
pub(crate) mod ticks;
pub mod vector;

pub use real::Real;
