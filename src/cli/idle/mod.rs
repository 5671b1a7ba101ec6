//! Options that a call cannot obey: refused by name, in one place, before anything is opened.
//!
//! clap checks most of what belongs together, but leaves a `requires` unchecked where the option that is required
//! conflicts with another that is given. What is left is here: for each command, options and when they do nothing.

mod rules;

use std::path::PathBuf;

use clap::parser::ValueSource;
use clap::{ArgMatches, Command};

use rules::RULES;

/// Arguments of one command that were given.
struct Given<'a>(&'a ArgMatches);

/// Options of commands that do nothing in some calls.
struct Rule {
    commands: &'static [&'static str],
    /// Names of the options in clap.
    options: &'static [&'static str],
    /// Returns why the options do nothing in this call, to follow "has no effect "; `None` if they do something.
    idle: fn(&Given<'_>) -> Option<&'static str>,
}

impl Given<'_> {
    /// Returns whether the option is on the command line; a default does not count.
    fn has(&self, id: &str) -> bool {
        self.0.try_contains_id(id).is_ok_and(|there| there) && self.0.value_source(id) == Some(ValueSource::CommandLine)
    }

    fn has_any(&self, ids: &[&str]) -> bool {
        ids.iter().any(|id| self.has(id))
    }

    /// The values of an option as they were written, or its default.
    fn texts(&self, id: &str) -> Vec<String> {
        let raw = self.0.try_get_raw(id).ok().flatten();
        raw.into_iter().flatten().map(|value| value.to_string_lossy().into_owned()).collect()
    }

    /// Returns whether an option has this value and no other.
    fn is(&self, id: &str, value: &str) -> bool {
        matches!(self.texts(id).as_slice(), [only] if only == value)
    }

    /// The path that an option gives.
    fn path(&self, id: &str) -> Option<PathBuf> {
        let path = PathBuf::from(self.texts(id).first().filter(|_| self.has(id))?);
        Some(std::path::absolute(&path).unwrap_or(path))
    }
}

/// Refuses what was given to the command `name` and does nothing there. `command` is how clap knows it.
///
/// # Errors
/// The option, why it has no effect, and what it needs.
pub(super) fn check(name: &str, command: &Command, matches: &ArgMatches) -> Result<(), String> {
    let given = Given(matches);
    let of_command = RULES.iter().filter(|rule| rule.commands.contains(&name));
    for rule in of_command {
        for id in rule.options.iter().filter(|id| given.has(id)) {
            if let Some(why) = (rule.idle)(&given) {
                return Err(format!("{} has no effect {why}", written(command, id)));
            }
        }
    }
    Ok(())
}

/// An option as it is typed.
fn written(command: &Command, id: &str) -> String {
    let argument = command.get_arguments().find(|a| a.get_id() == id);
    match argument.map(|a| a.get_long()) {
        Some(Some(long)) => format!("--{long}"),
        Some(None) => id.to_uppercase(),
        // One that all commands have in common.
        None => format!("--{}", id.replace('_', "-")),
    }
}

/// Refuses what does nothing in a whole command line.
///
/// # Errors
/// As [`check`]; a command of a command is checked by both names ("report merge").
pub(super) fn check_all(command: &Command, matches: &ArgMatches) -> Result<(), String> {
    let (mut name, mut command, mut matches) = (String::new(), command, matches);
    while let Some((next, inner)) = matches.subcommand() {
        let Some(of) = command.find_subcommand(next) else { return Ok(()) };
        name = if name.is_empty() { next.to_owned() } else { format!("{name} {next}") };
        (command, matches) = (of, inner);
        check(&name, command, matches)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
