//! A made-up room for the agent, and the table of requests that is asked in it.
#![allow(dead_code)] // Each test file uses a part of it.

pub mod room;
pub mod table;
