//! The whole window, headless: the user's view and actions, with the software adapter.

mod adding;
mod appearance;
mod comparing;
mod crop;
mod demo;
mod doubts;
mod edits;
mod elsewhere;
mod files;
mod hands;
mod kept;
mod keyboard;
mod locating;
mod measuring;
mod objects;
mod panes;
mod phrases;
mod problems;
mod queries;
mod rearranging;
mod removing;
mod report;
mod results;
mod runs;
mod selecting;
mod shapes;
mod split;
mod typing;
mod views;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use fmlgs::jobs::Folders;
use fmlgs::pipeline::observer::Silent;
use fmlgs::pipeline::synth::{self, SynthOptions};
use fmlgs::ui::actions::{Action, Pane};
use fmlgs::ui::app::App;
use fmlgs::worker::ViewMode;

struct Window {
    harness: Harness<'static, App>,
    // Deleted at the end.
    _folder: Option<tempfile::TempDir>,
}

impl Window {
    fn new(first: Option<Action>) -> Self {
        let folder = tempfile::tempdir().expect("folder");
        let data = folder.path().join("data");
        Self { _folder: Some(folder), ..Self::keeping(data, first) }
    }

    /// A window that keeps what it makes in `data`.
    fn keeping(data: PathBuf, first: Option<Action>) -> Self {
        let harness = crate::ui_common::window(Folders { data }, first);
        Self { harness, _folder: None }
    }

    fn app(&self) -> &App {
        self.harness.state()
    }

    /// Lets the window run until `done`, as the worker gets on.
    fn until(&mut self, what: &str, done: impl Fn(&App) -> bool) {
        crate::ui_common::until(&mut self.harness, what, done);
    }

    fn ask(&mut self, action: Action) {
        crate::ui_common::ask(&mut self.harness, action);
    }

    fn click(&mut self, label: &str) {
        self.harness.get_by_label(label).click();
        self.harness.run_steps(2);
    }

    fn press(&mut self, key: egui::Key) {
        self.harness.key_press(key);
        self.harness.run_steps(2);
    }

    /// Clicks twice in one frame: any time between the clicks would be too long on a slow machine.
    fn double_click(&mut self, pos: egui::Pos2) {
        let (button, modifiers) = (egui::PointerButton::Primary, egui::Modifiers::NONE);
        let click = |pressed| egui::Event::PointerButton { pos, button, pressed, modifiers };
        self.harness.hover_at(pos);
        self.harness.step();
        self.harness.input_mut().events.extend([true, false, true, false].map(click));
        self.harness.run_steps(3);
    }

    /// Types into whatever has the keyboard.
    fn types(&mut self, text: &str) {
        for letter in text.chars() {
            let key = egui::Key::from_name(&letter.to_uppercase().to_string());
            key.into_iter().for_each(|key| self.harness.key_down(key));
            self.harness.event(egui::Event::Text(letter.into()));
            key.into_iter().for_each(|key| self.harness.key_up(key));
            self.harness.step();
        }
    }

    fn shows(&self, text: &str) -> bool {
        self.harness.query_all_by_label_contains(text).next().is_some()
    }

    /// Returns whether a picture of the window has more than one color.
    fn is_drawn(&mut self) -> bool {
        let image = self.harness.render().expect("the software adapter draws");
        let first = *image.get_pixel(0, 0);
        image.pixels().any(|p| *p != first)
    }
}

/// A splat of a few Gaussians.
fn write_splat(folder: &Path) -> PathBuf {
    let n = 40;
    let cloud = fmlgs::scene::GaussianCloud {
        sh: vec![[0.5, 0.1, -0.3]; n],
        ..fmlgs::scene::GaussianCloud::isotropic(
            (0..n).map(|i| [(i % 7) as f32 * 0.1, (i / 7) as f32 * 0.1, 0.0]).collect(),
            -3.0,
            2.0,
        )
    };
    let path = folder.join("dots.ply");
    fmlgs::io::splat_ply::write(&path, &cloud).expect("write");
    path
}

