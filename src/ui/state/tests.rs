//! Tests of the fold over events.

use super::*;
use crate::jobs::workspace::TrainedRun;
use crate::pipeline::observer::{Evaluation, StepMetrics};
use crate::pipeline::train::TrainConfig;
use crate::scene::Dataset;
use crate::ui::train_history::MAX_STEPS;
use crate::worker::Failure;

const JOB: JobId = JobId::Local(7);

fn started(makes: Makes) -> Event {
    Event::Started(JOB, JobInfo::long("Doing it").makes(makes))
}

fn canceled(job: JobId) -> Event {
    Event::Ended(job, JobEnd::Cancelled)
}

fn failed(failure: Failure) -> Event {
    Event::Ended(JOB, JobEnd::Failed(failure))
}

fn step(n: u64) -> Event {
    Event::Step(JOB, StepMetrics { step: n, loss: 1.0 / n as f64, ..StepMetrics::default() })
}

/// Opens photos with these warnings.
fn open(state: &mut AppState, name: &str, warnings: &[&str]) {
    let dataset = Dataset { warnings: warnings.iter().map(|w| (*w).to_owned()).collect(), ..Dataset::default() };
    let scene = OpenedScene {
        scene: Scene { name: name.into(), path: name.into(), ..Scene::default() },
        dataset: Some(Arc::new(dataset)),
        ..OpenedScene::default()
    };
    state.apply(started(Makes::Scene));
    state.apply(Event::Ended(JOB, JobEnd::Finished));
    state.opened(scene, false);
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
    let mut s = fold([started(Makes::Gaussians), step(10), step(20)]);
    assert!(s.is_training());
    assert_eq!(s.history.steps.len(), 2);
    s.apply(Event::Paused(JOB, true));
    assert!(s.job.as_ref().is_some_and(|j| j.paused));
    s.apply(canceled(JOB));
    assert!(s.job.is_none());
    assert_eq!(s.history.steps.len(), 2, "what was measured stays");
    assert_eq!(s.toasts.len(), 1);
}

#[test]
fn events_of_another_job_change_nothing() {
    let mut s = fold([started(Makes::Gaussians), step(10)]);
    let other = JobId::Local(99);
    s.apply(Event::Step(other, StepMetrics { step: 11, ..StepMetrics::default() }));
    s.apply(Event::Paused(other, true));
    s.apply(canceled(other));
    assert_eq!(s.history.steps.len(), 1);
    assert!(s.job.as_ref().is_some_and(|j| !j.paused));
}

#[test]
fn a_failed_opening_keeps_the_scene_and_says_why() {
    let failure = Failure::new("x.ply, byte 12: truncated", "Copy it again.");
    let mut s = AppState::default();
    open(&mut s, "good", &[]);
    s.apply(started(Makes::Scene));
    s.apply(failed(failure.clone()));
    assert_eq!(s.scene.as_ref().map(|s| s.name.as_str()), Some("good"));
    assert_eq!(s.error, Some(ErrorBox { doing: "Doing it".into(), failure }));
    assert!(s.job.is_none());
}

#[test]
fn a_refusal_and_a_photo_that_fails_do_not_stop_anybody() {
    let photo = Event::Started(JOB, JobInfo::short("Loading a.jpg").aside());
    let mut s = fold([photo, failed(Failure::new("a.jpg is empty", ""))]);
    assert!(s.error.is_none());
    assert_eq!((s.toasts[0].tone, &*s.toasts[0].text), (Tone::Warning, "Loading a.jpg: a.jpg is empty"));
    s.apply(Event::Started(JOB, JobInfo::short("Editing objects")));
    s.apply(failed(Failure { is_refusal: true, ..Failure::new("there is no such object", "") }));
    assert!(s.error.is_none());
    assert_eq!((s.toasts[1].tone, &*s.toasts[1].text), (Tone::Warning, "there is no such object"));
}

