//! What actions do: the functions that the rows of [`super::actions`]' table call.
//!
//! An action changes the window at once, or starts a job with what is done with its result ([`super::app::App::start`]).

pub(super) mod edit;
pub(super) mod edits;
pub(super) mod export;
pub(super) mod objects;
pub(super) mod open;
pub(super) mod query;
pub(super) mod remote;
pub(super) mod train;
pub(super) mod view;
pub(super) mod window;