#[test]
fn the_empty_window_offers_what_to_do() {
    let mut w = Window::new(None);
    w.harness.run_steps(2);
    for label in ["Open the demo", "Train it yourself", "Open folder…", "Open file…"] {
        assert!(w.shows(label), "{label}");
    }
    assert!(w.is_drawn());
}

#[test]
fn a_path_that_is_not_there_gives_an_error_and_loses_nothing() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(Action::Open(write_splat(folder.path()))));
    w.until("the splat", |a| a.state.scene.is_some());
    w.until("its picture", |a| a.viewport.picture().is_some());
    w.ask(Action::Open("/no/such/scene".into()));
    w.until("the error", |a| a.state.error.is_some());
    assert!(w.shows("/no/such/scene"), "the error names the path");
    assert!(w.shows("Check the path") && w.shows("Open another"), "and a remedy");
    assert_eq!(w.app().state.scene.as_ref().map(|s| s.name.as_str()), Some("dots"));
    w.click("Close");
    assert!(w.app().state.error.is_none());
}

#[test]
fn a_splat_is_drawn_in_every_mode_and_only_when_something_changes() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(Action::Open(write_splat(folder.path()))));
    w.until("a picture at rest", |a| a.viewport.picture().is_some_and(|p| p.full && p.median_depth.is_some()));
    let bright =
        |a: &App| a.viewport.picture().expect("drawn").rgb.iter().filter(|p| p.iter().any(|c| *c > 60)).count();
    assert!(bright(w.app()) > 100, "the Gaussians are seen");
    let ticket = w.app().viewport.picture().expect("drawn").ticket;
    w.harness.run_steps(10);
    std::thread::sleep(Duration::from_millis(100));
    w.harness.run_steps(2);
    assert_eq!(w.app().viewport.picture().expect("drawn").ticket, ticket, "nothing changed, so nothing is drawn anew");
    for (key, mode) in
        [(egui::Key::Num5, ViewMode::Depth), (egui::Key::Num7, ViewMode::Alpha), (egui::Key::Num1, ViewMode::Rgb)]
    {
        let before = w.app().viewport.picture().expect("drawn").rgb.clone();
        w.harness.key_press(key);
        w.harness.run_steps(2);
        assert_eq!(w.app().layout.mode, mode);
        w.until("the other mode", |a| a.viewport.picture().expect("drawn").rgb != before);
    }
}

#[test]
fn keys_move_the_eye_and_home_brings_it_back() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(Action::Open(write_splat(folder.path()))));
    w.until("a picture", |a| a.viewport.picture().is_some());
    let center = |a: &App| a.viewport.picture().expect("drawn").camera.center;
    let home = center(w.app());
    w.harness.key_down(egui::Key::W);
    w.until("a nearer view", |a| center(a).distance(home) > 1e-3);
    w.harness.key_up(egui::Key::W);
    w.harness.run_steps(2);
    w.harness.key_press(egui::Key::Home);
    w.until("the first view", |a| center(a).distance(home) < 1e-9);
}

/// A few photos of the demo scene, as the program's own ray caster makes them; the same for all tests.
fn photos() -> PathBuf {
    static ONCE: OnceLock<PathBuf> = OnceLock::new();
    ONCE.get_or_init(|| {
        let out = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("ui_photos/table");
        write_photos(&out);
        out
    })
    .clone()
}

fn write_photos(out: &Path) {
    let glb = out.with_extension("glb");
    std::fs::create_dir_all(out).expect("folder");
    std::fs::write(&glb, synth::demo_glb()).expect("write");
    let options = SynthOptions {
        views: 8,
        held_out: 1,
        width_px: 96,
        height_px: 72,
        samples: 1,
        points: 600,
        ..SynthOptions::default()
    };
    synth::run(&glb, &options, out, &mut Silent).expect("photos");
}

