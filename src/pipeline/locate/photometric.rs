//! Colors of a rendering against those of a photo: gain and bias by channel in closed form, and a loss that gives up on
//! what is not in the scene (Geman and McClure 1985).

use crate::math::resize::{Filter, resize};
use crate::math::stats::OF_MAD;
use crate::pipeline::metrics;
use crate::scene::PhotoPixels;

/// Colors this near black or white may be clipped: the photo does not say how dark or bright.
const CLIPPED: f32 = 0.01;
/// Largest gain, and the inverse of the smallest: two stops each way in sRGB.
const LARGEST_GAIN: f32 = 3.0;
/// The loss turns away from errors of this many robust standard deviations.
pub(super) const WIDTH: f32 = 2.5;
/// Smallest and largest width of the loss, in full scale.
const WIDTHS: [f32; 2] = [0.02, 0.3];
/// Rounds of gain, bias and weights.
const ROUNDS: usize = 4;

/// A photo at one size.
#[derive(Clone, Debug)]
pub(super) struct PhotoLevel {
    pub(super) width: usize,
    pub(super) planes: [Vec<f32>; 3],
    /// Share of each pixel that the photo covers.
    pub(super) coverage: Vec<f32>,
}

impl PhotoLevel {
    pub(super) fn of(photo: &PhotoPixels, width: usize, height: usize) -> Self {
        let from = (photo.width_px as usize, photo.height_px as usize);
        let small = |plane: &[f32]| resize(plane, from, (width, height), Filter::Area);
        let coverage = match &photo.coverage {
            Some(coverage) => small(&coverage.iter().map(|c| f32::from(*c) / 255.0).collect::<Vec<_>>()),
            None => vec![1.0; width * height],
        };
        let mut planes = metrics::planes::<f32>(photo).map(|plane| small(&plane));
        // Pixels that are not covered are black: a border of them does not darken the covered share.
        for plane in &mut planes {
            plane.iter_mut().zip(&coverage).filter(|(_, c)| **c > 0.0).for_each(|(v, c)| *v /= *c);
        }
        let coverage = coverage.into_iter().map(|c| if c > 0.5 { c } else { 0.0 }).collect();
        Self { width, planes, coverage }
    }
}

/// Change of colors from a rendering to a photo, and width of the loss, by channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Exposure {
    pub(super) gain: [f32; 3],
    pub(super) bias: [f32; 3],
    pub(super) width: [f32; 3],
}

impl Exposure {
    /// The exposure that fits most pixels.
    pub(super) fn between(rendered: &[Vec<f32>; 3], photo: &PhotoLevel) -> Self {
        let mut found = Self { gain: [1.0; 3], bias: [0.0; 3], width: [WIDTHS[1]; 3] };
        for c in 0..3 {
            (found.gain[c], found.bias[c], found.width[c]) =
                of_channel(&rendered[c], &photo.planes[c], &photo.coverage);
        }
        found
    }

    /// Loss, and its gradient with respect to the rendered colors. `weights` receives the curvature with respect to
    /// them.
    pub(super) fn loss(
        &self,
        rendered: &[Vec<f32>; 3],
        photo: &PhotoLevel,
        gradient: &mut [Vec<f32>; 3],
        weights: &mut [Vec<f32>; 3],
    ) -> f64 {
        let mut loss = 0.0;
        for c in 0..3 {
            let (gain, bias, width) = (self.gain[c], self.bias[c], self.width[c]);
            let n = rendered[c].len();
            gradient[c].resize(n, 0.0);
            weights[c].resize(n, 0.0);
            for i in 0..n {
                let exposed = gain * rendered[c][i] + bias;
                let covered = photo.coverage[i];
                // A camera clips, too.
                let slope = if (0.0..=1.0).contains(&exposed) { gain } else { 0.0 };
                let off = (exposed.clamp(0.0, 1.0) - photo.planes[c][i]) / width;
                let below = 1.0 + off * off;
                loss += f64::from(covered * 0.5 * off * off / below);
                let weight = covered / (width * below * below);
                gradient[c][i] = weight * off * slope;
                weights[c][i] = weight / width * slope * slope;
            }
        }
        loss
    }

    /// The rendered colors as the photo's camera would have taken them.
    pub(super) fn applied(&self, rendered: &[Vec<f32>; 3]) -> [Vec<f32>; 3] {
        std::array::from_fn(|c| rendered[c].iter().map(|v| (self.gain[c] * v + self.bias[c]).clamp(0.0, 1.0)).collect())
    }
}

