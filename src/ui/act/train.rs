//! Training, evaluation and measuring.

use std::sync::Arc;

use super::remote;
use crate::jobs::phases;
use crate::jobs::report::{self, ReportRequest};
use crate::jobs::train::{IfChanged, TrainStart};
use crate::jobs::workspace::TrainingEnd;
use crate::measure::subject::{StudyOptions, Subject};
use crate::measure::{End, FILE, Knobs, StageName, turned};
use crate::pipeline::observer::{Observer, Severity};
use crate::ui::actions::{Action, Pane};
use crate::ui::app::App;
use crate::ui::dialogs::{DialogAnswer, Question};
use crate::ui::labels::sentence;
use crate::ui::state::{ShownReport, Tone};
use crate::worker::{JobInfo, Makes, Stop};

/// Continues the current training if its settings allow it and `anew` is false; else begins a new one beside it.
pub(in crate::ui) fn start(app: &mut App, anew: bool, if_changed: IfChanged) {
    let scene = app.state.scene.as_ref();
    let Some((dataset, out)) = scene.and_then(|s| Some((s.dataset.clone()?, s.out.clone()))) else {
        let text = "Open a folder of posed photos first: training needs them.";
        return app.state.toast(Tone::Warning, text);
    };
    if let Some(job) = &app.state.job {
        let text = format!("{} is still running; stop it first (Esc).", job.info.title);
        return app.state.toast(Tone::Warning, text);
    }
    let title = format!("Training {}", dataset.name);
    let config = app.state.next_training(&app.layout.config);
    app.state.antialias = config.render_settings(None, 1.0).antialias;
    let reached = app.state.continues_at(&config).filter(|_| !anew);
    if remote::refuses(app, &title, "run 'fmlgs train --serve' there") {
        return;
    }
    let from = TrainStart { more_steps: reached.is_some(), objects_of: Some(out.clone()), if_changed };
    let (out, workspace) = (Some(out).filter(|_| !anew), Arc::clone(&app.workspace));
    let info = JobInfo::long(title).makes(Makes::Gaussians).pausable().phases(phases::TRAINING);
    let (next, before) = (config.clone(), app.state.before_training(reached));
    let train = move |observer: &mut dyn Observer| workspace.train(&dataset, &config, out, &from, observer);
    let started = app.start_to_end(info, train, |app, job, end| match end {
        Ok(TrainingEnd::Trained(run)) => {
            if app.state.trained(job, *run) {
                app.ask(Action::FindObjects);
            }
        }
        Ok(TrainingEnd::InputsChanged(how)) => {
            app.state.undo_start(before);
            ask_how_to_train(app, &how);
        }
        Err(_) => {
            app.state.undo_start(before);
        }
    });
    if started {
        app.state.begin_training(next, reached);
    }
}

/// Asks whether to continue a training with photos that have changed since it began.
fn ask_how_to_train(app: &mut App, changes: &str) {
    let text = format!(
        "{}.\n\nTrain anew in a folder of its own, or go on with the photos as they are now? The training so far \
         stays as it is if you train anew.",
        sentence(changes)
    );
    let question = Question { text, yes: "Train anew", other: Some("Go on"), no: "Cancel", deletes: false };
    app.put_question(question, |app, answer| match answer {
        DialogAnswer::Yes => start(app, false, IfChanged::Anew),
        DialogAnswer::Other => start(app, false, IfChanged::GoOn),
        DialogAnswer::No => {}
    });
}

/// Pauses the running job, or resumes it.
pub(in crate::ui) fn pause(app: &mut App) {
    if let Some(job) = app.state.job.clone().filter(|j| j.info.can_pause) {
        remote::set_paused(app, job.id, !job.paused);
    }
}

