//! A scene on another computer: the window shows it like a local one. Requests that need that computer's files go to
//! its server, or are refused with a message.

use crate::jobs::edit::EditRequest;
use crate::remote::{Address, LinkUpdate, ServerLink};
use crate::ui::actions::{Action, Pane};
use crate::ui::app::App;
use crate::ui::state::Tone;
use crate::worker::{Event, Failure, JobId, Makes};

/// Connects to a server and shows its scene.
pub(in crate::ui) fn connect(app: &mut App, url: &str) {
    disconnect(app);
    let started = Address::parse(url).and_then(|address| {
        let (folders, clouds) = (app.workspace.folders().clone(), app.tasks.shared_clouds());
        ServerLink::start(address, folders, clouds, app.tasks.repaint()).map_err(|e| e.to_string())
    });
    match started {
        Ok(link) => {
            app.tasks.set_remote_photos(Some(link.photos()));
            app.link = Some(link);
        }
        Err(why) => app.state.fail("Connecting", Failure::new(why, "")),
    }
}

/// Ends the connection; jobs on the server continue.
pub(in crate::ui) fn disconnect(app: &mut App) {
    app.tasks.set_remote_photos(None);
    if let Some(link) = app.link.take() {
        let left = app.state.job.take_if(|job| is_remote(job.id));
        app.state.training_job.take_if(|job| is_remote(*job));
        let host = link.status().host;
        let goes_on = left.map_or("", |_| "; what runs there goes on");
        app.state.say(Tone::Info, format!("Disconnected from {host}{goes_on}"));
    }
}

/// Takes over all updates of the server since the last call.
pub(in crate::ui) fn take_updates(app: &mut App) {
    while let Some(update) = app.link.as_ref().and_then(ServerLink::next_update) {
        match update {
            LinkUpdate::Event(event) => {
                if matches!(&event, Event::Started(_, info) if info.makes == Makes::Gaussians) {
                    app.layout.dock.activate(Pane::Training);
                }
                app.state.apply(event);
            }
            LinkUpdate::Opened(scene) => app.state.opened(*scene, false),
            LinkUpdate::Trained(job, run) => {
                if app.state.trained(job, *run) {
                    app.ask(Action::FindObjects);
                }
            }
            LinkUpdate::Objects(map) => app.state.set_semantics(Some(map)),
            LinkUpdate::Refused(why) => app.state.toast(Tone::Warning, why),
        }
    }
    app.state.link = app.link.as_ref().map(ServerLink::status);
}

/// True if a job runs on another computer.
pub(super) fn is_remote(job: JobId) -> bool {
    matches!(job, JobId::Remote(_))
}

/// Pauses or resumes a job, on this computer or on the server.
pub(super) fn set_paused(app: &mut App, job: JobId, paused: bool) {
    match app.link.as_ref().filter(|_| is_remote(job)) {
        Some(link) if !link.status().connected || !link.set_paused(paused) => say_unreachable(app),
        Some(_) => {}
        None => app.tasks.set_paused(job, paused),
    }
}

/// Cancels the job on screen, on this computer or on the server.
pub(in crate::ui) fn cancel_job(app: &mut App) {
    let Some(job) = &mut app.state.job else { return };
    match app.link.as_ref().filter(|_| is_remote(job.id)) {
        // A scene that is still being received has no job on the server to cancel.
        Some(_) if job.info.makes != Makes::Gaussians => disconnect(app),
        Some(link) if !link.status().connected || !link.cancel() => say_unreachable(app),
        Some(_) => job.canceling = true,
        None => {
            app.tasks.cancel(job.id);
            job.canceling = true;
        }
    }
}

fn say_unreachable(app: &mut App) {
    app.state.toast(Tone::Warning, "There is no connection at the moment, so that cannot be passed on.");
}

/// Returns true, with a message, if the scene is on another computer; `doing` is impossible from here then.
pub(super) fn refuses(app: &mut App, doing: &str, instead: &str) -> bool {
    let Some(host) = app.state.scene.as_ref().and_then(|scene| Some(scene.remote.as_ref()?.host.clone())) else {
        return false;
    };
    app.state.toast(Tone::Warning, format!("{doing}: the scene is on {host}; {instead}."));
    true
}

/// Passes an edit of objects and parts to the server of the scene, if that is on another computer. Returns true if it is
/// settled so, or refused with a message.
pub(super) fn takes_edit(app: &mut App, request: &EditRequest) -> bool {
    let Some(origin) = app.state.scene.as_ref().and_then(|scene| scene.remote.clone()) else { return false };
    let instead = match request {
        _ if !origin.allow_edit => format!("{} does not allow changes (fmlgs serve --allow-edit)", origin.host),
        EditRequest::Apply(edit) if app.link.as_ref().is_some_and(|link| link.edit(edit.clone())) => return true,
        EditRequest::Apply(_) => "there is no connection at the moment".into(),
        EditRequest::Restore(_) => "its server keeps no earlier states to go back to".into(),
    };
    refuses(app, "Editing objects", &instead)
}
