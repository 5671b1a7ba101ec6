//! The `fmlgs` binary: every word on the command line is handled by [`fmlgs::cli`].

fn main() -> std::process::ExitCode {
    fmlgs::cli::main(|first, overrides| Ok(fmlgs::ui::run(first, overrides)?))
}
