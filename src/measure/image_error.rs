//! Images as numbers: errors between two, changes of size, and the integral over a pixel's
//! footprint, which an image samples at one point.

use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8};

use super::document::MOST_PSNR;
use super::order::Order;
use crate::math::Real;
use crate::math::resize::{Filter, resize};
use crate::math::stats::{mean, psnr_of, quantile, worst};
use crate::pipeline::metrics::psnr;
use crate::render::cpu::CpuRenderer;
use crate::render::{Features, Frame, RenderError, RenderSettings};
use crate::scene::{Camera, GaussianCloud, PhotoPixels};

/// Red, green and blue as they are shown, 0 to 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct RgbPlanes {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) color: [Vec<f64>; 3],
}

/// The colors of a frame, clamped to what a screen shows.
pub(crate) fn planes<R: Real>(frame: &Frame<R>) -> RgbPlanes {
    let color = std::array::from_fn(|c| frame.color[c].iter().map(|v| v.f64().clamp(0.0, 1.0)).collect());
    RgbPlanes { width: frame.width_px, height: frame.height_px, color }
}

/// A picture at the size of a camera's.
pub(crate) fn resized(p: &RgbPlanes, camera: &Camera, filter: Filter) -> RgbPlanes {
    let (width, height) = (camera.width_px as usize, camera.height_px as usize);
    let color = p.color.each_ref().map(|plane| resize(plane, (p.width, p.height), (width, height), filter));
    RgbPlanes { width, height, color }
}

/// Errors of an image against another: root mean square, largest, 99.9th percentile, mean of FLIP, 99th percentile of
/// FLIP.
pub(crate) type Errors = [f64; 5];

/// Errors of `b` against `a`, of the same size.
pub(crate) fn errors(a: &RgbPlanes, b: &RgbPlanes) -> Errors {
    let pairs = a.color.iter().flatten().zip(b.color.iter().flatten());
    let off: Vec<f64> = pairs.map(|(a, b)| (a - b).abs()).collect();
    let rms = mean(&off.iter().map(|e| e * e).collect::<Vec<_>>()).sqrt();
    let (flip, flip_tail) = flip(a, b);
    [rms, worst(off.iter().copied()), quantile(&off, 0.999), flip, flip_tail]
}

pub(crate) fn named([rms, largest, tail, flip, flip_tail]: Errors) -> Vec<(&'static str, f64)> {
    vec![
        ("RMS error", rms),
        ("PSNR", psnr_of(rms * rms).min(MOST_PSNR)),
        ("largest error", largest),
        ("99.9 % error", tail),
        ("FLIP", flip),
        ("FLIP 99 %", flip_tail),
    ]
}

/// PSNR in dB of an image in a photo of its size; what the photo does not cover does not count.
pub(crate) fn psnr_in_photo(p: &RgbPlanes, photo: &PhotoPixels) -> f64 {
    psnr(&p.color, (p.width, p.height), photo).min(MOST_PSNR)
}

/// Mean and 99th percentile of FLIP.
fn flip(a: &RgbPlanes, b: &RgbPlanes) -> (f64, f64) {
    let (w, h) = (a.width as u32, a.height as u32);
    let bytes = |p: &RgbPlanes| -> Vec<u8> {
        let [r, g, b] = &p.color;
        r.iter().zip(g).zip(b).flat_map(|((r, g), b)| [*r, *g, *b].map(|v| (v * 255.0).round() as u8)).collect()
    };
    if w == 0 || h == 0 {
        return (0.0, 0.0);
    }
    let [a, b] = [a, b].map(|p| FlipImageRgb8::with_data(w, h, &bytes(p)));
    let errors = nv_flip::flip(a, b, DEFAULT_PIXELS_PER_DEGREE).to_vec();
    let errors: Vec<f64> = errors.into_iter().map(f64::from).collect();
    (mean(&errors), quantile(&errors, 0.99))
}

/// Order at which the mean of `n` x `n` samples inside each pixel converges to the integral over the pixel:
/// the midpoint rule is of second order where the image is smooth. The blur of a splat does not
/// change with the samples, as their cameras differ by parts of a pixel only.
pub(crate) fn footprint_order(
    cloud: &GaussianCloud<f64>,
    camera: &Camera,
    settings: &RenderSettings,
) -> Result<Order, RenderError> {
    let mut renderer = CpuRenderer::<f64>::new();
    let mut sampled = |n: usize| -> Result<[Vec<f64>; 3], RenderError> {
        let mut sums: [Vec<f64>; 3] = Default::default();
        for k in 0..n * n {
            let shift = |i: usize| (i as f64 + 0.5) / n as f64 - 0.5;
            let mut shifted = camera.clone();
            shifted.principal_px -= glam::DVec2::new(shift(k % n), shift(k / n));
            let frame = renderer.render(cloud, Features::NONE, &shifted, settings)?;
            for (sum, plane) in sums.iter_mut().zip(&frame.color) {
                sum.resize(plane.len(), 0.0);
                sum.iter_mut().zip(plane).for_each(|(s, v)| *s += v / (n * n) as f64);
            }
        }
        Ok(sums)
    };
    let best = sampled(16)?;
    let mut pairs = Vec::new();
    for n in [1, 2, 4, 8] {
        let rough = sampled(n)?;
        let squared = best.iter().flatten().zip(rough.iter().flatten()).map(|(a, b)| (a - b) * (a - b));
        let count = (3 * best[0].len()).max(1) as f64;
        pairs.push([n as f64, (squared.sum::<f64>() / count).sqrt()]);
    }
    let meaning = "Samples along each side of a pixel against the RMS error of the pixel's mean; one sample is what \
                   is drawn.";
    Ok(Order::fit("quadrature of the pixel footprint", meaning, pairs, 2.0, 0.35, 1e-12))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: usize, height: usize, f: impl Fn(usize, usize) -> f64) -> RgbPlanes {
        let plane: Vec<f64> = (0..width * height).map(|i| f(i % width, i / width)).collect();
        RgbPlanes { width, height, color: std::array::from_fn(|_| plane.clone()) }
    }

    #[test]
    fn an_image_against_itself_is_without_error_and_others_are_not() {
        let a = image(32, 24, |x, y| ((x * 7 + y * 3) % 11) as f64 / 11.0);
        let same = errors(&a, &a);
        assert_eq!((same, named(same)[1].1), ([0.0; 5], MOST_PSNR));
        let off = image(32, 24, |x, y| ((x * 7 + y * 3) % 11) as f64 / 11.0 * 0.9);
        let [rms, largest, _, flip, flip_tail] = errors(&a, &off);
        assert!(rms > 0.01 && (largest - 1.0 / 11.0).abs() < 1e-9 && flip > 0.005 && flip_tail >= flip);
    }
}
