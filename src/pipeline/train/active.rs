//! Gaussians of which new photos say more than the old ones: these see them finer, or differ more from them.
//!
//! The finest sampling of a Gaussian is that of the view with most pixels per unit at its depth, among the views to
//! whose pixels it contributes. Its error is the mean difference of photos and renderings, weighted by its
//! contributions.

use glam::DVec3;
use rayon::prelude::*;

use super::refine::without_gain;
use super::{TrainError, TrainView};
use crate::math::lanes::Lane;
use crate::math::stats::median;
use crate::pipeline::observer::{Observer, Ticker};
use crate::render::{ContributionSink, Features, Frame, RenderSettings, Renderer, TILE_PX};
use crate::scene::{Camera, GaussianCloud};

/// Least contribution to a view for a Gaussian to count as seen by a new photo, and by an old one, px.
const SEEN_NEW_PX: f32 = 0.5;
const SEEN_OLD_PX: f32 = 0.1;
/// Ratio of samplings from which a new photo is finer than all old ones, and from which it is as fine.
const FINER: f32 = 1.4;
const AS_FINE: f32 = 0.7;
/// Error from which a finer photo says something new.
const NEWS: f32 = 0.012;
/// Error of an equally fine photo, and its multiple of the old photos' error, from which it says something new.
const DIFFERENT: f32 = 0.04;
const TIMES: f32 = 2.0;
/// Range of a photo's and a rendering's values that tell its gain; fewest such pixels, as a share.
const TELLING: [f32; 2] = [0.08, 0.92];
const FEWEST: f64 = 0.05;
/// Correlation with its rendering under which a photo does not show the scene at its pose.
const ALIKE: f64 = 0.3;
/// Contrast of a photo under which a correlation says nothing.
const FLAT: f64 = 0.03;
/// Longer side at which old photos are looked through for active Gaussians, px.
const LOOK_SIDE_PX: u32 = 200;

/// Gaussians as some photos show them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ShownGaussians {
    /// Finest sampling, px per scene unit; 0 if no photo sees it.
    rate: Vec<f32>,
    /// Contributions to all photos, px, and the same times the error of the pixel.
    weight: Vec<f32>,
    error: Vec<f32>,
    /// Contribution to the photo to which it contributes most, px.
    most: Vec<f32>,
}

/// Gaussians that go on, and the pixels of the new photos that they fill.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ActiveGaussians {
    pub(crate) is: Vec<bool>,
    /// Each Gaussian's pixels in the new photo that shows it largest, added up.
    pub(crate) pixels: f64,
}

impl ActiveGaussians {
    pub(crate) fn count(&self) -> usize {
        self.is.iter().filter(|is| **is).count()
    }

    /// Returns all Gaussians by index: those that stay, then those that go on.
    pub(crate) fn order(&self) -> Vec<usize> {
        let of = |wanted: bool| (0..self.is.len()).filter(move |i| self.is[*i] == wanted);
        of(false).chain(of(true)).collect()
    }
}

impl ShownGaussians {
    fn none(n: usize) -> Self {
        Self { rate: vec![0.0; n], weight: vec![0.0; n], error: vec![0.0; n], most: vec![0.0; n] }
    }

    /// Returns each Gaussian's pixels in the photo that shows it largest, added up.
    pub(crate) fn pixels(&self) -> f64 {
        self.most.iter().map(|px| f64::from(*px)).sum()
    }

    fn mean_error(&self, i: usize) -> f32 {
        if self.weight[i] > 0.0 { self.error[i] / self.weight[i] } else { 0.0 }
    }

    /// Returns the Gaussians of which `new` photos say more than these.
    pub(crate) fn less_than(&self, new: &Self) -> ActiveGaussians {
        let is = |i: usize| {
            let (before, after) = (self.rate[i], new.rate[i]);
            let (error, now) = (self.mean_error(i), new.mean_error(i));
            after > 0.0
                && (after >= FINER * before && now >= NEWS
                    || after >= AS_FINE * before && now >= DIFFERENT.max(TIMES * error))
        };
        let is: Vec<bool> = (0..self.rate.len()).map(is).collect();
        let pixels = is.iter().zip(&new.most).filter(|(is, _)| **is).map(|(_, px)| f64::from(*px)).sum();
        ActiveGaussians { is, pixels }
    }
}

