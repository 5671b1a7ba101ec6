//! A scene on another computer: the window shows it like a local one. Requests that need that computer's files go to
//! its server, or are refused with a message.

use super::app::App;
use super::state::Tone;
use crate::jobs::Folders;
use crate::jobs::edit::EditRequest;
use crate::remote::{Address, ServerLink};
use crate::worker::{Command, Event, Failure, JobId, JobKind};

impl App {
    /// Connects to a server and shows its scene.
    pub(super) fn connect(&mut self, url: &str) {
        self.disconnect();
        let failed = |message: String| Failure { message, remedy: String::new() };
        let started = Address::parse(url).and_then(|address| {
            ServerLink::start(address, Folders::of_user(), self.worker.source()).map_err(|e| e.to_string())
        });
        match started {
            Ok(link) => {
                self.worker.set_elsewhere(Some(link.takes()));
                self.link = Some(link);
            }
            Err(why) => self.state.fail("Connecting", failed(why)),
        }
    }

    /// Ends the connection; jobs on the server continue.
    pub(super) fn disconnect(&mut self) {
        self.worker.set_elsewhere(None);
        if let Some(link) = self.link.take() {
            let left = self.state.job.take_if(|job| link.owns(job.id));
            self.state.training_job.take_if(|job| link.owns(*job));
            let host = link.status().host;
            let goes_on = left.map_or("", |_| "; what runs there goes on");
            self.state.say(Tone::Info, format!("Disconnected from {host}{goes_on}"));
        }
    }

    /// True if an event comes from a server that is no longer connected.
    pub(super) fn is_of_earlier_server(&self, event: &Event) -> bool {
        event.job().is_remote() && !self.link.as_ref().is_some_and(|link| link.owns(event.job()))
    }

    /// Pauses or resumes a job, on this computer or on the server.
    pub(super) fn set_paused(&mut self, job: JobId, paused: bool) {
        match self.link.as_ref().filter(|link| link.owns(job)) {
            Some(link) if !link.status().connected || !link.set_paused(paused) => self.say_unreachable(),
            Some(_) => {}
            None => self.worker.set_paused(job, paused),
        }
    }

    /// Cancels the job on screen, on this computer or on the server.
    pub(super) fn cancel_job(&mut self) {
        let Some(job) = &mut self.state.job else { return };
        match self.link.as_ref().filter(|link| link.owns(job.id)) {
            // A scene that is still being received has no job on the server to cancel.
            Some(_) if job.kind != JobKind::Train => self.disconnect(),
            Some(link) if !link.status().connected || !link.cancel() => self.say_unreachable(),
            Some(_) => job.canceling = true,
            None => {
                self.worker.cancel(job.id);
                job.canceling = true;
            }
        }
    }

    fn say_unreachable(&mut self) {
        self.state.toast(Tone::Warning, "There is no connection at the moment, so that cannot be passed on.");
    }

    /// Sends a command about a scene on another computer to its server, or reports that it is impossible. Returns true
    /// if the command is settled.
    pub(super) fn settled_remotely(&mut self, command: &Command) -> bool {
        let Some(origin) = self.state.scene.as_ref().and_then(|scene| scene.remote.clone()) else { return false };
        let host = origin.host;
        let instead = match command {
            Command::EditObjects { request: EditRequest::Apply(edit), .. } if origin.allow_edit => {
                match self.link.as_ref().is_some_and(|link| link.edit(edit.clone())) {
                    true => return true,
                    false => "there is no connection at the moment".to_owned(),
                }
            }
            Command::EditObjects { .. } if origin.allow_edit => {
                "its server keeps no earlier states to go back to".into()
            }
            Command::EditObjects { .. } => format!("{host} does not allow changes (fmlgs serve --allow-edit)"),
            Command::FindObjects(_) => "run 'fmlgs preprocess' there".into(),
            Command::Train { .. } => "run 'fmlgs train --serve' there".into(),
            Command::Evaluate { .. } => "run 'fmlgs eval' there".into(),
            Command::Remove(_) => "run 'fmlgs remove' there".into(),
            Command::Rearrange(_) => {
                "run 'fmlgs edit' or 'fmlgs clean' there, or export the Gaussians here first".into()
            }
            Command::SetScale { .. } => "its scale is stored with the scene there".into(),
            _ => return false,
        };
        self.state.toast(Tone::Warning, format!("{}: the scene is on {host}; {instead}.", command.title()));
        true
    }
}
