//! Training of Gaussians from posed photos.
//!
//! [`run()`] is the whole job; [`trainer`] holds the state and its step; [`init`], [`schedule`] and [`density`] serve
//! the step; [`checkpoint`] stores the state on disk.
//!
//! On the CPU a seed determines the result, and a resumed run ends where an uninterrupted one does.

pub(crate) mod active;
pub(crate) mod border;
pub(crate) mod budget;
pub mod checkpoint;
mod coarse;
pub(crate) mod config;
pub mod density;
pub(crate) mod device;
mod divergence;
mod exposure;
mod fit_report;
mod folder;
pub(crate) mod geometry;
pub(crate) mod init;
pub(crate) mod inputs;
mod optimizer;
mod outcome;
pub(crate) mod photo_fits;
mod photos;
mod pose_gauge;
mod pose_offset;
pub(crate) mod poses;
pub(crate) mod refine;
mod resume;
mod run;
pub(crate) mod schedule;
mod sweep;
mod sweep_view;
pub mod trainer;
mod window;

pub use config::TrainConfig;
pub(crate) use folder::FolderUse;
pub(crate) use outcome::{TrainEnd, TrainError, TrainOutcome};
pub(crate) use photos::load_views;
pub(crate) use resume::begin_refinement;
pub(crate) use run::{run, run_on};

use crate::scene::{Camera, PhotoPixels};

/// Photo for training: undistorted, scaled, with its camera.
#[derive(Clone, Debug)]
pub struct TrainView {
    /// Name of the photo.
    pub name: String,
    /// Camera of the scaled picture.
    pub camera: Camera,
    /// Pixels, of the camera's size.
    pub pixels: PhotoPixels,
}
