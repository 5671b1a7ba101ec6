//! Start of the program's window.

use std::path::PathBuf;

/// First action of the window.
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
