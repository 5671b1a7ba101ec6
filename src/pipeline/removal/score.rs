//! Score of a removal against the truth: pixels of the thing in a view, uncovered ones and invented ones.

use glam::DVec3;
use serde::Serialize;

use super::plane::planes;
use crate::math::grid;
use crate::math::stats::{mean, psnr_of, quantile};
use crate::pipeline::depth::TrueDepth;
use crate::render::{Frame, ssim};
use crate::scene::Camera;

/// Relative difference from which depths along one ray are those of two surfaces: rays are cast exactly.
const SAME_RAY: f32 = 1e-4;
/// The same along two rays that meet a surface within a pixel of each other.
const SAME_DEPTH: f32 = 0.005;

/// Region of a pixel in a view from which a thing was removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RemovalRegion {
    /// No pixel of the thing.
    Outside,
    /// No pixel of the thing, but with its shadow or its light.
    Shaded,
    /// Beside the thing: the photo shows a little of both.
    Rim,
    /// Hidden by the thing here, but visible in another photo.
    Uncovered,
    /// Hidden by the thing in all photos.
    Invented,
}

/// Least difference of a color for a shadow or light of the thing.
const SHADE: f64 = 3.0 / 255.0;
/// Most flat surfaces behind a thing, and points sampled for them.
const FLAT: usize = 3;
const POINTS: usize = 4_000;

/// Marks pixels outside the thing whose colors with and without it differ.
pub(crate) fn mark_shaded(regions: &mut [RemovalRegion], with: &[Vec<f64>; 3], without: &[Vec<f64>; 3]) {
    for (i, region) in regions.iter_mut().enumerate().filter(|(_, r)| **r == RemovalRegion::Outside) {
        if (0..3).any(|c| (with[c][i] - without[c][i]).abs() > SHADE) {
            *region = RemovalRegion::Shaded;
        }
    }
}

/// Returns the share of the scene behind a thing that lies on flat surfaces, by cameras, regions, and true depths
/// with it and without.
pub(crate) fn flat_share<'a>(
    views: impl Iterator<Item = (&'a Camera, &'a [RemovalRegion], &'a TrueDepth, &'a TrueDepth)>,
) -> f64 {
    let (mut thing, mut behind, mut toward) = (Vec::new(), Vec::new(), DVec3::ZERO);
    for (camera, regions, with, without) in views {
        toward = camera.center;
        for (i, _) in
            regions.iter().enumerate().filter(|(_, r)| matches!(r, RemovalRegion::Uncovered | RemovalRegion::Invented))
        {
            let at = glam::DVec2::new((i % with.width) as f64 + 0.5, (i / with.width) as f64 + 0.5);
            let point = |depth: f32| camera.center + camera.ray(at) * f64::from(depth);
            thing.push(point(with.values[i]));
            if without.values[i] > 0.0 {
                behind.push(point(without.values[i]));
            }
        }
    }
    let middle = thing.iter().sum::<DVec3>() / thing.len().max(1) as f64;
    let far: Vec<f64> = thing.iter().map(|p| p.distance(middle)).collect();
    let step = behind.len().div_ceil(POINTS).max(1);
    let points: Vec<DVec3> = behind.into_iter().step_by(step).collect();
    let found = planes(&points, toward, quantile(&far, 0.98), FLAT, 0);
    let on_one = points.iter().filter(|p| found.iter().any(|plane| plane.height(**p).abs() <= plane.tolerance)).count();
    on_one as f64 / points.len().max(1) as f64
}

