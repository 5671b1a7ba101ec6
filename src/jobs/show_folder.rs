//! Showing a folder in the system's file manager.

use std::io;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time in which a file manager fails if it does; one that runs longer is open.
const FAILS_WITHIN: Duration = Duration::from_secs(3);

/// Opens `folder` in the system's file manager.
///
/// # Errors
/// If the folder is gone, or the system has no file manager that opens it, as without a display.
pub(crate) fn run(folder: &Path) -> io::Result<()> {
    if !folder.is_dir() {
        return Err(io::Error::new(io::ErrorKind::NotFound, "the folder is gone"));
    }
    first_that_works(open::commands(folder))
}

/// Starts the commands in order until one works; the last error if none does.
fn first_that_works(commands: Vec<Command>) -> io::Result<()> {
    let mut failed = io::Error::new(io::ErrorKind::NotFound, "there is no file manager");
    for mut command in commands {
        let [input, output, errors] = std::array::from_fn(|_| Stdio::null());
        match command.stdin(input).stdout(output).stderr(errors).spawn() {
            Ok(mut child) => {
                let begun = Instant::now();
                while begun.elapsed() < FAILS_WITHIN {
                    match child.try_wait()? {
                        Some(end) if end.success() => return Ok(()),
                        Some(end) => {
                            let program = command.get_program().to_string_lossy();
                            failed =
                                io::Error::other(format!("no file manager was found ({program} ended with {end})"));
                            break;
                        }
                        None => sleep(Duration::from_millis(20)),
                    }
                }
                if child.try_wait()?.is_none() {
                    return Ok(());
                }
            }
            Err(e) if e.kind() == io::ErrorKind::NotFound => {}
            Err(e) => failed = e,
        }
    }
    Err(failed)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn the_first_file_manager_that_works_is_used_and_none_is_an_error() {
        let folder = tempfile::tempdir().expect("folder");
        let made = folder.path().join("made");
        let touch = || {
            let mut touch = Command::new("touch");
            touch.arg(&made);
            touch
        };
        let missing = || Command::new("/no/such/file-manager");
        assert_eq!(first_that_works(vec![missing()]).expect_err("none").to_string(), "there is no file manager");
        let e = first_that_works(vec![Command::new("false"), missing()]).expect_err("it fails");
        assert!(e.to_string().contains("false ended with"), "{e}");
        assert!(!made.exists());
        first_that_works(vec![missing(), Command::new("false"), touch()]).expect("the third works");
        assert!(made.exists());
        assert_eq!(run(&folder.path().join("gone")).expect_err("gone").to_string(), "the folder is gone");
    }
}
