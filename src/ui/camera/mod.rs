//! The camera pane: keyframes of a path, a timeline to play and retime them, and videos of it.

mod keys;
pub(crate) mod player;
mod recording;
mod repeated;
mod timeline;

use std::collections::VecDeque;
use std::path::Path;

use egui::{Align, Button, Checkbox, ComboBox, DragValue, Layout, RichText, ScrollArea, Ui, vec2};
use glam::DVec3;

use self::player::{Clip, Player};
use self::repeated::RepeatedPath;
use super::ctx::Ctx;
use super::panes::PaneContents;
use super::theme;
use super::viewport::Viewport;
use super::viewport::route::CameraRoute;
use crate::io::video::VideoSettings;
use crate::navigate::camera_spline::{MOST_PICTURES, steps_of};
use crate::navigate::{CameraSpline, CameraTrajectory, Pose, Speed};
use crate::scene::{Camera, CameraPath, PathKey};
use crate::ui::actions::Action;
use crate::ui::paired::paired;

/// The camera path under edit, and its playback.
pub(crate) struct CameraPane {
    pub(crate) path: CameraPath,
    /// Speed profile along the path.
    pub(crate) speed: Speed,
    pub(crate) player: Player,
    /// Index of the chosen keyframe.
    selected: Option<usize>,
    /// True if the table has the columns that are seldom needed.
    shows_more: bool,
    /// Path and speed that the player's spline was last made of.
    loaded: Option<(CameraPath, Speed)>,
    /// True if the view shows the places that the camera can reach.
    pub(crate) show_reach: bool,
    /// Flights that wait for the one that plays, with the names of their targets.
    next: VecDeque<(CameraTrajectory, String)>,
    /// Name of the target of the flight that plays.
    flight_to: String,
    /// Number of the scene that the path belongs to.
    pub(crate) scene: u64,
    /// The path that was set to repeat last.
    repeated: Option<RepeatedPath>,
}

/// Width of the names of rows, points.
const NAME_PT: f32 = 44.0;

/// Reason shown on tools that need keyframes.
const NO_KEYS: &str = "Needs keyframes: add the current view (K).";

impl Default for CameraPane {
    fn default() -> Self {
        Self {
            path: empty(),
            speed: Speed::Constant,
            player: Player::default(),
            selected: None,
            shows_more: false,
            loaded: None,
            show_reach: false,
            next: VecDeque::new(),
            flight_to: String::new(),
            scene: 0,
            repeated: None,
        }
    }
}

fn empty() -> CameraPath {
    CameraPath { keys: Vec::new(), closed: false, fps: 30.0, seconds: 5.0 }
}

impl CameraPane {
    /// Replaces the path of another scene by the one that is kept with this scene.
    pub(crate) fn on_scene(&mut self, scene: u64, kept: Option<&CameraPath>) {
        if self.scene != scene {
            *self = Self { scene, path: kept.cloned().unwrap_or_else(empty), ..Self::default() };
        }
    }

    /// Queues a flight to the target named `to`.
    pub(crate) fn play_flight(&mut self, flight: CameraTrajectory, to: String) {
        self.next.push_back((flight, to));
        self.go_on();
    }

    /// Plays the next queued flight, if none plays.
    fn go_on(&mut self) {
        if !self.player.playing
            && let Some((flight, to)) = self.next.pop_front()
        {
            self.flight_to = to;
            self.player.looped = false;
            self.player.load(Clip::Flight(Box::new(flight)), true);
        }
    }

    /// The pose to show after `step_secs` of window time, if a clip plays.
    pub(crate) fn tick(&mut self, step_secs: f64) -> Option<Pose> {
        self.go_on();
        self.player.tick(step_secs)
    }

    /// True if there is a flight or a path to play.
    pub(crate) fn has_clip(&self) -> bool {
        self.player.clip().is_some() || !self.path.keys.is_empty()
    }

    /// Title of the loaded flight, if the clip is one.
    fn flight(&self) -> Option<String> {
        matches!(self.player.clip(), Some(Clip::Flight(_))).then(|| match &*self.flight_to {
            "" => "Flight".to_owned(),
            to => format!("Flight to {to}"),
        })
    }

