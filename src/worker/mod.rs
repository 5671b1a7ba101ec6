//! The background: long jobs, short jobs and the drawing of the viewport, each on its own thread.
//!
//! Control runs in closed enums: the window's actions become [`Command`]s (what a job is to do), which end in
//! [`Event`]s (what happened). Bulk data never queues: it is published in a [`Slot`].

pub mod control;
pub mod failure;
pub mod jobs;
mod low_priority_pool;
pub mod measure;
pub mod observer;
pub mod protocol;
pub mod slot;
pub mod text_encoder;
pub mod thread;
pub mod view;
pub mod view_modes;
mod view_renderer;
mod view_request;

pub use control::Control;
pub use failure::{Failure, Stop};
pub use observer::{CloudSnapshot, Repaint};
pub use protocol::{Command, Event, JobId, JobKind, Lane, MeasureRequest, Outcome, Start};
pub use slot::{Slot, Versioned};
pub use thread::{Jobs, QueueFull, Worker};
pub use view_modes::ViewMode;
