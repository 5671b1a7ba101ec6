//! Error against run time: a report's measurements as a plot, its verdicts on the defaults, and a button that applies a
//! measured setting.

pub(crate) mod apply;
mod empty;
mod grid;
mod scatter;
mod tables;

use egui::{CollapsingHeader, ComboBox, RichText, ScrollArea, Ui};

use self::apply::{Now, Offer};
use self::scatter::Scatter;
use super::super::ctx::Ctx;
use super::super::state::{AppState, ShownReport};
use super::super::theme;
use super::super::viewport::Viewport;
use super::PaneContents;
use super::plots::PsnrCurve;
use crate::measure::{Measure, Point, Report, Stage, StageName, table};
use crate::scene::text;
use crate::ui::actions::Action;

/// The user's choices in a report.
#[derive(Default)]
pub(crate) struct ReportPane {
    /// True while rendering is benchmarked; set by the window.
    pub(crate) measuring: bool,
    stage: Option<StageName>,
    measure: Option<String>,
    /// Knob and setting of the chosen point.
    selected: Option<[String; 2]>,
    /// Set after a point was chosen: the column scrolls to its facts at the top.
    to_top: bool,
}

impl ReportPane {
    /// Chooses the setting of a knob, as a click on its point does.
    pub(crate) fn select(&mut self, method: &str, setting: &str) {
        self.selected = Some([method.to_owned(), setting.to_owned()]);
    }

    /// PSNR over seconds of trainings in the report: of the default and of the chosen setting.
    pub(crate) fn curves(&self, state: &AppState) -> Vec<PsnrCurve> {
        let Some(stage) = state.report.as_ref().and_then(|r| r.report.stage(StageName::Train)) else {
            return Vec::new();
        };
        if stage.measures.first().is_none_or(|m| m.name != "PSNR") {
            return Vec::new();
        }
        let chosen = self.selected_of(stage);
        let wanted = |p: &&Point| p.curve.len() > 1 && (p.default || chosen.is_some_and(|c| std::ptr::eq(c, *p)));
        let named = |p: &Point| (format!("report, {}", tables::title(p)), p.curve.clone());
        stage.points.iter().filter(wanted).map(named).collect()
    }

    /// The chosen stage, or the first.
    fn stage_of<'a>(&self, report: &'a Report) -> Option<&'a Stage> {
        self.stage.and_then(|name| report.stage(name)).or_else(|| report.stages.first())
    }

    fn measure_of<'a>(&self, stage: &'a Stage) -> Option<&'a Measure> {
        self.measure.as_ref().and_then(|name| stage.measure(name)).or_else(|| stage.measures.first())
    }

    fn selected_of<'a>(&self, stage: &'a Stage) -> Option<&'a Point> {
        let [method, setting] = self.selected.as_ref()?;
        stage.points.iter().find(|p| p.method == *method && p.setting == *setting)
    }

    /// Draws the choice of report, stage and measure, and buttons to open other reports.
    fn header(&mut self, ui: &mut Ui, shown: &ShownReport, second: Option<&ShownReport>, cx: &mut Ctx<'_>) {
        let state = cx.state;
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new("Error vs. run time").strong());
            ui.label(RichText::new(name(shown)).color(theme::weak())).on_hover_text(text::path(&shown.path));
            if let Some(second) = second {
                ui.label(RichText::new(format!("compared with {} (hollow)", name(second))).color(theme::accent()))
                    .on_hover_text(text::path(&second.path));
                button(ui, "End comparison", &Action::EndComparison, true, cx);
            }
            ui.separator();
            let stage = self.stage_of(&shown.report);
            for s in &shown.report.stages {
                let is_shown = stage.is_some_and(|t| t.name == s.name);
                if ui.selectable_label(is_shown, s.name.title()).on_hover_text(&s.reference).clicked() {
                    (self.stage, self.measure) = (Some(s.name), None);
                }
            }
            if let Some((stage, measure)) = stage.and_then(|s| Some((s, self.measure_of(s)?))) {
                let names = ComboBox::from_id_salt("measure").selected_text(table::title(measure)).show_ui(ui, |ui| {
                    for m in &stage.measures {
                        let row = ui.selectable_label(m.name == measure.name, table::title(m));
                        if row.on_hover_text(&m.meaning).clicked() {
                            self.measure = Some(m.name.clone());
                        }
                    }
                });
                names.response.on_hover_text(&measure.meaning).accessible_name("Metric");
            }
            ui.separator();
            button(ui, "Open\u{2026}", &Action::ChooseReport, true, cx);
            button(ui, "Compare\u{2026}", &Action::ChooseSecondReport, true, cx);
            let can_measure = state.is_trained() && state.job.is_none();
            button(ui, "Benchmark rendering", &Action::BenchmarkRendering, can_measure, cx);
        });
    }
}

