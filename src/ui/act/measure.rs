//! Measurements: kept, stored with the scene, and exported.

use super::{export, remote};
use crate::jobs::measurements;
use crate::pipeline::observer::Observer;
use crate::ui::app::App;
use crate::ui::file_dialogs::{FileFormat, FileRequest};
use crate::ui::file_kind::FileKind;
use crate::ui::state::Tone;
use crate::ui::stored_measurements::StoredMeasurements;
use crate::worker::JobInfo;

/// Keeps the measurement that the ruler has made.
pub(in crate::ui) fn keep(app: &mut App) {
    if !app.viewport.take_measurement(&app.state) {
        app.state.toast(Tone::Info, "There is nothing to keep yet: the measurement has no value.");
    }
}

/// Stores measurements that were changed since the last call.
pub(in crate::ui) fn keep_up(app: &mut App) {
    let Some(scene) = app.state.scene.clone().filter(|_| app.viewport.is_of(app.state.scene_number)) else { return };
    let of = (app.state.scene_number, scene.out.clone());
    if app.measured.of != of {
        // Another folder of the same scene may hold some of them already.
        let is_opened = app.measured.of.0 != of.0;
        let stored = if is_opened { scene.measurements.clone() } else { Vec::new() };
        app.measured = StoredMeasurements { of, stored, ..StoredMeasurements::default() };
    }
    let (now, is_trained) = (&app.viewport.measurements, app.state.is_trained());
    let is_tried = app.measured.tried.as_ref().is_some_and(|(all, trained)| all == now && *trained == is_trained);
    if app.measured.is_storing || is_tried || app.measured.stored == *now {
        return;
    }
    let (now, base, folder) = (now.clone(), app.measured.stored.clone(), scene.out.clone());
    app.measured.tried = Some((now.clone(), is_trained));
    if scene.remote.is_some() {
        if !std::mem::replace(&mut app.measured.is_told, true) {
            remote::refuses(app, "Storing measurements", "export them instead");
        }
        return;
    }
    let ours = now.clone();
    let store = move |_: &mut dyn Observer| measurements::store(&folder, &base, &ours);
    let (of, info) = (app.measured.of.clone(), JobInfo::short("Storing measurements").aside());
    app.measured.is_storing = app.start_to_end(info, store, move |app, _, stored| {
        if app.measured.of != of {
            return;
        }
        app.measured.is_storing = false;
        match stored {
            Ok(true) => app.measured.stored = now,
            Ok(false) if !std::mem::replace(&mut app.measured.is_told, true) => {
                let text = "Measurements are kept in this window only: train the scene to store them, or export them.";
                app.state.toast(Tone::Info, text);
            }
            Ok(false) | Err(_) => {}
        }
    });
}

/// Asks for a file, and writes the measurements into it.
pub(in crate::ui) fn write(app: &mut App) {
    if app.viewport.measurements.is_empty() {
        return app.state.toast(Tone::Info, "There are no measurements to export yet: measure something first (M).");
    }
    let formats = vec![FileFormat::new("Table (.csv)", &[".csv"]), FileFormat::new("JSON (.json)", &[".json"])];
    let stem = format!("{}-measurements", export::scene_name(app));
    let request = FileRequest::save(FileKind::Measurements, "Export measurements", &stem, formats);
    app.choose(request, |app, path| {
        let all = app.viewport.measurements.clone();
        let meters = app.state.scene.as_ref().and_then(|scene| scene.meters_per_unit());
        let write = move |_: &mut dyn Observer| measurements::write(&path, &all, meters).map(|()| path);
        app.start(JobInfo::short("Exporting measurements"), write, export::is_saved);
    });
}
