//! The command line: one file per subcommand.
pub mod error;
pub mod interrupt;
pub mod progress;

/// Runs the command line of this process and returns its exit code.
pub fn main() -> std::process::ExitCode {
    std::process::ExitCode::SUCCESS
}