#[test]
fn opening_replaces_the_scene_and_is_remembered() {
    let mut s = AppState::default();
    open(&mut s, "a", &["17 photos are missing"]);
    open(&mut s, "b", &[]);
    assert_eq!(s.scene_number, 2);
    assert_eq!(s.recent, vec![PathBuf::from("b"), PathBuf::from("a")]);
    assert_eq!(s.toasts[0].text, "17 photos are missing");
}

#[test]
fn a_resumed_run_overwrites_the_steps_it_repeats() {
    let s = fold([started(Makes::Gaussians), step(10), step(20), step(15)]);
    assert_eq!(s.history.steps.iter().map(|s| s.step).collect::<Vec<_>>(), vec![10, 15]);
}

#[test]
fn a_new_run_starts_its_plot_over_and_a_resumed_one_goes_on() {
    let evaluation = |step| {
        let views = Vec::new();
        Event::Evaluation(JOB, Evaluation { step, secs: 1.0, psnr: 20.0, ssim: 0.5, gaussians: 9, views, fitted: None })
    };
    let mut s = fold([started(Makes::Gaussians), step(10), step(20), evaluation(20), canceled(JOB)]);
    s.apply(started(Makes::Gaussians));
    s.apply(step(30));
    assert_eq!((s.history.steps.len(), s.history.evaluations.len()), (3, 1));
    s.apply(canceled(JOB));
    s.apply(started(Makes::Gaussians));
    s.apply(step(10));
    assert_eq!((s.history.steps.len(), s.history.evaluations.len()), (1, 0));
}

#[test]
fn long_histories_are_thinned_and_keep_their_ends() {
    let s = fold(std::iter::once(started(Makes::Gaussians)).chain((1..=10_000).map(step)));
    assert!(s.history.steps.len() <= MAX_STEPS);
    assert_eq!(s.history.steps.first().map(|s| s.step), Some(1));
    assert_eq!(s.history.steps.last().map(|s| s.step), Some(10_000));
}

#[test]
fn objects_carried_by_masks_are_found_after_training() {
    let end = |masks: bool, semantics| {
        let scene = OpenedScene { masks: masks.then(|| PathBuf::from("masks")), ..OpenedScene::default() };
        let mut s = AppState::default();
        s.opened(scene, false);
        s.apply(started(Makes::Gaussians));
        s.apply(Event::Ended(JOB, JobEnd::Finished));
        let facts = SceneFacts::default();
        let (out, evaluations, runs) = (PathBuf::from("out"), Vec::new(), Vec::new());
        s.training_job = Some(JOB);
        let finds = s.trained(JOB, TrainedRun { evaluations, out, semantics, runs, stopped_at: None, facts });
        let carried = s.has_carried_objects;
        s.set_semantics(Some(Arc::default()));
        assert!(!s.has_carried_objects, "objects that are found are news");
        (finds, carried)
    };
    assert_eq!(end(true, None), (true, false));
    assert_eq!(end(true, Some(Arc::default())), (false, true), "they came along");
    assert_eq!(end(false, None), (false, false));
}

#[test]
fn a_stopped_training_says_how_far_it_came() {
    let end = |stopped_at| {
        let mut s = AppState {
            resumable: Some((TrainConfig { steps: 150, ..TrainConfig::default() }, 0)),
            ..AppState::default()
        };
        let (facts, runs) = (SceneFacts::default(), Vec::new());
        let (evaluations, out, semantics) = (Vec::new(), PathBuf::from("out"), None);
        s.trained(JOB, TrainedRun { evaluations, out, semantics, runs, stopped_at, facts });
        s.toasts.last().map(|toast| toast.text.clone()).expect("a message")
    };
    assert_eq!(end(Some(92)), "Training stopped at step 92 of 150, saved");
    assert_eq!(end(None), "Training finished", "the control");
}

