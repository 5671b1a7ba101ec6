//! Floaters: Gaussians that hang in the air and that the photos do not need.
//!
//! Two kinds of groups are suspects: small pieces apart from all else, and connected Gaussians with colors that
//! contradict the photos. All are removed at once, the photos' views are rendered with and without them, and each
//! group is judged by its pixels. Missed groups come back, and the rest is judged again without them.

use std::collections::HashMap;

use super::pieces::{Pieces, pieces};
use super::support::{PhotoSupport, color};
use super::{CleanError, SmallView};
use crate::math::lanes::Lane;
use crate::pipeline::observer::{Observer, Ticker};
use crate::render::{ContributionSink, Features, RenderSettings, Renderer, TILE_PX};
use crate::scene::{GaussianCloud, PhotoPixels};

/// Size of a small piece: fewer Gaussians than this, or than this share of the cloud.
const SMALL: u32 = 30;
const SMALL_SHARE: f64 = 1.0 / 2000.0;
/// Least number of photos that must show a piece to keep it: a piece in one photo alone may be anywhere.
const WITNESSES: f32 = 3.0;
/// Difference of its color from the photos from which a Gaussian is a suspect anywhere.
const SUSPECT: f32 = 0.2;
/// Growth of the mean squared error of its pixels from which a piece is missed: a color step of 2 %.
const NOTICED: f64 = 0.0004;
/// Decrease of that error from which a group on a surface is better removed: a color step of 10 %.
const CLEARLY: f64 = 0.01;
/// Least share of the photos of a group on a surface that must be better without it.
const AGREED: f64 = 0.8;
/// Most rounds; the last ones bring hardly anything back.
const ROUNDS: usize = 6;

/// Neighbors, sizes and pieces of the Gaussians.
pub(super) struct Shape<'a> {
    pub(super) neighbors: &'a [Vec<(u32, f32)>],
    /// Largest standard deviations.
    pub(super) sizes: &'a [f32],
    pub(super) pieces: &'a Pieces,
}

/// Returns whether each Gaussian belongs to a floater.
pub(super) fn find(
    cloud: &GaussianCloud,
    shape: &Shape<'_>,
    support: Option<&PhotoSupport>,
    views: &[SmallView],
    settings: &RenderSettings,
    observer: &mut dyn Observer,
) -> Result<Vec<bool>, CleanError> {
    let n = cloud.len();
    let least = SMALL.max((n as f64 * SMALL_SHARE) as u32).min(n.div_ceil(2) as u32);
    let apart = |i: usize| shape.pieces.size(i) < least;
    let mut floating: Vec<bool> = (0..n).map(apart).collect();
    let Some(PhotoSupport { photos, error: Some(error), .. }) = support else {
        // With cameras alone, only the number of views counts.
        let seen = |i: usize| support.is_some_and(|s| s.photos[i] >= WITNESSES);
        let mut kept = vec![false; n];
        (0..n).filter(|i| seen(*i)).for_each(|i| kept[shape.pieces.of(i) as usize] = true);
        (0..n).for_each(|i| floating[i] &= !kept[shape.pieces.of(i) as usize]);
        return Ok(floating);
    };
    let mut looking = Looking { cloud, views, settings, photos, observer };
    let of: Vec<usize> = (0..n).map(|i| shape.pieces.of(i) as usize).collect();
    looking.keep(&vec![false; n], &mut floating, &of, |verdict| !verdict.is_missed())?;
    // A floater's error would be blamed on the surface behind it, so floaters are removed before surfaces are judged.
    let gone = floating;
    let odd = |i: usize| !gone[i] && !apart(i) && error[i] > SUSPECT && photos[i] >= WITNESSES;
    let odd_pieces = pieces(shape.neighbors, shape.sizes, odd);
    let of: Vec<usize> = (0..n).map(|i| odd_pieces.of(i) as usize).collect();
    let mut on_surfaces: Vec<bool> = (0..n).map(odd).collect();
    looking.keep(&gone, &mut on_surfaces, &of, Verdict::is_better_without)?;
    Ok(gone.iter().zip(&on_surfaces).map(|(a, b)| a | b).collect())
}

/// Gaussians under judgment, and the views of them.
struct Looking<'a> {
    cloud: &'a GaussianCloud,
    views: &'a [SmallView],
    settings: &'a RenderSettings,
    /// Photos that show each Gaussian.
    photos: &'a [f32],
    observer: &'a mut dyn Observer,
}

