//! What the program was started with.

use std::path::PathBuf;

/// What the window does first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Start {
    /// Opens the trained demo.
    Demo,
    /// Opens this scene.
    Scene(PathBuf),
    /// Shows this report.
    Report(PathBuf),
    /// Looks at what is served at this address.
    Remote(String),
    /// Compares it with this one.
    SecondReport(PathBuf),
}
