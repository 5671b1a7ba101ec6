//! Output of the subcommands: results on standard output, notes on standard error.
//! All text for a terminal goes through here, so that nothing foreign in it acts on one.

use std::io::{ErrorKind, Write};

use serde::Serialize;

use super::CliError;
use crate::scene::text;

/// Prints `text` and a line break to standard output. A reader that has closed its end (`| head`)
/// has seen enough, which is no failure.
pub(crate) fn print(text: &str) -> Result<(), CliError> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text::lines(text).as_bytes()).and_then(|()| out.write_all(b"\n")).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// Prints a warning to standard error.
pub(crate) fn warn(text: String) {
    note(&format!("warning: {text}"));
}

/// Prints `value` as indented JSON.
pub(crate) fn print_json(value: &impl Serialize) -> Result<(), CliError> {
    print(&text::json(&serde_json::to_string_pretty(value)?))
}

/// Prints a message of a protocol, which is JSON on one line.
pub(crate) fn print_message(json: &str) -> Result<(), CliError> {
    print(&text::json(json))
}

/// Prints a message to standard error. Errors of writing are ignored: a closed reader ends no work.
pub(crate) fn note(text: &str) {
    let _ = writeln!(std::io::stderr(), "{}", text::message(text));
}

/// Command line of this process, quoted for a shell.
pub(crate) fn command_line() -> String {
    let words = std::env::args_os().skip(1).map(|word| text::shell_word(&word.to_string_lossy()));
    std::iter::once("fmlgs".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

/// Rows of cells as aligned columns: the first to the left, the others to the right.
pub(crate) fn table(rows: &[Vec<String>]) -> String {
    // A cell is one line, and no wider than a name: formatting takes no width over 65,535.
    let cell = |s: &String| text::shortened(&text::line(s), text::LONGEST_NAME).into_owned();
    let rows: Vec<Vec<String>> = rows.iter().map(|row| row.iter().map(cell).collect()).collect();
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| rows.iter().filter_map(|r| r.get(c)).map(|s| s.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let cell = |(c, s): (usize, &String)| {
            let w = widths[c];
            if c == 0 { format!("{s:<w$}") } else { format!("{s:>w$}") }
        };
        row.iter().enumerate().map(cell).collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let rows = [vec!["view".into(), "PSNR".into()], vec!["a long name".into(), "9.1".into()]];
        assert_eq!(table(&rows), "view         PSNR\na long name   9.1");
    }

    #[test]
    fn cells_are_one_line_of_bounded_width() {
        let rows = [vec!["é".repeat(70_000), "1".into()], vec!["a\nb\u{1b}[2J".into(), "2".into()]];
        let lines = table(&rows);
        assert_eq!(lines.lines().count(), 2);
        assert!(lines.chars().count() < 3 * text::LONGEST_NAME && !lines.contains('\u{1b}'), "{lines}");
    }
}