/// Returns the regions of the view of `camera`: the thing's pixels by true depths with it and without, and those of
/// them that the `photos` with it uncover. Depths have the cameras' sizes.
pub(crate) fn regions(
    camera: &Camera,
    (with, without): (&TrueDepth, &TrueDepth),
    photos: &[(Camera, TrueDepth)],
) -> Vec<RemovalRegion> {
    const RIM_PX: usize = 2;
    let differ = |a: f32, b: f32, share: f32| (a - b).abs() > share * a.max(b);
    let one = |i: usize| {
        let (before, behind) = (with.values[i], without.values[i]);
        if !differ(before, behind, SAME_RAY) {
            return RemovalRegion::Outside;
        }
        let at = glam::DVec2::new((i % with.width) as f64 + 0.5, (i / with.width) as f64 + 0.5);
        // An empty background is known to be empty.
        let point = camera.center + camera.ray(at) * f64::from(behind);
        let shows = |(photo, depth): &(Camera, TrueDepth)| {
            let Some(p) = photo.project(point) else { return false };
            let inside = p.x >= 0.0 && p.y >= 0.0 && p.x < depth.width as f64 && p.y < depth.height as f64;
            inside && {
                let there = depth.values[p.y as usize * depth.width + p.x as usize];
                !differ(there, photo.camera_from_world(point).z as f32, SAME_DEPTH)
            }
        };
        if behind == 0.0 || photos.iter().any(shows) { RemovalRegion::Uncovered } else { RemovalRegion::Invented }
    };
    let mut all: Vec<RemovalRegion> = (0..with.values.len()).map(one).collect();
    let inside = all.iter().map(|r| *r != RemovalRegion::Outside).collect();
    let beside = grid::grown(with.width, inside, RIM_PX);
    all.iter_mut()
        .zip(beside)
        .filter(|(r, is)| **r == RemovalRegion::Outside && *is)
        .for_each(|(r, _)| *r = RemovalRegion::Rim);
    all
}

/// Pixels of one region over all views.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    pixels: usize,
    squares: f64,
    /// SSIM of the region in each view, from images that may differ only there, and its pixels.
    ssim: Vec<(f64, usize)>,
    /// Relative errors of depth; 1 for a missing depth.
    depth: Vec<f64>,
}

/// Figures of a [`Tally`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct RegionScore {
    pub(crate) pixels: usize,
    /// PSNR, dB.
    pub(crate) psnr: f64,
    pub(crate) ssim: f64,
    /// Mean relative error of depth.
    pub(crate) depth: f64,
}

impl Tally {
    /// Adds the pixels of a frame in the region `which`, against planes of the truth.
    pub(crate) fn add(
        &mut self,
        frame: &Frame<f32>,
        truth: &[Vec<f64>; 3],
        depth: Option<&TrueDepth>,
        regions: &[RemovalRegion],
        which: RemovalRegion,
    ) {
        let inside: Vec<usize> = (0..regions.len()).filter(|i| regions[*i] == which).collect();
        if inside.is_empty() {
            return;
        }
        let mut drawn = truth.clone();
        for c in 0..3 {
            for &i in &inside {
                drawn[c][i] = f64::from(frame.color[c][i].clamp(0.0, 1.0));
                self.squares += (drawn[c][i] - truth[c][i]).powi(2) / 3.0;
            }
        }
        self.pixels += inside.len();
        // Elsewhere nothing differs, so the whole loss of the mean is the region's.
        let lacks = (1.0 - ssim(&drawn, truth, frame.width_px)) * regions.len() as f64 / inside.len() as f64;
        self.ssim.push((1.0 - lacks, inside.len()));
        for (i, want) in inside.iter().filter_map(|&i| Some((i, depth?.values[i]))).filter(|(_, want)| *want > 0.0) {
            let have = frame.median_depth[i];
            self.depth.push(if have > 0.0 { f64::from((have - want).abs() / want) } else { 1.0 });
        }
    }

    /// Returns the score; `None` if no view has the region.
    pub(crate) fn score(&self) -> Option<RegionScore> {
        (self.pixels > 0).then(|| RegionScore {
            pixels: self.pixels,
            psnr: psnr_of(self.squares / self.pixels as f64),
            ssim: self.ssim.iter().map(|(s, n)| s * *n as f64).sum::<f64>() / self.pixels as f64,
            depth: mean(&self.depth),
        })
    }
}
