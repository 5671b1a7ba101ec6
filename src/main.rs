//! The `fmlgs` binary: every word on the command line is handled by [`fmlgs::cli`].

/// The version, which packages name together with the commit that they are built from (`tools/version.sh`).
const VERSION: &str = match option_env!("FMLGS_VERSION") {
    Some(version) => version,
    None => env!("CARGO_PKG_VERSION"),
};

fn main() -> std::process::ExitCode {
    fmlgs::cli::main(VERSION, |first, overrides| Ok(fmlgs::ui::run(first, overrides)?))
}
