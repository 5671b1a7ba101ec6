//! Tests of the fold over events.

use super::*;
use crate::pipeline::observer::StepMetrics;
use crate::scene::Dataset;
use crate::ui::train_history::MAX_STEPS;
use crate::worker::Failure;

const JOB: JobId = JobId(7);

fn started(kind: JobKind) -> Event {
    Event::Started { job: JOB, kind, title: "Doing it".into() }
}

fn step(n: u64) -> Event {
    Event::Step(JOB, StepMetrics { step: n, loss: 1.0 / n as f64, ..StepMetrics::default() })
}

fn opened(name: &str, warnings: &[&str]) -> Event {
    let dataset = Dataset { warnings: warnings.iter().map(|w| (*w).to_owned()).collect(), ..Dataset::default() };
    let scene = OpenedScene {
        name: name.into(),
        path: name.into(),
        dataset: Some(Arc::new(dataset)),
        ..OpenedScene::default()
    };
    Event::Finished(JOB, Outcome::Opened(Box::new(scene)))
}

fn fold(events: impl IntoIterator<Item = Event>) -> AppState {
    let mut state = AppState::default();
    for e in events {
        state.apply(e);
    }
    state
}

#[test]
fn training_moves_the_plot_and_ends() {
    let mut s = fold([started(JobKind::Train), step(10), step(20)]);
    assert!(s.is_training());
    assert_eq!(s.history.steps.len(), 2);
    s.apply(Event::Paused(JOB, true));
    assert!(s.job.as_ref().is_some_and(|j| j.paused));
    s.apply(Event::Cancelled(JOB));
    assert!(s.job.is_none());
    assert_eq!(s.history.steps.len(), 2, "what was measured stays");
    assert_eq!(s.toasts.len(), 1);
}

#[test]
fn events_of_another_job_change_nothing() {
    let mut s = fold([started(JobKind::Train), step(10)]);
    let other = JobId(99);
    s.apply(Event::Step(other, StepMetrics { step: 11, ..StepMetrics::default() }));
    s.apply(Event::Paused(other, true));
    s.apply(Event::Cancelled(other));
    assert_eq!(s.history.steps.len(), 1);
    assert!(s.job.as_ref().is_some_and(|j| !j.paused));
}

#[test]
fn a_failed_opening_keeps_the_scene_and_says_why() {
    let failure = Failure { message: "x.ply, byte 12: truncated".into(), remedy: "Copy it again.".into() };
    let s = fold([
        started(JobKind::Open),
        opened("good", &[]),
        started(JobKind::Open),
        Event::Failed(JOB, failure.clone()),
    ]);
    assert_eq!(s.scene.as_ref().map(|s| s.name.as_str()), Some("good"));
    assert_eq!(s.error, Some(ErrorBox { doing: "Doing it".into(), failure }));
    assert!(s.job.is_none());
}

#[test]
fn a_photo_that_fails_does_not_stop_anybody() {
    let failure = Failure { message: "a.jpg is empty".into(), remedy: String::new() };
    let s = fold([started(JobKind::Photo), Event::Failed(JOB, failure)]);
    assert!(s.error.is_none());
    assert_eq!(s.toasts[0].tone, Tone::Warning);
    assert_eq!(s.failed_photos, vec![JOB]);
}

#[test]
fn opening_replaces_the_scene_and_is_remembered() {
    let s = fold([
        started(JobKind::Open),
        opened("a", &["17 photos are missing"]),
        started(JobKind::Open),
        opened("b", &[]),
    ]);
    assert_eq!(s.scene_number, 2);
    assert_eq!(s.recent, vec![PathBuf::from("b"), PathBuf::from("a")]);
    assert_eq!(s.toasts[0].text, "17 photos are missing");
}

#[test]
fn the_demo_is_asked_or_trained_at_once_and_not_listed_as_recent() {
    let mut s = fold([started(JobKind::DemoPhotos)]);
    assert_eq!(s.apply(opened("demo", &[])), [Action::StartTraining]);
    s.apply(started(JobKind::Demo));
    assert_eq!(s.apply(opened("demo", &[])), [Action::Ask("a button of the red controller".into())]);
    assert!(s.recent.is_empty());
    s.apply(started(JobKind::Open));
    assert!(s.apply(opened("other", &[])).is_empty(), "nothing else is");
}

