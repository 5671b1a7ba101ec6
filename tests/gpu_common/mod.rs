//! Shared parts of the GPU tests: one device for all tests of a file, and their behavior without one.
#![allow(dead_code)]

pub mod adapter;
pub mod compare;

use std::sync::{Mutex, PoisonError};

use fmlgs::render::gpu::Device;

/// Runs `test` on the machine's GPU, or skips it. One test at a time, since a software adapter uses
/// every core for each.
pub fn with_context(test: impl FnOnce(&Device)) {
    static TURN: Mutex<()> = Mutex::new(());
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(context) = adapter::context() {
        test(context);
        context.check().unwrap();
    }
}
