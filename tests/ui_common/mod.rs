//! The window without a screen, run until something has happened.

use std::time::{Duration, Instant};

use egui_kittest::Harness;

use fmlgs::jobs::Folders;
use fmlgs::ui::actions::Action;
use fmlgs::ui::app::App;

/// Only a test that hangs takes this long: making the demo's photos is the longest step.
const LONG: Duration = Duration::from_secs(600);

/// A window that keeps what it makes in the folder of `places`.
pub fn window(places: Folders, first: Option<Action>) -> Harness<'static, App> {
    Harness::builder()
        .with_size([1200.0, 800.0])
        .with_max_steps(20)
        .wgpu()
        .build_eframe(|cc| App::new(cc, places, first).expect("threads"))
}

/// Lets the window run until `done`, as the worker gets on.
pub fn until(harness: &mut Harness<'static, App>, what: &str, done: impl Fn(&App) -> bool) {
    let start = Instant::now();
    while !done(harness.state()) {
        assert!(start.elapsed() < LONG, "waited too long for: {what}\n{:#?}", harness.state().state.log);
        harness.step();
        std::thread::sleep(Duration::from_millis(10));
    }
    harness.run_steps(2);
}

/// Asks for an action and lets it begin.
pub fn ask(harness: &mut Harness<'static, App>, action: Action) {
    harness.state_mut().ask(action);
    harness.run_steps(3);
}
