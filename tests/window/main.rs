//! The whole window, headless, on the software adapter.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod app;
#[path = "../cli_support/mod.rs"]
mod cli_support;
#[path = "../common/mod.rs"]
mod common;
mod picking;
mod plan;
mod served;
#[path = "../it/serve/served.rs"]
mod served_scene;
#[path = "../ui_common/mod.rs"]
mod ui_common;
