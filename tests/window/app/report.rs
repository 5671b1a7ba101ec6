//! Reports in the window: opened, compared, their settings applied.

use fmlgs::measure::{self, ErrorKind, Knobs, Measure, Point, Report, Rule, Sample, Stage, StageName};

use super::*;

/// A report of two stages, whose settings the window has.
pub(crate) fn write_report(folder: &Path, times: f64, cores: usize) {
    let sample = |v: f64| {
        let mut s = Sample::default();
        [v, 1.1 * v, 0.9 * v].iter().for_each(|v| s.add(*v));
        s
    };
    let point = |method: &str, setting: &str, knobs: &[(&str, serde_json::Value)], secs: f64, error: f64| Point {
        method: method.into(),
        setting: setting.into(),
        knobs: knobs.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect::<Knobs>(),
        default: method == "default",
        secs: sample(times * secs),
        values: [("error".to_owned(), sample(error))].into(),
        ..Point::default()
    };
    let stage = |name: StageName, points: Vec<Point>| Stage {
        name,
        secs_of: "it".into(),
        reference: "the truth".into(),
        input: Default::default(),
        seeds: vec![0, 1, 2],
        planned: 4,
        measures: vec![Measure::new("error", "", ErrorKind::Error, "how wrong it is")],
        rule: Rule { measure: "error".into(), times: 1.1, floor: 0.0, spare_secs: 0.0 },
        points,
        orders: Vec::new(),
        left_out: Vec::new(),
    };
    let drawing = vec![
        point("default", "as the scene says", &[], 0.02, 0.001),
        point("filter", "on", &[("antialias", true.into())], 0.015, 0.01),
        point("precision", "16 bits", &[("precision", "half".into())], 0.02, 0.003),
    ];
    let training =
        vec![point("default", "all", &[], 20.0, 0.1), point("steps", "500", &[("steps", 500.into())], 5.0, 0.2)];
    let report = Report {
        version: measure::VERSION,
        program: "test".into(),
        scene: "dots".into(),
        computer: measure::Computer { cores, ..Default::default() },
        commands: vec!["fmlgs report dots".into()],
        stages: vec![stage(StageName::Render, drawing), stage(StageName::Train, training)],
    };
    std::fs::create_dir_all(folder).expect("folder");
    report.write(&folder.join(measure::FILE)).expect("written");
}

#[test]
fn a_report_is_opened_compared_and_its_settings_are_applied() {
    let folder = tempfile::tempdir().expect("folder");
    let at = |name: &str| folder.path().join(name);
    write_report(&at("one"), 1.0, 2);
    write_report(&at("two"), 2.0, 64);
    let mut w = Window::new(Some(Action::Open(write_splat(folder.path()))));
    w.until("the splat", |a| a.viewport.picture().is_some_and(|p| p.full));
    w.ask(Action::TogglePane(Pane::Report));
    assert!(w.shows("Error vs. run time") && w.shows("fmlgs report") && w.shows("Benchmark rendering"));

    // As if it was dropped: it is no scene, and takes no scene's place.
    w.ask(Action::Open(at("one")));
    w.until("the report", |a| a.state.report.is_some());
    assert_eq!(w.app().state.scene.as_ref().map(|s| s.name.as_str()), Some("dots"));
    assert!(
        w.shows("Incomplete: 4 planned settings, 3 runs each; so far each setting 3 times"),
        "an incomplete sweep says so"
    );
    assert!(w.is_drawn());
    w.click("precision: 16 bits");
    assert!(w.shows("measured for comparison") && !w.shows("Apply to the view"), "what cannot be applied says why");
    w.click("filter: on");
    let before = w.app().viewport.picture().expect("drawn").rgb.clone();
    w.click("Apply to the view");
    assert_eq!(w.app().viewport.overrides.antialias, Some(true));
    w.until("another picture", |a| a.viewport.full_picture().is_some_and(|p| p.rgb != before));
    assert!(w.shows("rendered with filter on") && w.shows("Already active"));
    w.click("default: as the scene says");
    w.click("Apply to the view");
    w.until("the first picture", |a| a.viewport.full_picture().is_some_and(|p| p.rgb == before));

    w.ask(Action::TogglePane(Pane::Training));
    w.click("Training");
    w.click("steps: 500");
    assert_ne!(w.app().layout.config.steps, 500);
    w.click("Apply to the next training");
    assert_eq!(w.app().layout.config.steps, 500);
    assert!(w.app().layout.shows(Pane::Training), "where it can be seen");

    w.ask(Action::CompareReport(at("two")));
    w.until("the second report", |a| a.state.second_report.is_some());
    assert!(w.shows("Both reports") && w.shows("\u{d7} 2.00") && w.shows("cores: 2 / 64"));
    w.ask(Action::EndComparison);
    assert!(!w.shows("Both reports"));

    std::fs::write(at("two").join(measure::FILE), "{").expect("written");
    w.ask(Action::OpenReport(at("two")));
    w.until("the error", |a| a.state.error.is_some());
    assert!(w.shows("not a report") && w.app().state.report.is_some(), "what was open stays");
}

#[test]
fn frame_times_are_shown_and_cost_nothing_when_they_are_not() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(Action::Open(write_splat(folder.path()))));
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    assert!(!w.shows("median of"));
    w.harness.key_press(egui::Key::F3);
    w.harness.run_steps(2);
    assert!(w.app().layout.times);
    w.until("times of a picture", |a| a.viewport.picture().is_some_and(|p| p.full && p.ticket > 1));
    w.harness.run_steps(3);
    assert!(w.shows("median of") && w.shows("total") && w.shows("upload"));
    w.harness.key_press(egui::Key::F3);
    w.harness.run_steps(3);
    assert!(!w.shows("median of"));
}