/// Measures what photos show of each Gaussian. `are_new` photos must show it well to count.
pub(crate) fn shown(
    cloud: &GaussianCloud,
    views: &[&TrainView],
    settings: &RenderSettings,
    are_new: bool,
    observer: &mut dyn Observer,
) -> Result<ShownGaussians, TrainError> {
    let mut ticker = Ticker::new(if are_new { "Comparing new photos" } else { "Comparing photos" }, views.len());
    let (mut renderer, mut all) = (Renderer::new(), ShownGaussians::none(cloud.len()));
    let least = if are_new { SEEN_NEW_PX } else { SEEN_OLD_PX };
    for (done, view) in views.iter().enumerate() {
        let failed = |e| TrainError::Render(view.name.clone(), e);
        let frame = renderer.render(cloud, Features::NONE, &view.camera, settings).map_err(failed)?;
        let errors = differences(&frame, view);
        let mut own = vec![[0.0_f32; 2]; cloud.len()];
        for (gaussian, sums) in weighed(&mut renderer, cloud, &view.camera, settings, &errors).map_err(failed)? {
            own[gaussian as usize].iter_mut().zip(sums).for_each(|(o, s)| *o += s);
        }
        let axis = view.camera.world_from_camera * DVec3::Z;
        for (i, [weight, error]) in own.into_iter().enumerate().filter(|(_, [weight, _])| *weight >= least) {
            let depth = (cloud.world_position(i) - view.camera.center).dot(axis);
            if depth > 0.0 {
                all.rate[i] = all.rate[i].max((view.camera.focal_px.x / depth) as f32);
            }
            all.weight[i] += weight;
            all.error[i] += error;
            all.most[i] = all.most[i].max(weight);
        }
        ticker.tick(done + 1, observer)?;
    }
    Ok(all)
}

/// Returns the share of each view that active Gaussians fill.
pub(crate) fn shares(
    cloud: &GaussianCloud,
    active: &[bool],
    cameras: &[&Camera],
    settings: &RenderSettings,
    observer: &mut dyn Observer,
) -> Result<Vec<f64>, TrainError> {
    let mut ticker = Ticker::new("Looking for photos of what is refined", cameras.len());
    let (mut renderer, mut all) = (Renderer::new(), Vec::with_capacity(cameras.len()));
    for (done, camera) in cameras.iter().enumerate() {
        let camera = camera.limited_to(LOOK_SIDE_PX);
        let pixels = camera.width_px as usize * camera.height_px as usize;
        let found = weighed(&mut renderer, cloud, &camera, settings, &vec![0.0; pixels]);
        let found = found.map_err(|e| TrainError::Render(format!("{}", done + 1), e))?;
        let filled = found.iter().filter(|(g, _)| active[*g as usize]).map(|(_, [w, _])| f64::from(*w)).sum::<f64>();
        all.push(filled / pixels.max(1) as f64);
        ticker.tick(done + 1, observer)?;
    }
    Ok(all)
}

/// Fit of a photo to the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AddedPhotoFit {
    /// Gain of its colors against the scene's, by channel.
    pub(crate) gain: [f32; 3],
    /// False if it does not show the scene at its pose.
    pub(crate) fits: bool,
}

/// Compares a photo with the scene at its pose.
pub(crate) fn fit(
    renderer: &mut Renderer,
    cloud: &GaussianCloud,
    view: &TrainView,
    settings: &RenderSettings,
) -> Result<AddedPhotoFit, TrainError> {
    let frame = renderer.render(cloud, Features::NONE, &view.camera, settings);
    let frame = frame.map_err(|e| TrainError::Render(view.name.clone(), e))?;
    Ok(AddedPhotoFit { gain: gain(&frame, view), fits: is_alike(&frame, view) })
}

