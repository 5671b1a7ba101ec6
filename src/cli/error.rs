//! How a subcommand fails, and the exit code that says so to a script.

use std::error::Error;
use std::process::ExitCode;

use super::output;
use crate::pipeline::observer::Interrupted;

/// Why a subcommand did not do what was asked.
#[derive(Debug)]
pub enum CliError {
    /// The arguments make no sense together; exit code 2, as for arguments that do not parse.
    Usage(String),
    /// The work failed; exit code 1.
    Failed(Box<dyn Error + Send + Sync>),
    /// Ctrl-C or SIGTERM; exit code 130. The text says what was saved and how to go on.
    Cancelled(String),
}

impl CliError {
    /// A failure described by `text`: what, where, and what to do about it.
    pub fn failed(text: impl Into<String>) -> Self {
        Self::Failed(text.into().into())
    }

    /// Of work that may have been asked to stop; `saved` says what is left of it then.
    pub fn of_work(error: impl Error + Send + Sync + 'static, saved: &str) -> Self {
        if Interrupted::is_cause_of(&error) { Self::Cancelled(saved.into()) } else { error.into() }
    }

    /// Prints the error to standard error and returns its exit code.
    pub fn report(&self) -> ExitCode {
        match self {
            Self::Usage(text) => {
                output::note(&format!("error: {text}"));
                output::note("");
                output::note("For more information, try 'fmlgs --help'.");
                ExitCode::from(2)
            }
            Self::Failed(error) => {
                output::note(&format!("error: {}", chain(error.as_ref())));
                ExitCode::FAILURE
            }
            Self::Cancelled(text) => {
                output::note(&format!("cancelled: {text}"));
                ExitCode::from(130)
            }
        }
    }
}

impl<E: Error + Send + Sync + 'static> From<E> for CliError {
    fn from(error: E) -> Self {
        Self::Failed(Box::new(error))
    }
}

/// The error and its causes, each once: many errors already quote their cause.
fn chain(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut next = error.source();
    while let Some(cause) = next {
        let cause_text = cause.to_string();
        if !text.contains(&cause_text) {
            text.push_str(": ");
            text.push_str(&cause_text);
        }
        next = cause.source();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    enum Outer {
        #[error("cannot save")]
        Silent(#[source] std::io::Error),
        #[error("cannot save: {0}")]
        Quoting(#[source] std::io::Error),
    }

    #[test]
    fn each_cause_is_told_once() {
        let cause = || std::io::Error::other("disk full");
        assert_eq!(chain(&Outer::Silent(cause())), "cannot save: disk full");
        assert_eq!(chain(&Outer::Quoting(cause())), "cannot save: disk full");
    }
}
