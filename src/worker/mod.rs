//! The background: long jobs, short jobs and the drawing of the viewport, each on its own thread.
//!
//! [`Tasks::spawn`] runs a closure of [`crate::jobs`] on a thread and returns a [`Task`], which whoever asked holds and
//! polls. [`Event`]s tell the rest of the window what happens. Bulk data never queues: it is published in a [`Slot`].
//!
//! A job ends in exactly one of finished, canceled or failed, panics included.

pub(crate) mod comparing;
pub(crate) mod control;
pub(crate) mod event;
pub(crate) mod failure;
mod levels;
mod low_priority_pool;
pub(crate) mod observer;
mod photos;
pub(crate) mod slot;
mod start;
pub(crate) mod task;
pub(crate) mod text_encoder;
pub(crate) mod thread;
pub mod view;
pub(crate) mod view_modes;
mod view_renderer;
mod view_request;

pub(crate) use control::Control;
pub use event::Event;
pub use failure::{Failure, Stop};
pub(crate) use observer::{CloudSnapshot, PosesSnapshot, Repaint};
pub(crate) use photos::{RemotePhotos, load_photo};
pub(crate) use slot::Slot;
pub use slot::Versioned;
pub use start::Start;
pub use task::{JobEnd, JobId, JobInfo, Task};
pub(crate) use task::{JobLane, Makes, TaskResult};
pub use thread::{QueueFull, Tasks};
pub use view_modes::ViewMode;
