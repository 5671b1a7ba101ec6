//! Phases of jobs with their shares of the time, for one progress over a whole job that never goes back.

use crate::pipeline::observer::Progress;

/// Phase of a job: the beginning of its stage's name, and its share of the job's time in percent, by experience.
type Phase = (&'static str, f64);

/// Least share of the phases up to the present one from whose time that of the others is told.
const LEAST_SHARE: f64 = 0.2;

/// Phases of a training.
pub(crate) const TRAINING: &[Phase] = &[("Loading photos", 2.0), ("Training", 96.0), ("Measuring", 2.0)];
/// Phases of finding objects and parts. A phase that is not needed is skipped.
pub(crate) const FINDING: &[Phase] = &[
    ("Counting labels", 2.0),
    ("Analyzing photos", 8.0),
    ("Finding masks", 25.0),
    ("Tracking masks", 15.0),
    ("Checking labels", 6.0),
    ("Preparing selection", 14.0),
    ("Completing identities", 10.0),
    ("Checking labels", 6.0),
    ("Choosing views of the objects", 4.0),
    ("Embedding objects and parts", 12.0),
    ("Training codes", 10.0),
];
/// Phases of adding photos to a scene.
pub(crate) const ADDING: &[Phase] = &[
    ("Looking at the scene", 2.0),
    ("Locating photos", 6.0),
    ("Loading added photos", 1.0),
    ("Loading photos", 1.0),
    ("Comparing photos", 3.0),
    ("Comparing new photos", 2.0),
    ("Looking for photos of what is refined", 2.0),
    ("Loading photos", 1.0),
    ("Training", 78.0),
    ("Measuring", 2.0),
    ("Finding parts in close-ups", 2.0),
];
/// Phases of a removal.
pub(crate) const REMOVAL: &[Phase] = &[
    ("Finding hidden surfaces", 30.0),
    ("Looking at what was hidden", 20.0),
    ("Closing surfaces", 40.0),
    ("Finding hidden surfaces", 10.0),
];
/// Phases of a removal with a training after it.
pub(crate) const RETRAINING: &[Phase] = &[
    ("Finding hidden surfaces", 3.0),
    ("Looking at what was hidden", 2.0),
    ("Closing surfaces", 4.0),
    ("Finding hidden surfaces", 1.0),
    ("Photos without it", 5.0),
    ("Loading photos", 1.0),
    ("Training", 82.0),
    ("Measuring", 2.0),
];
/// Phases of measuring Gaussians before they are cleaned.
pub(crate) const CLEANING: &[Phase] = &[
    ("Looking for neighbors", 15.0),
    ("Loading photos", 15.0),
    ("Looking for support in photos", 35.0),
    ("Comparing with the photos", 35.0),
];
/// Phases of finding camera poses.
pub(crate) const POSES: &[Phase] = &[
    ("Looking at the video", 6.0),
    ("Taking photos from the video", 4.0),
    ("Finding features", 18.0),
    ("Matching photos", 27.0),
    ("Finding camera poses", 45.0),
];
/// Phases of exporting Gaussians.
pub(crate) const EXPORT: &[Phase] = &[("Writing Gaussians", 70.0), ("Measuring the loss", 30.0)];
/// Phases of exporting everything.
pub(crate) const EXPORT_ALL: &[Phase] = &[("Writing Gaussians", 30.0), ("Writing masks", 70.0)];
/// Phases of rendering the demo.
pub(crate) const DEMO: &[Phase] = &[("Building the scene", 10.0), ("Rendering photos", 90.0)];

/// Progress over all phases of a job. Without phases, that of the present stage.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct WholeProgress {
    phases: &'static [Phase],
    /// Index of the phase in progress, once one has begun.
    at: Option<usize>,
    stage: String,
    /// Shares of the phases before, skipped ones left out.
    shares_before: f64,
    /// Seconds of the stages before, and of this one.
    secs_before: f64,
    stage_secs: f64,
    /// Done fraction, which never falls.
    fraction: f64,
}

impl WholeProgress {
    /// The progress of a job that has not begun yet.
    pub(crate) fn of(phases: &'static [Phase]) -> Self {
        Self { phases, ..Self::default() }
    }

    /// True if the phases of the job are known.
    pub(crate) fn is_planned(&self) -> bool {
        !self.phases.is_empty()
    }

