//! The running job and its remaining time.

use super::AppState;
use crate::jobs::phases::WholeProgress;
use crate::math::format;
use crate::pipeline::observer::Progress;
use crate::worker::{JobId, JobInfo, Makes};

/// Time constant of the average over forecasts, s.
const FORECAST_SECS: f64 = 30.0;

/// The running long job.
#[derive(Clone, Debug, PartialEq)]
pub struct RunningJob {
    pub(crate) id: JobId,
    pub(crate) info: JobInfo,
    pub(crate) progress: Option<Progress>,
    /// Progress over all phases of the job.
    pub(crate) whole: WholeProgress,
    /// Remaining time in s, if known: a moving average, as the forecasts from rates jump.
    pub(crate) left_secs: Option<f64>,
    /// Stage whose rate the remaining time is from.
    left_stage: String,
    /// True if the job is paused.
    pub paused: bool,
    /// True if cancellation was requested.
    pub canceling: bool,
}

impl RunningJob {
    pub(super) fn begun(id: JobId, info: JobInfo) -> Self {
        let whole = info.whole.clone();
        Self {
            id,
            info,
            progress: None,
            whole,
            left_secs: None,
            left_stage: String::new(),
            paused: false,
            canceling: false,
        }
    }

    /// Title, with a note if the job is paused or being stopped.
    pub(crate) fn text(&self) -> String {
        match (self.canceling, self.paused) {
            (true, _) => format!("{}: stopping\u{2026}", self.info.title),
            (_, true) => format!("{} (paused)", self.info.title),
            _ => self.info.title.clone(),
        }
    }

    /// Question whether to end it now.
    pub(crate) fn stop_question(&self) -> String {
        let what = match self.info.makes {
            Makes::Gaussians => "the training".to_owned(),
            _ => format!("\u{201c}{}\u{201d}", self.info.title),
        };
        format!("Stop {what}? {}", self.leaves())
    }

    /// Sentence on what is left of the job if it is ended now.
    pub(crate) fn leaves(&self) -> &'static str {
        match self.info.makes {
            Makes::Gaussians => "It is saved, and can be continued.",
            Makes::Objects => "It goes on where it was next time.",
            Makes::SceneBeside => "It is saved, and goes on when the same photos are added again.",
            Makes::Scene | Makes::Nothing => "What it has done so far is discarded.",
        }
    }

    /// Done fraction of the whole job; `None` if nothing is counted.
    pub(crate) fn fraction(&self) -> Option<f32> {
        let is_counted = self.whole.is_planned() || self.progress.as_ref().is_some_and(|p| p.total > 0);
        is_counted.then(|| self.whole.fraction() as f32)
    }

    /// Stage, count and remaining time for display: "Closing surfaces  2 of 3  ·  about 40 s left".
    pub(crate) fn stage_text(&self) -> String {
        let Some(progress) = &self.progress else { return String::new() };
        let counted = progress.counted().map_or_else(|| "\u{2026}".into(), |counted| format!("  {counted}"));
        let left = self.left_secs.filter(|_| !self.paused).map_or_else(String::new, |secs| {
            let time = format::about(secs);
            let about = if self.whole.is_guess() && !time.starts_with("about") { "about " } else { "" };
            format!("  \u{b7}  {about}{time} left")
        });
        format!("{}{counted}{left}", progress.stage)
    }

    pub(super) fn goes_on(&mut self, progress: Progress) {
        let (secs, is_planned) = (self.whole.secs(), self.whole.is_planned());
        self.whole.take(&progress);
        let before = self.progress.replace(progress.clone()).filter(|p| is_planned || p.stage == progress.stage);
        let before = before.and(self.left_secs).map(|left| (self.whole.secs() - secs, left));
        let with_later = |left: f64| Some(left + self.whole.later_secs(left)?);
        let is_of_stage = self.left_stage == progress.stage;
        let now = progress.eta_secs().filter(|_| progress.done > 0 || !is_planned).and_then(with_later);
        if now.is_some() {
            self.left_stage.clone_from(&progress.stage);
        }
        self.left_secs = match (now, before) {
            // What another phase let expect was a guess.
            (Some(now), Some((step, left))) if is_of_stage => {
                let expected = left - step;
                let smooth = expected + (now - expected) * (1.0 - (-step.max(0.0) / FORECAST_SECS).exp());
                // At least half the forecast by the mean rate: a first rate may have been far too high.
                let average = progress.elapsed_secs * progress.total as f64 / progress.done.max(1) as f64;
                let average = with_later((average - progress.elapsed_secs).max(0.0)).unwrap_or(now);
                Some(smooth.max(0.5 * average.min(now)).max(0.0))
            }
            // Other phases follow.
            (None, Some((step, left))) if self.whole.is_guess() => Some((left - step).max(0.0)),
            // All counted work is done, or nothing is counted.
            _ if progress.done >= progress.total => None,
            (now, before) => now.or(before.map(|(_, left)| left)),
        };
    }
}

