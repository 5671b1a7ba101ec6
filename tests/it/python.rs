//! The Python package (`python/`), by its own tests, against scenes that the program writes.

use std::path::Path;
use std::process::{Command, Stdio};

/// A Python that has NumPy: the one that `FMLGS_PYTHON` names, the first of the user's, the system's.
fn python() -> Option<String> {
    let named = std::env::var("FMLGS_PYTHON").ok();
    let candidates = named.into_iter().chain(["python3", "/usr/bin/python3"].map(str::to_owned));
    candidates.into_iter().find(|python| {
        let check = "import sys, numpy; sys.exit(sys.version_info < (3, 10))";
        Command::new(python).args(["-c", check]).stderr(Stdio::null()).status().is_ok_and(|s| s.success())
    })
}

#[test]
fn the_python_package_passes_its_tests() {
    let Some(python) = python() else {
        println!("skipped: no Python 3.10 or newer with NumPy here");
        return;
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("python");
    let tests = Command::new(python)
        .args(["-m", "unittest", "discover", "-s", "tests", "-t", "."])
        .current_dir(&folder)
        .env("PYTHONPATH", folder.join("src"))
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("FMLGS_BINARY", env!("CARGO_BIN_EXE_fmlgs"))
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .stdin(Stdio::null())
        .output()
        .expect("Python starts");
    let said = String::from_utf8_lossy(&tests.stderr);
    assert!(tests.status.success(), "{said}");
    // No test at all would succeed as well.
    let count = said.lines().find_map(|l| l.strip_prefix("Ran ")?.split(' ').next()?.parse::<u32>().ok());
    assert!(count.is_some_and(|n| n >= 20), "{said}");
}
