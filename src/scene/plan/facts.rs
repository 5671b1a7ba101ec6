//! Facts about a scene's data and the machine, gathered once; a plan is computed from them.

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use crate::math::rotation::matrix_from_quaternion;
use crate::math::{Real, sh};
use crate::scene::{Camera, Dataset, GaussianCloud, LanguageFeatures, Level, SemanticMap};

/// Resources of the machine that a plan depends on.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// Memory that programs may still use, in bytes.
    pub(crate) free_memory_bytes: u64,
    /// Most Gaussians of a training run in that memory.
    pub(crate) max_gaussians: usize,
    pub(crate) cores: usize,
    /// Name of the graphics adapter if it is a real one; `None` where there is none or it is
    /// emulated in software.
    pub(crate) gpu: Option<String>,
}

/// Settings of the user that a plan starts from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Limits {
    /// Longer side of training pictures at most, px.
    pub train_side_px: u32,
    /// Longer side, at most, of the pictures in which objects are searched for, px.
    pub object_side_px: u32,
    /// Highest degree of a training's spherical harmonics.
    pub sh_degree: u8,
    /// Interval of held-out photos; 0 = none.
    pub holdout_every: usize,
}

/// The Gaussians of a scene.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct CloudFacts {
    pub(crate) gaussians: usize,
    /// Degree of the spherical harmonics in the file.
    pub(crate) sh_stored: u8,
    /// Degree up to which any coefficient is not zero.
    pub(crate) sh_used: u8,
    /// Degree up to which they can be seen.
    pub(crate) sh_visible: u8,
    /// Longer side in px at which the photos show all that the Gaussians resolve; `None` without
    /// photos.
    pub(crate) resolved_side_px: Option<u32>,
}

/// The photos of a scene.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PhotoFacts {
    pub(crate) photos: usize,
    /// Photos that the dataset marks as test.
    pub(crate) test_photos: usize,
    /// Width and height of the first, px.
    pub(crate) size_px: [u32; 2],
    /// Longest side of all of them, px.
    pub(crate) longest_px: u32,
    pub(crate) pixels: u64,
    /// Pixels of all of them once they are limited to the training's size.
    pub(crate) limited_pixels: u64,
}

/// Objects and parts of a scene.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SemanticFacts {
    pub(crate) objects: usize,
    pub(crate) parts: usize,
    /// Encoder of their embeddings, if there are any.
    pub(crate) encoder: Option<String>,
    pub(crate) numbers: usize,
}

/// All that a plan depends on.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SceneFacts {
    /// The Gaussians, if they are a result.
    pub(crate) cloud: Option<CloudFacts>,
    pub(crate) photos: Option<PhotoFacts>,
    /// Objects and parts, if they were found.
    pub(crate) semantics: Option<SemanticFacts>,
    pub(crate) machine: Machine,
    pub(crate) limits: Limits,
}

impl SceneFacts {
    /// Facts of a machine with nothing open.
    pub fn of(machine: Machine, limits: Limits) -> Self {
        Self { machine, limits, ..Self::default() }
    }

    /// With the photos that these cameras took.
    pub fn with_photos(mut self, cameras: &[Camera]) -> Self {
        self.photos = PhotoFacts::of(cameras, self.limits.train_side_px);
        self
    }

    /// With this number of photos that the dataset marks as test.
    pub(crate) fn with_test_photos(mut self, test_photos: usize) -> Self {
        self.photos = self.photos.map(|photos| PhotoFacts { test_photos, ..photos });
        self
    }

    /// With these Gaussians, whose file had harmonics of degree `sh_stored`, seen by `cameras`.
    pub fn with_cloud(mut self, cloud: &GaussianCloud, sh_stored: u8, cameras: &[Camera]) -> Self {
        self.cloud = Some(CloudFacts {
            gaussians: cloud.len(),
            sh_stored,
            sh_used: used_degree(cloud),
            sh_visible: visible_degree(cloud),
            resolved_side_px: resolved_side_px(cloud, cameras),
        });
        self
    }

    /// The same scene with other Gaussians.
    pub(crate) fn with_edited(self, cloud: &GaussianCloud, cameras: &[Camera]) -> Self {
        let sh_stored = self.cloud.as_ref().map_or(cloud.sh_degree, |c| c.sh_stored);
        self.with_cloud(cloud, sh_stored, cameras)
    }

    /// Returns whether a CPU draws, and there are more Gaussians than it can draw in time.
    pub(crate) fn is_large(&self, on_cpu: bool) -> bool {
        (on_cpu || self.machine.gpu.is_none()) && self.cloud.as_ref().is_some_and(|c| c.gaussians >= LARGE)
    }

    /// With these objects and parts.
    pub fn with_semantics(mut self, map: Option<&SemanticMap>) -> Self {
        self.semantics = map.map(SemanticFacts::of);
        self
    }

