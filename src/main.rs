//! The `fmlgs` binary: every word on the command line is handled by [`fmlgs::cli`].

use fmlgs::worker::Action;

fn main() -> std::process::ExitCode {
    fmlgs::cli::main(|first| {
        let path = match first {
            Some(Action::Open(p)) => Some(p),
            _ => None,
        };
        Ok(fmlgs::ui::run(path)?)
    })
}
