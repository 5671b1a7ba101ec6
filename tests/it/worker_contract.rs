//! The worker's contract: every job ends exactly once, whatever happens in it, and nothing but
//! progress is ever lost.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use fmlgs::pipeline::observer::{Observer, Progress, Severity, Signal, StepMetrics};
use fmlgs::scene::GaussianCloud;
use fmlgs::worker::{Event, Failure, JobEnd, JobId, JobInfo, QueueFull, Stop, Task, Tasks};

const LONG: Duration = Duration::from_secs(20);

/// Job that acts by its name.
fn script(name: &'static str, observer: &mut dyn Observer) -> Result<&'static str, Stop> {
    match name {
        "panic" => panic!("the script says so"),
        "panic in a pool" => {
            rayon::join(|| (), || assert!(name.is_empty(), "deep down"));
        }
        "fail" => return Err(Stop::Failed(Failure::new("no", "never"))),
        "until cancelled" => loop {
            match observer.signal() {
                Signal::Cancel => return Err(Stop::Cancelled),
                Signal::Pause | Signal::Continue => std::thread::sleep(Duration::from_millis(1)),
            }
        },
        "talk" => {
            for i in 0..5_000 {
                observer.progress(progress(i));
                observer.step(StepMetrics { step: i, ..StepMetrics::default() });
                observer.note(Severity::Info, i.to_string());
            }
        }
        "clouds" => {
            let start = Instant::now();
            let mut given = 0;
            while start.elapsed() < Duration::from_millis(1_000) {
                if observer.wants_cloud() {
                    observer.cloud(Arc::new(GaussianCloud::default()), given);
                    given += 1;
                }
            }
            observer.note(Severity::Info, given.to_string());
        }
        _ => {}
    }
    Ok(name)
}

fn progress(done: u64) -> Progress {
    Progress { stage: "Talking".into(), done, total: 5_000, elapsed_secs: 0.0, rate: 0.0 }
}

fn worker() -> Tasks {
    Tasks::start(Arc::new(|| ())).expect("threads")
}

/// Starts a long job.
fn start(worker: &Tasks, name: &'static str) -> Task<&'static str> {
    worker.spawn(JobInfo::long(name), move |observer| script(name, observer)).expect("room")
}

/// Events of `job` up to its end.
fn run(worker: &Tasks, job: JobId) -> Vec<Event> {
    let mut events = Vec::new();
    loop {
        let event = worker.wait_event(LONG).expect("the job ends");
        if event.job() == job {
            events.push(event);
            if events.last().is_some_and(Event::is_end) {
                return events;
            }
        }
    }
}

#[test]
fn every_job_starts_once_and_ends_once() {
    let worker = worker();
    let scripts = ["fine", "panic", "fail", "panic in a pool", "fine"];
    let tasks: Vec<_> = scripts.iter().map(|s| start(&worker, s)).collect();
    let mut events = Vec::new();
    while events.iter().filter(|e: &&Event| e.is_end()).count() < tasks.len() {
        events.push(worker.wait_event(LONG).expect("they end"));
    }
    assert!(worker.wait_event(Duration::from_millis(100)).is_none(), "nothing comes after the ends");
    for (task, script) in tasks.iter().zip(scripts) {
        let own: Vec<&Event> = events.iter().filter(|e| e.job() == task.job()).collect();
        assert!(matches!(own.first(), Some(Event::Started(..))), "{script}");
        assert_eq!(own.len(), 2, "{script}: {own:?}");
        let result = task.poll().expect("it has ended");
        let right = match script {
            "fine" => matches!(own[1], Event::Ended(_, JobEnd::Finished)) && result == Ok("fine"),
            _ => matches!(own[1], Event::Ended(_, JobEnd::Failed(_))) && matches!(result, Err(Stop::Failed(_))),
        };
        assert!(right, "{script}: {:?} {result:?}", own[1]);
    }
}

#[test]
fn a_panic_says_what_happened_and_the_worker_lives_on() {
    let worker = worker();
    let job = start(&worker, "panic").job();
    let Some(Event::Ended(_, JobEnd::Failed(failure))) = run(&worker, job).pop() else { panic!("it must fail") };
    assert!(failure.message.contains("the script says so"), "{failure:?}");
    let job = start(&worker, "fine").job();
    assert!(matches!(run(&worker, job).pop(), Some(Event::Ended(_, JobEnd::Finished))));
}

#[test]
fn running_and_waiting_jobs_can_be_cancelled() {
    let worker = worker();
    let (running, waiting) = (start(&worker, "until cancelled"), start(&worker, "fine"));
    worker.cancel(waiting.job());
    std::thread::sleep(Duration::from_millis(20));
    worker.cancel(running.job());
    for task in [running, waiting] {
        assert!(matches!(run(&worker, task.job()).pop(), Some(Event::Ended(_, JobEnd::Cancelled))));
        assert_eq!(task.poll(), Some(Err(Stop::Cancelled)));
    }
}

#[test]
fn pausing_is_reported_when_it_takes_hold() {
    let worker = worker();
    let job = start(&worker, "until cancelled").job();
    worker.set_paused(job, true);
    let next = || worker.wait_event(LONG).expect("an event");
    assert!(matches!(next(), Event::Started(..)));
    assert!(matches!(next(), Event::Paused(_, true)));
    worker.set_paused(job, false);
    assert!(matches!(next(), Event::Paused(_, false)));
    worker.cancel(job);
    assert!(matches!(next(), Event::Ended(_, JobEnd::Cancelled)));
}

#[test]
fn a_slow_window_loses_progress_and_nothing_else() {
    let worker = worker();
    let job = start(&worker, "talk").job();
    // Nobody takes events for a while: the channel fills up, and the job waits.
    std::thread::sleep(Duration::from_millis(200));
    let events = run(&worker, job);
    let steps: Vec<u64> =
        events.iter().filter_map(|e| if let Event::Step(_, m) = e { Some(m.step) } else { None }).collect();
    assert_eq!(steps, (0..5_000).collect::<Vec<_>>());
    assert_eq!(events.iter().filter(|e| matches!(e, Event::Note(..))).count(), 5_000);
    let progress = events.iter().filter(|e| matches!(e, Event::Progress(..))).count();
    assert!(progress > 0 && progress < 5_000, "{progress} of 5,000 progress events came");
}

#[test]
fn short_jobs_are_answered_while_a_long_one_runs() {
    let worker = worker();
    let long = start(&worker, "until cancelled").job();
    let short = worker.spawn(JobInfo::short("fine"), |observer| script("fine", observer)).expect("room").job();
    assert!(matches!(run(&worker, short).pop(), Some(Event::Ended(_, JobEnd::Finished))));
    worker.cancel(long);
    assert!(matches!(run(&worker, long).pop(), Some(Event::Ended(_, JobEnd::Cancelled))));
}

#[test]
fn clouds_are_wanted_about_three_times_a_second_and_only_the_latest_is_kept() {
    let worker = worker();
    let job = start(&worker, "clouds").job();
    let events = run(&worker, job);
    let given: u64 = events
        .iter()
        .find_map(|e| if let Event::Note(_, _, text) = e { text.parse().ok() } else { None })
        .expect("the script says how many");
    assert!((2..=4).contains(&given), "{given} clouds in a second");
    let (generation, latest) = worker.clouds().newer_than(0).expect("a cloud");
    assert_eq!((generation, latest.step), (given, given - 1));
    assert_eq!(latest.job, job);
}

#[test]
fn a_full_queue_is_refused() {
    let worker = worker();
    let first = start(&worker, "until cancelled").job();
    let mut jobs = vec![first];
    let refusal = loop {
        match worker.spawn(JobInfo::long("fine"), |observer| script("fine", observer)) {
            Ok(task) => jobs.push(task.job()),
            Err(e) => break e,
        }
        assert!(jobs.len() < 1_000, "the queue is bounded");
    };
    assert_eq!(refusal, QueueFull);
    worker.cancel(first);
    let mut ends = 0;
    while ends < jobs.len() {
        ends += usize::from(worker.wait_event(LONG).expect("they end").is_end());
    }
}

#[test]
fn every_event_asks_for_a_redraw() {
    let asked = Arc::new(AtomicUsize::new(0));
    let counter = Arc::clone(&asked);
    let repaint = Arc::new(move || {
        counter.fetch_add(1, Ordering::Relaxed);
    });
    let worker = Tasks::start(repaint).expect("threads");
    let job = start(&worker, "fine").job();
    let events = run(&worker, job).len();
    // The last call comes right after its event.
    std::thread::sleep(Duration::from_millis(50));
    assert_eq!(asked.load(Ordering::Relaxed), events);
}

#[test]
fn the_end_of_the_program_ends_running_jobs() {
    let worker = worker();
    start(&worker, "until cancelled").job();
    start(&worker, "talk").job();
    let start = Instant::now();
    drop(worker);
    assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
}
