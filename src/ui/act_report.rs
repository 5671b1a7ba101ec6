//! Actions on reports.

use std::path::PathBuf;
use std::sync::Arc;

use super::app::App;
use super::state::Tone;
use crate::jobs::report::ReportRequest;
use crate::measure::subject::{StudyOptions, Subject};
use crate::measure::{Knobs, StageName, turned};
use crate::ui::actions::Pane;
use crate::worker::Command;

impl App {
    /// Reads a report and shows its pane.
    pub(super) fn read_report(&mut self, path: PathBuf, second: bool) {
        self.layout.show(Pane::Report);
        self.submit(Command::ReadReport { path, second });
    }

    /// Measures the rendering of the scene, from photos or from the current camera.
    pub(super) fn measure_drawing(&mut self) {
        let scene = self.state.scene.clone();
        let cloud = self.viewport.cloud().cloned().filter(|_| self.state.is_trained());
        let (Some(scene), Some(cloud)) = (scene, cloud) else {
            self.state.toast(Tone::Warning, "Open or train a scene first: there is nothing to render.");
            return;
        };
        if let Some(job) = &self.state.job {
            let text = format!("{} is still running and would distort the times; cancel it first (Esc).", job.title);
            self.state.toast(Tone::Warning, text);
            return;
        }
        let subject = Subject {
            name: scene.path.display().to_string(),
            cloud: Arc::clone(&cloud),
            settings: scene.render.clone(),
            cameras: vec![(self.viewport.camera(), false)],
            holdout_every: self.layout.config.holdout_every,
            dataset: scene.dataset.clone(),
            map: None,
            options: StudyOptions::default(),
        };
        let (stages, out) = (vec![StageName::Render], scene.report_out.clone());
        let command = "'Benchmark rendering' in the window".into();
        let request = ReportRequest { subject, stages, out, fresh: false, budget_secs: f64::INFINITY, command };
        self.layout.show(Pane::Report);
        self.submit(Command::Measure(Box::new(request)));
    }

    /// Applies a measured setting to the next training or to the view.
    pub(super) fn apply_setting(&mut self, stage: StageName, knobs: &Knobs) {
        let done = match stage {
            StageName::Train => turned(&self.layout.config, knobs).map(|config| {
                self.layout.config = config;
                self.layout.show(Pane::Training);
                "The next training will use this setting (Training pane)"
            }),
            StageName::Render => turned(&self.viewport.overrides, knobs).map(|drawing| {
                self.viewport.overrides = drawing;
                "The view now uses this setting; videos and exports do not"
            }),
            _ => Err("the window has no setting for it".into()),
        };
        match done {
            Ok(text) => self.state.toast(Tone::Good, text),
            Err(text) => self.state.toast(Tone::Warning, format!("Cannot apply: {text}")),
        }
    }
}
