//! A made-up room for the agent, and the table of requests that is asked in it.
#![allow(dead_code)] // Each test file uses a part of it.
#![allow(clippy::disallowed_methods)] // A server for a second needs no name, a test room no care for zero vectors.

pub mod room;
pub mod server;
pub mod table;
