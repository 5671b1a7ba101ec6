//! `fmlgs generate`: man pages and shell completions, for those who make packages.

use std::path::PathBuf;

use clap_complete::Shell;

use super::CliError;
use crate::jobs::export;

/// Write man pages and shell completions
///
/// One manual page each for the program and its commands, and completions for bash, zsh, fish and PowerShell.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  fmlgs generate out/      writes out/man/*.1 and out/completions/*")]
pub(crate) struct GenerateArgs {
    /// Folder to write into
    folder: PathBuf,
}

pub(crate) fn run(args: &GenerateArgs, mut command: clap::Command) -> Result<(), CliError> {
    let folder = &args.folder;
    command.build();
    write_pages(&command, &folder.join("man"))?;
    for shell in [Shell::Bash, Shell::Zsh, Shell::Fish, Shell::PowerShell] {
        let mut script = Vec::new();
        clap_complete::generate(shell, &mut command, "fmlgs", &mut script);
        let name = shell.to_string();
        export::bytes(&folder.join("completions").join(format!("fmlgs.{name}")), &script)?;
    }
    Ok(())
}

/// The pages of a command and of all below it, but hidden ones.
fn write_pages(command: &clap::Command, folder: &std::path::Path) -> Result<(), CliError> {
    let man = clap_mangen::Man::new(command.clone());
    let (name, mut page) = (man.get_filename(), Vec::new());
    man.render(&mut page).map_err(|e| CliError::failed(e.to_string()))?;
    export::bytes(&folder.join(name), &page)?;
    let shown = command.get_subcommands().filter(|c| !c.is_hide_set() && c.get_name() != "help");
    shown.map(|c| c.clone().disable_help_subcommand(true)).try_for_each(|c| write_pages(&c, folder))
}