/// Returns the view without its gain.
pub(crate) fn corrected(view: &TrainView, gain: [f32; 3]) -> TrainView {
    let mut view = view.clone();
    without_gain(&mut view.pixels, gain);
    view
}

fn counts(view: &TrainView, pixel: usize) -> bool {
    view.pixels.coverage.as_ref().is_none_or(|c| c[pixel] > 127)
}

/// Returns the median ratio of photo and rendering by channel; 1 where too few pixels tell.
fn gain(frame: &Frame<f32>, view: &TrainView) -> [f32; 3] {
    let [low, high] = TELLING;
    std::array::from_fn(|c| {
        let pairs = view.pixels.rgb.iter().enumerate().map(|(i, rgb)| (i, f32::from(rgb[c]) / 255.0));
        let telling = pairs.filter(|(i, photo)| {
            let drawn = frame.color[c][*i];
            counts(view, *i) && [*photo, drawn].iter().all(|v| (low..=high).contains(v))
        });
        let ratios: Vec<f64> = telling.map(|(i, photo)| f64::from(photo / frame.color[c][i])).collect();
        let is_enough = ratios.len() as f64 >= FEWEST * view.pixels.rgb.len() as f64;
        if is_enough { median(&ratios) as f32 } else { 1.0 }
    })
}

/// Returns whether a photo and its rendering have the same bright and dark places, as far as the photo has any.
fn is_alike(frame: &Frame<f32>, view: &TrainView) -> bool {
    let gray = |rgb: [f64; 3]| (rgb[0] + rgb[1] + rgb[2]) / 3.0;
    let pairs: Vec<[f64; 2]> = (0..view.pixels.rgb.len())
        .filter(|i| counts(view, *i))
        .map(|i| {
            let drawn = std::array::from_fn(|c| f64::from(frame.color[c][i]).clamp(0.0, 1.0));
            [gray(view.pixels.rgb[i].map(|v| f64::from(v) / 255.0)), gray(drawn)]
        })
        .collect();
    let n = pairs.len().max(1) as f64;
    let mean = |k: usize| pairs.iter().map(|p| p[k]).sum::<f64>() / n;
    let (a, b) = (mean(0), mean(1));
    let product = |i: usize, j: usize| {
        let off = |p: &[f64; 2], k: usize| p[k] - if k == 0 { a } else { b };
        pairs.iter().map(|p| off(p, i) * off(p, j)).sum::<f64>() / n
    };
    let (photo, drawn) = (product(0, 0).sqrt(), product(1, 1).sqrt());
    photo < FLAT || product(0, 1) >= ALIKE * photo * drawn && drawn > 0.0
}

/// Mean difference of a photo and its rendering at each pixel, 0 to 1; 0 where the photo shows nothing.
fn differences(frame: &Frame<f32>, view: &TrainView) -> Vec<f32> {
    let of = |(i, rgb): (usize, &[u8; 3])| {
        let off = |c: usize| (frame.color[c][i].clamp(0.0, 1.0) - f32::from(rgb[c]) / 255.0).abs();
        if counts(view, i) { (off(0) + off(1) + off(2)) / 3.0 } else { 0.0 }
    };
    view.pixels.rgb.par_iter().enumerate().map(of).collect()
}

/// Returns the contributions of Gaussians to a view: weight in px, and weight times the value of the pixel, row of
/// tiles by row.
fn weighed(
    renderer: &mut Renderer,
    cloud: &GaussianCloud,
    camera: &Camera,
    settings: &RenderSettings,
    values: &[f32],
) -> Result<Vec<(u32, [f32; 2])>, crate::render::RenderError> {
    let (width, height) = (camera.width_px as usize, camera.height_px as usize);
    let row = || WeighedRow { values, width, found: Vec::new() };
    let mut rows: Vec<WeighedRow<'_>> = (0..height.div_ceil(TILE_PX)).map(|_| row()).collect();
    renderer.contributions(cloud, camera, settings, &mut rows)?;
    Ok(rows.into_iter().flat_map(|r| r.found).collect())
}

