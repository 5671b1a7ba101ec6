//! One file per part of the window.

pub mod bars;
pub mod dataset;
pub mod empty;
pub mod log;
pub mod models;
pub mod object_thumbnails;
pub mod objects;
pub mod plan;
pub mod plots;
pub mod report;
pub mod training;
