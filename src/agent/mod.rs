//! Interactive agent: commands and plain sentences become checked calls of a closed set of tools.
//!
//! Two nested loops, as in the paper. The outer one is a user's request ([`session::Session::say`]); the inner one is
//! a sequence of calls that may change after each result. A [`planner::Planner`] proposes the next call:
//! [`commands::Commands`], a small built-in command language, or [`llm::Llm`], any chat model behind an
//! OpenAI-compatible address. A program that plans by itself makes its calls through [`mcp`]. Only a
//! [`tool::ToolCall`] that passes [`execute::check`] is executed: the [`policy`] permits it, its target is in the scene
//! and unambiguous, it does not conflict with the facts of the scene, and the user has confirmed it if it is
//! destructive. Names in the scene and the user's words are data throughout.
//!
//! The scene is a [`world::World`]: [`scene::SceneWorld`] for the window and the command line, a synthetic room for
//! tests.

#![allow(missing_docs, reason = "fields and variants whose name says it all have no doc of three words")]

pub(crate) mod answer;
pub mod camera_args;
pub mod commands;
#[cfg(test)]
mod demo_tests;
pub(crate) mod describe;
pub(crate) mod dialog;
mod effect;
pub(crate) mod event;
pub mod execute;
mod language;
mod listing;
pub mod llm;
pub mod mcp;
pub(crate) mod names;
mod objection;
mod photo_answer;
pub mod planner;
pub(crate) mod policy;
pub(crate) mod refusal;
pub mod relation;
pub(crate) mod resolve;
pub mod scene;
pub mod schema;
pub(crate) mod session;
pub mod tool;
pub mod transcript;
#[cfg(test)]
mod undo_tests;
mod view_shares;
pub(crate) mod words;
pub mod world;

pub use event::AgentEvent;
pub use planner::Planner;
pub use policy::Policy;
pub use refusal::{Refusal, RefusalKind};
pub use session::{Awaited, Reply, Session};
pub use tool::ToolCall;
pub use world::World;
