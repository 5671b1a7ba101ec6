//! Poses of training photos, refined while the scene is trained.
//!
//! A photo's pose is the given one and six numbers: a move along the given camera's axes and a turn about them. When
//! the photo has its turn, they take a damped Gauss-Newton step. Its slope is the rasterizer's own; its curvature is
//! that of the colors moving as their depth says, with the weights of the loss. Adam's steps of one length would take
//! moves and turns, which look alike in a picture, for one another. There is no state but the six numbers.
//!
//! A prior holds each pose to the given one: [`MOVE_DEVIATION`] and [`TURN_DEVIATION`] are what a pose is expected to be
//! off by. Changes far smaller than that in all photos are given back: the scene is never at rest, and would take right
//! poses with it. What no photo can tell, a move, turn and change of size of everything, is taken out after each step
//! ([`PoseGauge`]), unless some poses are held, which then hold the others.

use std::ops::Range;

use super::pose_gauge::PoseGauge;
use super::pose_offset::{MOVE_DEVIATION, PoseOffset, TURN_DEVIATION};
use crate::math::cholesky::solve;
use crate::pipeline::locate::{Curvature, PARAMETERS, hold_focal, moved};
use crate::render::PoseGradient;
use crate::scene::Camera;

/// Share of the steps before poses move: the scene must show something to align with.
const BEGIN: f64 = 0.1;
/// Least and most steps before poses move.
const BEGIN_STEPS: [u64; 2] = [100, 1_000];
/// Share of the steps after which poses rest, so that Gaussians settle.
const END: f64 = 0.9;
/// Share of the Gauss-Newton step that is taken at the begin and at the end; it falls exponentially.
const SHARE: [f64; 2] = [0.5, 0.05];
/// Largest step, in deviations of the prior.
const LARGEST: f64 = 0.5;
/// Share of a photo's change that it gives back at a turn where changes are as large as expected, and at most; in between
/// it falls by their mean square.
const SHRINKAGE: f64 = 0.0017;
const MOST_SHRINKAGE: f64 = 0.2;
/// Damping, by share of the curvature.
const DAMPING: f64 = 1e-2;

/// Slope and curvature of the loss by a photo's pose.
pub(super) struct PoseSlope {
    pub(super) gradient: PoseGradient,
    pub(super) curvature: Curvature,
    /// Weight of the prior, in the loss's units.
    pub(super) prior: f64,
}

/// The poses of the training photos.
#[derive(Debug)]
pub(crate) struct PoseRefiner {
    /// Changes of [`Self::given`].
    pub(super) offsets: Vec<PoseOffset>,
    given: Vec<Camera>,
    free: Vec<bool>,
    gauge: Option<PoseGauge>,
    /// Radius of the scene, scene units.
    pub(super) extent: f64,
    steps: Range<u64>,
}

impl PoseRefiner {
    /// Poses of a run of these `steps`, of which those that are `free` move.
    pub(crate) fn new(given: Vec<Camera>, free: Vec<bool>, extent: f64, steps: Range<u64>) -> Self {
        let gauge = free.iter().all(|f| *f).then(|| PoseGauge::new(&given, extent)).flatten();
        Self { offsets: vec![PoseOffset::default(); given.len()], given, free, gauge, extent, steps }
    }

    /// Steps between which poses move. A run that goes on from another has a scene from the begin.
    fn span(&self) -> [u64; 2] {
        let Range { start, end } = self.steps;
        let of = |share: f64| (share * end.saturating_sub(start) as f64).round() as u64;
        let wait = if start > 0 { 0 } else { of(BEGIN).clamp(BEGIN_STEPS[0], BEGIN_STEPS[1]) };
        [start + wait, start + of(END)]
    }

    /// Returns whether photo `i` moves at `step`.
    pub(super) fn moves(&self, i: usize, step: u64) -> bool {
        let [from, until] = self.span();
        self.free.get(i).copied().unwrap_or(false) && (from..until).contains(&step)
    }

    /// Camera of photo `i`, at its given pose or at another size of it.
    pub(super) fn camera(&self, i: usize, given: &Camera) -> Camera {
        self.offsets.get(i).map_or_else(|| given.clone(), |offset| offset.applied(given))
    }

    /// Share of the full step at `step`.
    fn share(&self, step: u64) -> f64 {
        let [from, until] = self.span();
        let t = step.saturating_sub(from) as f64 / until.saturating_sub(from).max(1) as f64;
        SHARE[0] * (SHARE[1] / SHARE[0]).powf(t.min(1.0))
    }