#[test]
fn a_resumed_run_overwrites_the_steps_it_repeats() {
    let s = fold([started(JobKind::Train), step(10), step(20), step(15)]);
    assert_eq!(s.history.steps.iter().map(|s| s.step).collect::<Vec<_>>(), vec![10, 15]);
}

#[test]
fn a_new_run_starts_its_plot_over_and_a_resumed_one_goes_on() {
    let evaluation = |step| {
        let views = Vec::new();
        Event::Evaluation(JOB, Evaluation { step, secs: 1.0, psnr: 20.0, ssim: 0.5, gaussians: 9, views })
    };
    let mut s = fold([started(JobKind::Train), step(10), step(20), evaluation(20), Event::Cancelled(JOB)]);
    s.apply(started(JobKind::Train));
    s.apply(step(30));
    assert_eq!((s.history.steps.len(), s.history.evaluations.len()), (3, 1));
    s.apply(Event::Cancelled(JOB));
    s.apply(started(JobKind::Train));
    s.apply(step(10));
    assert_eq!((s.history.steps.len(), s.history.evaluations.len()), (1, 0));
}

#[test]
fn long_histories_are_thinned_and_keep_their_ends() {
    let s = fold(std::iter::once(started(JobKind::Train)).chain((1..=10_000).map(step)));
    assert!(s.history.steps.len() <= MAX_STEPS);
    assert_eq!(s.history.steps.first().map(|s| s.step), Some(1));
    assert_eq!(s.history.steps.last().map(|s| s.step), Some(10_000));
}

#[test]
fn reports_are_shown_and_compared_and_a_canceled_measurement_is_read() {
    use crate::measure::{Computer, Report, VERSION};
    let read = |scene: &str, second| {
        let computer = Computer::default();
        let report = Report {
            version: VERSION,
            program: String::new(),
            scene: scene.into(),
            computer,
            commands: vec![],
            stages: vec![],
        };
        Event::Finished(JOB, Outcome::Report { path: scene.into(), report: Arc::new(report), second })
    };
    let mut s = fold([started(JobKind::Report), read("a", false), started(JobKind::Report), read("b", true)]);
    let scenes = |s: &AppState| [&s.report, &s.second_report].map(|r| r.as_ref().map(|r| r.report.scene.clone()));
    assert_eq!(scenes(&s), [Some("a".into()), Some("b".into())]);
    let failure = Failure { message: "c: not a report".into(), remedy: String::new() };
    s.apply(started(JobKind::Report));
    s.apply(Event::Failed(JOB, failure));
    assert!(s.error.is_some() && scenes(&s)[0].is_some(), "what was shown stays");
    assert!(s.error.take().is_some_and(|e| e.doing == "Doing it"));
    s.apply(started(JobKind::Open));
    s.apply(opened("d", &[]));
    s.apply(started(JobKind::Train));
    assert!(s.apply(Event::Cancelled(JOB)).is_empty());
    s.apply(started(JobKind::Measure));
    let report = s.scene.as_ref().expect("open").report_out.clone();
    assert_eq!(s.apply(Event::Cancelled(JOB)), [Action::OpenReport(report)]);
}

#[test]
fn objects_carried_by_masks_are_found_after_training() {
    let trained = |semantics| {
        let (out, facts) = (PathBuf::from("out"), Box::default());
        Event::Finished(
            JOB,
            Outcome::Trained { evaluations: Vec::new(), out, semantics, runs: Vec::new(), stopped_at: None, facts },
        )
    };
    let with_masks = |masks: bool| {
        let masks = masks.then(|| PathBuf::from("masks"));
        let scene = OpenedScene { masks, ..OpenedScene::default() };
        let opened = Event::Finished(JOB, Outcome::Opened(Box::new(scene)));
        fold([started(JobKind::Open), opened, started(JobKind::Train)])
    };
    assert_eq!(with_masks(true).apply(trained(None)), [Action::FindObjects]);
    assert!(with_masks(true).apply(trained(Some(Arc::default()))).is_empty(), "they came along");
    assert!(with_masks(false).apply(trained(None)).is_empty());
}