/// Contributions to a row of tiles, with the values of its pixels.
struct WeighedRow<'a> {
    values: &'a [f32],
    width: usize,
    found: Vec<(u32, [f32; 2])>,
}

impl ContributionSink<f32> for WeighedRow<'_> {
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
        let end = (x + weights.len()).min(self.width);
        let values = &self.values[y * self.width + x..y * self.width + end];
        let sums = values.iter().zip(weights).fold([0.0; 2], |[w, e], (v, weight)| [w + weight, e + weight * v]);
        match self.found.last_mut().filter(|last| last.0 == gaussian) {
            Some((_, own)) => own.iter_mut().zip(sums).for_each(|(o, s)| *o += s),
            None => self.found.push((gaussian, sums)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::observer::Silent;
    use crate::scene::PhotoPixels;

    fn view(name: &str, distance: f64, value: u8) -> TrainView {
        let eye = DVec3::new(0.0, 0.0, -distance);
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::NEG_Y, 0.6, 48, 48).expect("valid");
        let rgb = vec![[value; 3]; 48 * 48];
        TrainView {
            name: name.into(),
            camera,
            pixels: PhotoPixels { width_px: 48, height_px: 48, rgb, coverage: None, alpha: None },
        }
    }

    /// A gray Gaussian in the middle, one far to the side that only the far view sees.
    fn cloud() -> GaussianCloud {
        GaussianCloud { sh: vec![[0.0; 3]; 2], ..GaussianCloud::isotropic(vec![[0.0; 3], [2.5, 0.0, 0.0]], -1.5, 3.0) }
    }

    fn active(near: &TrainView) -> Vec<bool> {
        let (cloud, settings, far) = (cloud(), RenderSettings::default(), view("far", 12.0, 128));
        let old = shown(&cloud, &[&far], &settings, false, &mut Silent).expect("drawn");
        let new = shown(&cloud, &[near], &settings, true, &mut Silent).expect("drawn");
        let found = old.less_than(&new);
        assert_eq!(found.is.iter().filter(|is| **is).count(), found.count());
        assert!((found.pixels > 0.0) == (found.count() > 0));
        found.is
    }

    #[test]
    fn what_a_finer_or_differing_photo_shows_is_active() {
        assert_eq!(active(&view("near", 3.0, 40)), [true, false], "finer; the other one is not in it");
        assert_eq!(active(&view("again", 12.0, 128)), [false; 2], "the control: the same photo once more");
        assert_eq!(active(&view("coarser", 24.0, 40)), [false; 2], "differs, but sees less");
        let order = ActiveGaussians { is: vec![true, false, true, false], pixels: 1.0 }.order();
        assert_eq!(order, [1, 3, 0, 2]);
    }

    #[test]
    fn gains_are_measured_and_photos_of_something_else_told() {
        let (cloud, settings, mut renderer) = (cloud(), RenderSettings::default(), Renderer::new());
        let mut photo = view("near", 3.0, 0);
        let frame = renderer.render(&cloud, Features::NONE, &photo.camera, &settings).expect("drawn");
        let drawn = |i: usize, c: usize| frame.color[c][i];
        let of = |gain: f32| -> Vec<[u8; 3]> {
            (0..48 * 48).map(|i| std::array::from_fn(|c| (drawn(i, c) * gain * 255.0) as u8)).collect()
        };
        photo.pixels.rgb = of(1.25);
        let fit = |photo: &TrainView| super::fit(&mut Renderer::new(), &cloud, photo, &settings).expect("drawn");
        let found = fit(&photo);
        assert!(found.fits && found.gain.iter().all(|g| (g - 1.25).abs() < 0.03), "{found:?}");
        let same = corrected(&photo, found.gain);
        assert!(differences(&frame, &same).iter().all(|e| *e < 0.02));
        photo.pixels.rgb = of(1.0).iter().map(|rgb| rgb.map(|v| 255 - v)).collect();
        assert!(!fit(&photo).fits, "the control: a negative");
        let shares = shares(&cloud, &[true, false], &[&photo.camera], &settings, &mut Silent).expect("drawn");
        assert!(shares[0] > 0.01, "{shares:?}");
    }
}
