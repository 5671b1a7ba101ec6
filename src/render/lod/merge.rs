//! One Gaussian for several: their moments, weighted by opacity times area.

use glam::{DMat3, DQuat, DVec3};

use crate::math::rotation::matrix_from_quaternion;
use crate::math::sh::SH_C0;
use crate::math::{Real, eigen};
use crate::scene::GaussianCloud;

/// Standard deviations at which the faintest visible alpha of an opaque Gaussian lies: `sqrt(2 ln 255)`.
const VISIBLE: f64 = 3.33;
/// Logarithms of scales are clamped to these: no picture shows scales beyond, and no square overflows within.
const LOG_SCALES: [f64; 2] = [-60.0, 60.0];
/// Opacities that logits of single precision hold.
const OPACITIES: [f64; 2] = [1e-6, 1.0 - 1e-6];

/// Largest growth of the area of merged Gaussians that covered it more than once: at its edges one Gaussian lets light
/// through that the many did not.
const WIDEST: f64 = 1.7;

/// Moments of a Gaussian, or of several.
#[derive(Clone, Copy)]
pub(super) struct GaussianMoments {
    pub(super) mean: DVec3,
    pub(super) covariance: DMat3,
    /// Opacity times area.
    pub(super) weight: f64,
    /// Distance from the mean within which it can be seen.
    pub(super) reach: f64,
    /// Its displayed color without view dependence.
    pub(super) color: DVec3,
    /// Variance of such colors within it, mean over the channels.
    pub(super) contrast: f64,
}

/// Size of a Gaussian as seen from an unknown direction: for a disk its area, for a ball nearly twice that.
fn area(covariance: &DMat3) -> f64 {
    let trace = covariance.x_axis.x + covariance.y_axis.y + covariance.z_axis.z;
    let squares: f64 = covariance.to_cols_array().iter().map(|v| v * v).sum();
    // The sum of the products of two eigenvalues each.
    (0.5 * (trace * trace - squares)).max(0.0).sqrt()
}

impl GaussianMoments {
    /// Gaussian `i`; `None` if it cannot be drawn.
    pub(super) fn of<R: Real>(cloud: &GaussianCloud<R>, i: usize) -> Option<Self> {
        let mean = DVec3::from_array(cloud.positions[i].map(Real::f64));
        let turn = DMat3::from_cols_array_2d(&matrix_from_quaternion(cloud.quaternions[i].map(Real::f64))?).transpose();
        let [least, most] = LOG_SCALES;
        let scale = DVec3::from_array(cloud.log_scales[i].map(|s| s.f64().clamp(least, most).exp()));
        let half = turn * DMat3::from_diagonal(scale);
        let covariance = half * half.transpose();
        let weight = cloud.opacity_logits[i].f64().sigmoid() * area(&covariance);
        let color = DVec3::from_array(cloud.gaussian(i).sh[0].map(Real::f64)) * SH_C0;
        let reach = VISIBLE * scale.max_element();
        let part = Self { mean, covariance, weight, reach, color, contrast: 0.0 };
        (mean.is_finite() && covariance.is_finite() && weight.is_finite()).then_some(part)
    }
}

/// The Gaussian of some parts.
pub(super) struct Merged {
    pub(super) part: GaussianMoments,
    pub(super) log_scale: DVec3,
    /// `[w, x, y, z]`.
    pub(super) quaternion: [f64; 4],
    pub(super) opacity_logit: f64,
    /// Shares of the parts, which sum to 1.
    pub(super) shares: Vec<f64>,
}

/// Merges parts, of which some cannot be drawn; if none can, the result is invisible.
pub(super) fn merge(parts: &[Option<GaussianMoments>]) -> Merged {
    let usable = parts.iter().flatten();
    let total: f64 = usable.clone().map(|p| p.weight).sum();
    let count = usable.clone().count().max(1) as f64;
    // Those without any weight count alike.
    let share = |p: &Option<GaussianMoments>| {
        p.as_ref().map_or(0.0, |p| if total > 0.0 { p.weight / total } else { 1.0 / count })
    };
    let shares: Vec<f64> = parts.iter().map(share).collect();
    let each = || parts.iter().zip(&shares).filter_map(|(p, share)| Some((p.as_ref()?, *share)));
    let mean: DVec3 = each().map(|(p, share)| p.mean * share).sum();
    let outer = |d: DVec3| DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    let covariance = each().fold(DMat3::ZERO, |sum, (p, share)| sum + (p.covariance + outer(p.mean - mean)) * share);
    let cover = total / area(&covariance);
    let covariance = covariance * cover.clamp(1.0, WIDEST);
    let (values, axes) = eigen::axes(&covariance);
    let [least, most] = LOG_SCALES;
    let log_scale = values.map(|v| (0.5 * v.max(f64::MIN_POSITIVE).ln()).clamp(least, most));
    let [thin, opaque] = OPACITIES;
    let opacity = cover.clamp(thin, opaque);
    let opacity = if opacity.is_nan() { thin } else { opacity };
    let turn = DQuat::from_mat3(&axes);
    let reach = each().fold(VISIBLE * values.x.max(0.0).sqrt(), |m, (p, _)| m.max(p.mean.distance(mean) + p.reach));
    let color: DVec3 = each().map(|(p, share)| p.color * share).sum();
    let contrast = each().map(|(p, share)| (p.contrast + (p.color - color).length_squared() / 3.0) * share).sum();
    Merged {
        part: GaussianMoments { mean, covariance, weight: total, reach, color, contrast },
        log_scale,
        quaternion: [turn.w, turn.x, turn.y, turn.z],
        opacity_logit: (opacity / (1.0 - opacity)).ln(),
        shares,
    }
}