#[test]
fn the_demo_is_made_opened_and_trained_by_itself() {
    // Its photos take a while and are the same every time; what was trained on them goes.
    let data = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("ui_demo");
    let _ = std::fs::remove_dir_all(data.join("trained"));
    let mut w = Window::keeping(data, None);
    w.harness.run_steps(2);
    w.harness.state_mut().layout.config.max_side_px = 100;
    w.click("Train it yourself");
    w.until("the demo's photos", |a| a.state.scene.is_some());
    w.until("training without being asked", |a| a.state.is_training());
    w.until("the plot", |a| a.state.history.steps.len() >= 3);
    assert!(w.app().state.history.steps.iter().all(|s| s.loss.is_finite() && s.gaussians > 100));
    w.harness.key_press(egui::Key::T);
    w.until("the pause", |a| a.state.job.as_ref().is_some_and(|j| j.paused));
    w.click("Stop the running job");
    w.until("the end", |a| a.state.job.is_none());
    assert!(w.app().state.error.is_none() && w.app().state.recent.is_empty());
}

fn last_step(app: &App) -> u64 {
    app.state.history.steps.last().map_or(0, |s| s.step)
}

#[test]
fn training_moves_the_plot_pauses_resumes_and_is_cancelled() {
    let mut w = Window::new(Some(Action::Open(photos())));
    w.until("the photos", |a| a.state.scene.is_some());
    assert!(w.shows("7 train") && w.shows("1 held-out"), "the photos pane");
    w.click("Scene plan");
    assert!(w.shows("Feature maps"), "the scene plan");
    w.click("Training");
    w.harness.state_mut().layout.config.steps = 50_000;
    w.click("Start training");
    w.until("the plot", |a| a.state.history.steps.len() >= 5);
    assert!(w.shows("Pause") && w.shows("Held-out PSNR") && w.shows("Plot of PSNR"));
    w.harness.get_by_role_and_label(egui::accesskit::Role::Button, "Loss").click();
    w.harness.run_steps(2);
    assert!(w.shows("Plot of the loss") && !w.shows("Plot of PSNR"), "one plot at a time");
    let before = w.app().viewport.picture().map(|p| p.ticket);
    w.until("a newer picture of the scene", |a| a.viewport.picture().map(|p| p.ticket) > before);

    w.harness.key_press(egui::Key::T);
    w.until("the pause", |a| a.state.job.as_ref().is_some_and(|j| j.paused));
    // A step that was under way may still report.
    std::thread::sleep(Duration::from_millis(200));
    w.harness.run_steps(2);
    let held = last_step(w.app());
    std::thread::sleep(Duration::from_millis(300));
    w.harness.run_steps(2);
    assert_eq!(last_step(w.app()), held, "nothing moves while paused");
    w.click("Resume");
    w.until("further steps", |a| last_step(a) > held);

    w.harness.key_press(egui::Key::Escape);
    w.harness.run_steps(2);
    w.click("Stop");
    w.until("the end", |a| a.state.job.is_none());
    assert!(w.app().state.error.is_none(), "{:?}", w.app().state.error);
    let reached = last_step(w.app());
    assert!(reached < 50_000);
    assert!(w.app().viewport.cloud().is_some_and(|c| !c.is_empty()), "what was trained stays");

    w.harness.get_by_label_contains("Continue (").click();
    w.until("going on from the checkpoint", |a| last_step(a) > reached);
    assert!(w.app().state.history.steps.iter().any(|s| s.step < reached), "the curve resumes where it was");
    w.ask(Action::Cancel);
    w.until("the end", |a| a.state.job.is_none());
}

