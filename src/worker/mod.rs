//! The background: long jobs, short jobs and the drawing of the viewport, each on its own thread.
//!
//! Control runs in closed enums: the window's actions become [`Command`]s (what a job is to do), which end in
//! [`Event`]s (what happened). Bulk data never queues: it is published in a [`Slot`].
//!
//! A job ends in exactly one of finished, canceled or failed, panics included.

pub(crate) mod control;
pub(crate) mod failure;
pub mod jobs;
mod kind;
mod levels;
mod low_priority_pool;
pub(crate) mod observer;
pub(crate) mod protocol;
pub(crate) mod slot;
mod start;
pub(crate) mod text_encoder;
pub(crate) mod thread;
mod title;
pub mod view;
pub(crate) mod view_modes;
mod view_renderer;
mod view_request;

pub(crate) use control::Control;
pub use failure::{Failure, Stop};
pub(crate) use observer::{CloudSnapshot, Repaint};
pub use protocol::{Command, Event, JobId, JobKind, Outcome, WorkerThread};
pub(crate) use slot::Slot;
pub use slot::Versioned;
pub use start::Start;
pub(crate) use thread::{Elsewhere, EventSource};
pub use thread::{Jobs, QueueFull, Worker};
pub use view_modes::ViewMode;
