//! Floaters: small pieces that hang in the air apart and that the photos do without.

use super::pieces::Pieces;
use super::support::color;
use super::{CleanError, CleanView};
use crate::math::lanes::Lane;
use crate::pipeline::observer::{Observer, Ticker};
use crate::render::{ContributionSink, Features, RenderSettings, Renderer, TILE_PX};
use crate::scene::GaussianCloud;

/// A piece of fewer Gaussians is small, and one of fewer than this share of the cloud.
const SMALL: u32 = 30;
const SMALL_SHARE: f64 = 1.0 / 2000.0;
/// Photos that must show a piece before they can speak for it: what one alone shows may be anywhere.
const WITNESSES: f32 = 3.0;
/// Growth of the mean squared error of its pixels from which photos miss a piece: a color step of 2 %.
const MISSED: f64 = 0.0004;

/// Whether each Gaussian is of a floater; `photos` says how many show it, if that is known.
pub(super) fn find(
    cloud: &GaussianCloud,
    pieces: &Pieces,
    photos: Option<&[f32]>,
    views: &[CleanView],
    settings: &RenderSettings,
    observer: &mut dyn Observer,
) -> Result<Vec<bool>, CleanError> {
    let n = cloud.len();
    let small = SMALL.max((n as f64 * SMALL_SHARE) as u32);
    let mut floating: Vec<bool> = (0..n).map(|i| pieces.size(i) < small.min(n.div_ceil(2) as u32)).collect();
    if let Some(photos) = photos
        && floating.contains(&true)
    {
        let mut witnesses = vec![0.0_f32; n];
        (0..n).for_each(|i| witnesses[pieces.of(i) as usize] = witnesses[pieces.of(i) as usize].max(photos[i]));
        let missed = missed(cloud, pieces, &floating, views, settings, observer)?;
        for i in 0..n {
            let piece = pieces.of(i) as usize;
            floating[i] = floating[i] && (witnesses[piece] < WITNESSES || !missed[piece]);
        }
    }
    Ok(floating)
}

/// Whether the photos become worse without each piece that is `floating`, all of them being gone; nothing is missed
/// that no photo at hand shows.
fn missed(
    cloud: &GaussianCloud,
    pieces: &Pieces,
    floating: &[bool],
    views: &[CleanView],
    settings: &RenderSettings,
    observer: &mut dyn Observer,
) -> Result<Vec<bool>, CleanError> {
    let rest: Vec<usize> = (0..cloud.len()).filter(|&i| !floating[i]).collect();
    let rest = cloud.select(&rest);
    let (mut weight, mut worse) = (vec![0.0_f64; cloud.len()], vec![0.0_f64; cloud.len()]);
    let mut renderer = Renderer::new();
    let mut ticker = Ticker::new("Comparing with the photos", views.len());
    for (k, view) in views.iter().enumerate() {
        ticker.tick(k, observer)?;
        let (camera, Some(photo)) = view.small()? else { continue };
        let mut errors = |cloud: &GaussianCloud| -> Result<Vec<f32>, CleanError> {
            let frame = renderer.render(cloud, Features::NONE, &camera, settings)?;
            let error = |i: usize| {
                let there = color(&photo, i)?;
                Some((0..3).map(|c| (frame.color[c][i].clamp(0.0, 1.0) - there[c]).powi(2)).sum::<f32>() / 3.0)
            };
            Ok((0..photo.rgb.len()).map(|i| error(i).unwrap_or(0.0)).collect())
        };
        let (with, without) = (errors(cloud)?, errors(&rest)?);
        let growth: Vec<f32> = without.iter().zip(&with).map(|(a, b)| a - b).collect();
        let mut rows: Vec<Row<'_>> = (0..camera.height_px.div_ceil(TILE_PX as u32))
            .map(|_| Row { growth: &growth, width: camera.width_px as usize, floating, sums: Vec::new() })
            .collect();
        renderer.contributions(cloud, &camera, settings, &mut rows)?;
        for (i, w, g) in rows.into_iter().flat_map(|row| row.sums) {
            let piece = pieces.of(i as usize) as usize;
            weight[piece] += f64::from(w);
            worse[piece] += f64::from(g);
        }
    }
    Ok(weight.iter().zip(&worse).map(|(w, g)| *g > MISSED * w && *w > 0.0).collect())
}

struct Row<'a> {
    /// Growth of each pixel's error when what floats is gone.
    growth: &'a [f32],
    width: usize,
    floating: &'a [bool],
    /// Gaussians, their shares of pixels and the growth there; one may stand there several times.
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