    /// Starts or stops the clip; loads the path if there is none.
    pub(crate) fn toggle(&mut self) {
        if self.player.clip().is_none() {
            self.put_path_in();
        }
        self.player.toggle();
    }

    /// Steps by `pictures` frames; returns the pose there.
    pub(crate) fn step(&mut self, pictures: f64) -> Option<Pose> {
        let time = self.player.time + pictures / self.path.fps.max(1.0);
        self.player.seek(time)
    }

    /// Adds the current view as a keyframe: at the playhead if it stands between two keys, else at the end. Returns its
    /// number, and its time if it was inserted.
    pub(crate) fn record(&mut self, pose: &Pose) -> (usize, Option<f64>) {
        self.keep_up();
        let (key, time) = (pose.key(), self.player.time);
        let inserted = match self.player.clip() {
            Some(Clip::Path(spline)) => recording::insert(&mut self.path, &spline.times, time, &key),
            _ => None,
        };
        let place = inserted.unwrap_or_else(|| recording::append(&mut self.path, key));
        self.selected = Some(place);
        self.put_path_in();
        (place + 1, inserted.map(|_| time))
    }

    /// Replaces the path by one that is repeated, and plays it.
    pub(crate) fn repeat(&mut self, path: CameraPath) {
        self.next.clear();
        let (before, was_looped) = (self.path.clone(), self.player.looped);
        self.repeated = Some(RepeatedPath { path: path.clone(), before, was_looped });
        self.player.replace(None);
        self.open(path);
        (self.player.looped, self.player.playing) = (true, true);
    }

    /// Replaces the path by one read from a file.
    pub(crate) fn open(&mut self, path: CameraPath) {
        self.path = path;
        self.selected = None;
        self.put_path_in();
    }

    /// Replaces the path by an earlier or later state. With a repeated one, the repetition goes and comes.
    pub(crate) fn set_path(&mut self, path: CameraPath) {
        if let Some(looped) = self.repeated.as_ref().and_then(|repeated| repeated.loops(&self.path, &path)) {
            (self.player.looped, self.player.playing) = (looped, false);
        }
        self.path = path;
        self.selected = self.selected.filter(|i| *i < self.path.keys.len());
    }

    /// Loads the path into the player.
    fn put_path_in(&mut self) {
        self.loaded = Some((self.path.clone(), self.speed));
        match CameraSpline::new(&self.path, self.speed) {
            Some(spline) if matches!(self.player.clip(), Some(Clip::Path(_))) => {
                self.player.replace(Some(Clip::Path(Box::new(spline))));
            }
            Some(spline) => self.player.load(Clip::Path(Box::new(spline)), false),
            None => self.player.replace(None),
        }
    }

    /// Reloads the path into the player if it has changed.
    fn keep_up(&mut self) {
        let is_path = matches!(self.player.clip(), Some(Clip::Path(_)) | None);
        let current = self.loaded.as_ref().is_some_and(|(path, speed)| *path == self.path && *speed == self.speed);
        if is_path && !current {
            self.put_path_in();
        }
    }

    /// Frames and seconds of a video of the loaded clip; `None` without a clip.
    pub(crate) fn length(&self) -> Option<(usize, f64)> {
        let seconds = self.player.clip()?.seconds();
        Some((steps_of(seconds, self.path.fps, MOST_PICTURES) + 1, seconds))
    }

    /// Cameras and settings of a video of the loaded clip; `None` without a clip. The vertical field of view is the
    /// clip's.
    pub(crate) fn video(
        &self,
        out: &Path,
        [width, height]: [u32; 2],
        quality: u8,
    ) -> Option<(Vec<Camera>, VideoSettings)> {
        let clip = self.player.clip()?;
        let frames = steps_of(clip.seconds(), self.path.fps, MOST_PICTURES);
        let time = |i: usize| clip.seconds() * i as f64 / frames as f64;
        let cameras = (0..=frames).filter_map(|i| clip.at(time(i))).map(|p| p.camera(width, height)).collect();
        let mut settings = VideoSettings::new(width, height, self.path.fps);
        // The dialog has asked whether the file may be replaced.
        (settings.quality, settings.overwrite) = (quality, out.exists());
        Some((cameras, settings))
    }

