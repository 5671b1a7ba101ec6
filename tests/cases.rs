//! Inputs as people really have them, each after a public report, and their relatives: what is right, not what was.
//! The inputs of the reports lie beside the project; a test that needs one is skipped, and counted, where it is absent.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod cli_support;
mod common;
#[path = "cases/compared.rs"]
mod compared;
#[path = "cases/data_sets.rs"]
mod data_sets;
#[path = "cases/kept.rs"]
mod kept;
#[path = "cases/labels.rs"]
mod labels;
#[path = "cases/lenses.rs"]
mod lenses;
#[path = "cases/object_photos.rs"]
mod object_photos;
#[path = "cases/splat_numbers.rs"]
mod splat_numbers;
#[path = "cases/splats.rs"]
mod splats;
#[path = "cases/training.rs"]
mod training;
#[path = "cases/words.rs"]
mod words;
