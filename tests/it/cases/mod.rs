//! Inputs as people really have them, each after a public report, and their relatives: what is right, not what was.
//! The inputs of the reports lie beside the project; a test that needs one is skipped, and counted, where it is absent.

mod compared;
mod data_sets;
mod kept;
mod labels;
mod lenses;
mod object_photos;
mod splat_numbers;
mod splats;
mod training;
mod words;