    /// Takes a report.
    pub(crate) fn take(&mut self, report: &Progress) {
        let fraction = if report.total > 0 { report.done as f64 / report.total as f64 } else { 0.0 };
        if self.stage != report.stage {
            self.secs_before += std::mem::take(&mut self.stage_secs);
            self.stage.clone_from(&report.stage);
            let first = self.at.unwrap_or(0);
            let is_it = |phase: &Phase| report.stage.starts_with(phase.0);
            if let Some(next) = self.phases.iter().skip(first).position(is_it).map(|n| n + first)
                && self.at != Some(next)
            {
                self.shares_before += self.at.map_or(0.0, |at| self.phases[at].1);
                self.at = Some(next);
            }
        }
        self.stage_secs = report.elapsed_secs;
        if !self.is_planned() {
            self.fraction = fraction;
        } else if let Some((at, is_listed)) = self.at.map(|at| (at, self.stage.starts_with(self.phases[at].0))) {
            let own = self.phases[at].1;
            // A stage that is in no plan does not move the bar.
            let now = if is_listed { own * fraction } else { 0.0 };
            let whole = (self.shares_before + now) / (self.shares_before + own + self.later());
            self.fraction = self.fraction.max(whole);
        }
    }

    /// Done fraction of the job.
    pub(crate) fn fraction(&self) -> f64 {
        self.fraction
    }

    /// Seconds of work so far.
    pub(crate) fn secs(&self) -> f64 {
        self.secs_before + self.stage_secs
    }

    /// Seconds of the phases to come, if the present stage needs another `stage_left` s. `None` in a phase that is too
    /// short to tell.
    pub(crate) fn later_secs(&self, stage_left: f64) -> Option<f64> {
        let Some(at) = self.at else { return Some(0.0) };
        let so_far = self.shares_before + self.phases[at].1;
        let is_told = so_far >= LEAST_SHARE * (so_far + self.later());
        is_told.then(|| self.later() * (self.secs() + stage_left) / so_far)
    }

    /// True if phases follow whose time is a guess.
    pub(crate) fn is_guess(&self) -> bool {
        self.later() > 0.0
    }

    fn later(&self) -> f64 {
        self.at.map_or(0.0, |at| self.phases[at + 1..].iter().map(|phase| phase.1).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(stage: &str, done: u64, elapsed_secs: f64) -> Progress {
        Progress { stage: stage.into(), done, total: 10, elapsed_secs, rate: 1.0 }
    }

    #[test]
    fn one_bar_serves_all_phases_and_never_goes_back() {
        let stages = [
            "Analyzing photos",
            "Finding masks in a.png",
            "Comparing 3 masks of a.png with what is known",
            "Checking labels",
            "Looking where most is still unknown",
            "Finding masks in b.png",
            "Checking labels",
            "Preparing selection",
            "Checking labels",
            "Training codes",
        ];
        let (mut whole, mut last) = (WholeProgress::of(FINDING), 0.0);
        for stage in stages {
            for done in 0..=10 {
                whole.take(&report(stage, done, done as f64));
                assert!(whole.fraction() >= last, "{stage} {done}: {} after {last}", whole.fraction());
                last = whole.fraction();
            }
            assert_eq!(last == 1.0, stage == "Training codes", "{stage}");
        }
        assert_eq!(whole.secs(), 100.0);
        // Control: without a plan, each stage has a bar of its own.
        let mut none = WholeProgress::of(&[]);
        none.take(&report("A", 10, 1.0));
        assert_eq!(none.fraction(), 1.0);
        none.take(&report("B", 1, 1.0));
        assert_eq!(none.fraction(), 0.1);
    }

    #[test]
    fn phases_to_come_take_as_long_as_their_shares_say() {
        let mut whole = WholeProgress::of(EXPORT);
        assert!(!whole.is_guess(), "nothing has begun");
        whole.take(&report("Writing Gaussians", 5, 35.0));
        assert_eq!((whole.is_guess(), whole.later_secs(35.0)), (true, Some(30.0)));
        whole.take(&report("Measuring the loss", 1, 3.0));
        assert_eq!((whole.is_guess(), whole.later_secs(27.0)), (false, Some(0.0)), "the last phase has none after it");
        let mut whole = WholeProgress::of(TRAINING);
        whole.take(&report("Loading photos", 5, 20.0));
        assert_eq!(whole.later_secs(20.0), None, "a slow disk says nothing of the training");
    }

    #[test]
    fn every_phase_is_a_stage_of_the_program() {
        fn sources(folder: &std::path::Path, all: &mut String) {
            for entry in std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()) {
                match entry.is_dir() {
                    true => sources(&entry, all),
                    false if entry.ends_with("phases.rs") => {}
                    false => all.push_str(&std::fs::read_to_string(entry).unwrap_or_default()),
                }
            }
        }
        let mut all = String::new();
        for folder in ["src/pipeline", "src/jobs"] {
            sources(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(folder), &mut all);
        }
        let is_stage = |name: &str| all.contains(&format!("\"{name}"));
        for (name, _) in
            [TRAINING, FINDING, ADDING, REMOVAL, RETRAINING, CLEANING, POSES, EXPORT, EXPORT_ALL, DEMO].concat()
        {
            assert!(is_stage(name), "{name}");
        }
        assert!(!is_stage("Looking for a stage that nobody reports"));
    }
}
