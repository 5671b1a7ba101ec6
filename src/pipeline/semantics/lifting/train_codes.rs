//! The paper's lifting: codes of the Gaussians, both levels in one pass, trained until the rendered codes match those
//! of the masks (L1 + 0.2 D-SSIM). The Gaussians themselves do not change.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use super::votes::UNKNOWN;
use crate::math::finite::{CHECKED, all_finite};
use crate::pipeline::observer::{Observer, Ticker};
use crate::pipeline::train::device::LAMBDA;
use crate::render::{
    AdamStep, DifferentiableRenderer, Features, FrameGradient, PhotoLoss, RenderError, RenderSettings,
};
use crate::scene::semantic_map::{BACKGROUND_CODE, CODE_CHANNELS};
use crate::scene::{Camera, GaussianCloud, Identities, IdentityId};

/// Longer side of the masks that codes are trained on, px.
pub(crate) const CODE_SIDE_PX: u32 = 256;
/// Learning rate at the first and at the last step, in units of code space.
const RATES: [f64; 2] = [0.02, 0.002];

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CodeView {
    pub(crate) camera: Camera,
    /// Innermost identity of each pixel, row-major; `UNKNOWN` pixels are ignored.
    pub(crate) labels: Vec<IdentityId>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CodeTraining {
    pub(crate) steps: u64,
    /// Seed of the order of the views.
    pub(crate) seed: u64,
}

/// Trains `codes`, one set per Gaussian of `cloud`, from their current values. Returns the mean loss of the last
/// tenth of the steps. The observer may cancel it; codes are then those of the last step.
pub(crate) fn train_codes(
    cloud: &GaussianCloud,
    codes: &mut [[f32; CODE_CHANNELS]],
    views: &[CodeView],
    identities: &Identities,
    settings: &RenderSettings,
    training: CodeTraining,
    observer: &mut dyn Observer,
) -> Result<f64, RenderError> {
    assert_eq!(codes.len(), cloud.len(), "one set of codes per Gaussian");
    let settings = RenderSettings { sh_degree: 0, depth: false, ..settings.clone() };
    let targets: Vec<[Vec<f32>; CODE_CHANNELS]> = views.iter().map(|v| target(v, identities)).collect();
    let mut moments = vec![[[0.0_f32; 2]; CODE_CHANNELS]; codes.len()];
    let mut touched = vec![0_u64; codes.len()];
    let mut renderer = DifferentiableRenderer::new();
    let mut loss = PhotoLoss::default();
    let mut rng = Pcg64Mcg::seed_from_u64(training.seed);
    let (mut order, mut last): (Vec<usize>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut ticker = Ticker::new("Training codes", training.steps as usize);
    for step in 0..training.steps {
        if views.is_empty() || observer.proceed().is_err() {
            break;
        }
        if order.is_empty() {
            order = (0..views.len()).collect();
            order.shuffle(&mut rng);
        }
        let Some(v) = order.pop() else { break };
        let total = one_step(&mut renderer, &mut loss, cloud, codes, &views[v], &targets[v], &settings)?;
        if (step + 1) * 10 > training.steps * 9 {
            last.push(total);
        }
        let along = step as f64 / training.steps.max(1) as f64;
        let rate = (RATES[0].ln() * (1.0 - along) + RATES[1].ln() * along).exp() as f32;
        let renderer = &renderer;
        // Adam's bias correction needs the steps of each Gaussian, which is in some of the views only.
        codes.par_iter_mut().zip(&mut moments).zip(&mut touched).enumerate().for_each(|(i, ((code, moments), t))| {
            let mut gradient = [0.0; CODE_CHANNELS];
            if !renderer.feature_gradient(i, &mut gradient) || gradient.iter().any(|g| !g.is_finite()) {
                return;
            }
            *t += 1;
            let adam = AdamStep::new(*t);
            for ((c, g), [first, second]) in code.iter_mut().zip(gradient).zip(moments) {
                adam.update(c, g, first, second, rate);
            }
        });
        if CHECKED {
            all_finite("Adam on codes", "code", codes.as_flattened())?;
        }
        if step % 10 == 9 {
            ticker.report(step + 1, observer);
        }
    }
    Ok(last.iter().sum::<f64>() / last.len().max(1) as f64)
}

/// Renders a view and propagates backward; afterwards the renderer holds the gradient. Returns the loss.
fn one_step(
    renderer: &mut DifferentiableRenderer,
    loss: &mut PhotoLoss<f32>,
    cloud: &GaussianCloud,
    codes: &[[f32; CODE_CHANNELS]],
    view: &CodeView,
    target: &[Vec<f32>; CODE_CHANNELS],
    settings: &RenderSettings,
) -> Result<f64, RenderError> {
    let features = Features { channels: CODE_CHANNELS, values: codes.as_flattened() };
    let frame = renderer.render(cloud, features, &view.camera, settings)?;
    let (width, pixels) = (frame.width_px, frame.alpha.len());
    let mut gradient = FrameGradient { features: vec![vec![0.0; pixels]; CODE_CHANNELS], ..FrameGradient::default() };
    let mut total = 0.0;
    for (c, plane) in gradient.features.iter_mut().enumerate() {
        let behind = BACKGROUND_CODE[c % 3];
        // Transparent pixels show the background's code; unknown pixels are set to it on both sides, so they have no
        // error.
        let drawn = frame.features[c].iter().zip(&frame.alpha).zip(&target[c]);
        let drawn: Vec<f32> =
            drawn.map(|((f, a), t)| if t.is_nan() { behind } else { f + (1.0 - a) * behind }).collect();
        let wanted: Vec<f32> = target[c].iter().map(|t| if t.is_nan() { behind } else { *t }).collect();
        total += loss.channel(&drawn, &wanted, width, LAMBDA, CODE_CHANNELS, plane).total(LAMBDA);
        plane.iter_mut().zip(&target[c]).filter(|(_, t)| t.is_nan()).for_each(|(g, _)| *g = 0.0);
    }
    renderer.backward_tiles(&gradient);
    if CHECKED {
        gradient.features.iter().try_for_each(|p| all_finite("the loss of codes", "the gradient of pixel", p))?;
        renderer.check_backward()?;
    }
    Ok(total / CODE_CHANNELS as f64)
}

/// Returns the target codes of a view; NaN for unknown pixels.
fn target(view: &CodeView, identities: &Identities) -> [Vec<f32>; CODE_CHANNELS] {
    let by_id: Vec<_> = (0..=identities.len() as IdentityId).map(|id| identities.codes(id)).collect();
    let code = |id: IdentityId, c: usize| match by_id.get(id as usize) {
        Some(codes) => codes[c],
        None if id == UNKNOWN => f32::NAN,
        None => BACKGROUND_CODE[c % 3],
    };
    std::array::from_fn(|c| view.labels.iter().map(|id| code(*id, c)).collect())
}

/// Returns the identity of each Gaussian by its codes: the part with the nearest code, if that is nearer than the
/// background's, else the object.
pub(crate) fn decode(codes: &[[f32; CODE_CHANNELS]], identities: &Identities) -> Vec<IdentityId> {
    let all: Vec<[f32; CODE_CHANNELS]> = (0..=identities.len() as IdentityId).map(|id| identities.codes(id)).collect();
    let far =
        |a: &[f32; CODE_CHANNELS], b: &[f32; CODE_CHANNELS]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f32>();
    let nearest =
        |c: &[f32; CODE_CHANNELS]| (0..all.len()).min_by(|&a, &b| far(c, &all[a]).total_cmp(&far(c, &all[b])));
    codes.par_iter().map(|c| nearest(c).unwrap_or(0) as IdentityId).collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::math::stats::worst_difference;
    use crate::pipeline::observer::Silent;
    use crate::scene::{Level, NO_IDENTITY};

    /// Two Gaussians side by side, one of them a part, with the masks that the user would draw: a disc of 4 px around
    /// the center of each, half a length to either side at 51.7 px a length and three lengths away.
    fn scene() -> (GaussianCloud, Identities, Vec<CodeView>) {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec![]);
        let eye = all.add(Level::Part, doll, vec![]);
        for (id, code) in [(doll, [0.9, 0.2, 0.5]), (eye, [0.1, 0.3, 0.8])] {
            all.get_mut(id).expect("there").code = code;
        }
        let cloud = GaussianCloud::isotropic(vec![[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]], -1.6, 4.0);
        let camera =
            Camera::look_at(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, DVec3::NEG_Y, 0.6, 48, 32).expect("valid");
        let label = |i: usize| {
            let (x, y) = ((i % 48) as f64 + 0.5 - 24.0, (i / 48) as f64 + 0.5 - 16.0);
            let near = |middle: f64| (x - middle).hypot(y) < 4.0;
            if near(-8.62) {
                doll
            } else if near(8.62) {
                eye
            } else {
                NO_IDENTITY
            }
        };
        let views = vec![CodeView { camera, labels: (0..48 * 32).map(label).collect() }];
        (cloud, all, views)
    }

    fn train(steps: u64, labels: impl Fn(IdentityId) -> IdentityId) -> (Vec<[f32; 6]>, Vec<IdentityId>, f64) {
        let (cloud, all, mut views) = scene();
        views[0].labels.iter_mut().for_each(|l| *l = labels(*l));
        let mut codes = vec![[0.5; CODE_CHANNELS]; cloud.len()];
        let training = CodeTraining { steps, seed: 1 };
        let settings = RenderSettings::default();
        let loss = train_codes(&cloud, &mut codes, &views, &all, &settings, training, &mut Silent).expect("trains");
        let of = decode(&codes, &all);
        (codes, of, loss)
    }

    #[test]
    fn codes_are_learned_from_masks() {
        let (codes, of, loss) = train(400, |l| l);
        assert_eq!(of, [1, 2], "{codes:?}");
        for (code, wanted) in codes.iter().zip([[0.9, 0.2, 0.5, 0.5, 0.5, 0.5], [0.9, 0.2, 0.5, 0.1, 0.3, 0.8]]) {
            // Not nearer: a disc ends at once, a Gaussian fades.
            assert!(worst_difference(code, &wanted) < 0.11, "{code:?} {wanted:?}");
        }
        let (_, _, first) = train(1, |l| l);
        assert!(loss < 0.8 * first, "{loss} {first}");
        // Without masks nothing is learned; with wrong ones, the wrong thing.
        let (codes, of, _) = train(100, |_| UNKNOWN);
        assert_eq!((codes[0], of), ([0.5; 6], vec![NO_IDENTITY; 2]));
        let (_, of, _) = train(400, |l| [0, 2, 1].get(l as usize).copied().unwrap_or(l));
        assert_eq!(of, [2, 1]);
    }
}
