//! Training Gaussians from posed photos.

pub mod config;

pub use config::{BackendChoice, TrainConfig};
