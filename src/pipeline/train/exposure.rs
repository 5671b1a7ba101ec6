//! Exposures of training photos: a gain and a bias by channel, learned while the scene is trained.
//!
//! A photo's colors are `gain * color + bias` of the light that comes from the scene; the background behind it stays as
//! it is stated. When the photo has its turn, they take a damped Gauss-Newton step by the slope of the loss. The mean
//! gain of all photos is held at 1 and the mean bias at 0, as the scene's own colors could make up for others; where
//! some photos are held, these say so.

use crate::math::Real;
use crate::math::cholesky::solve;
use crate::render::{Frame, FrameGradient};
use crate::scene::PhotoExposure;

/// Expected deviation of gains from 1, and of biases from 0.
const DEVIATIONS: [f64; 2] = [0.5, 0.1];
/// Share of the Gauss-Newton step that is taken.
const SHARE: f64 = 0.3;
/// Largest step of a gain and of a bias.
const LARGEST: [f64; 2] = [0.1, 0.05];
/// Largest gain, and the inverse of the smallest: two stops each way in sRGB.
const LARGEST_GAIN: f64 = 3.0;
/// Damping, by share of the curvature.
const DAMPING: f64 = 1e-2;
/// Steps before exposures are learned: every photo must have shown what it sees.
const BEGIN_STEPS: u64 = 100;

/// Slope and curvature of the loss by gain and bias of each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ExposureSlope {
    pub(super) slope: [[f64; 2]; 3],
    /// By gain twice, by both, by bias twice.
    pub(super) curvature: [[f64; 3]; 3],
}

/// The colors of a rendering as the photo's camera takes them.
pub(super) fn exposed<R: Real>(by: &PhotoExposure, frame: &Frame<R>, background: [f32; 3]) -> [Vec<R>; 3] {
    std::array::from_fn(|c| {
        let [gain, bias, behind] = [by.gain[c], by.bias[c], f64::from(background[c])].map(R::of);
        let one = |(v, a): (&R, &R)| *v + (gain - R::ONE) * (*v - behind * (R::ONE - *a)) + bias * *a;
        frame.color[c].iter().zip(&frame.alpha).map(one).collect()
    })
}

/// Turns the gradient with respect to exposed colors into that with respect to the rendered colors and alpha, and
/// `weights`, the curvature with respect to them, likewise. Returns the slope by the exposure.
pub(super) fn backward<R: Real>(
    by: &PhotoExposure,
    frame: &Frame<R>,
    background: [f32; 3],
    gradient: &mut FrameGradient<R>,
    weights: &mut [Vec<R>; 3],
) -> ExposureSlope {
    let mut found = ExposureSlope::default();
    for c in 0..3 {
        let (gain, bias, behind) = (by.gain[c], by.bias[c], f64::from(background[c]));
        let through_alpha = R::of(bias + (gain - 1.0) * behind);
        let own = gradient.color[c].iter_mut().zip(&mut weights[c]).zip(&mut gradient.alpha);
        for (((d, w), d_alpha), (v, a)) in own.zip(frame.color[c].iter().zip(&frame.alpha)) {
            let (slope, weight, alpha) = (d.f64(), w.f64(), a.f64());
            let light = v.f64() - behind * (1.0 - alpha);
            let [by_gain, by_bias] = &mut found.slope[c];
            *by_gain += slope * light;
            *by_bias += slope * alpha;
            let [gg, gb, bb] = &mut found.curvature[c];
            *gg += weight * light * light;
            *gb += weight * light * alpha;
            *bb += weight * alpha * alpha;
            *d_alpha += *d * through_alpha;
            *d *= R::of(gain);
            *w *= R::of(gain * gain);
        }
    }
    found
}

/// The exposures of the training photos.
#[derive(Debug)]
pub(crate) struct ExposureFit {
    pub(super) exposures: Vec<PhotoExposure>,
    free: Vec<bool>,
}

impl ExposureFit {
    /// Exposures of which those that are `free` are learned.
    pub(crate) fn new(free: Vec<bool>) -> Self {
        Self { exposures: vec![PhotoExposure::default(); free.len()], free }
    }

    pub(super) fn of(&self, i: usize) -> PhotoExposure {
        self.exposures.get(i).copied().unwrap_or_default()
    }

    /// Returns whether the exposure of photo `i` is learned at `step`.
    pub(super) fn learns(&self, i: usize, step: u64) -> bool {
        step >= BEGIN_STEPS.max(self.free.len() as u64) && self.free.get(i).copied().unwrap_or(false)
    }