#[test]
fn the_recent_list_is_short_and_has_no_doubles() {
    let mut s = AppState::default();
    for i in (0..20).chain([19, 15]) {
        s.remember(PathBuf::from(i.to_string()));
    }
    assert_eq!(s.recent.len(), MAX_RECENT);
    assert_eq!(s.recent[..2], [PathBuf::from("15"), PathBuf::from("19")]);
}

#[test]
fn foreign_text_is_cleaned_on_its_way_to_the_window() {
    let evil = "a\u{1b}[31m\u{202e}b\u{9b}\nc";
    let progress = Progress { stage: evil.into(), done: 1, total: 2, elapsed_secs: 1.0, rate: 1.0 };
    let mut s = fold([
        Event::Started { job: JOB, kind: JobKind::Train, title: evil.into() },
        Event::Progress(JOB, progress),
        Event::Note(JOB, Severity::Warning, evil.into()),
    ]);
    s.toast(Tone::Info, evil);
    s.fail(evil, Failure { message: evil.into(), remedy: evil.into() });
    let job = s.job.as_ref().expect("a job");
    let error = s.error.as_ref().expect("an error");
    let one_line = s.log.iter().map(|l| &l.text).chain([&job.title, &error.doing]);
    let one_line: Vec<&String> = one_line.chain(job.progress.as_ref().map(|p| &p.stage)).collect();
    let more = [&s.toasts[0].text, &error.failure.message, &error.failure.remedy];
    assert!(one_line.len() > 5 && one_line.iter().all(|t| !t.contains('\n')), "{one_line:?}");
    for text in one_line.into_iter().chain(more) {
        assert!(!text.contains(['\u{1b}', '\u{202e}', '\u{9b}']) && text.contains("31mb"), "{text:?}");
    }
}

#[test]
fn a_stopped_training_goes_on_with_its_own_settings_alone() {
    let config = TrainConfig { steps: 3_000, ..TrainConfig::default() };
    let progress = Progress { stage: "Training".into(), done: 253, total: 3_000, elapsed_secs: 1.0, rate: 1.0 };
    let mut s = fold([started(JobKind::Train), step(250), Event::Progress(JOB, progress)]);
    s.resumable = Some((config.clone(), 0));
    assert_eq!(s.continues_at(&config), None, "nothing is stopped yet");
    s.apply(Event::Cancelled(JOB));
    assert_eq!(s.continues_at(&config), Some(253));
    let seldom = TrainConfig { eval_every: 9, checkpoint_secs: 1.0, ..config.clone() };
    assert_eq!(s.continues_at(&seldom), Some(253), "looking at it changes nothing");
    assert_eq!(s.continues_at(&TrainConfig { seed: 1, ..config.clone() }), None, "that is another training");
    assert_eq!(s.continues_at(&TrainConfig { steps: 253, ..config }), None, "it is done");
}

#[test]
fn the_training_before_stays_to_be_compared_with() {
    let mut s = fold([started(JobKind::Train), step(10), step(20), Event::Cancelled(JOB), started(JobKind::Train)]);
    s.apply(step(30));
    assert!(s.previous.steps.is_empty(), "it went on");
    s.apply(Event::Cancelled(JOB));
    s.apply(started(JobKind::Train));
    s.apply(step(10));
    assert_eq!((s.history.steps.len(), s.previous.steps.len()), (1, 3));
    s.apply(started(JobKind::Open));
    s.apply(opened("other", &[]));
    assert!(s.previous.steps.is_empty(), "of another scene nothing stays");
}

#[test]
fn lines_of_the_log_have_their_time() {
    let mut s = AppState::default();
    s.say(Tone::Info, "first");
    s.stamp_log(1.5);
    s.say(Tone::Info, "second");
    s.stamp_log(20.25);
    let lines: Vec<String> = s.log.iter().map(LogLine::dated).collect();
    assert_eq!(lines, ["    1.50 s  first", "   20.25 s  second"]);
}
