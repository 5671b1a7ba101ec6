//! The background: long jobs, short jobs and the drawing of the viewport, each on its own thread.
//!
//! Control runs in closed enums: the window's actions become [`Command`]s (what a job is to do), which end in
//! [`Event`]s (what happened). Bulk data never queues: it is published in a [`Slot`].

pub mod control;
pub mod edit;
pub mod guide;
pub mod jobs;
pub mod machine;
pub mod measure;
pub mod models;
pub mod observer;
pub mod places;
pub mod preview;
pub mod protocol;
mod quiet;
pub mod slot;
pub mod text_encoder;
pub mod thread;
pub mod view;
pub mod view_modes;

pub use control::Control;
pub use edit::EditRequest;
pub use guide::{Explored, FilmRequest, VisitRequest, Visited};
pub use measure::MeasureRequest;
pub use protocol::{Command, Event, Failure, HomeView, JobId, JobKind, Lane, OpenedScene, Outcome, Start, Stop};
pub use slot::{Slot, Versioned};
pub use thread::{CloudSnapshot, Jobs, QueueFull, Repaint, Worker};
pub use view::ViewMaps;
pub use view_modes::ViewMode;
