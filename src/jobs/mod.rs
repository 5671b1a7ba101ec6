//! One file per use case: what the window, the command line and the agent do with a scene, wired once.
//!
//! Jobs take plain inputs and an [`Observer`](crate::pipeline::observer::Observer) where they take long,
//! and return a typed result or a [`JobError`]. Whoever calls them says the result in its own way.

pub mod edit;
pub mod error;
pub mod evaluate;
pub mod evaluate_masks;
pub mod export;
pub mod find_objects;
pub mod folders;
pub mod go_to;
pub mod models;
pub mod open;
pub mod plan;
pub mod query;
pub mod render;
pub mod segment;
pub mod thumbnails;
pub mod train;
pub mod video;

pub use error::JobError;
pub use folders::Folders;
pub use open::{OpenedScene, Scene};