    /// Moves photo `i` downhill. The slope is that at its present camera; see [`Self::with_prior`].
    pub(super) fn advance(&mut self, i: usize, step: u64, slope: &PoseSlope) {
        let (Some(offset), Some(given)) = (self.offsets.get(i).copied(), self.given.get(i)) else { return };
        let now = offset.applied(given);
        let (downhill, curvature) = self.with_prior(i, &now, slope);
        let Some(full) = solve(&curvature, &downhill) else { return };
        let mut change = full.map(|v| v * self.share(step));
        let length = |part: &[f64]| part.iter().map(|v| v * v).sum::<f64>().sqrt();
        let over = [length(&change[..3]) / (MOVE_DEVIATION * self.extent), length(&change[3..6]) / TURN_DEVIATION]
            .map(|deviations| deviations / LARGEST)
            .into_iter()
            .fold(1.0, f64::max);
        change.iter_mut().for_each(|v| *v /= over);
        let kept = 1.0 - self.shrinkage();
        let next = PoseOffset::between(given, &moved(&now, &change));
        let next = PoseOffset { along: next.along * kept, turn: next.turn * kept };
        if next.along.is_finite() && next.turn.is_finite() {
            self.offsets[i] = next;
            if let Some(gauge) = &self.gauge {
                gauge.remove(&mut self.offsets);
            }
        }
    }

    /// Share of its change that a photo gives back at each turn. Changes that are small for all photos together are
    /// rather the scene's own unrest than errors of the poses, and with right poses nothing may move.
    fn shrinkage(&self) -> f64 {
        let square = |o: &PoseOffset| {
            let parts = [o.along / (MOVE_DEVIATION * self.extent), o.turn / TURN_DEVIATION];
            parts.map(|p| p.length_squared()).iter().sum::<f64>() / 6.0
        };
        let free = self.free.iter().filter(|f| **f).count().max(1);
        let all: f64 = self.offsets.iter().map(square).sum();
        (SHRINKAGE * free as f64 / all).min(MOST_SHRINKAGE)
    }