    /// Moves the exposure of photo `i` downhill; `prior` is the weight of the expected deviations, in the loss's units.
    pub(super) fn advance(&mut self, i: usize, found: &ExposureSlope, prior: f64) {
        let Some(own) = self.exposures.get_mut(i) else { return };
        let weights = DEVIATIONS.map(|d| prior / (d * d));
        for c in 0..3 {
            let [gg, gb, bb] = found.curvature[c];
            let damped = [[gg * (1.0 + DAMPING) + weights[0], gb], [gb, bb * (1.0 + DAMPING) + weights[1]]];
            let away = [own.gain[c] - 1.0, own.bias[c]];
            let downhill = [0, 1].map(|k| -(found.slope[c][k] + weights[k] * away[k]));
            let Some(full) = solve(&damped, &downhill) else { continue };
            let [gain, bias] = [0, 1].map(|k| (SHARE * full[k]).clamp(-LARGEST[k], LARGEST[k]));
            own.gain[c] = (own.gain[c] + gain).clamp(1.0 / LARGEST_GAIN, LARGEST_GAIN);
            own.bias[c] += bias;
        }
        if self.free.iter().all(|f| *f) {
            self.center();
        }
    }

    /// Moves all exposures so that the mean gain is 1 and the mean bias 0.
    fn center(&mut self) {
        let n = self.exposures.len() as f64;
        for c in 0..3 {
            let gain = self.exposures.iter().map(|e| e.gain[c]).sum::<f64>() / n;
            let bias = self.exposures.iter().map(|e| e.bias[c]).sum::<f64>() / n;
            for e in &mut self.exposures {
                e.gain[c] /= gain;
                e.bias[c] -= bias;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    const BACKGROUND: [f32; 3] = [0.5, 0.25, 0.75];

    /// A half transparent rendering and weights of its pixels.
    fn problem() -> (Frame<f64>, [Vec<f64>; 3], PhotoExposure) {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(3);
        let mut plane = |low: f64, high: f64| (0..60).map(|_| rng.random_range(low..high)).collect::<Vec<f64>>();
        let frame = Frame {
            width_px: 10,
            height_px: 6,
            color: std::array::from_fn(|_| plane(0.0, 0.9)),
            alpha: plane(0.2, 1.0),
            ..Frame::default()
        };
        let weights = std::array::from_fn(|_| plane(-1.0, 1.0));
        (frame, weights, PhotoExposure { gain: [1.3, 0.8, 1.1], bias: [0.05, -0.04, 0.02] })
    }

    fn loss(by: &PhotoExposure, frame: &Frame<f64>, weights: &[Vec<f64>; 3]) -> f64 {
        let colors = exposed(by, frame, BACKGROUND);
        colors.iter().zip(weights).flat_map(|(v, w)| v.iter().zip(w)).map(|(v, w)| w * v * v).sum()
    }

    /// Gradient by the exposed colors, then through the exposure.
    fn gradients(
        frame: &Frame<f64>,
        weights: &[Vec<f64>; 3],
        by: &PhotoExposure,
    ) -> (ExposureSlope, FrameGradient<f64>) {
        let colors = exposed(by, frame, BACKGROUND);
        let color = |c: usize| colors[c].iter().zip(&weights[c]).map(|(v, w)| 2.0 * w * v).collect();
        let mut gradient =
            FrameGradient { color: std::array::from_fn(color), alpha: vec![0.0; 60], ..FrameGradient::default() };
        let mut unit = std::array::from_fn(|_| vec![1.0; 60]);
        (backward(by, frame, BACKGROUND, &mut gradient, &mut unit), gradient)
    }

    #[test]
    fn gain_and_bias_match_central_differences() {
        let (frame, weights, by) = problem();
        let (found, _) = gradients(&frame, &weights, &by);
        let central = |change: &dyn Fn(&mut PhotoExposure, f64)| {
            let at = |h: f64| {
                let mut by = by;
                change(&mut by, h);
                loss(&by, &frame, &weights)
            };
            (at(1e-5) - at(-1e-5)) / 2e-5
        };
        for c in 0..3 {
            let [gain, bias] = [central(&|e, h| e.gain[c] += h), central(&|e, h| e.bias[c] += h)];
            assert!((found.slope[c][0] - gain).abs() < 1e-8 * (1.0 + gain.abs()), "{c}: {found:?} {gain}");
            assert!((found.slope[c][1] - bias).abs() < 1e-8 * (1.0 + bias.abs()), "{c}: {found:?} {bias}");
            // The control: the slopes are no zeros, and not each other.
            assert!(gain.abs() > 1e-2 && (gain - bias).abs() > 1e-2);
        }
    }

    #[test]
    fn colors_and_alpha_match_central_differences() {
        let (frame, weights, by) = problem();
        let (_, found) = gradients(&frame, &weights, &by);
        for i in [0, 7, 41] {
            let at = |color: f64, alpha: f64| {
                let mut frame = frame.clone();
                frame.color[1][i] += color;
                frame.alpha[i] += alpha;
                loss(&by, &frame, &weights)
            };
            let color = (at(1e-5, 0.0) - at(-1e-5, 0.0)) / 2e-5;
            let alpha = (at(0.0, 1e-5) - at(0.0, -1e-5)) / 2e-5;
            assert!((found.color[1][i] - color).abs() < 1e-8, "{i}: {} {color}", found.color[1][i]);
            assert!((found.alpha[i] - alpha).abs() < 1e-8 && alpha.abs() > 1e-3, "{i}: {} {alpha}", found.alpha[i]);
        }
    }

    #[test]
    fn the_usual_exposure_changes_nothing() {
        let (frame, ..) = problem();
        assert_eq!(exposed(&PhotoExposure::default(), &frame, BACKGROUND), frame.color);
    }

    /// Photos of one rendering in these exposures, learned in turns, each from the photo of `from`.
    fn learned(truth: &[PhotoExposure], from: impl Fn(usize) -> usize, zeroed: bool) -> (Vec<PhotoExposure>, f64) {
        let (frame, ..) = problem();
        let mut fit = ExposureFit::new(vec![true; truth.len()]);
        let difference = |by: &PhotoExposure, truth: &PhotoExposure| -> [Vec<f64>; 3] {
            let (own, photo) = (exposed(by, &frame, BACKGROUND), exposed(truth, &frame, BACKGROUND));
            std::array::from_fn(|c| own[c].iter().zip(&photo[c]).map(|(a, b)| a - b).collect())
        };
        for turn in 0..40 * truth.len() {
            let i = turn % truth.len();
            let color = difference(&fit.of(i), &truth[from(i)]);
            let color = if zeroed { color.map(|plane| vec![0.0; plane.len()]) } else { color };
            let mut gradient = FrameGradient { color, alpha: vec![0.0; 60], ..FrameGradient::default() };
            let mut weights = std::array::from_fn(|_| vec![1.0; 60]);
            let slope = backward(&fit.of(i), &frame, BACKGROUND, &mut gradient, &mut weights);
            fit.advance(i, &slope, 1e-6);
        }
        let off = |i: usize| difference(&fit.of(i), &truth[i]).concat().iter().map(|d| d * d).sum::<f64>();
        let left = (0..truth.len()).map(off).sum();
        (fit.exposures, left)
    }

    #[test]
    fn exposures_are_found_and_shuffled_or_zeroed_ones_do_not_help() {
        let of = |gain: f64, bias: f64| PhotoExposure { gain: [gain, 1.0, 2.0 - gain], bias: [bias, 0.0, -bias] };
        let truth = [of(1.3, 0.04), of(0.7, -0.05), of(1.1, 0.02), of(0.9, -0.01)];
        let (found, left) = learned(&truth, |i| i, false);
        for (found, truth) in found.iter().zip(&truth) {
            assert!((0..3).all(|c| (found.gain[c] - truth.gain[c]).abs() < 0.02), "{found:?} {truth:?}");
            assert!((0..3).all(|c| (found.bias[c] - truth.bias[c]).abs() < 0.02), "{found:?} {truth:?}");
        }
        let (_, zeroed) = learned(&truth, |i| i, true);
        let (_, shuffled) = learned(&truth, |i| (i + 1) % 4, false);
        assert!(left < 0.01 * zeroed && shuffled > zeroed, "{left} {zeroed} {shuffled}");
    }

    #[test]
    fn the_mean_is_held_only_where_all_are_free() {
        let slope = ExposureSlope { slope: [[-1.0, 0.5]; 3], curvature: [[4.0, 0.5, 4.0]; 3] };
        let mean = |free: [bool; 3]| {
            let mut fit = ExposureFit::new(free.to_vec());
            fit.advance(1, &slope, 1e-6);
            fit.exposures.iter().map(|e| e.gain[0]).sum::<f64>() / 3.0
        };
        assert!((mean([true; 3]) - 1.0).abs() < 1e-12 && mean([false, true, true]) > 1.01);
        let fit = ExposureFit::new(vec![false, true]);
        assert!(!fit.learns(0, 500) && fit.learns(1, 500) && !fit.learns(1, 50));
    }
}