#[test]
fn looking_through_a_photo_compares_it_with_the_picture() {
    let mut w = Window::new(Some(Action::Open(photos())));
    w.until("the photos", |a| a.state.scene.is_some());
    w.harness.key_press(egui::Key::CloseBracket);
    w.until("the first photo", |a| a.viewport.photo_index() == Some(0));
    w.harness.key_press(egui::Key::CloseBracket);
    let scene = w.app().state.scene.clone().expect("open");
    let photo = &scene.dataset.as_ref().expect("photos").photos[1];
    // A picture of the first photo may still be on its way.
    w.until("its PSNR", |a| {
        let its = |p: &fmlgs::worker::view::ViewPicture| p.psnr.is_some() && p.camera.center == photo.camera.center;
        a.viewport.photo_index() == Some(1) && a.viewport.picture().is_some_and(its)
    });
    let drawn = &w.app().viewport.picture().expect("drawn").camera;
    assert_eq!(drawn.center, photo.camera.center);
    assert!(
        (drawn.focal_px / f64::from(drawn.width_px) - photo.camera.focal_px / f64::from(photo.camera.width_px))
            .length()
            < 1e-3
    );
    w.harness.key_press(egui::Key::C);
    w.harness.run_steps(3);
    assert!(w.app().layout.compare);
    assert!(w.is_drawn());
    w.ask(Action::FrameScene);
    assert_eq!(w.app().viewport.photo_index(), None);
}

#[test]
fn opening_something_else_while_a_job_runs_asks_first() {
    let folder = tempfile::tempdir().expect("folder");
    let splat = write_splat(folder.path());
    let mut w = Window::new(Some(Action::Open(photos())));
    w.until("the photos", |a| a.state.scene.is_some());
    w.harness.state_mut().layout.config.steps = 50_000;
    w.ask(Action::StartTraining);
    w.until("training", |a| a.state.is_training());
    w.ask(Action::Open(splat.clone()));
    assert!(w.shows("still running"));
    w.click("Keep running");
    assert!(w.app().state.is_training());
    w.ask(Action::Open(splat));
    w.click("Stop and continue");
    w.until("the splat", |a| a.state.scene.as_ref().is_some_and(|s| s.name == "dots"));
}

#[test]
fn quitting_while_a_job_runs_asks_once() {
    let close = |w: &mut Window| {
        let viewport = w.harness.input_mut().viewports.entry(egui::ViewportId::ROOT).or_default();
        viewport.events.push(egui::ViewportEvent::Close);
        w.harness.run_steps(2);
        let sent = |w: &Window, command: &egui::ViewportCommand| {
            let output = &w.harness.output().viewport_output[&egui::ViewportId::ROOT];
            output.commands.contains(command)
        };
        sent(w, &egui::ViewportCommand::Close)
    };
    let mut w = Window::new(Some(Action::Open(photos())));
    w.until("the photos", |a| a.state.scene.is_some());
    close(&mut w);
    assert!(!w.shows("still running"), "nothing is lost");
    w.harness.state_mut().layout.config.steps = 50_000;
    w.ask(Action::StartTraining);
    w.until("training", |a| a.state.is_training());
    assert!(!close(&mut w) && w.shows("It is saved, and can be continued"));
    w.click("Keep running");
    assert!(w.app().state.is_training() && !w.shows("still running"));
    close(&mut w);
    w.click("Quit");
    w.harness.step();
    let output = &w.harness.output().viewport_output[&egui::ViewportId::ROOT];
    assert!(output.commands.contains(&egui::ViewportCommand::Close));
    w.ask(Action::Cancel);
    w.until("the end", |a| a.state.job.is_none());
}

#[test]
fn a_photo_that_is_broken_is_marked_and_the_rest_stays_usable() {
    let folder = tempfile::tempdir().expect("folder");
    let photos = folder.path().join("table");
    write_photos(&photos);
    let broken = photos.join("images/0003.png");
    let bytes = std::fs::read(&broken).expect("a photo");
    std::fs::write(&broken, &bytes[..bytes.len() / 2]).expect("write");
    let mut w = Window::new(Some(Action::Open(photos)));
    w.until("the warning", |a| a.state.log.iter().any(|l| l.text.contains("0003.png")));
    assert!(w.app().state.error.is_none(), "it is no reason to stop the user");
    assert!(w.app().state.scene.is_some());
}
