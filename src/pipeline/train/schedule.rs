//! Learning rates and milestones of a run, scaled to its number of steps.
//!
//! The values of 3DGS are for 30,000 steps; a run of `n` steps goes through the same phases.

use super::TrainConfig;
use crate::render::{AdamStep, Rates};

/// Number of steps of 3DGS's milestones.
const REFERENCE_STEPS: f64 = 30_000.0;
/// Intervals of density control in the steps of a refinement.
const REFINING_ROUNDS: u64 = 25;

/// Learning rates and milestones of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    steps: u64,
    /// Step from which a refinement goes on; 0 in other runs.
    from: u64,
    sh_degree: u8,
    extent: f64,
    /// Factor on every rate, lowered after a divergence.
    pub damping: f64,
    /// Steps between activations of SH bands; 0 = all are active.
    pub(crate) sh_interval: u64,
    /// First step at which Gaussians may be added.
    pub(crate) densify_from: u64,
    /// Last step at which Gaussians may be added.
    pub(crate) densify_until: u64,
    pub(crate) densify_interval: u64,
    pub(crate) reset_interval: u64,
}

impl Schedule {
    /// Schedule of a run in a scene of this extent (see `Dataset::camera_extent`).
    pub(crate) fn new(config: &TrainConfig, extent: f64) -> Self {
        let n = config.steps as f64;
        let scaled = |reference: f64| (reference * n / REFERENCE_STEPS).round() as u64;
        Self {
            steps: config.steps,
            from: 0,
            sh_degree: config.sh_degree,
            extent,
            damping: 1.0,
            sh_interval: if config.sh_at_once { 0 } else { scaled(2_000.0).clamp(1, 1_000) },
            densify_from: scaled(1_000.0).clamp(50, 500),
            densify_until: scaled(17_000.0),
            densify_interval: scaled(400.0).clamp(20, 100),
            // Not scaled: a short run has no time to recover from a reset.
            reset_interval: 3_000,
        }
    }

    /// Schedule of a refinement that goes on from a step: all bands of color are open, Gaussians are added in the first
    /// part, and no opacity is reset.
    pub(crate) fn refining(config: &TrainConfig, extent: f64, from: u64) -> Self {
        let n = config.steps.saturating_sub(from);
        let densify_interval = (n / REFINING_ROUNDS).clamp(10, 100);
        Self {
            from,
            sh_interval: 0,
            densify_from: from + densify_interval,
            densify_until: from + n * 2 / 5,
            densify_interval,
            reset_interval: u64::MAX,
            ..Self::new(config, extent)
        }
    }

    /// Steps of this run that are done at `step`.
    pub(crate) fn done(&self, step: u64) -> u64 {
        step.saturating_sub(self.from)
    }

    /// Rates at `step`, counted from 0: exponential decay by 100 for positions, constant otherwise. In a refinement all
    /// end low, so that photos which agreed before agree again; positions begin well above the end of training.
    pub(crate) fn rates(&self, step: u64) -> Rates {
        let t = self.done(step) as f64 / self.done(self.steps).max(1) as f64;
        let (begin, settle) = if self.from > 0 { (0.25, 0.03_f64.powf(t)) } else { (0.0, 1.0) };
        let position = 1.6e-4 * self.extent * 0.01_f64.powf(begin + t * (1.0 - begin));
        let rate = |r: f64| (r * settle * self.damping) as f32;
        Rates {
            position: (position * self.damping) as f32,
            log_scale: rate(5e-3),
            quaternion: rate(1e-3),
            opacity_logit: rate(5e-2),
            sh_constant: rate(2.5e-3),
            // 3DGS divides by 20, with which short runs hardly learn them (docs/notes/density-control.md).
            sh_rest: rate(2.5e-3 / 8.0),
        }
    }

    /// SH degree in use at `step`.
    pub(crate) fn sh_degree(&self, step: u64) -> u8 {
        step.checked_div(self.sh_interval).map_or(self.sh_degree, |open| open.min(u64::from(self.sh_degree)) as u8)
    }

    /// Returns whether Gaussians are added and removed after `done` steps.
    pub(crate) fn densifies(&self, done: u64) -> bool {
        let is_due = self.done(done) % self.densify_interval == 0;
        done >= self.densify_from && done <= self.densify_until && is_due
    }

    /// Rounds of density control left after `done` steps, including the present one.
    pub(crate) fn rounds_left(&self, done: u64) -> u64 {
        self.densify_until.saturating_sub(done) / self.densify_interval + 1
    }

    /// Returns whether opacities are reset after `done` steps. Never near the end of density control, so that Gaussians
    /// can recover or be removed after a reset.
    pub(crate) fn resets(&self, done: u64) -> bool {
        done > 0 && done % self.reset_interval == 0 && done + self.densify_interval * 5 <= self.densify_until
    }

    /// Adam's constants for the step after `step`.
    pub(crate) fn adam(&self, step: u64) -> AdamStep {
        AdamStep::new(self.done(step) + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn schedule(steps: u64) -> Schedule {
        Schedule::new(&TrainConfig { steps, ..TrainConfig::default() }, 2.0)
    }

    #[test]
    fn rates_decay_to_a_hundredth() {
        let s = schedule(1_000);
        let (a, b) = (s.rates(0).position, s.rates(1_000).position);
        assert!((a - 3.2e-4).abs() < 1e-9 && (a / b - 100.0).abs() < 1e-2);
        assert_eq!(s.rates(0).opacity_logit, s.rates(999).opacity_logit);
    }

    #[test]
    fn a_refinement_begins_low_ends_lower_and_resets_nothing() {
        let config = TrainConfig { steps: 7_900, ..TrainConfig::default() };
        let (s, end) = (Schedule::refining(&config, 2.0, 7_000), schedule(7_000).rates(7_000));
        let [first, last] = [7_000, 7_900].map(|step| s.rates(step));
        assert!(first.position > 5.0 * end.position && last.position < 1.01 * end.position);
        assert!(first.opacity_logit == end.opacity_logit && last.opacity_logit < 0.05 * end.opacity_logit);
        assert_eq!(s.sh_degree(7_000), 3);
        assert!(!(7_000..=7_900).any(|done| s.resets(done)));
        let rounds: Vec<u64> = (7_000..=7_900).filter(|done| s.densifies(*done)).collect();
        assert!(rounds.len() >= 10 && rounds.last().is_some_and(|last| *last <= 7_360), "{rounds:?}");
        assert!(rounds.iter().zip((1..=rounds.len() as u64).rev()).all(|(done, left)| s.rounds_left(*done) == left));
        let first_step = |s: &Schedule, step| s.adam(step).first_correction;
        assert_eq!(first_step(&s, 7_000), first_step(&schedule(7_000), 0), "its moments begin at zero");
    }

    #[test]
    fn every_length_goes_through_all_phases() {
        for steps in [300, 2_000, 7_000, 30_000] {
            let s = schedule(steps);
            assert_eq!(s.sh_degree(0), 0);
            assert_eq!(s.sh_degree(steps), 3, "{steps}");
            let rounds = (1..=steps).filter(|&d| s.densifies(d)).count();
            assert!(rounds >= 4, "{steps}: {rounds}");
            let at = (1..=steps).filter(|&d| s.densifies(d));
            assert!(at.zip((1..=rounds as u64).rev()).all(|(d, left)| s.rounds_left(d) == left));
            assert!((1..=steps).rev().take(steps as usize / 3).all(|d| !s.densifies(d) && !s.resets(d)));
        }
    }
}
