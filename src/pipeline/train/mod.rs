//! Training Gaussians from posed photos.
//!
//! [`run()`] is the whole job; [`trainer`] the state and its step; [`init`], [`schedule`] and
//! [`density`] what the step consults; [`checkpoint`] what survives a kill.

pub mod border;
pub mod budget;
pub mod checkpoint;
mod coarse;
pub mod config;
pub mod density;
pub mod device;
mod folder;
pub mod geometry;
pub mod init;
mod outcome;
mod photos;
mod run;
pub mod schedule;
pub mod trainer;

pub use config::TrainConfig;
pub use outcome::{TrainEnd, TrainError, TrainOutcome};
pub use photos::load_views;
pub use run::run;

use crate::scene::{Camera, PhotoPixels};

/// A photo ready for comparison: undistorted, scaled, with its camera.
#[derive(Clone, Debug)]
pub struct TrainView {
    /// The photo's name.
    pub name: String,
    /// Camera of the scaled picture.
    pub camera: Camera,
    /// Its pixels, of the camera's size.
    pub pixels: PhotoPixels,
}
