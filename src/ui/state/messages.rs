//! Messages to the user: lines of the log, toasts, errors, and problems over the view.

use super::AppState;
use crate::scene::text;
use crate::worker::{Failure, JobId};

/// Lines kept in the log.
const MAX_LOG: usize = 1_000;

/// Kind of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tone {
    Info,
    Good,
    /// Something was left out or changed.
    Warning,
    Error,
}

/// A line of the log.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLine {
    /// Seconds since the program start; set once the window has seen the line.
    pub(crate) at_secs: Option<f64>,
    /// Kind of the message.
    pub(crate) tone: Tone,
    /// Text of the message.
    pub text: String,
}

/// A message that disappears by itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Toast {
    /// Identifier, for the window's timer.
    pub(crate) id: u64,
    /// Kind of the message.
    pub(crate) tone: Tone,
    pub(crate) text: String,
    /// True for the result of a job: it stays until the user has had time to read it.
    pub(crate) is_result: bool,
}

/// An error that is shown until the user closes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ErrorBox {
    /// The failed operation, such as "Opening fox".
    pub(crate) doing: String,
    /// Description of the error, and its remedy.
    pub(crate) failure: Failure,
}

impl LogLine {
    /// The line as it is shown and copied: "12.34 s  Trained".
    pub(crate) fn dated(&self) -> String {
        let time = self.at_secs.map_or_else(String::new, |secs| format!("{secs:.2} s"));
        format!("{time:>10}  {}", self.text)
    }
}

impl AppState {
    /// Adds a line to the log.
    pub(crate) fn say(&mut self, tone: Tone, text: impl Into<String>) {
        self.say_at(None, tone, text);
    }

    /// Adds a line to the log, with its time if known.
    pub(crate) fn say_at(&mut self, at_secs: Option<f64>, tone: Tone, text: impl Into<String>) {
        if self.log.len() == MAX_LOG {
            self.log.pop_front();
        }
        self.log.push_back(LogLine { at_secs, tone, text: text::line(&text.into()).into_owned() });
    }

    /// Sets the time of the log lines added since the last call.
    pub(crate) fn stamp_log(&mut self, now_secs: f64) {
        self.log.iter_mut().rev().take_while(|line| line.at_secs.is_none()).for_each(|l| l.at_secs = Some(now_secs));
    }

    /// Shows a problem of the open scene over the view, until it is dismissed or another job makes a scene.
    pub(crate) fn problem(&mut self, job: Option<JobId>, text: &str) {
        let text = text::line(text).into_owned();
        if self.problems.iter().all(|(_, known)| *known != text) {
            self.problems.push((job, text));
        }
    }

    /// Shows a message that disappears by itself, and logs it. It replaces earlier ones but results, warnings and errors.
    pub(crate) fn toast(&mut self, tone: Tone, text: impl Into<String>) {
        self.show(tone, text, false);
    }

    /// Shows the result of a job, which no other message replaces.
    pub(crate) fn result(&mut self, text: impl Into<String>) {
        self.show(Tone::Good, text, true);
    }

    fn show(&mut self, tone: Tone, text: impl Into<String>, is_result: bool) {
        let text = text::lines(&text.into()).into_owned();
        self.say(tone, text.clone());
        self.toasts.retain(|t| (t.is_result || matches!(t.tone, Tone::Warning | Tone::Error)) && t.text != text);
        self.toasts.push(Toast { id: self.next_toast, tone, text, is_result });
        self.next_toast += 1;
    }

    /// Shows an error until it is dismissed, and logs it.
    pub(crate) fn fail(&mut self, doing: impl Into<String>, failure: Failure) {
        let doing = text::line(&doing.into()).into_owned();
        let [message, remedy] = [&failure.message, &failure.remedy].map(|t| text::lines(t).into_owned());
        let failure = Failure::new(message, remedy);
        self.say(Tone::Error, format!("{doing}: {}", failure.message));
        self.error = Some(ErrorBox { doing, failure });
    }
}