    /// The same facts for other settings of the user.
    pub(crate) fn with_limits(mut self, limits: Limits, dataset: Option<&Dataset>) -> Self {
        if let (Some(dataset), true) = (dataset, limits.train_side_px != self.limits.train_side_px) {
            self.photos = PhotoFacts::of(&dataset.cameras(), limits.train_side_px);
            self = self.with_test_photos(dataset.test_photos());
        }
        self.limits = limits;
        self
    }
}

impl PhotoFacts {
    fn of(cameras: &[Camera], limit_px: u32) -> Option<Self> {
        let first = cameras.first()?;
        let pixels = |c: &Camera| u64::from(c.width_px) * u64::from(c.height_px);
        Some(Self {
            photos: cameras.len(),
            test_photos: 0,
            size_px: [first.width_px, first.height_px],
            longest_px: cameras.iter().map(|c| c.width_px.max(c.height_px)).max().unwrap_or(0),
            pixels: cameras.iter().map(pixels).sum(),
            limited_pixels: cameras.iter().map(|c| pixels(&c.limited_to(limit_px))).sum(),
        })
    }
}

impl SemanticFacts {
    fn of(map: &SemanticMap) -> Self {
        let of = |level: Level| map.identities.iter().filter(|(_, i)| i.level == level).count();
        let vectors =
            |l: &LanguageFeatures| -> usize { l.by_identity.iter().map(|f| f.raw.len() + f.deviated.len()).sum() };
        let numbers = map.language.as_ref().map_or(0, |l| l.dimension * vectors(l));
        let encoder = map.language.as_ref().map(|l| l.encoder.clone());
        Self { objects: of(Level::Object), parts: of(Level::Part), encoder, numbers }
    }
}

/// Gaussians from which on a moving picture of all of them is too slow (docs/notes/speed.md).
pub(crate) const LARGE: usize = 100_000;

/// Half a step of an 8-bit picture: smaller changes cannot be seen.
pub const NOISE_FLOOR: f64 = 0.5 / 255.0;

/// The lowest degree from which on no band can change any pixel by half an 8-bit step.
///
/// A band of degree `l` adds at most `|c| sqrt((2l + 1) / 4 pi)` to a color, `c` its coefficients
/// of one channel (Cauchy-Schwarz and the addition theorem). Blending weights sum to at most 1, so
/// the largest such bound over the Gaussians bounds the change of every pixel.
pub fn visible_degree<R: Real>(cloud: &GaussianCloud<R>) -> u8 {
    let bound = band_bounds(cloud);
    let mut left_out = 0.0;
    let sum_reaches = |&d: &u8| {
        left_out += bound[usize::from(d)];
        left_out >= NOISE_FLOOR
    };
    (1..=cloud.sh_degree).rev().find(sum_reaches).unwrap_or(0)
}

/// The degree above which every coefficient is zero.
pub fn used_degree<R: Real>(cloud: &GaussianCloud<R>) -> u8 {
    let bound = band_bounds(cloud);
    (1..=cloud.sh_degree).rev().find(|&d| bound[usize::from(d)] > 0.0).unwrap_or(0)
}

/// Largest change of a color by each band, by degree.
fn band_bounds<R: Real>(cloud: &GaussianCloud<R>) -> [f64; 4] {
    let of = |gaussian: &[[R; 3]]| {
        let mut energies = [0.0_f64; 4];
        for degree in 1..=cloud.sh_degree {
            let band = &gaussian[sh::coefficients(degree - 1)..sh::coefficients(degree)];
            let energy = |channel: usize| band.iter().map(|c| c[channel].f64().powi(2)).sum::<f64>();
            energies[usize::from(degree)] = (0..3).map(energy).fold(0.0, f64::max);
        }
        energies
    };
    let larger = |a: [f64; 4], b: [f64; 4]| [0, 1, 2, 3].map(|k| a[k].max(b[k]));
    let energies = cloud.sh.par_chunks_exact(cloud.sh_stride().max(1)).map(of).reduce(|| [0.0; 4], larger);
    let reach = |degree: usize| ((2 * degree + 1) as f64 / (4.0 * std::f64::consts::PI)).sqrt();
    [0, 1, 2, 3].map(|degree| energies[degree].sqrt() * reach(degree))
}

/// Most cameras and Gaussians that are sampled for the resolved size.
const CAMERAS: usize = 8;
const GAUSSIANS: usize = 4_000;
/// Share of the footprints that may be finer than the resolved size.
const FINER: f64 = 0.05;
/// Opacity under which a Gaussian draws no detail.
const FAINT: f64 = 0.1;