    /// The loaded clip and the keyframes, for drawing them into the view of a camera at `eye`.
    pub(crate) fn route(&self, eye: DVec3) -> CameraRoute {
        let last = 120;
        let at = |clip: &Clip, i: i32| clip.at(clip.seconds() * f64::from(i) / f64::from(last)).map(|p| p.center);
        let clip = self.player.shown_from(eye);
        let way = clip.map(|clip| (0..=last).filter_map(|i| at(clip, i)).collect()).unwrap_or_default();
        let keys = self.path.keys.iter().enumerate().map(|(i, k)| (k.center, self.selected == Some(i))).collect();
        CameraRoute { way, keys, show_reach: self.show_reach, plays: self.player.playing }
    }

    fn controls(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>) {
        let has_clip = self.player.clip().is_some();
        let tip = |a: &Action| format!("{}  {}", a.tooltip(), super::keys::label(ui.ctx(), a));
        let play = if self.player.playing { "Pause" } else { "Play" };
        let entries = [("\u{2039}", Action::StepBack), (play, Action::PlayPath), ("\u{203a}", Action::StepForward)];
        let entries = entries.map(|(symbol, action)| (symbol, tip(&action), action));
        for (symbol, tip, action) in entries {
            let button = Button::new(symbol).min_size(egui::vec2(28.0, 24.0));
            let button = ui.add_enabled(has_clip, button).on_hover_text(tip);
            if button.accessible_name(action.text()).clicked() {
                cx.ask(action);
            }
        }
        ui.checkbox(&mut self.player.looped, "Loop");
        let rate = ComboBox::from_id_salt("rate")
            .selected_text(format!("{}\u{d7}", self.player.rate))
            .width(56.0)
            .show_ui(ui, |ui| {
                for rate in [0.25, 0.5, 1.0, 2.0, 4.0] {
                    ui.selectable_value(&mut self.player.rate, rate, format!("{rate}\u{d7}"));
                }
            });
        rate.response.accessible_name("Playback speed");
        let seconds = self.player.clip().map_or(0.0, Clip::seconds);
        ui.label(RichText::new(format!("{:.2} / {seconds:.2} s", self.player.time)).monospace());
        if let Some(rate) = self.player.rate_shown().filter(|_| self.player.playing) {
            ui.weak(format!("{rate:.0} frames/s")).on_hover_text("Frames per second that this machine shows.");
        }
        if !has_clip {
            ui.weak("Nothing to play");
        }
        if let Some(Clip::Flight(flight)) = self.player.clip() {
            let flight = (**flight).clone();
            if ui
                .button("Convert to path")
                .on_hover_text("Turn this flight into keyframes, so that it can be edited.")
                .clicked()
            {
                self.keep(&flight);
            }
            if !self.path.keys.is_empty() && ui.button("Back to the path").clicked() {
                self.player.replace(None);
                self.put_path_in();
            }
        }
    }

    /// Replaces the path by keyframes of a flight, enough for the path to follow it.
    fn keep(&mut self, flight: &CameraTrajectory) {
        let last = flight.poses.len().saturating_sub(1);
        let count = last.min(8);
        let at = |i: usize| flight.poses.get(i * last / count.max(1));
        let time = |i: usize| flight.seconds * (i * last / count.max(1)) as f64 / last.max(1) as f64;
        let keys = (0..=count).filter_map(|i| Some(PathKey { time_secs: Some(time(i)), ..at(i)?.key() })).collect();
        let (closed, fps) = (false, self.path.fps);
        self.path = CameraPath { keys, closed, fps, seconds: flight.seconds };
        self.selected = None;
        self.player.replace(None);
        self.put_path_in();
    }

