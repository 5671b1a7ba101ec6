//! The background: long jobs, short jobs and the drawing of the viewport, each on its own thread.
//!
//! Control runs in three closed enums: [`Action`] (what a person wants), [`Command`] (what a job is
//! to do), [`Event`] (what happened). Bulk data never queues: it is published in a [`Slot`].

pub mod action;
pub mod control;
pub mod jobs;
pub mod measure;
pub mod observer;
mod paint;
pub mod protocol;
mod quiet;
pub mod slot;
pub mod thread;
pub mod view;

pub use action::{Action, Axis, Pane, Shortcut, ViewMode};
pub use control::Control;
pub use measure::MeasureRequest;
pub use protocol::{Command, Event, Failure, JobId, JobKind, Lane, Outcome, Stop};
pub use slot::Slot;
pub use thread::{CloudSnapshot, Jobs, QueueFull, Repaint, Worker};

pub use crate::jobs::OpenedScene;
pub use crate::jobs::edit::EditRequest;
pub use crate::jobs::go_to::{Explored, VisitRequest, Visited};
pub use crate::jobs::query::ViewMaps;
pub use crate::jobs::video::VideoRequest;