/// Longer side in px that the photos need to show all that the Gaussians resolve.
///
/// A Gaussian of standard deviation `s` px keeps under 1 % of its contrast beyond the highest
/// frequency that pixels `s` px apart can carry (`exp(-pi²/2)`). So pixels as far apart as the
/// finest twentieth of the footprints is wide, along its narrower axis, lose nothing to speak of.
pub fn resolved_side_px(cloud: &GaussianCloud, cameras: &[Camera]) -> Option<u32> {
    let longest = cameras.iter().map(|c| c.width_px.max(c.height_px)).max()?;
    let mut widths: Vec<f64> = Vec::new();
    for camera in cameras.iter().step_by(cameras.len().div_ceil(CAMERAS)) {
        let scale = f64::from(longest) / f64::from(camera.width_px.max(camera.height_px));
        let step = cloud.len().div_ceil(GAUSSIANS).max(1);
        widths.extend((0..cloud.len()).step_by(step).filter_map(|i| Some(footprint_px(cloud, i, camera)? * scale)));
    }
    if widths.is_empty() {
        return Some(longest);
    }
    let at = (widths.len() as f64 * FINER) as usize;
    let (_, width, _) = widths.select_nth_unstable_by(at, f64::total_cmp);
    Some((f64::from(longest) / width.max(1.0)).ceil() as u32)
}

/// Standard deviation of a Gaussian's picture along its narrower axis in px; `None` where it is not
/// in the picture or too faint to matter.
fn footprint_px(cloud: &GaussianCloud, i: usize, camera: &Camera) -> Option<f64> {
    let g = cloud.gaussian(i);
    if 1.0 / (1.0 + (-f64::from(g.opacity_logit)).exp()) < FAINT {
        return None;
    }
    let world = cloud.world_position(i);
    let at = camera.project(world)?;
    let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < f64::from(camera.width_px) && at.y < f64::from(camera.height_px);
    if !inside {
        return None;
    }
    let camera_from_world = camera.world_from_camera.transpose();
    let local = camera_from_world * (world - camera.center);
    let rotation = DMat3::from_cols_array_2d(&matrix_from_quaternion(g.quaternion.map(f64::from))?).transpose();
    let scales = DVec3::from_array(g.log_scale.map(|s| f64::from(s).exp()));
    // Rows of this map a standard normal vector to camera space; the projection is linear nearby.
    let axes = (camera_from_world * rotation * DMat3::from_diagonal(scales)).transpose();
    let row =
        |focal: f64, across: DVec3, offset: f64| axes * (across - DVec3::Z * (offset / local.z)) * (focal / local.z);
    let (u, v) = (row(camera.focal_px.x, DVec3::X, local.x), row(camera.focal_px.y, DVec3::Y, local.y));
    let (a, b, c) = (u.dot(u), u.dot(v), v.dot(v));
    let smaller = 0.5 * (a + c) - (0.25 * (a - c).powi(2) + b * b).sqrt();
    smaller.is_finite().then(|| smaller.max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_footprint_is_the_narrower_side_of_the_picture() {
        let cloud = GaussianCloud {
            origin: DVec3::new(0.3, -0.2, 0.1),
            positions: vec![[0.4, 0.3, -0.2]],
            log_scales: vec![[-3.0, -4.5, -2.5]],
            quaternions: vec![[0.7, -0.2, 0.4, 0.5]],
            opacity_logits: vec![2.0],
            sh: vec![[0.0; 3]],
            ..GaussianCloud::default()
        };
        let mut camera =
            Camera::look_at(DVec3::new(1.0, -0.5, -4.0), DVec3::ZERO, DVec3::NEG_Y, 0.8, 640, 480).expect("valid");
        camera.focal_px.x *= 1.3;
        // Motion of the picture along each axis of the Gaussian, by differences; the narrower side is the
        // least over all directions in the picture.
        let [w, x, y, z] = [0.7, -0.2, 0.4, 0.5];
        let turn = glam::DQuat::from_vec4(glam::DVec4::new(x, y, z, w).try_normalize().expect("turns"));
        let at = cloud.world_position(0);
        let moves = [(DVec3::X, -3.0), (DVec3::Y, -4.5), (DVec3::Z, -2.5)].map(|(axis, log): (DVec3, f64)| {
            let step = turn * axis * log.exp() * 1e-4;
            (camera.project(at + step).expect("in front") - camera.project(at - step).expect("in front")) / 2e-4
        });
        let along = |angle: f64| {
            let direction = glam::DVec2::from_angle(angle);
            moves.iter().map(|m| m.dot(direction).powi(2)).sum::<f64>().sqrt()
        };
        let expected =
            (0..20_000).map(|k| along(f64::from(k) * 1e-4 * std::f64::consts::FRAC_PI_2)).fold(f64::MAX, f64::min);
        let found = footprint_px(&cloud, 0, &camera).expect("seen");
        assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
        // Too faint, behind, and beyond each edge.
        let seen = |change: &dyn Fn(&mut GaussianCloud, &mut Camera)| {
            let (mut cloud, mut camera) = (cloud.clone(), camera.clone());
            change(&mut cloud, &mut camera);
            footprint_px(&cloud, 0, &camera).is_some()
        };
        assert!(seen(&|_, _| {}) && !seen(&|c, _| c.opacity_logits[0] = -30.0));
        assert!(!seen(&|_, v| v.center += v.forward() * 30.0));
        for (dx, dy) in [(-700.0, 0.0), (700.0, 0.0), (0.0, -700.0), (0.0, 700.0)] {
            assert!(!seen(&|_, v| v.principal_px += glam::DVec2::new(dx, dy)), "{dx} {dy}");
        }
    }
}