/// Measures PSNR and SSIM on the held-out photos.
pub(in crate::ui) fn evaluate(app: &mut App) {
    let scene = app.state.scene.as_ref().and_then(|s| Some((s.dataset.clone()?, s.out.clone())));
    let trained = app.state.training_job.is_some() || app.state.scene.as_ref().is_some_and(|s| s.trained);
    let (Some((dataset, out)), Some(cloud), true) = (scene, app.viewport.cloud().cloned(), trained) else {
        let text = "Train first: evaluation needs trained Gaussians and held-out photos.";
        return app.state.toast(Tone::Warning, text);
    };
    let title = format!("Evaluating {}", dataset.name);
    if remote::refuses(app, &title, "run 'fmlgs eval' there") {
        return;
    }
    let (cloud, config, settings) = (Arc::clone(&cloud), app.layout.config.clone(), app.state.render_settings());
    let workspace = Arc::clone(&app.workspace);
    let evaluate =
        move |observer: &mut dyn Observer| workspace.evaluate(dataset, cloud, config, settings, &out, observer);
    app.start_in_scene(JobInfo::long(title), evaluate, |app, evaluation| {
        evaluation.into_iter().for_each(|evaluation| app.state.evaluated(evaluation));
    });
}

/// Measures the rendering of the scene, from photos or from the current camera.
pub(in crate::ui) fn benchmark_rendering(app: &mut App) {
    let scene = app.state.scene.clone();
    let cloud = app.viewport.cloud().cloned().filter(|_| app.state.is_trained());
    let (Some(scene), Some(cloud)) = (scene, cloud) else {
        return app.state.toast(Tone::Warning, "Open or train a scene first: there is nothing to render.");
    };
    if let Some(job) = &app.state.job {
        let title = &job.info.title;
        let text = format!("{title} is still running and would distort the times; stop it first (Esc).");
        return app.state.toast(Tone::Warning, text);
    }
    let subject = Subject {
        name: scene.path.display().to_string(),
        cloud: Arc::clone(&cloud),
        settings: scene.settings.clone(),
        cameras: vec![(app.viewport.camera(), false)],
        holdout_every: app.layout.config.holdout_every,
        dataset: scene.dataset.clone(),
        map: None,
        options: StudyOptions::default(),
    };
    let (stages, out) = (vec![StageName::Render], scene.report_out.clone());
    let command = "'Benchmark rendering' in the window".into();
    let request = ReportRequest { subject, stages, out, fresh: false, budget_secs: f64::INFINITY, command };
    app.layout.show(Pane::Report);
    let measure = move |observer: &mut dyn Observer| {
        let done = report::run(&request, observer)?;
        if done.end == End::Cancelled {
            let kept = request.out.join(FILE);
            observer.note(Severity::Info, format!("What was measured so far is kept in {}", kept.display()));
            return Err(Stop::Cancelled);
        }
        Ok(ShownReport { path: request.out, report: Arc::new(done.report) })
    };
    app.report.measuring = app.start_to_end(JobInfo::long("Benchmarking rendering"), measure, move |app, _, end| {
        app.report.measuring = false;
        match end {
            Ok(shown) => app.state.report = Some(shown),
            // Results measured before the cancellation are shown.
            Err(Stop::Cancelled) => app.ask(Action::OpenReport(scene.report_out.clone())),
            Err(Stop::Failed(_)) => {}
        }
    });
}

/// Applies a measured setting to the next training or to the view.
pub(in crate::ui) fn apply_setting(app: &mut App, stage: StageName, knobs: &Knobs) {
    let done = match stage {
        StageName::Train => turned(&app.layout.config, knobs).map(|config| {
            app.layout.config = config;
            app.layout.show(Pane::Training);
            "The next training will use this setting (Training pane)"
        }),
        StageName::Render => turned(&app.viewport.overrides, knobs).map(|drawing| {
            app.viewport.overrides = drawing;
            "The view now uses this setting; videos and exports do not"
        }),
        StageName::Features | StageName::Query | StageName::Path | StageName::Depth => {
            Err("the window has no setting for it".into())
        }
    };
    match done {
        Ok(text) => app.state.toast(Tone::Good, text),
        Err(text) => app.state.toast(Tone::Warning, format!("Cannot apply: {text}")),
    }
}