impl PaneContents for ReportPane {
    fn ui(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>, view: &mut Viewport) {
        let state = cx.state;
        let Some(shown) = state.report.clone() else {
            let job = state.job.as_ref().filter(|_| self.measuring);
            ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| empty::show(ui, job, cx));
            return;
        };
        let second = state.second_report.clone();
        let report = &*shown.report;
        self.header(ui, &shown, second.as_ref(), cx);
        let Some(stage) = self.stage_of(report) else {
            ui.weak("Nothing was measured yet: the report has no stage. Run the same command again to continue.");
            return;
        };
        let Some(measure) = self.measure_of(stage) else {
            ui.weak("This stage has no metric.");
            return;
        };
        let second_report = second.as_ref().map(|s| &*s.report);
        warnings(ui, stage, report, second_report);
        let other = second_report.and_then(|r| r.stage(stage.name));
        let selected = self.selected_of(stage);
        let own = state.scene.as_ref().map(|_| state.render_settings());
        let now = Now { config: &cx.layout.config, own: own.as_ref(), drawing: &view.overrides, on_gpu: view.on_gpu() };
        let size = ui.available_size();
        // A column of its own if there is room, else above the tables.
        let wide = size.x > 1_100.0;
        let widths = if wide { [0.46, 0.23, 0.31] } else { [0.54, 0.0, 0.46] }.map(|share: f32| share * size.x - 8.0);
        let (mut clicked, mut applied) = (None, None);
        ui.horizontal_top(|ui| {
            ui.allocate_ui(egui::vec2(widths[0], size.y), |ui| {
                let scatter = Scatter { stage, second: other, measure, selected };
                clicked = scatter.show(ui, size.y.max(120.0));
            });
            if wide {
                column(ui, "chosen", widths[1], false, |ui| applied = chosen(ui, stage, selected, &now));
            }
            column(ui, "tables", widths[2], self.to_top && !wide, |ui| {
                if !wide {
                    applied = chosen(ui, stage, selected, &now);
                }
                if let Some(other) = other {
                    section(ui, "Both reports", true, |ui| {
                        tables::comparison(ui, &stage.beside(other, measure), measure);
                    });
                }
                let title = format!("Measurements ({})", stage.points.len());
                let in_table = section(ui, &title, true, |ui| tables::points(ui, stage, measure, selected));
                clicked = clicked.or(in_table.flatten());
                section(ui, "Defaults check", true, |ui| tables::choices(ui, stage));
                if !stage.orders.is_empty() {
                    section(ui, "Orders of convergence", true, |ui| tables::orders(ui, stage));
                }
                section(ui, "About this report", false, |ui| tables::about(ui, report, stage));
            });
        });
        applied.into_iter().for_each(|action| cx.ask(action));
        self.to_top = clicked.is_some();
        if let Some(point) = clicked {
            self.select(&point.method, &point.setting);
        }
    }
}

fn name(shown: &ShownReport) -> String {
    let folder = if shown.path.is_dir() { Some(shown.path.as_path()) } else { shown.path.parent() };
    let name = folder.and_then(|f| f.file_name()).map(|n| n.to_string_lossy().into_owned());
    text::elided(&name.unwrap_or_else(|| shown.path.display().to_string()), 32)
}

fn button(ui: &mut Ui, text: &str, action: &Action, enabled: bool, cx: &mut Ctx<'_>) {
    let response = ui.add_enabled(enabled, egui::Button::new(text).small());
    let disabled = "Needs a trained scene, and no other job.";
    if response.on_hover_text(action.tooltip()).on_disabled_hover_text(disabled).clicked() {
        cx.ask(action.clone());
    }
}

fn column(ui: &mut Ui, name: &str, width: f32, to_top: bool, add: impl FnOnce(&mut Ui)) {
    ui.allocate_ui(egui::vec2(width, ui.available_height()), |ui| {
        let area = ScrollArea::both().auto_shrink([false, false]).id_salt(name);
        let area = if to_top { area.vertical_scroll_offset(0.0) } else { area };
        area.show(ui, |ui| ui.vertical(add));
    });
}

fn section<R>(ui: &mut Ui, title: &str, open: bool, add: impl FnOnce(&mut Ui) -> R) -> Option<R> {
    let id = title.split(" (").next().unwrap_or(title);
    let header = CollapsingHeader::new(RichText::new(title).small().strong()).id_salt(id).default_open(open);
    header.show(ui, add).body_returned
}

