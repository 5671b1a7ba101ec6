//! Pointing, clicking and marking in the view, on a small scene made by hand: a table with a lamp on it, whose
//! shade is a part, and a box behind the lamp.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use fmlgs::io::SceneFolder;
use fmlgs::io::trained::SceneInfo;
use fmlgs::jobs::Folders;
use fmlgs::scene::{GaussianCloud, Identities, IdentityId, Level, NO_IDENTITY, SemanticMap};
use fmlgs::ui::actions::Action;
use fmlgs::ui::app::App;
use fmlgs::ui::color_by::ColorBy;
use fmlgs::worker::ViewMode;

const TABLE: IdentityId = 1;
const LAMP: IdentityId = 2;
const SHADE: IdentityId = 3;
const BOX: IdentityId = 4;

/// Gaussians that fill a box evenly, all of one size.
fn fill(cloud: &mut GaussianCloud, of: &mut Vec<IdentityId>, n: usize, id: IdentityId, [min, max]: [[f32; 3]; 2]) {
    let at = |k: usize, axis: usize| min[axis] + (max[axis] - min[axis]) * k as f32 / (n - 1) as f32;
    for i in 0..n * n * n {
        let p = [at(i % n, 0), at(i / n % n, 1), at(i / n / n, 2)];
        let half = (0..3).map(|a| 0.6 * (max[a] - min[a]) / (n - 1) as f32).fold(0.0, f32::max);
        cloud.positions.push(p);
        cloud.log_scales.push([half.max(0.01).ln(); 3]);
        cloud.quaternions.push([1.0, 0.0, 0.0, 0.0]);
        cloud.opacity_logits.push(3.0);
        cloud.sh.push([[1.2, 0.2, -0.8][id as usize % 3], 0.3 * id as f32, 0.5]);
        of.push(id);
    }
}

/// The scene with `n`^3 Gaussians in each of its things, saved into `folder`. Up is -y, as where photos say nothing else.
fn write_scene(folder: &Path, n: usize) -> PathBuf {
    let (mut cloud, mut of) = (GaussianCloud::default(), Vec::new());
    for (id, room) in [
        (TABLE, [[-2.0, 0.0, -2.0], [2.0, 0.3, 2.0]]),
        (LAMP, [[-0.3, -0.7, -0.3], [0.3, -0.1, 0.3]]),
        (SHADE, [[-0.6, -1.6, -0.6], [0.6, -0.8, 0.6]]),
        (BOX, [[3.0, -0.2, 3.0], [3.2, 0.0, 3.2]]),
    ] {
        fill(&mut cloud, &mut of, n, id, room);
    }
    let mut all = Identities::default();
    all.add(Level::Object, NO_IDENTITY, vec!["table".into()]);
    all.add(Level::Object, NO_IDENTITY, vec!["lamp".into()]);
    all.add(Level::Part, LAMP, vec!["shade".into()]);
    all.add(Level::Object, NO_IDENTITY, vec!["box".into()]);
    for id in [TABLE, LAMP, SHADE, BOX] {
        let code = 0.2 * id as f32;
        all.get_mut(id).expect("there").code = [code, 1.0 - code, code];
    }
    let map = SemanticMap::from_identities(all, of, vec![1.0; cloud.len()], vec!["a.png".into()]);
    let scene = folder.join("scene");
    let info = SceneInfo { version: 1, name: "by hand".into(), ..SceneInfo::default() };
    SceneFolder::hold(&scene, "a test").expect("ours").save(&info, &cloud, Some(&map)).expect("saved");
    scene
}

struct Window {
    harness: Harness<'static, App>,
    _folder: tempfile::TempDir,
}

impl Window {
    /// The scene with all that its pixels belong to.
    fn new() -> Self {
        Self::of(9)
    }

