//! Arguments as a table of a TOML file gives them: by the long names of the command line, and by its rules.

use clap::{Arg, ArgAction, Args, Command};

use super::idle;

/// Reads `table` as the options of the command `name`, without those in `left_out`; the words `given` come before them
/// (positional arguments, for example).
///
/// # Errors
/// The problem and the key that has it.
pub(crate) fn parse<A: Args>(name: &str, table: &toml::Table, given: &[&str], left_out: &[&str]) -> Result<A, String> {
    let command = A::augment_args(Command::new("fmlgs").no_binary_name(true).disable_help_flag(true));
    let known: Vec<(&str, &Arg)> = command.get_arguments().filter_map(|a| Some((a.get_long()?, a))).collect();
    let mut line: Vec<String> = given.iter().map(|word| (*word).to_owned()).collect();
    for (key, value) in table {
        let Some((_, argument)) = known.iter().find(|(long, _)| long == key && !left_out.contains(long)) else {
            let names: Vec<&str> = known.iter().map(|(long, _)| *long).filter(|n| !left_out.contains(n)).collect();
            return Err(format!("'{key}' is unknown; known are {}", names.join(", ")));
        };
        let values = match (argument.get_action(), value) {
            (ArgAction::SetTrue, toml::Value::Boolean(false)) => continue,
            (ArgAction::SetTrue, toml::Value::Boolean(true)) => {
                line.push(format!("--{key}"));
                continue;
            }
            (ArgAction::SetTrue, _) => return Err(format!("'{key}': true or false is needed, without quotes")),
            (ArgAction::Append, toml::Value::Array(values)) => values.iter().collect(),
            (_, value) => vec![value],
        };
        for value in values {
            let text = match value {
                toml::Value::String(text) => text.clone(),
                toml::Value::Integer(number) => number.to_string(),
                toml::Value::Float(number) => number.to_string(),
                other => return Err(format!("'{key}': one value is needed, not {}", other.type_str())),
            };
            line.push(format!("--{key}={text}"));
        }
    }
    let matches = command.clone().try_get_matches_from(line).map_err(|e| message(&e))?;
    idle::check(name, &command, &matches)?;
    A::from_arg_matches(&matches).map_err(|e| message(&e))
}

/// Message of an error of clap, without the parts that are meant for a terminal.
fn message(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let text = text.trim_start_matches("error: ").split("\n\nUsage").next().unwrap_or_default();
    let text = text.split("\n\nFor more information").next().unwrap_or_default();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
