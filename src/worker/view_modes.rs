//! View modes of the viewport, and the conversion of a rendered frame to their pixels.

use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantArray};

use crate::math::colormap::Colormap;
use crate::math::resize::{Filter, nearest, resize};
use crate::math::stats::quantile;
use crate::pipeline::metrics;
use crate::render::Frame;
use crate::scene::{PhotoExposure, PhotoPixels};

/// Quantity that the viewport shows, in the order of the toolbar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, VariantArray, IntoStaticStr)]
pub enum ViewMode {
    /// The rendered image.
    #[default]
    #[strum(serialize = "RGB")]
    Rgb,
    /// Expected depth, turbo colors from near to far.
    Depth,
    /// Absolute difference from the photo.
    Difference,
    /// Accumulated opacity.
    Alpha,
    /// The photo itself.
    Photo,
}

impl ViewMode {
    pub(crate) fn text(self) -> &'static str {
        self.into()
    }

    /// Returns whether it shows something only at the camera pose of a photo.
    pub(crate) fn needs_photo(self) -> bool {
        matches!(self, Self::Difference | Self::Photo)
    }
}

/// Factor that amplifies the difference from the photo, so that an error of 1/4 is white.
pub(crate) const DIFFERENCE_GAIN: f64 = 4.0;

/// A frame as pixels.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Drawn {
    pub(super) rgb: Vec<[u8; 3]>,
    pub(super) depth_range: Option<(f32, f32)>,
    pub(super) psnr: Option<f64>,
}

/// Turns a frame into pixels. A photo of another size than the frame is sampled at the pixels'
/// centers. Its difference is measured without its exposure.
pub(super) fn paint(
    frame: &Frame<f32>,
    mode: ViewMode,
    photo: Option<&PhotoPixels>,
    exposure: &PhotoExposure,
) -> Drawn {
    let photo = photo.filter(|p| p.len() == p.width_px as usize * p.height_px as usize && !p.is_empty());
    let rgb = || frame.to_rgb8();
    // An exact match has no finite PSNR; none is shown for it.
    let measure = |p| metrics::psnr(&frame.color, (frame.width_px, frame.height_px), p);
    let psnr = photo.map(measure).filter(|db| db.is_finite());
    match (mode, photo) {
        (ViewMode::Depth, _) => {
            let (rgb, depth_range) = depth(frame);
            Drawn { rgb, depth_range, psnr }
        }
        (ViewMode::Alpha, _) => {
            let rgb = frame.alpha.iter().map(|a| [(a.clamp(0.0, 1.0) * 255.0 + 0.5) as u8; 3]).collect();
            Drawn { rgb, depth_range: None, psnr }
        }
        (ViewMode::Difference, Some(p)) => Drawn { rgb: difference(frame, p, exposure), depth_range: None, psnr },
        (ViewMode::Photo, Some(p)) => {
            let (from, to) = ((p.width_px as usize, p.height_px as usize), (frame.width_px, frame.height_px));
            Drawn { rgb: resize(&p.rgb, from, to, Filter::Bilinear), depth_range: None, psnr }
        }
        (ViewMode::Rgb | ViewMode::Difference | ViewMode::Photo, _) => Drawn { rgb: rgb(), depth_range: None, psnr },
    }
}

/// Expected depth, near blue to far red between its 2nd and 98th percentile; black where nothing is.
fn depth(frame: &Frame<f32>) -> (Vec<[u8; 3]>, Option<(f32, f32)>) {
    let depths: Vec<f32> =
        frame.depth.iter().zip(&frame.alpha).map(|(d, a)| if *a > 0.1 { d / a } else { f32::NAN }).collect();
    // A few thousand values place the percentiles closely enough.
    let stride = (depths.len() / 4096).max(1);
    let sample: Vec<f64> = depths.iter().step_by(stride).filter(|d| d.is_finite()).map(|d| f64::from(*d)).collect();
    if sample.is_empty() {
        return (vec![[0; 3]; frame.alpha.len()], None);
    }
    let (near, far) = (quantile(&sample, 0.02) as f32, quantile(&sample, 0.98) as f32);
    let span = (far - near).max(f32::MIN_POSITIVE);
    (depths.iter().map(|d| Colormap::Turbo.color((d - near) / span)).collect(), Some((near, far)))
}