/// Draws warnings on the reliability of the numbers.
fn warnings(ui: &mut Ui, stage: &Stage, report: &Report, second: Option<&Report>) {
    let warn = |ui: &mut Ui, text: String| ui.label(RichText::new(text).small().color(theme::warning()));
    if !stage.complete() {
        let text = format!(
            "Incomplete: {} planned settings, {} runs each; so far {}. Run the same command to continue.",
            stage.planned,
            stage.seeds.len(),
            stage.runs()
        );
        warn(ui, text);
    }
    let Some(second) = second else { return };
    let differs = report.differs_from(second);
    if !differs.is_empty() {
        let text = format!("Measured under different conditions; times are not comparable: {}", differs.join("; "));
        warn(ui, text::elided(&text, 180)).on_hover_text(differs.join("\n"));
    }
    if second.stage(stage.name).is_none() {
        warn(ui, format!("Missing from the second report: {}.", stage.name.title().to_lowercase()));
    }
}

/// Draws the chosen point, with a button that applies its setting; returns the action of the button if it was clicked.
fn chosen(ui: &mut Ui, stage: &Stage, selected: Option<&Point>, now: &Now<'_>) -> Option<Action> {
    let Some(point) = selected else {
        ui.weak(
            "Click on a point, or on a row below, to see the changes it would make. Drag to move, Ctrl+wheel to zoom.",
        );
        return None;
    };
    let shown = egui::Frame::new().fill(theme::surface()).corner_radius(8).inner_margin(10).show(ui, |ui| {
        ui.set_width(ui.available_width());
        scatter::facts(ui, point, &stage.measures, "");
        ui.add_space(4.0);
        match apply::offer(stage, point, now) {
            Offer::Changes(changes, action) => {
                for c in &changes {
                    ui.label(format!("{}: {}, instead of {}", c.name, c.to, c.from));
                }
                let what = match stage.name {
                    StageName::Train => "Apply to the next training",
                    _ => "Apply to the view",
                };
                let clicked = ui.add(theme::primary_button(what)).on_hover_text(action.tooltip()).clicked();
                clicked.then_some(action)
            }
            Offer::Active => {
                ui.colored_label(theme::good(), "Already active.");
                None
            }
            Offer::Not(why) => {
                ui.label(RichText::new(why).color(theme::weak()));
                None
            }
        }
    });
    shown.inner
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::{Computer, Rule, Sample, VERSION};
    use std::collections::BTreeMap;
    use std::sync::Arc;

    fn report() -> Report {
        let sample = |v: f64| {
            let mut s = Sample::default();
            s.add(v);
            s
        };
        let point = |method: &str, setting: &str, secs: f64| Point {
            method: method.into(),
            setting: setting.into(),
            default: method == "default",
            secs: sample(secs),
            values: BTreeMap::from([("PSNR".to_owned(), sample(20.0 + secs))]),
            curve: vec![[0.5 * secs, 15.0], [secs, 20.0 + secs]],
            ..Point::default()
        };
        let stage = Stage {
            name: StageName::Train,
            secs_of: "training".into(),
            reference: String::new(),
            input: BTreeMap::new(),
            seeds: vec![0],
            planned: 3,
            measures: vec![Measure::new("PSNR", "dB", crate::measure::ErrorKind::Decibels, "")],
            rule: Rule { measure: "PSNR".into(), times: 1.0, floor: 0.0, spare_secs: 0.0 },
            points: vec![point("default", "all", 2.0), point("steps", "500", 1.0), point("steps", "50", 0.1)],
            orders: Vec::new(),
            left_out: Vec::new(),
        };
        let computer = Computer::default();
        let stages = vec![stage];
        Report { version: VERSION, program: String::new(), scene: String::new(), computer, commands: vec![], stages }
    }

    #[test]
    fn curves_of_the_default_and_of_the_chosen_setting_go_beside_a_training() {
        let mut pane = ReportPane::default();
        let mut state = AppState::default();
        assert!(pane.curves(&state).is_empty());
        state.report = Some(ShownReport { path: "report".into(), report: Arc::new(report()) });
        let names = |pane: &ReportPane| pane.curves(&state).into_iter().map(|c| c.0).collect::<Vec<_>>();
        assert_eq!(names(&pane), ["report, default: all"]);
        pane.select("steps", "500");
        assert_eq!(names(&pane), ["report, default: all", "report, steps: 500"]);
        assert_eq!(pane.curves(&state)[1].1, [[0.5, 15.0], [1.0, 21.0]]);
        let mut other = report();
        other.stages[0].measures[0].name = "SSIM".into();
        state.report = Some(ShownReport { path: "report".into(), report: Arc::new(other) });
        assert!(pane.curves(&state).is_empty(), "curves are of the first measure");
    }

    #[test]
    fn what_is_gone_from_a_report_is_looked_at_no_more() {
        let report = report();
        let mut pane = ReportPane { stage: Some(StageName::Path), measure: Some("x".into()), ..ReportPane::default() };
        pane.select("steps", "none");
        let stage = pane.stage_of(&report).expect("the first");
        assert_eq!((stage.name, pane.measure_of(stage).map(|m| m.name.as_str())), (StageName::Train, Some("PSNR")));
        assert!(pane.selected_of(stage).is_none());
    }
}
