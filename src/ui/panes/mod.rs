//! One file per part of the window.

pub(crate) mod bars;
pub(crate) mod clean;
pub(crate) mod dataset;
pub(crate) mod empty;
mod histogram;
pub(crate) mod log;
pub(crate) mod models;
mod object_facts;
pub(crate) mod object_thumbnails;
pub(crate) mod objects;
pub mod phrases;
pub(crate) mod plan;
pub(crate) mod plots;
pub(crate) mod problems;
pub(crate) mod report;
pub(crate) mod training;
pub(crate) mod unposed;
