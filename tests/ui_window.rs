//! The whole window, headless: what a person sees and does, with the software adapter.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::PathBuf;
use std::time::{Duration, Instant};

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use fmlgs::ui::app::App;
use fmlgs::worker::jobs::PipelineJobs;
use fmlgs::worker::places::Places;
use fmlgs::worker::{Action, Pane, ViewMode};

const LONG: Duration = Duration::from_secs(120);

struct Window {
    harness: Harness<'static, App>,
    // Deleted at the end.
    _folder: tempfile::TempDir,
}

impl Window {
    fn new(open: Option<PathBuf>) -> Self {
        let folder = tempfile::tempdir().expect("folder");
        let places = Places { data: folder.path().join("data") };
        let harness = Harness::builder()
            .with_size([1200.0, 800.0])
            .with_max_steps(20)
            .wgpu()
            .build_eframe(|cc| App::new(cc, PipelineJobs::new(places), open.map(Action::Open)).expect("threads"));
        Self { harness, _folder: folder }
    }

    fn app(&self) -> &App {
        self.harness.state()
    }

    /// Lets the window run until `done`, as the worker gets on.
    fn until(&mut self, what: &str, done: impl Fn(&App) -> bool) {
        let start = Instant::now();
        while !done(self.app()) {
            assert!(start.elapsed() < LONG, "waited too long for: {what}\n{:#?}", self.app().state.log);
            self.harness.step();
            std::thread::sleep(Duration::from_millis(10));
        }
        self.harness.run_steps(2);
    }

    fn ask(&mut self, action: Action) {
        self.harness.state_mut().ask(action);
        self.harness.run_steps(3);
    }

    fn click(&mut self, label: &str) {
        self.harness.get_by_label(label).click();
        self.harness.run_steps(2);
    }

    fn shows(&self, text: &str) -> bool {
        self.harness.query_all_by_label_contains(text).next().is_some()
    }

    /// Whether a picture of the window has more than one colour.
    fn is_drawn(&mut self) -> bool {
        let image = self.harness.render().expect("the software adapter draws");
        let first = *image.get_pixel(0, 0);
        image.pixels().any(|p| *p != first)
    }
}

/// A splat of a few Gaussians.
fn write_splat(folder: &std::path::Path) -> PathBuf {
    let n = 40;
    let cloud = fmlgs::scene::GaussianCloud {
        positions: (0..n).map(|i| [(i % 7) as f32 * 0.1, (i / 7) as f32 * 0.1, 0.0]).collect(),
        log_scales: vec![[-3.0; 3]; n],
        quaternions: vec![[1.0, 0.0, 0.0, 0.0]; n],
        opacity_logits: vec![2.0; n],
        sh: vec![[0.5, 0.1, -0.3]; n],
        ..Default::default()
    };
    let path = folder.join("dots.ply");
    fmlgs::io::splat_ply::write(&path, &cloud).expect("write");
    path
}

#[test]
fn the_empty_window_offers_what_to_do() {
    let mut w = Window::new(None);
    w.harness.run_steps(2);
    for label in ["Try the demo", "Open folder…", "Open file…"] {
        assert!(w.shows(label), "{label}");
    }
    assert!(w.is_drawn());
}

#[test]
fn a_path_that_is_not_there_gives_an_error_and_loses_nothing() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(write_splat(folder.path())));
    w.until("the splat", |a| a.state.scene.is_some());
    w.until("its picture", |a| a.viewport.picture().is_some());
    w.ask(Action::Open("/no/such/scene".into()));
    w.until("the error", |a| a.state.error.is_some());
    assert!(w.shows("/no/such/scene"), "the error names the path");
    assert!(w.shows("Check the path"), "and a remedy");
    assert_eq!(w.app().state.scene.as_ref().map(|s| s.name.as_str()), Some("dots"));
    w.click("Close");
    assert!(w.app().state.error.is_none());
}

#[test]
fn a_splat_is_drawn_in_every_mode_and_only_when_something_changes() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(write_splat(folder.path())));
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
        [(egui::Key::Num5, ViewMode::Depth), (egui::Key::Num7, ViewMode::Alpha), (egui::Key::Num1, ViewMode::Picture)]
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
    let mut w = Window::new(Some(write_splat(folder.path())));
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

#[test]
fn the_palette_and_the_shortcut_sheet_list_the_actions() {
    let mut w = Window::new(None);
    w.ask(Action::Palette);
    assert!(w.shows("Start training"));
    w.harness.get_by_label("Search actions").type_text("scene plan");
    w.harness.run_steps(2);
    assert!(!w.shows("Start training"));
    assert!(w.app().layout.shows(Pane::Plan));
    w.harness.key_press(egui::Key::Enter);
    w.harness.run_steps(3);
    assert!(!w.app().layout.shows(Pane::Plan), "the found action was run");
    w.harness.key_press(egui::Key::F1);
    w.harness.run_steps(3);
    assert!(w.shows("Keyboard and mouse") && w.shows("Ctrl+P"));
}