/// Gain, bias and width of the loss of a channel. Gain is the ratio of standard deviations of what fits, which a
/// rendering from a slightly wrong pose does not flatten as a regression would.
fn of_channel(rendered: &[f32], photo: &[f32], coverage: &[f32]) -> (f32, f32, f32) {
    let is_clear = |v: f32| (CLIPPED..=1.0 - CLIPPED).contains(&v);
    let mut base: Vec<f32> = photo.iter().zip(coverage).map(|(p, c)| if is_clear(*p) { *c } else { 0.0 }).collect();
    let covered: f32 = coverage.iter().sum();
    if base.iter().sum::<f32>() < 0.1 * covered {
        base = coverage.to_vec();
    }
    let (mut gain, mut bias, mut width) = (1.0, 0.0, WIDTHS[1]);
    let mut weights = base.clone();
    for _ in 0..ROUNDS {
        let sum: f64 = weights.iter().map(|w| f64::from(*w)).sum();
        if !(sum > 0.0) {
            break;
        }
        let mean = |v: &[f32]| v.iter().zip(&weights).map(|(v, w)| f64::from(v * w)).sum::<f64>() / sum;
        let (r, p) = (mean(rendered), mean(photo));
        let spread = |v: &[f32], mean: f64| {
            (v.iter().zip(&weights).map(|(v, w)| f64::from(*w) * (f64::from(*v) - mean).powi(2)).sum::<f64>() / sum)
                .sqrt()
        };
        let (of_rendered, of_photo) = (spread(rendered, r), spread(photo, p));
        let ratio = if of_rendered > 1e-4 { of_photo / of_rendered } else { 1.0 };
        gain = (ratio as f32).clamp(1.0 / LARGEST_GAIN, LARGEST_GAIN);
        bias = p as f32 - gain * r as f32;
        let off = |i: usize| (gain * rendered[i] + bias).clamp(0.0, 1.0) - photo[i];
        let mut errors: Vec<f32> = (0..photo.len()).filter(|&i| base[i] > 0.0).map(|i| off(i).abs()).collect();
        if errors.is_empty() {
            break;
        }
        let middle = errors.len() / 2;
        let mad = *errors.select_nth_unstable_by(middle, f32::total_cmp).1;
        width = (WIDTH * OF_MAD as f32 * mad).clamp(WIDTHS[0], WIDTHS[1]);
        for (i, w) in weights.iter_mut().enumerate() {
            *w = base[i] / (1.0 + (off(i) / width).powi(2)).powi(2);
        }
    }
    (gain, bias, width)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(of: impl Fn(usize) -> f32) -> PhotoLevel {
        let plane: Vec<f32> = (0..400).map(of).collect();
        PhotoLevel { width: 20, planes: [plane.clone(), plane.clone(), plane], coverage: vec![1.0; 400] }
    }

    fn scene(i: usize) -> f32 {
        0.4 + 0.2 * (i as f32 * 0.7).sin()
    }

    #[test]
    fn gain_and_bias_are_found_beside_a_gray_box() {
        let rendered: Vec<f32> = (0..400).map(scene).collect();
        let photo = level(|i| if i < 60 { 0.95 } else { 1.4 * scene(i) - 0.05 });
        let found = Exposure::between(&[rendered.clone(), rendered.clone(), rendered], &photo);
        assert!((found.gain[0] - 1.4).abs() < 0.05 && (found.bias[0] + 0.05).abs() < 0.03, "{found:?}");
        assert!(found.width[0] < 0.06, "the box does not widen the loss: {found:?}");
    }

    #[test]
    fn the_losss_gradient_is_its_slope_and_clipped_colors_have_none() {
        let photo = level(|i| scene(i) + 0.03 * (i as f32).cos());
        let mut rendered: [Vec<f32>; 3] = std::array::from_fn(|_| (0..400).map(scene).collect());
        let exposure = Exposure { gain: [1.2, 0.9, 1.0], bias: [-0.05, 0.0, 0.1], width: [0.05; 3] };
        let (mut gradient, mut weights) = (<[Vec<f32>; 3]>::default(), <[Vec<f32>; 3]>::default());
        exposure.loss(&rendered, &photo, &mut gradient, &mut weights);
        let slope = gradient[0][7];
        let mut at = |by: f32| {
            let start = rendered[0][7];
            rendered[0][7] = start + by;
            let loss = exposure.loss(&rendered, &photo, &mut <[Vec<f32>; 3]>::default(), &mut weights);
            rendered[0][7] = start;
            loss
        };
        let numeric = (at(1e-3) - at(-1e-3)) / 2e-3;
        assert!((numeric - f64::from(slope)).abs() < 0.02 * f64::from(slope).abs().max(0.1), "{numeric} {slope}");
        rendered[0][7] = 3.0;
        exposure.loss(&rendered, &photo, &mut gradient, &mut weights);
        assert_eq!(gradient[0][7], 0.0);
    }
}