/// The amplified difference of every pixel that the photo covers, in the scene's exposure. What the photo's camera clipped
/// is no difference.
fn difference(frame: &Frame<f32>, photo: &PhotoPixels, exposure: &PhotoExposure) -> Vec<[u8; 3]> {
    let (w, h) = (photo.width_px as usize, photo.height_px as usize);
    let PhotoExposure { gain, bias } = exposure;
    // Each value of the rendering as the photo's camera would have taken it.
    let taken: [[f64; 256]; 3] = std::array::from_fn(|c| {
        std::array::from_fn(|value| (gain[c] * value as f64 + 255.0 * bias[c]).clamp(0.0, 255.0))
    });
    let pixel = |(i, drawn): (usize, [u8; 3])| {
        let (x, y) = (i % frame.width_px, i / frame.width_px);
        let at = nearest(y, h, frame.height_px) * w + nearest(x, w, frame.width_px);
        let covered = photo.coverage.as_ref().is_none_or(|c| c[at] > 127);
        let off = |c: usize| {
            let off = (taken[c][usize::from(drawn[c])] - f64::from(photo.rgb[at][c])).abs() / gain[c];
            (DIFFERENCE_GAIN * off).round() as u8
        };
        if covered { std::array::from_fn(off) } else { [0; 3] }
    };
    frame.to_rgb8().into_iter().enumerate().map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(value: f32) -> Frame<f32> {
        let plane = vec![value; 4];
        Frame {
            width_px: 2,
            height_px: 2,
            color: [plane.clone(), plane.clone(), plane],
            alpha: vec![1.0, 1.0, 1.0, 0.0],
            depth: vec![1.0, 2.0, 3.0, 0.0],
            ..Frame::default()
        }
    }

    const AS_IS: PhotoExposure = PhotoExposure { gain: [1.0; 3], bias: [0.0; 3] };

    fn photo(level: u8, coverage: Option<Vec<u8>>) -> PhotoPixels {
        PhotoPixels { width_px: 2, height_px: 2, rgb: vec![[level; 3]; 4], coverage, alpha: None }
    }

    #[test]
    fn difference_is_amplified_and_ignores_uncovered_pixels() {
        let drawn = paint(&frame(0.0), ViewMode::Difference, Some(&photo(10, Some(vec![255, 255, 0, 255]))), &AS_IS);
        assert_eq!(drawn.rgb, vec![[40; 3], [40; 3], [0; 3], [40; 3]]);
        let psnr = drawn.psnr.expect("they differ");
        assert!((psnr - 20.0 * 25.5_f64.log10()).abs() < 1e-9, "{psnr}");
        assert_eq!(paint(&frame(0.0), ViewMode::Rgb, Some(&photo(0, None)), &AS_IS).psnr, None);
    }

    #[test]
    fn a_photo_in_other_light_differs_only_where_something_has_changed() {
        // Half as bright again, and a little more; the last pixel of the scene has changed.
        let exposure = PhotoExposure { gain: [1.5, 1.5, 0.5], bias: [0.1, 0.0, 0.0] };
        let scene = frame(0.4);
        let taken = |v: f64| exposure.gain.map(|gain| gain * v * 255.0);
        let mut picture = photo(0, None);
        picture.rgb = vec![std::array::from_fn(|c| (taken(0.4)[c] + 255.0 * exposure.bias[c]).round() as u8); 4];
        picture.rgb[3] = [20, 20, 120];
        let of = |exposure: &PhotoExposure| paint(&scene, ViewMode::Difference, Some(&picture), exposure).rgb;
        let without = of(&exposure);
        assert!(without[..3].as_flattened().iter().all(|v| *v <= 8), "{without:?}");
        assert!(without[3].iter().all(|v| *v > 200), "the change stays: {without:?}");
        assert!(
            of(&AS_IS)[..3].as_flattened().iter().all(|v| *v > 100),
            "the control: with its exposure all is bright"
        );
        // What the camera clipped is not darker than the scene.
        let white = photo(255, None);
        let clipped = PhotoExposure { gain: [1.5; 3], ..AS_IS };
        let drawn = paint(&frame(0.9), ViewMode::Difference, Some(&white), &clipped);
        assert_eq!(drawn.rgb, vec![[0; 3]; 4]);
    }

    #[test]
    fn depth_runs_from_near_to_far_and_leaves_holes_black() {
        let drawn = paint(&frame(0.5), ViewMode::Depth, None, &AS_IS);
        let (near, far) = drawn.depth_range.expect("something is there");
        assert!((1.0..1.1).contains(&near) && (2.9..=3.0).contains(&far));
        assert_eq!(drawn.rgb[3], [0; 3]);
        assert!(drawn.rgb[0][2] > drawn.rgb[0][1] || drawn.rgb[0] != drawn.rgb[2]);
    }

    #[test]
    fn a_photo_of_another_size_is_sampled_at_pixel_centers() {
        let big = PhotoPixels {
            width_px: 4,
            height_px: 4,
            rgb: (0..16).map(|i| [i; 3]).collect(),
            coverage: None,
            alpha: None,
        };
        assert_eq!(paint(&frame(0.0), ViewMode::Photo, Some(&photo(7, None)), &AS_IS).rgb, vec![[7; 3]; 4], "as it is");
        assert_eq!(paint(&frame(0.0), ViewMode::Photo, Some(&big), &AS_IS).rgb.len(), 4);
        assert_eq!(paint(&frame(0.0), ViewMode::Photo, None, &AS_IS).rgb, vec![[0; 3]; 4], "the rendering without one");
        let drawn = paint(&frame(0.0), ViewMode::Difference, Some(&big), &AS_IS);
        assert_eq!(drawn.rgb.iter().map(|p| p[0] / 4).collect::<Vec<_>>(), vec![5, 7, 13, 15]);
    }
}