#[test]
fn the_recent_list_is_short_and_has_no_doubles() {
    let mut s = AppState::default();
    for i in (0..20).chain([19, 15]) {
        s.remember(PathBuf::from(i.to_string()));
    }
    assert_eq!(s.recent.len(), MAX_RECENT);
    assert_eq!(s.recent[..2], [PathBuf::from("15"), PathBuf::from("19")]);
    let folder = tempfile::tempdir().expect("folder");
    let [own, other] = ["fox", "other"].map(|name| folder.path().join(name));
    for path in [&own, &other] {
        std::fs::create_dir(path).expect("created");
    }
    s.recent.clear();
    for path in [other.join("../fox"), other.clone(), own.clone()] {
        s.remember(path);
    }
    assert_eq!(s.recent, [own, other], "one place, by its last path");
}

#[test]
fn foreign_text_is_cleaned_on_its_way_to_the_window() {
    let evil = "a\u{1b}[31m\u{202e}b\u{9b}\nc";
    let progress = Progress { stage: evil.into(), done: 1, total: 2, elapsed_secs: 1.0, rate: 1.0 };
    let mut s = fold([
        Event::Started(JOB, JobInfo::long(evil).makes(Makes::Gaussians)),
        Event::Progress(JOB, progress),
        Event::Note(JOB, Severity::Warning, evil.into()),
    ]);
    s.toast(Tone::Info, evil);
    s.fail(evil, Failure::new(evil, evil));
    let job = s.job.as_ref().expect("a job");
    let error = s.error.as_ref().expect("an error");
    let one_line = s.log.iter().map(|l| &l.text).chain([&job.info.title, &error.doing]);
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
    let mut s = fold([started(Makes::Gaussians), step(250), Event::Progress(JOB, progress)]);
    s.resumable = Some((config.clone(), 0));
    assert_eq!(s.continues_at(&config), None, "nothing is stopped yet");
    s.apply(canceled(JOB));
    assert_eq!(s.continues_at(&config), Some(253));
    let seldom = TrainConfig { eval_every: 9, checkpoint_secs: 1.0, ..config.clone() };
    assert_eq!(s.continues_at(&seldom), Some(253), "looking at it changes nothing");
    assert_eq!(s.continues_at(&TrainConfig { seed: 1, ..config.clone() }), None, "that is another training");
    assert_eq!(s.continues_at(&TrainConfig { steps: 253, ..config }), None, "it is done");
}

#[test]
fn the_training_before_stays_to_be_compared_with() {
    let mut s = fold([started(Makes::Gaussians), step(10), step(20), canceled(JOB), started(Makes::Gaussians)]);
    s.apply(step(30));
    assert!(s.previous.steps.is_empty(), "it went on");
    s.apply(canceled(JOB));
    s.apply(started(Makes::Gaussians));
    s.apply(step(10));
    assert_eq!((s.history.steps.len(), s.previous.steps.len()), (1, 3));
    open(&mut s, "other", &[]);
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

#[test]
fn a_training_without_a_step_puts_back_what_it_replaced() {
    let config = TrainConfig::default();
    for (reached, steps, is_undone) in
        [(None, 0, true), (None, 100, false), (Some(100), 0, true), (Some(100), 101, false)]
    {
        let mut s = AppState { resumable: Some((config.clone(), 100)), ..AppState::default() };
        s.history.push(StepMetrics { step: 100, ..StepMetrics::default() });
        s.set_semantics(Some(Arc::new(SemanticMap::default())));
        let before = s.before_training(reached);
        s.begin_training(TrainConfig { steps: 7, ..config.clone() }, reached);
        s.apply(started(Makes::Gaussians));
        assert!(s.semantics.is_none() && s.history.steps.is_empty() == reached.is_none());
        assert_eq!(s.trains_anew(), reached.is_none());
        if steps > 0 {
            s.apply(step(steps));
        }
        s.apply(canceled(JOB));
        assert_eq!(s.undo_start(before), is_undone, "{reached:?}, {steps}");
        assert_eq!(s.semantics.is_some(), is_undone);
        assert_eq!(s.resumable.as_ref().is_some_and(|(config, _)| config.steps != 7), is_undone);
        assert_eq!(s.history.steps.len(), if reached.is_some() && !is_undone { 2 } else { 1 });
    }
}
