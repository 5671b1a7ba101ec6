//! The camera path: stored with the scene.

use super::remote;
use crate::jobs::camera_path::{self, KeptPath};
use crate::pipeline::observer::Observer;
use crate::ui::app::App;
use crate::ui::state::Tone;
use crate::ui::stored_path::StoredPath;
use crate::worker::JobInfo;

/// Stores the camera path if it was changed since the last call.
pub(in crate::ui) fn keep_up(app: &mut App) {
    let Some(scene) = app.state.scene.clone().filter(|_| app.camera.scene == app.state.scene_number) else { return };
    let of = (app.state.scene_number, scene.out.clone());
    if app.stored_path.of != of {
        // Another folder of the same scene may hold the path already.
        let is_elsewhere = app.stored_path.of.0 == of.0;
        let stored = if is_elsewhere { app.stored_path.stored.take() } else { scene.camera_path.clone() };
        app.stored_path = StoredPath { of, stored, is_elsewhere, ..StoredPath::default() };
    }
    let is_trained = app.state.is_trained();
    let (now, known) = (Some(&app.camera.path).filter(|path| !path.keys.is_empty()), &app.stored_path);
    let waits = known.waits && app.state.job.is_some();
    let is_tried = known.tried.as_ref().is_some_and(|(path, trained)| path.as_ref() == now && *trained == is_trained);
    let is_stored = !known.is_elsewhere && known.stored.as_ref() == now;
    if known.is_storing || waits || is_stored || is_tried && !known.waits {
        return;
    }
    let (now, base, folder) = (now.cloned(), known.stored.clone(), scene.out.clone());
    (app.stored_path.tried, app.stored_path.waits) = (Some((now.clone(), is_trained)), false);
    if scene.remote.is_some() {
        if !std::mem::replace(&mut app.stored_path.is_told, true) {
            remote::refuses(app, "Storing the camera path", "save it to a file instead");
        }
        return;
    }
    let store = move |_: &mut dyn Observer| camera_path::store(&folder, base.as_ref(), now.as_ref());
    let (of, info) = (app.stored_path.of.clone(), JobInfo::short("Storing the camera path").aside());
    app.stored_path.is_storing = app.start_to_end(info, store, move |app, _, outcome| {
        if app.stored_path.of != of {
            return;
        }
        app.stored_path.is_storing = false;
        let why = match outcome {
            Ok(KeptPath::Stored(stored)) => {
                (app.stored_path.stored, app.stored_path.is_elsewhere) = (stored, false);
                return;
            }
            Ok(KeptPath::Busy) => {
                app.stored_path.waits = true;
                return;
            }
            Ok(KeptPath::NoScene) => "train the scene to store it, or save it to a file (Save\u{2026})".to_owned(),
            Ok(KeptPath::Blocked(why)) => format!("{why}. Save it to another file (Save\u{2026})"),
            Err(_) => return,
        };
        if !std::mem::replace(&mut app.stored_path.is_told, true) {
            app.state.toast(Tone::Warning, format!("The camera path is kept in this window only: {why}."));
        }
    });
}
