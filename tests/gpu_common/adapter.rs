//! The GPU that tests run on, or that there is none.

use std::sync::OnceLock;

use fmlgs::render::gpu::{Device, GpuError};

/// The machine's GPU, real or emulated. Without any the test is skipped: this prints the line that
/// `tools/test.sh` counts. `REQUIRE_GPU=1` makes that a failure, and a software adapter too.
pub fn context() -> Option<&'static Device> {
    static CONTEXT: OnceLock<Result<Device, GpuError>> = OnceLock::new();
    let required = std::env::var("REQUIRE_GPU").is_ok_and(|v| v == "1");
    match CONTEXT.get_or_init(Device::new) {
        Ok(context) => {
            assert!(!(required && context.is_software()), "REQUIRE_GPU=1, but there is only {}", context.describe());
            Some(context)
        }
        Err(e) => {
            assert!(!required, "REQUIRE_GPU=1: {e}");
            println!("skipped: {e}");
            None
        }
    }
}