    /// Direction downhill and damped curvature of loss and prior together, by a change along and about the axes of
    /// `now`.
    fn with_prior(&self, i: usize, now: &Camera, slope: &PoseSlope) -> ([f64; PARAMETERS], Curvature) {
        let weights = [MOVE_DEVIATION * self.extent, TURN_DEVIATION].map(|d| slope.prior / (d * d));
        let given = &self.given[i];
        // Of the squared angle, the slope by a turn about the own axes is twice the turn itself.
        let away =
            (now.world_from_camera.transpose() * (now.center - given.center), PoseOffset::between(given, now).turn);
        let move_slope = slope.gradient.translation + weights[0] * away.0;
        let turn_slope = slope.gradient.rotation + weights[1] * away.1;
        let ([a, b, c], [d, e, f]) = (move_slope.to_array(), turn_slope.to_array());
        let mut downhill = [a, b, c, d, e, f, 0.0].map(|g| -g);
        let mut curvature = slope.curvature;
        for k in 0..6 {
            curvature[k][k] = curvature[k][k] * (1.0 + DAMPING) + weights[k / 3];
        }
        hold_focal(&mut curvature, &mut downhill);
        (downhill, curvature)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn camera(k: usize) -> Camera {
        let a = k as f64;
        let eye = DVec3::new(3.0 * a.cos(), 3.0 * a.sin(), 0.5 + 0.3 * (a * 1.3).sin());
        Camera::look_at(eye, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid")
    }

    fn refiner(free: bool) -> PoseRefiner {
        let cameras: Vec<Camera> = (0..5).map(camera).collect();
        PoseRefiner::new(cameras, vec![free, true, true, true, true], 3.0, 0..1_000)
    }

    #[test]
    fn an_offset_is_what_lies_between_two_poses() {
        let offset = PoseOffset { along: DVec3::new(0.1, -0.2, 0.05), turn: DVec3::new(-0.02, 0.03, 0.01) };
        let back = PoseOffset::between(&camera(1), &offset.applied(&camera(1)));
        assert!(back.along.distance(offset.along) < 1e-12 && back.turn.distance(offset.turn) < 1e-12, "{back:?}");
        assert_ne!(PoseOffset::between(&camera(2), &offset.applied(&camera(1))), offset, "the control");
    }

    /// Loss that is a parabola around a true pose, by the squared move and turn from it, and the prior.
    fn loss(refiner: &PoseRefiner, now: &Camera, truth: &Camera, prior: f64) -> f64 {
        let of = |from: &Camera, weights: [f64; 2]| {
            let PoseOffset { along, turn } = PoseOffset::between(from, now);
            0.5 * (weights[0] * along.length_squared() + weights[1] * turn.length_squared())
        };
        let deviations = [MOVE_DEVIATION * refiner.extent, TURN_DEVIATION];
        of(truth, [5.0, 2.0]) + of(&refiner.given[1], deviations.map(|d| prior / (d * d)))
    }

    fn slope(now: &Camera, truth: &Camera, prior: f64) -> PoseSlope {
        let gradient = PoseGradient {
            translation: 5.0 * (now.world_from_camera.transpose() * (now.center - truth.center)),
            rotation: 2.0 * PoseOffset::between(truth, now).turn,
            ..PoseGradient::default()
        };
        let mut curvature = [[0.0; PARAMETERS]; PARAMETERS];
        (0..6).for_each(|k| curvature[k][k] = if k < 3 { 5.0 } else { 2.0 });
        PoseSlope { gradient, curvature, prior }
    }

    fn truth() -> (PoseOffset, Camera) {
        let offset = PoseOffset { along: DVec3::new(0.05, -0.03, 0.02), turn: DVec3::new(0.01, -0.02, 0.015) };
        (offset, offset.applied(&camera(1)))
    }

    #[test]
    fn slope_with_prior_matches_central_differences() {
        let refiner = refiner(false);
        let (_, truth) = truth();
        let now =
            PoseOffset { along: DVec3::new(-0.3, 0.2, 0.4), turn: DVec3::new(0.2, 0.1, -0.3) }.applied(&camera(1));
        let (downhill, _) = refiner.with_prior(1, &now, &slope(&now, &truth, 0.01));
        let central = |k: usize| {
            let at = |by: f64| {
                let mut step = [0.0; PARAMETERS];
                step[k] = by;
                loss(&refiner, &moved(&now, &step), &truth, 0.01)
            };
            (at(1e-5) - at(-1e-5)) / 2e-5
        };
        let scale = (0..6).map(|k| central(k).abs()).fold(0.0, f64::max);
        for (k, found) in downhill.iter().enumerate().take(6) {
            assert!((-found - central(k)).abs() < 1e-6 * scale, "{k}: {found} {}", central(k));
        }
        // The control: another weight of the prior has another slope.
        let (other, _) = refiner.with_prior(1, &now, &slope(&now, &truth, 0.02));
        assert!((0..6).any(|k| (other[k] + central(k)).abs() > 1e-3 * scale));
    }

    #[test]
    fn a_photo_reaches_the_best_pose_and_stays_without_a_slope() {
        let (offset, truth) = truth();
        let run = |gradient: f64, prior: f64| {
            let mut refiner = refiner(false);
            for step in 200..400 {
                let now = refiner.camera(1, &camera(1));
                let mut slope = slope(&now, &truth, prior);
                slope.gradient.translation *= gradient;
                slope.gradient.rotation *= gradient;
                refiner.advance(1, step, &slope);
            }
            refiner.offsets[1]
        };
        let off = |found: PoseOffset| found.along.distance(offset.along) + found.turn.distance(offset.turn);
        let found = run(1.0, 1e-9);
        // A single wrong one among right ones gives back a little of all that it found, and of nothing else.
        let kept = found.along.dot(offset.along) / offset.along.length_squared();
        let whole = PoseOffset { along: found.along / kept, turn: found.turn / kept };
        assert!(off(whole) < 1e-4 && (0.98..1.0).contains(&kept), "{kept}: {found:?}");
        let held = run(1.0, 1e-2);
        assert!(held.along.length() < 0.6 * offset.along.length(), "the prior holds it: {held:?}");
        assert_eq!(run(0.0, 1e-9), PoseOffset::default(), "zeroed gradients move nothing");
    }

    #[test]
    fn small_changes_of_all_are_given_back_and_large_ones_kept() {
        let shrinkage = |deviations: f64| {
            let mut refiner = refiner(true);
            let along = DVec3::X * deviations * MOVE_DEVIATION * 3.0;
            refiner.offsets.fill(PoseOffset { along, turn: DVec3::Y * deviations * TURN_DEVIATION });
            refiner.shrinkage()
        };
        assert!(shrinkage(3.0) < 1e-3 && shrinkage(0.1) > 0.1, "{} {}", shrinkage(3.0), shrinkage(0.1));
        assert_eq!(shrinkage(0.0), MOST_SHRINKAGE);
    }

    #[test]
    fn held_photos_stay_and_others_move_only_in_time() {
        let refiner = refiner(false);
        assert!(!refiner.moves(0, 500) && refiner.moves(1, 500));
        assert!(!refiner.moves(1, 99) && refiner.moves(1, 100) && refiner.moves(1, 899) && !refiner.moves(1, 900));
        assert!(refiner.share(100) > 9.0 * refiner.share(900));
        let later = PoseRefiner::new(vec![camera(0)], vec![true], 3.0, 5_000..5_400);
        assert!(!later.moves(0, 4_999) && later.moves(0, 5_000) && later.moves(0, 5_359) && !later.moves(0, 5_360));
        assert!(later.share(5_000) > 9.0 * later.share(5_360));
    }

    #[test]
    fn what_no_photo_can_tell_is_taken_out_only_where_all_move() {
        let (_, truth) = truth();
        let mean = |free: bool| {
            let mut refiner = refiner(free);
            (200..260).for_each(|step| {
                let now = refiner.camera(1, &camera(1));
                refiner.advance(1, step, &slope(&now, &truth, 1e-9));
            });
            let world = |k: usize| camera(k).world_from_camera * refiner.offsets[k].along;
            (0..5).map(world).sum::<DVec3>().length() / 5.0
        };
        assert!(mean(true) < 1e-6 && mean(false) > 1e-3, "{} {}", mean(true), mean(false));
    }
}