    /// With so many Gaussians along each side of each thing.
    fn of(n: usize) -> Self {
        let folder = tempfile::tempdir().expect("folder");
        let first = Action::Open(write_scene(folder.path(), n));
        let harness = crate::ui_common::window(Folders { data: folder.path().join("data") }, Some(first));
        let mut w = Self { harness, _folder: folder };
        w.until("the scene", |a| a.state.semantics.is_some() && a.viewport.picture().is_some_and(|p| p.full));
        w
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

    fn view(&self) -> Rect {
        self.harness.get_by_label("Viewport").rect()
    }

    fn shows(&self, text: &str) -> bool {
        self.harness.query_all_by_label_contains(text).next().is_some()
    }

    /// A place in the window, free of cards, where a pixel belongs to `id`, well inside of it.
    fn place_of(&mut self, id: IdentityId) -> Pos2 {
        self.harness.hover_at(self.view().center());
        self.until("what the pixels belong to", |a| a.viewport.queries.maps().is_some());
        let map = &self.app().viewport.queries.maps().expect("drawn").identities;
        let (w, view, ctx) = (map.width_px, self.view(), &self.harness.ctx);
        let place = |i: usize| {
            view.min + vec2((i % w) as f32, (i / w) as f32) / vec2(w as f32, map.height_px as f32) * view.size()
        };
        let free = |at: Pos2| ctx.layer_id_at(at).is_none_or(|layer| layer.order == egui::Order::Background);
        let inside = |i: usize| [i.wrapping_sub(4), i + 4].iter().all(|j| map.identity.get(*j) == Some(&id));
        let found =
            (0..map.identity.len()).filter(|i| map.identity[*i] == id && inside(*i)).map(place).find(|at| free(*at));
        found.unwrap_or_else(|| panic!("no pixel of {id} is free"))
    }

    fn hover(&mut self, at: Pos2) {
        self.harness.hover_at(at);
        self.harness.run_steps(3);
    }

    fn click(&mut self, at: Pos2, button: PointerButton, modifiers: Modifiers) {
        self.hover(at);
        self.harness.event(Event::PointerButton { pos: at, button, pressed: true, modifiers });
        self.harness.step();
        self.harness.event(Event::PointerButton { pos: at, button, pressed: false, modifiers });
        // Long enough that the next one makes no double click.
        self.harness.run_steps(60);
    }

    /// Drags the view by so many points.
    fn pan(&mut self, by: egui::Vec2) {
        let (from, button, modifiers) = (self.view().center(), PointerButton::Secondary, Modifiers::NONE);
        self.hover(from);
        self.harness.event(Event::PointerButton { pos: from, button, pressed: true, modifiers });
        for k in 1..=4 {
            self.harness.hover_at(from + by * k as f32 / 4.0);
            self.harness.step();
        }
        self.harness.event(Event::PointerButton { pos: from + by, button, pressed: false, modifiers });
        self.harness.run_steps(3);
    }

    fn selected(&self) -> Option<IdentityId> {
        self.app().viewport.picking.selected()
    }

    fn pixels_of(app: &App, id: IdentityId) -> Option<usize> {
        let identities = &app.state.semantics.as_ref()?.identities;
        Some(app.viewport.queries.maps()?.identities.mask(identities, id).area())
    }
}

#[test]
fn things_are_pointed_at_selected_isolated_and_hidden() {
    let mut w = Window::new();
    let (table, shade, lamp) = (w.place_of(TABLE), w.place_of(SHADE), w.place_of(LAMP));
    w.hover(table);
    assert_eq!((w.app().viewport.picking.hovered(), w.selected()), (Some(TABLE), None), "looking selects nothing");
    let plain = Modifiers::NONE;
    w.click(table, PointerButton::Primary, plain);
    assert_eq!(w.selected(), Some(TABLE));
    w.click(shade, PointerButton::Primary, plain);
    assert_eq!(w.selected(), Some(SHADE), "the part first");
    w.click(shade, PointerButton::Primary, plain);
    assert_eq!(w.selected(), Some(LAMP), "then its object");
    w.click(shade, PointerButton::Primary, plain);
    w.harness.key_press(Key::U);
    w.harness.run_steps(3);
    assert_eq!(w.selected(), Some(LAMP), "a key for it");
    w.click(lamp, PointerButton::Primary, plain);
    assert_eq!(w.selected(), Some(LAMP));
    w.click(table, PointerButton::Primary, plain);
    w.harness.event(Event::ModifiersChanged(Modifiers::ALT));
    w.click(shade, PointerButton::Primary, Modifiers::ALT);
    w.harness.event(Event::ModifiersChanged(plain));
    assert_eq!(w.selected(), Some(LAMP), "Alt takes the object at once");
    w.click(table, PointerButton::Primary, plain);
    w.click(shade, PointerButton::Primary, plain);

    // Keys are about what is selected.
    w.harness.key_press(Key::I);
    w.until("it is alone", |a| Window::pixels_of(a, TABLE) == Some(0));
    w.harness.key_press(Key::I);
    w.until("all is back", |a| Window::pixels_of(a, TABLE).is_some_and(|n| n > 0));
    w.harness.key_press(Key::H);
    w.until("it is hidden", |a| Window::pixels_of(a, SHADE) == Some(0));
    w.ask(Action::Isolate(None));
    w.until("it is back", |a| Window::pixels_of(a, SHADE).is_some_and(|n| n > 0));
    w.harness.key_press(Key::Escape);
    w.harness.run_steps(3);
    assert_eq!(w.selected(), None, "Escape deselects");
    w.harness.key_press(Key::H);
    w.harness.run_steps(3);
    assert!(w.shows("Nothing is selected"), "a key without its object says so");

    // The menu of a right click is about what is under the cursor.
    w.click(shade, PointerButton::Secondary, plain);
    assert_eq!(w.selected(), Some(SHADE));
    assert!(w.shows("Ask for this") && w.shows("Export Gaussians"), "the menu");
    w.harness.get_by_label("Ask for this").click();
    w.harness.run_steps(4);
    assert_eq!(w.app().viewport.queries.found(), [SHADE]);
    assert!(!w.shows("Ask for this"), "a choice closes it");
}

#[test]
fn what_is_not_in_view_is_marked_and_masks_follow_the_eye() {
    let mut w = Window::new();
    let shade = w.place_of(SHADE);
    w.ask(Action::Ask("lamp".into()));
    w.until("its mask", |a| Window::pixels_of(a, LAMP).is_some_and(|n| n > 0));
    assert!(!w.shows("Fly to lamp"), "what is seen needs no arrow");
    w.click(shade, PointerButton::Primary, Modifiers::NONE);
    let before = w.app().viewport.pose();
    w.harness.key_press(Key::F);
    w.harness.run_steps(4);
    let after = w.app().viewport.pose();
    assert!(before.center.distance(after.center) > 0.1, "F frames what is selected");

    // Moved out of view: an arrow, by which one flies there.
    for _ in 0..3 {
        w.pan(vec2(0.45, 0.0) * w.view().size());
    }
    w.until("nothing of it", |a| Window::pixels_of(a, LAMP) == Some(0));
    w.harness.run_steps(3);
    assert!(w.shows("Fly to lamp"), "an arrow");
    w.harness.get_by_label("Fly to lamp").click();
    w.until("where one can go is looked at", |a| a.state.explored.is_some());

    // While the eye moves the mask is drawn too.
    w.ask(Action::ResetView);
    w.until("rest", |a| a.viewport.queries.maps().is_some());
    let mut views = std::collections::BTreeSet::new();
    w.harness.key_down(Key::D);
    for _ in 0..60 {
        w.harness.step();
        std::thread::sleep(std::time::Duration::from_millis(10));
        let queries = &w.app().viewport.queries;
        assert!(queries.shown_maps().is_some(), "the mask stays on screen");
        views.extend(queries.shown_maps().filter(|_| queries.maps().is_none()).map(|m| m.generation()));
    }
    w.harness.key_up(Key::D);
    assert!(views.len() > 2, "drawn anew as the eye moves: {views:?}");

    w.harness.key_press(Key::Num3);
    w.harness.run_steps(3);
    assert!(w.shows("One color per object"), "the legend");
    w.ask(Action::Tint(ColorBy::Objects));
    assert!(!w.shows("One color per object"), "again for the RGB image");

    // What is drawn and what tints it are one choice, but with Shift.
    let shown = |w: &mut Window| {
        w.harness.run_steps(3);
        (w.shows("One color per object"), w.app().layout.mode)
    };
    w.harness.key_press(Key::Num3);
    assert_eq!(shown(&mut w), (true, ViewMode::Rgb));
    w.harness.key_press(Key::Num5);
    assert_eq!(shown(&mut w), (false, ViewMode::Depth));
    w.harness.key_press_modifiers(Modifiers::SHIFT, Key::Num3);
    assert_eq!(shown(&mut w), (true, ViewMode::Depth));
    w.harness.key_press(Key::Num1);
    assert_eq!(shown(&mut w), (false, ViewMode::Rgb));
}

/// Prints how long it takes from the cursor, and from a click, to the outline.
#[test]
#[ignore = "prints timings"]
fn times_of_hover_and_click() {
    for n in [30, 50] {
        let mut w = Window::of(n);
        let still = w.app().viewport.picture().map_or(0.0, |p| 1e3 * p.secs);
        let places = [w.place_of(TABLE), w.place_of(SHADE)];
        let mut times = [Vec::new(), Vec::new(), Vec::new()];
        for k in 0..20 {
            let at = places[k % 2];
            let start = Instant::now();
            w.harness.hover_at(at);
            w.harness.step();
            times[0].push(start.elapsed());
            assert!(w.app().viewport.picking.hovered().is_some());
            let start = Instant::now();
            for pressed in [true, false] {
                let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
                w.harness.event(Event::PointerButton { pos: at, button, pressed, modifiers });
                w.harness.step();
            }
            w.harness.step();
            times[1].push(start.elapsed());
            assert!(w.selected().is_some());
            w.harness.run_steps(60);
            w.ask(Action::Select(None));
            let start = Instant::now();
            w.harness.step();
            times[2].push(start.elapsed());
        }
        let median = |times: &mut Vec<Duration>| {
            times.sort();
            times[times.len() / 2].as_secs_f64() * 1e3
        };
        let [hover, click, idle] = times.each_mut().map(median);
        println!(
            "{} Gaussians: picture {still:.1} ms; hover {hover:.1} ms, click {click:.1} ms, a frame of nothing new {idle:.1} ms",
            4 * n * n * n
        );
    }
}