impl Looking<'_> {
    /// Leaves `floating` only the groups that `floats` accepts and those in too few photos, until each is judged
    /// without the others; `gone` Gaussians are absent.
    fn keep(
        &mut self,
        gone: &[bool],
        floating: &mut [bool],
        group: &[usize],
        floats: impl Fn(&Verdict) -> bool,
    ) -> Result<(), CleanError> {
        let mut witnesses = vec![0.0_f32; group.len()];
        for (of, photos) in group.iter().zip(self.photos) {
            witnesses[*of] = witnesses[*of].max(*photos);
        }
        for _ in 0..ROUNDS {
            if !floating.contains(&true) {
                break;
            }
            let verdicts = self.judge(gone, floating, group)?;
            let mut is_changed = false;
            for (floating, of) in floating.iter_mut().zip(group) {
                let stays = *floating && !floats(&verdicts[*of]) && witnesses[*of] >= WITNESSES;
                (*floating, is_changed) = (*floating && !stays, is_changed || stays);
            }
            if !is_changed {
                break;
            }
        }
        Ok(())
    }
}

/// Evidence of the photos about a group.
#[derive(Clone, Copy, Default)]
struct Verdict {
    /// Shares of pixels, and growth of their squared errors without the floating groups.
    weight: f64,
    growth: f64,
    /// Photos that show it, and those that are better without it.
    photos: f64,
    better: f64,
}

impl Verdict {
    fn is_missed(&self) -> bool {
        self.growth > NOTICED * self.weight
    }

    fn is_better_without(&self) -> bool {
        self.growth < -CLEARLY * self.weight && self.better >= AGREED * self.photos
    }
}

impl Looking<'_> {
    /// Judges each group of the `floating` Gaussians, with all of them removed.
    fn judge(&mut self, gone: &[bool], floating: &[bool], group: &[usize]) -> Result<Vec<Verdict>, CleanError> {
        let there: Vec<usize> = (0..gone.len()).filter(|&i| !gone[i]).collect();
        let rest: Vec<usize> = there.iter().copied().filter(|&i| !floating[i]).collect();
        let (there, rest) = ((self.cloud.select(&there), there), self.cloud.select(&rest));
        let is_judged: Vec<bool> = there.1.iter().map(|&i| floating[i]).collect();
        let mut verdicts = vec![Verdict::default(); gone.len()];
        let mut renderer = Renderer::new();
        let mut ticker = Ticker::new("Comparing with the photos", self.views.len());
        for (k, view) in self.views.iter().enumerate() {
            ticker.tick(k, self.observer)?;
            let (camera, Some(photo)) = view else { continue };
            let mut errors = |cloud: &GaussianCloud| -> Result<Vec<f32>, CleanError> {
                let frame = renderer.render(cloud, Features::NONE, camera, self.settings)?;
                Ok((0..photo.rgb.len()).map(|i| squared_error(&frame.color, photo, i)).collect())
            };
            let (with, without) = (errors(&there.0)?, errors(&rest)?);
            let growth: Vec<f32> = without.iter().zip(&with).map(|(a, b)| a - b).collect();
            let mut rows: Vec<Row<'_>> = (0..camera.height_px.div_ceil(TILE_PX as u32))
                .map(|_| Row {
                    growth: &growth,
                    width: camera.width_px as usize,
                    floating: &is_judged,
                    sums: Vec::new(),
                })
                .collect();
            renderer.contributions(&there.0, camera, self.settings, &mut rows)?;
            let mut here: HashMap<usize, (f64, f64)> = HashMap::new();
            for (i, w, g) in rows.into_iter().flat_map(|row| row.sums) {
                let sums = here.entry(group[there.1[i as usize]]).or_default();
                *sums = (sums.0 + f64::from(w), sums.1 + f64::from(g));
            }
            for (of, (weight, growth)) in here {
                let verdict = &mut verdicts[of];
                verdict.weight += weight;
                verdict.growth += growth;
                verdict.photos += 1.0;
                verdict.better += f64::from(growth < 0.0);
            }
        }
        Ok(verdicts)
    }
}

/// Mean over the channels; 0 for pixels that the photo does not cover.
fn squared_error(drawn: &[Vec<f32>; 3], photo: &PhotoPixels, i: usize) -> f32 {
    let Some(there) = color(photo, i) else { return 0.0 };
    (0..3).map(|c| (drawn[c][i].clamp(0.0, 1.0) - there[c]).powi(2)).sum::<f32>() / 3.0
}

struct Row<'a> {
    /// Growth of each pixel's error without the floating groups.
    growth: &'a [f32],
    width: usize,
    floating: &'a [bool],
    /// Gaussians, their shares of pixels and the growth there; one may be listed several times.
    sums: Vec<(u32, f32, f32)>,
}

impl ContributionSink<f32> for Row<'_> {
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
        if !self.floating[gaussian as usize] {
            return;
        }
        let there = self.growth[(y * self.width + x).min(self.growth.len())..].iter();
        let inside = weights.iter().zip(there).take(self.width.saturating_sub(x));
        let (w, g) = inside.fold((0.0, 0.0), |(w, g), (share, growth)| (w + share, g + share * growth));
        match self.sums.last_mut().filter(|last| last.0 == gaussian) {
            Some(last) => (last.1, last.2) = (last.1 + w, last.2 + g),
            None => self.sums.push((gaussian, w, g)),
        }
    }
}