impl AppState {
    /// The running job with this number, long or short.
    pub(crate) fn running(&self, job: JobId) -> Option<&RunningJob> {
        self.job.as_ref().filter(|j| j.id == job).or(self.short_jobs.get(&job))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::phases;

    fn at(done: u64, elapsed_secs: f64, rate: f64) -> Progress {
        Progress { stage: "Training".into(), done, total: 3_000, elapsed_secs, rate }
    }

    #[test]
    fn the_question_whether_to_stop_says_what_is_left() {
        let of = |makes| RunningJob::begun(JobId::Local(1), JobInfo::long("Exporting").makes(makes)).stop_question();
        assert_eq!(of(Makes::Gaussians), "Stop the training? It is saved, and can be continued.");
        let beside = of(Makes::SceneBeside);
        assert!(beside.starts_with("Stop \u{201c}Exporting\u{201d}?") && beside.contains("is saved"), "{beside}");
        let control = of(Makes::Nothing);
        assert!(control.starts_with("Stop \u{201c}Exporting\u{201d}?") && control.contains("discarded"), "{control}");
    }

    #[test]
    fn a_forecast_does_not_follow_every_jump_of_the_rate() {
        let mut job = RunningJob::begun(JobId::Local(1), JobInfo::long("Training"));
        job.goes_on(at(0, 0.0, 0.0));
        assert_eq!(job.left_secs, None, "nothing is known yet");
        job.goes_on(at(10, 1.0, 10.0));
        assert_eq!(job.left_secs, Some(299.0));
        // One second at a tenth of the rate, which alone would forecast 2,990 s.
        job.goes_on(at(11, 2.0, 1.0));
        let left = job.left_secs.expect("known");
        assert!((299.0..400.0).contains(&left), "{left}");
        // A lasting slowdown determines the forecast.
        (0..200).for_each(|i| job.goes_on(at(11 + i, 3.0 + i as f64, 1.0)));
        assert!((job.left_secs.expect("known") - 2_790.0).abs() < 60.0, "{:?}", job.left_secs);
        // The first of 48 views took an instant, each later one a second.
        let mut job = RunningJob::begun(JobId::Local(1), JobInfo::long("Removing"));
        let view = |i: u64, rate| Progress { total: 48, ..at(i, i as f64, rate) };
        job.goes_on(view(1, 100.0));
        (2..20).for_each(|i| job.goes_on(view(i, 1.0)));
        assert!((14.0..40.0).contains(&job.left_secs.expect("known")), "{:?}", job.left_secs);
        job.goes_on(Progress { stage: "Saving".into(), ..at(0, 0.5, 100.0) });
        assert_eq!(job.left_secs, Some(30.0), "another stage begins anew");
        job.goes_on(Progress { stage: "Saving".into(), ..at(3_000, 30.5, 100.0) });
        assert_eq!(job.left_secs, None, "what is done leaves nothing");
    }

    #[test]
    fn phases_share_one_bar_and_one_remaining_time() {
        let info = JobInfo::long("Exporting").phases(phases::EXPORT);
        let mut job = RunningJob::begun(JobId::Local(1), info);
        assert_eq!((job.fraction(), job.stage_text().as_str()), (Some(0.0), ""));
        let at = |stage: &str, done| Progress { stage: stage.into(), total: 70, ..at(done, done as f64, 1.0) };
        job.goes_on(at("Writing Gaussians", 35));
        assert_eq!((job.fraction(), job.left_secs), (Some(0.35), Some(65.0)), "35 s, and 30 s of the other phase");
        assert_eq!(job.stage_text(), "Writing Gaussians  35 of 70  \u{b7}  about 70 s left");
        job.goes_on(at("Writing Gaussians", 70));
        assert_eq!((job.fraction(), job.left_secs), (Some(0.7), Some(30.0)));
        job.goes_on(at("Measuring the loss", 0));
        assert_eq!((job.fraction(), job.left_secs), (Some(0.7), Some(30.0)), "it goes on from there");
        job.goes_on(at("Measuring the loss", 70));
        assert_eq!((job.fraction(), job.left_secs), (Some(1.0), None));
        // A second for the photos does not make minutes of the training.
        let mut job = RunningJob::begun(JobId::Local(1), JobInfo::long("Training").phases(phases::TRAINING));
        job.goes_on(Progress { rate: 10.0, ..at("Loading photos", 35) });
        assert_eq!(job.left_secs, None);
        job.goes_on(at("Training", 10));
        assert!((60.0..65.0).contains(&job.left_secs.expect("known")), "{:?}", job.left_secs);
        // Control: a job of unknown phases has a bar for each, and none while nothing is counted.
        let mut job = RunningJob::begun(JobId::Local(1), JobInfo::long("Exporting"));
        assert_eq!(job.fraction(), None);
        job.goes_on(at("Writing Gaussians", 70));
        job.goes_on(at("Measuring the loss", 7));
        assert_eq!(job.fraction(), Some(0.1));
    }
}
