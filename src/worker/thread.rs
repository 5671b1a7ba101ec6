//! The two threads that run jobs, and the handle that feeds them.

use std::any::Any;
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, bounded};

use super::event::Event;
use super::failure::{Failure, Stop};
use super::observer::{CloudSnapshot, JobObserver, PosesSnapshot, Repaint};
use super::task::{JobEnd, JobId, JobInfo, JobLane, Task};
use super::{Control, RemotePhotos, Slot};
use crate::pipeline::observer::{Observer, Signal};

/// Events that may wait to be taken.
const EVENTS: usize = 1024;
/// Jobs that may wait on each lane.
const QUEUED: usize = 64;
/// Time that the end of the program waits for a job to reach a consistent state.
const FAREWELL: Duration = Duration::from_secs(5);

/// Too many jobs wait already.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{QUEUED} jobs are waiting already; try again when some are done")]
pub struct QueueFull;

/// The closure of a job, which gives the result to its task.
type Work = Box<dyn FnOnce(&mut JobObserver) -> JobEnd + Send>;

struct Queued {
    job: JobId,
    info: JobInfo,
    work: Work,
    control: Arc<Control>,
}

type Controls = Arc<Mutex<HashMap<JobId, Arc<Control>>>>;

/// A test's results in place of those of the jobs; `None` runs the job.
#[cfg(test)]
pub(crate) type Script = Box<dyn Fn(&JobInfo) -> Option<Result<Box<dyn Any + Send>, Stop>>>;

/// Runs jobs in the background. Dropping it cancels all of them and waits a few seconds.
pub struct Tasks {
    long: Option<Sender<Queued>>,
    short: Option<Sender<Queued>>,
    events: Option<Receiver<Event>>,
    clouds: Arc<Slot<CloudSnapshot>>,
    poses: Arc<Slot<PosesSnapshot>>,
    repaint: Repaint,
    remote_photos: Option<RemotePhotos>,
    controls: Controls,
    next: AtomicU64,
    threads: Vec<JoinHandle<()>>,
    #[cfg(test)]
    pub(crate) script: Option<Script>,
}

impl Tasks {
    /// Starts the threads. Fails only if the system gives none.
    pub fn start(repaint: Repaint) -> std::io::Result<Self> {
        let (event_sender, events) = bounded(EVENTS);
        let (clouds, poses) = (Arc::new(Slot::default()), Arc::new(Slot::default()));
        let controls = Controls::default();
        let mut threads = Vec::new();
        let mut lane = |name: &str, pool: Option<rayon::ThreadPool>| {
            let (sender, queue) = bounded::<Queued>(QUEUED);
            let (events, controls, repaint) = (event_sender.clone(), Arc::clone(&controls), repaint.clone());
            let slots = (Arc::clone(&clouds), Arc::clone(&poses));
            let work = move || {
                for queued in queue {
                    let yields = queued.info.lane == JobLane::Long;
                    let run = || run_one(queued, &events, &slots, &controls, &repaint);
                    match &pool {
                        Some(pool) if yields => pool.install(run),
                        _ => run(),
                    }
                }
            };
            threads.push(std::thread::Builder::new().name(name.to_owned()).spawn(work)?);
            Ok::<_, std::io::Error>(Some(sender))
        };
        let (long, short) = (lane("long jobs", super::low_priority_pool::pool())?, lane("short jobs", None)?);
        let (events, next) = (Some(events), AtomicU64::new(1));
        Ok(Self {
            long,
            short,
            events,
            clouds,
            poses,
            repaint,
            remote_photos: None,
            controls,
            next,
            threads,
            #[cfg(test)]
            script: None,
        })
    }

    /// Queues a job on its lane. The closure gets the job's observer; its result goes to the task.
    pub fn spawn<T, E>(
        &self,
        info: JobInfo,
        work: impl FnOnce(&mut dyn Observer) -> Result<T, E> + Send + 'static,
    ) -> Result<Task<T>, QueueFull>
    where
        T: Send + 'static,
        E: Into<Stop>,
    {
        let job = JobId::Local(self.next.fetch_add(1, Ordering::Relaxed));
        let (task, result) = Task::pair(job);
        #[cfg(test)]
        let scripted = self.scripted::<T>(&info);
        let work = Box::new(move |observer: &mut JobObserver| {
            #[cfg(test)]
            if let Some(scripted) = scripted {
                return result.give(scripted);
            }
            let done = catch_unwind(AssertUnwindSafe(|| work(observer).map_err(Into::into)))
                .unwrap_or_else(|payload| Err(Stop::Failed(panic_failure(payload.as_ref()))));
            result.give(done)
        });
        let control = Arc::new(Control::default());
        lock(&self.controls).insert(job, Arc::clone(&control));
        let lane = match info.lane {
            JobLane::Long | JobLane::Urgent => &self.long,
            JobLane::Short => &self.short,
        };
        let queued = Queued { job, info, work, control };
        if lane.as_ref().is_some_and(|l| l.try_send(queued).is_ok()) {
            return Ok(task);
        }
        lock(&self.controls).remove(&job);
        Err(QueueFull)
    }

