//! The window follows the scene plan: nothing of models, paths or agents is loaded before it is
//! used, and a window at rest draws nothing. One test, because the trace is the whole process's.

use std::path::{Path, PathBuf};
use std::time::Duration;

use egui_kittest::Harness;

use crate::common::alone;
use fmlgs::jobs::Folders;
use fmlgs::navigate::target::Side;
use fmlgs::pipeline::observer::Silent;
use fmlgs::pipeline::synth::{self, SynthOptions};
use fmlgs::scene::IdentityId;
use fmlgs::scene::plan::PlanOverride;
use fmlgs::scene::resource_log::{self, ResourceKind};
use fmlgs::ui::actions::{Action, Pane};
use fmlgs::ui::app::App;

/// A window and its trace since it was opened.
struct Window {
    harness: Harness<'static, App>,
    traced: usize,
}

impl Window {
    /// A window without the panes that list objects, for which `overrides` are made.
    fn new(data: &Path, first: PathBuf, overrides: &[&str]) -> Self {
        let traced = resource_log::since(0).len();
        let mut harness = crate::ui_common::window(Folders { data: data.to_path_buf() }, Some(Action::Open(first)));
        let app = harness.state_mut();
        app.layout.hidden.extend([Pane::Objects, Pane::Chat]);
        app.override_plan(overrides.iter().map(|w| w.parse::<PlanOverride>().expect("an override")));
        Self { harness, traced }
    }

    fn app(&self) -> &App {
        self.harness.state()
    }

    fn until(&mut self, what: &str, done: impl Fn(&App) -> bool) {
        crate::ui_common::until(&mut self.harness, what, done);
    }

    fn ask(&mut self, action: Action) {
        crate::ui_common::ask(&mut self.harness, action);
    }

    /// Lets time pass without input.
    fn rest(&mut self) {
        for _ in 0..10 {
            self.harness.step();
            std::thread::sleep(Duration::from_millis(40));
        }
    }

    fn loaded(&self, sort: ResourceKind) -> usize {
        resource_log::since(self.traced).iter().filter(|l| l.kind == sort).count()
    }

    fn until_loaded(&mut self, sort: ResourceKind) {
        let traced = self.traced;
        self.until(&format!("{sort:?} to be loaded"), |_| resource_log::since(traced).iter().any(|l| l.kind == sort));
    }

    fn ticket(&self) -> u64 {
        self.app().viewport.picture().expect("drawn").ticket
    }
}

/// Resources that are loaded only once they are used.
const LATER: [ResourceKind; 5] =
    [ResourceKind::Maps, ResourceKind::Thumbnails, ResourceKind::Model, ResourceKind::Paths, ResourceKind::Agent];

/// A trained scene with objects and their looks, and its photos.
fn trained(folder: &Path) -> PathBuf {
    let (photos, glb) = (folder.join("photos"), folder.join("table.glb"));
    std::fs::create_dir_all(&photos).expect("folder");
    std::fs::write(&glb, synth::demo_glb()).expect("write");
    let size = SynthOptions { views: 8, held_out: 1, width_px: 96, height_px: 72, ..SynthOptions::default() };
    synth::run(&glb, &SynthOptions { samples: 1, points: 600, ..size }, &photos, &mut Silent).expect("photos");
    let mut w = Window::new(&folder.join("data"), photos, &[]);
    w.until("the photos", |a| a.state.scene.is_some());
    w.harness.state_mut().layout.config.steps = 60;
    w.ask(Action::StartTraining);
    w.until("objects after training", |a| a.state.semantics.is_some());
    assert!(w.loaded(ResourceKind::Model) > 0, "finding objects looks at them");
    w.app().state.scene.as_ref().expect("open").out.clone()
}

/// The objects that are found, and the pixels of the first.
fn answer(w: &mut Window, question: &str) -> (Vec<IdentityId>, usize) {
    w.ask(Action::Ask(question.into()));
    w.until("the maps", |a| a.viewport.queries.maps().is_some());
    let map = w.app().state.semantics.clone().expect("objects");
    let found = w.app().viewport.queries.found();
    let maps = w.app().viewport.queries.maps().cloned().expect("maps");
    let area = found.first().map_or(0, |id| maps.identities.mask(&map.identities, *id).area());
    (found, area)
}

#[test]
fn nothing_is_loaded_or_drawn_before_it_is_used() {
    if !alone(module_path!(), "nothing_is_loaded_or_drawn_before_it_is_used") {
        return;
    }
    let folder = tempfile::tempdir().expect("folder");
    let scene = trained(folder.path());
    let data = folder.path().join("data");

    // Viewed, but never queried and never navigated.
    let mut w = Window::new(&data, scene.clone(), &[]);
    w.until("a picture at rest", |a| a.viewport.picture().is_some_and(|p| p.full));
    assert!(w.app().state.semantics.is_some(), "there is something to ask for");
    w.harness.key_press(egui::Key::CloseBracket);
    w.until("a photo's view", |a| a.viewport.photo_index() == Some(0));
    w.harness.key_press(egui::Key::Home);
    w.until("the first view", |a| a.viewport.photo_index().is_none() && a.viewport.picture().is_some_and(|p| p.full));
    w.rest();
    let too_early: Vec<ResourceKind> = LATER.into_iter().filter(|s| w.loaded(*s) > 0).collect();
    assert!(too_early.is_empty(), "{too_early:?}: {:#?}", resource_log::since(w.traced));
    assert_eq!((w.loaded(ResourceKind::Gaussians), w.loaded(ResourceKind::Objects)), (1, 1));

    // An idle window draws nothing.
    let ticket = w.ticket();
    w.rest();
    assert_eq!(w.ticket(), ticket);

    // Each is loaded by what needs it, and by nothing else.
    let lazy = answer(&mut w, "the table");
    assert!(w.loaded(ResourceKind::Maps) == 1 && lazy.1 > 0, "{lazy:?}");
    w.until_loaded(ResourceKind::Model);
    assert_eq!(w.loaded(ResourceKind::Model), 1, "one network understands phrases");
    assert_eq!([ResourceKind::Paths, ResourceKind::Thumbnails, ResourceKind::Agent].map(|s| w.loaded(s)), [0; 3]);
    w.ask(Action::TogglePane(Pane::Objects));
    w.until_loaded(ResourceKind::Thumbnails);
    assert_eq!(w.loaded(ResourceKind::Paths), 0);
    w.ask(Action::GoToTarget(lazy.0[0], Side::default()));
    w.until("the graph", |a| a.state.explored.is_some());
    assert_eq!((w.loaded(ResourceKind::Paths), w.loaded(ResourceKind::Agent)), (1, 0));
    drop(w);

    // Overridden: maps and the network are loaded at opening, and the answer is the same.
    let mut all = Window::new(&data, scene, &["feature-maps=always", "encoder=eager"]);
    all.until("a picture at rest", |a| a.viewport.picture().is_some_and(|p| p.full));
    [ResourceKind::Maps, ResourceKind::Model].into_iter().for_each(|sort| all.until_loaded(sort));
    assert_eq!(answer(&mut all, "the table"), lazy);
}
