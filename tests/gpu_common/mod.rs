//! What the GPU tests share: one device for all tests of a file, and what happens without one.
#![allow(dead_code)]

pub mod compare;

use std::sync::{Mutex, OnceLock, PoisonError};

use fmlgs::render::gpu::{Context, GpuError};

/// Runs `test` on the machine's GPU. Where there is no adapter at all the test is ignored, with
/// one line; `REQUIRE_GPU=1` makes that a failure, and a software adapter too. One test at a
/// time, since a software adapter uses every core for each.
pub fn with_context(test: impl FnOnce(&Context)) {
    static CONTEXT: OnceLock<Result<Context, GpuError>> = OnceLock::new();
    static TURN: Mutex<()> = Mutex::new(());
    let required = std::env::var("REQUIRE_GPU").is_ok_and(|v| v == "1");
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    match CONTEXT.get_or_init(Context::new) {
        Ok(context) => {
            assert!(!(required && context.is_software()), "REQUIRE_GPU=1, but there is only {}", context.describe());
            test(context);
            context.check().unwrap();
        }
        Err(e) => {
            assert!(!required, "REQUIRE_GPU=1: {e}");
            println!("ignored: no GPU adapter");
        }
    }
}
