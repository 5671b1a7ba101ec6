//! What the window says to the user: lines of the log, messages that go away, errors, and problems over the view.

use super::AppState;
use crate::jobs::remove::{self, RemovedScene};
use crate::scene::text;
use crate::ui::actions::Action;
use crate::worker::{Failure, JobId, JobKind};

/// Lines kept in the log.
const MAX_LOG: usize = 1_000;

/// How a message is meant.
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
    /// Seconds since the program was started; set once the window has seen it.
    pub(crate) at_secs: Option<f64>,
    /// How it is meant.
    pub(crate) tone: Tone,
    /// What it says.
    pub text: String,
}

/// A message that goes away by itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Toast {
    /// Names it, so that the window can time it.
    pub(crate) id: u64,
    /// How it is meant.
    pub(crate) tone: Tone,
    pub(crate) text: String,
}

/// An error that is shown until a user has read it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ErrorBox {
    /// What was being done: "Opening fox".
    pub(crate) doing: String,
    /// What went wrong, and what to do.
    pub(crate) failure: Failure,
}

impl LogLine {
    /// As it is shown and copied: "12.34 s  Trained".
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

    /// The same with the time at which it was, if that is known.
    pub(crate) fn say_at(&mut self, at_secs: Option<f64>, tone: Tone, text: impl Into<String>) {
        if self.log.len() == MAX_LOG {
            self.log.pop_front();
        }
        self.log.push_back(LogLine { at_secs, tone, text: text::line(&text.into()).into_owned() });
    }

    /// Says when lines of the log were written that have come since this was said last.
    pub(crate) fn stamp_log(&mut self, now_secs: f64) {
        self.log.iter_mut().rev().take_while(|line| line.at_secs.is_none()).for_each(|l| l.at_secs = Some(now_secs));
    }

    /// Shows over the view what is wrong with what is open, until it is dismissed or another job makes it anew.
    pub(crate) fn problem(&mut self, job: Option<JobId>, text: &str) {
        let text = text::line(text).into_owned();
        if self.problems.iter().all(|(_, known)| *known != text) {
            self.problems.push((job, text));
        }
    }

    /// Shows a message that goes away by itself, and logs it.
    pub(crate) fn toast(&mut self, tone: Tone, text: impl Into<String>) {
        let text = text::lines(&text.into()).into_owned();
        self.say(tone, text.clone());
        self.toasts.push(Toast { id: self.next_toast, tone, text });
        self.next_toast += 1;
    }

    /// Takes in a scene without a thing, which is to be seen beside the one that it was made of.
    pub(super) fn take_removed(&mut self, removed: RemovedScene) -> Action {
        self.toast(Tone::Good, remove::told(&removed.name, &removed.report));
        self.say(Tone::Info, format!("Saved to {}", removed.folder.display()));
        let show = Action::OpenBeside(Some(removed.folder.clone()));
        self.removed = Some(removed);
        show
    }

    /// " on HOST" where the scene is on another computer.
    pub(super) fn elsewhere(&self) -> String {
        let origin = self.scene.as_ref().and_then(|scene| scene.remote.as_ref());
        origin.map_or_else(String::new, |origin| format!(" on {}", origin.host))
    }

    /// Takes in that a job could not go on.
    pub(super) fn failed(&mut self, job: JobId, failure: Failure) {
        let doing = match self.end_short(job) {
            // A photo that cannot be read is no reason to stop a user.
            Some((JobKind::Photo, title)) => {
                self.toast(Tone::Warning, format!("{title}: {}", failure.message));
                self.failed_photos.push(job);
                return;
            }
            Some((_, title)) => title,
            None => self.end(job).map_or_else(|| "Working".to_owned(), |j| j.title),
        };
        self.fail(doing, failure);
    }

    /// Shows an error until it is dismissed, and logs it.
    pub(crate) fn fail(&mut self, doing: impl Into<String>, failure: Failure) {
        let doing = text::line(&doing.into()).into_owned();
        let [message, remedy] = [&failure.message, &failure.remedy].map(|t| text::lines(t).into_owned());
        let failure = Failure { message, remedy };
        self.say(Tone::Error, format!("{doing}: {}", failure.message));
        self.error = Some(ErrorBox { doing, failure });
    }
}
