//! The table of a path's keyframes.

use egui::{Button, DragValue, Grid, ScrollArea, TextEdit, Ui};

use super::{CameraPane, caption};
use crate::navigate::Pose;
use crate::scene::PathKey;

/// Width of a name, points.
const NAME_PT: f32 = 120.0;
/// Least size of an icon button, points.
const ICON: egui::Vec2 = egui::vec2(26.0, 22.0);
/// Icons of "Go to" and "Replace by the view".
const GO: &str = "\u{1f441}";
const REPLACE: &str = "\u{1f4f7}";

/// Change of a keyframe by the user.
enum KeyChange {
    Choose,
    Go,
    Update,
    Copy,
    Up,
    Down,
    Delete,
}

/// Draws the table. Returns the pose of the keyframe to show.
pub(crate) fn show(ui: &mut Ui, pane: &mut CameraPane, eye: &Pose) -> Option<Pose> {
    let mut wanted_change: Option<(usize, KeyChange)> = None;
    let more = pane.shows_more;
    ScrollArea::horizontal().auto_shrink([false, true]).show(ui, |ui| {
        Grid::new("keys").num_columns(if more { 7 } else { 4 }).striped(true).spacing([10.0, 4.0]).show(ui, |ui| {
            for text in ["", "Name", "Time", ""] {
                ui.label(caption(text));
            }
            if more {
                for text in ["Field of view", "Roll", "Wait"] {
                    ui.label(caption(text));
                }
            }
            ui.end_row();
            for (i, key) in pane.path.keys.iter_mut().enumerate() {
                if let Some(wanted) = row(ui, i, key, pane.selected == Some(i)) {
                    wanted_change = Some((i, wanted));
                }
                if more {
                    more_fields(ui, i, key);
                }
                ui.end_row();
            }
        });
    });
    let (i, wanted_change) = wanted_change?;
    pane.selected = Some(i);
    let keys = &mut pane.path.keys;
    match wanted_change {
        KeyChange::Choose => {}
        KeyChange::Go => return keys.get(i).map(Pose::of_key),
        KeyChange::Update => {
            let old = &keys[i];
            keys[i] =
                PathKey { name: old.name.clone(), dwell_secs: old.dwell_secs, time_secs: old.time_secs, ..eye.key() };
        }
        KeyChange::Copy => {
            let copy = PathKey { time_secs: None, ..keys[i].clone() };
            keys.insert(i + 1, copy);
        }
        KeyChange::Up if i > 0 => swap(keys, i, i - 1),
        KeyChange::Down if i + 1 < keys.len() => swap(keys, i, i + 1),
        KeyChange::Up | KeyChange::Down => {}
        KeyChange::Delete => {
            keys.remove(i);
            pane.selected = None;
        }
    }
    None
}

/// Swaps two keyframes; their times stay in place.
fn swap(keys: &mut [PathKey], a: usize, b: usize) {
    keys.swap(a, b);
    let times = (keys[a].time_secs, keys[b].time_secs);
    (keys[b].time_secs, keys[a].time_secs) = times;
}

/// Draws number, name and time of a keyframe, and its buttons.
fn row(ui: &mut Ui, i: usize, key: &mut PathKey, chosen: bool) -> Option<KeyChange> {
    let mut wanted_change = None;
    let number = ui.selectable_label(chosen, format!("{}", i + 1));
    if number.accessible_name(format!("Keyframe {}", i + 1)).clicked() {
        wanted_change = Some(KeyChange::Choose);
    }
    let named = |what: &str| format!("{what} of keyframe {}", i + 1);
    let mut name = key.name.clone().unwrap_or_default();
    let edit = TextEdit::singleline(&mut name).char_limit(80).hint_text("name");
    // As high as the other cells, else it stands lower.
    let size = egui::vec2(NAME_PT, ui.spacing().interact_size.y);
    ui.add_sized(size, edit.align(egui::Align2::LEFT_CENTER)).accessible_name(named("Name"));
    key.name = Some(name).filter(|n| !n.is_empty());
    ui.horizontal(|ui| {
        let mut fixed = key.time_secs.is_some();
        let fix = ui.checkbox(&mut fixed, "").on_hover_text("Fix the time of this keyframe.");
        if fix.accessible_name(named("Fixed time")).changed() {
            key.time_secs = fixed.then_some(i as f64);
        }
        match &mut key.time_secs {
            Some(time) => {
                let time = DragValue::new(time).range(0.0..=3600.0).speed(0.02).max_decimals(2).suffix(" s");
                ui.add(time).accessible_name(named("Time"))
            }
            None => ui.label(caption("even")),
        };
    });
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let number = i + 1;
        for (icon, name, tip, wanted) in [
            (GO, format!("Go to keyframe {number}"), "Move the view to this keyframe.", KeyChange::Go),
            (
                REPLACE,
                format!("Replace keyframe {number} by the view"),
                "Replace this keyframe by the current view; its time, wait and name stay.",
                KeyChange::Update,
            ),
        ] {
            if ui.add(Button::new(icon).min_size(ICON)).on_hover_text(tip).accessible_name(name).clicked() {
                wanted_change = Some(wanted);
            }
        }
        let more = ui.menu_button("\u{2026}", |ui| {
            for (text, tip, wanted) in [
                ("Copy", "Insert a copy after it.", KeyChange::Copy),
                ("Earlier", "Swap it with the previous keyframe.", KeyChange::Up),
                ("Later", "Swap it with the next keyframe.", KeyChange::Down),
                ("Delete", "Remove it from the path.", KeyChange::Delete),
            ] {
                if ui.button(text).on_hover_text(tip).clicked() {
                    wanted_change = Some(wanted);
                    ui.close();
                }
            }
        });
        more.response.on_hover_text("More").accessible_name(format!("More on keyframe {number}"));
    });
    wanted_change
}

/// Draws what is seldom needed of a keyframe.
fn more_fields(ui: &mut Ui, i: usize, key: &mut PathKey) {
    let named = |what: &str| format!("{what} of keyframe {}", i + 1);
    let mut degrees = key.fov_y_rad.to_degrees();
    let fov = DragValue::new(&mut degrees).range(5.0..=150.0).speed(0.2).max_decimals(1).suffix("\u{b0}");
    if ui.add(fov).accessible_name(named("Field of view")).changed() {
        key.fov_y_rad = degrees.to_radians();
    }
    let mut roll = key.roll_rad.to_degrees();
    let angle = DragValue::new(&mut roll).range(-180.0..=180.0).speed(0.5).max_decimals(1).suffix("\u{b0}");
    if ui.add(angle).accessible_name(named("Roll")).changed() {
        key.roll_rad = roll.to_radians();
    }
    let wait = DragValue::new(&mut key.dwell_secs).range(0.0..=600.0).speed(0.02).suffix(" s");
    ui.add(wait).accessible_name(named("Wait"));
}