    /// The result that the test's script has for a job.
    #[cfg(test)]
    fn scripted<T: 'static>(&self, info: &JobInfo) -> Option<Result<T, Stop>> {
        let result = self.script.as_ref()?(info)?;
        Some(result.map(|value| *value.downcast::<T>().unwrap_or_else(|_| panic!("{}: another type", info.title))))
    }

    /// Asks a job to end, whether it runs or waits. Does nothing if it is over.
    pub fn cancel(&self, job: JobId) {
        if let Some(c) = lock(&self.controls).get(&job) {
            c.cancel();
        }
    }

    /// Asks a job to wait or to go on. Does nothing if it is over.
    pub fn set_paused(&self, job: JobId, paused: bool) {
        if let Some(c) = lock(&self.controls).get(&job) {
            c.set_paused(paused);
        }
    }

    /// The next event, if one waits.
    pub(crate) fn next_event(&self) -> Option<Event> {
        self.events.as_ref()?.try_recv().ok()
    }

    /// The next event, waiting for it at most `limit`.
    pub fn wait_event(&self, limit: Duration) -> Option<Event> {
        self.events.as_ref()?.recv_timeout(limit).ok()
    }

    /// Slot in which the Gaussians in training are published.
    pub fn clouds(&self) -> &Slot<CloudSnapshot> {
        &self.clouds
    }

    /// Slot in which poses are published while they are sought.
    pub(crate) fn poses(&self) -> &Slot<PosesSnapshot> {
        &self.poses
    }

    /// The slot of Gaussians in training, for a training on another computer.
    pub(crate) fn shared_clouds(&self) -> Arc<Slot<CloudSnapshot>> {
        Arc::clone(&self.clouds)
    }

    /// The request of a redraw after each event.
    pub(crate) fn repaint(&self) -> Repaint {
        Arc::clone(&self.repaint)
    }

    /// Loads later photos from another computer, or from this one again.
    pub(crate) fn set_remote_photos(&mut self, photos: Option<RemotePhotos>) {
        self.remote_photos = photos;
    }

    pub(super) fn remote_photos(&self) -> Option<&RemotePhotos> {
        self.remote_photos.as_ref()
    }
}

impl Drop for Tasks {
    fn drop(&mut self) {
        for control in lock(&self.controls).values() {
            control.cancel();
        }
        // Without senders the lanes end after their jobs; without the receiver no job waits for
        // its events to be taken.
        (self.long, self.short, self.events) = (None, None, None);
        let start = Instant::now();
        while self.threads.iter().any(|t| !t.is_finished()) && start.elapsed() < FAREWELL {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

// Both maps and flags stay consistent if a holder panics: each change is a single call.
fn lock(controls: &Controls) -> MutexGuard<'_, HashMap<JobId, Arc<Control>>> {
    controls.lock().unwrap_or_else(PoisonError::into_inner)
}

fn run_one(
    queued: Queued,
    events: &Sender<Event>,
    (clouds, poses): &(Arc<Slot<CloudSnapshot>>, Arc<Slot<PosesSnapshot>>),
    controls: &Controls,
    repaint: &Repaint,
) {
    let Queued { job, info, work, control } = queued;
    let mut observer = JobObserver {
        job,
        control,
        events: events.clone(),
        clouds: Arc::clone(clouds),
        poses: Arc::clone(poses),
        repaint: repaint.clone(),
        last_cloud: None,
        paused: AtomicBool::new(false),
        alone: AtomicBool::new(false),
    };
    observer.send(Event::Started(job, info));
    let end = match observer.control.signal() {
        Signal::Cancel => {
            // The task knows before the event that there is no result.
            drop(work);
            JobEnd::Cancelled
        }
        Signal::Pause | Signal::Continue => work(&mut observer),
    };
    lock(controls).remove(&job);
    observer.send(Event::Ended(job, end));
}

/// Failure with the message of a panic, for display.
pub(super) fn panic_failure(payload: &(dyn Any + Send)) -> Failure {
    let text = payload
        .downcast_ref::<&str>()
        .map(|s| (*s).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".into());
    let remedy = "The scene on screen is unharmed. Please report this with the log.";
    Failure::new(format!("Internal error: {text}"), remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::observer::FoundSoFar;

    #[test]
    fn the_newest_poses_are_kept_with_their_search() {
        let tasks = Tasks::start(Arc::new(|| ())).expect("threads");
        let find = |observer: &mut dyn Observer| {
            for photos in [2, 3] {
                observer.poses(FoundSoFar { photos, ..FoundSoFar::default() });
            }
            Ok::<_, Stop>(observer.wants_poses())
        };
        assert!(tasks.poses().newer_than(0).is_none());
        let task = tasks.spawn(JobInfo::long("Finding camera poses"), find).expect("room");
        while !tasks.wait_event(Duration::from_secs(20)).expect("the job ends").is_end() {}
        assert_eq!(task.poll(), Some(Ok(true)));
        let (generation, snapshot) = tasks.poses().newer_than(0).expect("poses");
        assert_eq!((generation, snapshot.job, snapshot.found.photos), (2, task.job(), 3));
    }
}