    fn path_tools(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>) {
        for (text, action) in [("Add keyframe", Action::AddKey), ("Turntable", Action::Turntable(None))] {
            let tip = format!("{}  {}", action.tooltip(), super::keys::label(ui.ctx(), &action));
            if ui.button(text).on_hover_text(tip.trim_end()).clicked() {
                cx.ask(action);
            }
        }
        for (text, action, enabled) in
            [("Open\u{2026}", Action::OpenPath, true), ("Save\u{2026}", Action::SavePath, !self.path.keys.is_empty())]
        {
            let button = ui.add_enabled(enabled, Button::new(text)).on_disabled_hover_text(NO_KEYS);
            if button.on_hover_text(action.tooltip()).clicked() {
                cx.ask(action);
            }
        }
        let has_keys = !self.path.keys.is_empty();
        let seconds = DragValue::new(&mut self.path.seconds).range(0.1..=3600.0).speed(0.05).suffix(" s");
        paired(ui, "Duration".into(), 80.0, |ui, label| ui.add_enabled(has_keys, seconds).labelled_by(label));
        ui.add_enabled(has_keys, Checkbox::new(&mut self.path.closed, "Closed loop"))
            .on_hover_text("Continue from the last keyframe to the first.");
        let mut eased = self.speed == Speed::Eased;
        ui.add_enabled(has_keys, Checkbox::new(&mut eased, "Ease in/out"))
            .on_hover_text("Start and stop smoothly, also at waits.");
        self.speed = if eased { Speed::Eased } else { Speed::Constant };
    }

    /// Draws the choice of what is shown of the path.
    fn shown(&mut self, ui: &mut Ui, cx: &Ctx<'_>) {
        ui.add_enabled(cx.state.explored.is_some(), Checkbox::new(&mut self.show_reach, "Show reach"))
            .on_hover_text("Mark the places that the camera can go to: green; red ones cannot be reached from here.")
            .on_disabled_hover_text("Known once the camera has gone to an object.");
        ui.add_enabled(!self.path.keys.is_empty(), Checkbox::new(&mut self.shows_more, "More columns"))
            .on_hover_text("Field of view, roll and wait of each keyframe.")
            .on_disabled_hover_text(NO_KEYS);
    }

    fn video_tools(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>) {
        let is_busy = cx.state.job.is_some();
        let idle = !is_busy && self.player.clip().is_some();
        let flight = self.flight().is_some();
        let text = if flight { "Export flight as video\u{2026}" } else { "Export video\u{2026}" };
        let button = ui.add_enabled(idle, Button::new(text));
        let why = if is_busy { "Another job is running." } else { NO_KEYS };
        if button.on_hover_text(Action::ExportVideo.tooltip()).on_disabled_hover_text(why).clicked() {
            cx.ask(Action::ExportVideo);
        }
    }
}

impl PaneContents for CameraPane {
    /// Draws the pane, and moves the view when the user moves in time or chooses a keyframe.
    fn ui(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>, view: &mut Viewport) {
        let eye = view.pose();
        self.keep_up();
        ui.horizontal_wrapped(|ui| {
            self.controls(ui, cx);
            self.shown(ui, cx);
        });
        ui.add_space(2.0);
        let mut wanted = timeline::show(ui, self);
        ui.add_space(2.0);
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            row(ui, "Path", |ui| self.path_tools(ui, cx));
            row(ui, "Video", |ui| self.video_tools(ui, cx));
            if self.path.keys.is_empty() {
                ui.add_space(4.0);
                ui.weak("No keyframes yet. Add the current view (K), open a path, or convert the flight to an object.");
            } else {
                wanted = keys::show(ui, self, &eye).or(wanted);
            }
        });
        if let Some(pose) = wanted {
            view.stand(&pose, cx.state, ui.input(|i| i.time));
        }
    }
}

/// Reads a path's file; returns the error as text for the user.
pub(crate) fn read(path: &Path) -> Result<CameraPath, String> {
    crate::jobs::video::camera_path(path).map_err(|e| e.to_string())
}

/// Writes a path's file, in nerfstudio's format if its name says so.
pub(crate) fn write(file: &Path, path: &CameraPath, aspect: f64) -> Result<(), String> {
    crate::jobs::export::camera_path(file, path, aspect).map_err(|e| e.to_string())
}

/// A row of tools after its name, wrapped if the pane is narrow.
fn row(ui: &mut Ui, name: &str, add: impl FnOnce(&mut Ui)) {
    ui.horizontal_wrapped(|ui| {
        let size = vec2(NAME_PT, ui.spacing().interact_size.y);
        ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
            ui.set_min_width(NAME_PT);
            ui.label(caption(name));
        });
        add(ui);
    });
}

fn caption(text: &str) -> RichText {
    RichText::new(text).small().color(theme::weak())
}
