//! One file per use case: the jobs that the window, the command line and the agent run on a scene.
//!
//! Jobs take plain inputs and an [`Observer`](crate::pipeline::observer::Observer) if they take long, and return a
//! typed result or a [`JobError`]. The caller reports the result in its own way.

pub(crate) mod ask_result;
pub(crate) mod batch;
pub(crate) mod bench;
pub(crate) mod camera_path;
pub(crate) mod changed;
pub(crate) mod clean;
mod coco;
pub(crate) mod compare;
pub(crate) mod demo;
pub(crate) mod demo_questions;
pub(crate) mod demo_tour;
pub(crate) mod derived;
pub mod edit;
pub(crate) mod error;
pub(crate) mod evaluate;
pub(crate) mod evaluate_language;
pub(crate) mod evaluate_masks;
pub(crate) mod evaluate_removal;
mod experiment;
pub(crate) mod export;
pub(crate) mod export_all;
pub(crate) mod export_forecast;
pub(crate) mod export_splat;
pub(crate) mod features;
pub mod find_objects;
pub(crate) mod folders;
pub(crate) mod go_to;
pub(crate) mod held_out;
pub(crate) mod import;
pub(crate) mod inspect;
pub(crate) mod locate;
pub(crate) mod measurements;
pub(crate) mod models;
pub mod open;
pub(crate) mod page;
pub(crate) mod phases;
pub(crate) mod photos_without;
pub mod phrases;
pub(crate) mod plan;
pub(crate) mod poses;
pub(crate) mod presets;
pub(crate) mod query;
pub(crate) mod rearrange;
pub mod recent;
pub(crate) mod remove;
pub(crate) mod render;
pub(crate) mod report;
pub(crate) mod reproduce;
pub mod runs;
pub(crate) mod save_copy;
pub(crate) mod scale;
pub(crate) mod segment;
pub mod select;
pub(crate) mod show_folder;
pub(crate) mod sparse_cloud;
pub(crate) mod synth;
pub(crate) mod thumbnails;
pub(crate) mod train;
pub(crate) mod video;
pub mod workspace;

pub(crate) use error::JobError;
pub use folders::Folders;
pub(crate) use open::{OpenedScene, Scene};
