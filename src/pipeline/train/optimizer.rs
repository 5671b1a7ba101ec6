//! Backward pass of the projection and Adam on the CPU, fused per Gaussian: gradients never reach memory, and
//! Gaussians that were not drawn cost nothing.

use rayon::prelude::*;

use super::density::DensityStats;
use crate::render::{AdamStep, DifferentiableRenderer, Rates, normals};
use crate::scene::{Gaussian, GaussianCloud};

/// Gaussians that one task updates.
const BLOCK: usize = 512;

/// Statistics of skipped updates in a step.
#[derive(Clone, Copy, Default)]
pub(super) struct StepStats {
    /// Gaussians whose gradient was not finite.
    pub(super) skipped: usize,
    /// The first of them.
    pub(super) first: Option<usize>,
    /// Gradients that were clipped as outliers.
    pub(super) outliers: usize,
}

impl StepStats {
    fn add(self, other: Self) -> Self {
        Self {
            skipped: self.skipped + other.skipped,
            first: self.first.into_iter().chain(other.first).min(),
            outliers: self.outliers + other.outliers,
        }
    }
}

/// Constants of a step's update.
pub(super) struct Update {
    pub(super) rates: Rates,
    pub(super) adam: AdamStep,
    pub(super) stride: usize,
    pub(super) active: usize,
    /// Gaussians at the front of the cloud that stay as they are.
    pub(super) frozen: usize,
    /// Center of the camera relative to the cloud's origin, if Gaussians carry their normals as extra channels.
    pub(super) eye: Option<[f32; 3]>,
}

impl Update {
    /// Updates the Gaussians that were drawn, and the statistics of density control.
    pub(super) fn apply(
        &self,
        renderer: &DifferentiableRenderer,
        cloud: &mut GaussianCloud,
        [first, second]: &mut [GaussianCloud; 2],
        stats: &mut DensityStats,
    ) -> StepStats {
        let blocks: Vec<Block<'_>> = blocks(cloud)
            .zip(blocks(first))
            .zip(blocks(second))
            .zip(stats.gradient.chunks_mut(BLOCK))
            .zip(stats.seen.chunks_mut(BLOCK))
            .enumerate()
            .map(|(b, ((((p, m), v), gradient), seen))| Block { first: b * BLOCK, p, m, v, gradient, seen })
            .collect();
        blocks
            .into_par_iter()
            .map(|mut block| step_block(renderer, &mut block, self))
            .reduce(StepStats::default, StepStats::add)
    }
}

/// Parameters of a block of consecutive Gaussians.
struct Slices<'a> {
    positions: &'a mut [[f32; 3]],
    log_scales: &'a mut [[f32; 3]],
    quaternions: &'a mut [[f32; 4]],
    opacity_logits: &'a mut [f32],
    sh: &'a mut [[f32; 3]],
}

/// Data of the update of a block of consecutive Gaussians.
struct Block<'a> {
    first: usize,
    p: Slices<'a>,
    m: Slices<'a>,
    v: Slices<'a>,
    gradient: &'a mut [f32],
    seen: &'a mut [u32],
}

fn blocks(cloud: &mut GaussianCloud) -> impl Iterator<Item = Slices<'_>> {
    let stride = cloud.sh_stride();
    cloud
        .positions
        .chunks_mut(BLOCK)
        .zip(cloud.log_scales.chunks_mut(BLOCK))
        .zip(cloud.quaternions.chunks_mut(BLOCK))
        .zip(cloud.opacity_logits.chunks_mut(BLOCK))
        .zip(cloud.sh.chunks_mut(BLOCK * stride))
        .map(|((((positions, log_scales), quaternions), opacity_logits), sh)| Slices {
            positions,
            log_scales,
            quaternions,
            opacity_logits,
            sh,
        })
}

/// Updates parameters with their moments and returns the number of outlier gradients. A plain loop: closures would be
/// calls for a few numbers each, and would not be vectorized with the caller.
#[inline(always)]
fn update_all(adam: &AdamStep, [p, m, v]: [&mut [f32]; 3], g: &[f32], rate: f32) -> usize {
    let (p, m, v) = (&mut p[..g.len()], &mut m[..g.len()], &mut v[..g.len()]);
    let mut outliers = 0_u32;
    for i in 0..g.len() {
        outliers += u32::from(adam.update(&mut p[i], g[i], &mut m[i], &mut v[i], rate));
    }
    outliers as usize
}

/// Updates a block and returns its statistics.
#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
fn step_block(renderer: &DifferentiableRenderer, block: &mut Block<'_>, update: &Update) -> StepStats {
    let Update { rates, adam, stride, active, frozen, eye } = update;
    let Block { first, p, m, v, gradient, seen } = block;
    let mut left = StepStats::default();
    for i in frozen.saturating_sub(*first).min(p.positions.len())..p.positions.len() {
        let own = i * stride..(i + 1) * stride;
        let gaussian = Gaussian {
            position: p.positions[i],
            log_scale: p.log_scales[i],
            quaternion: p.quaternions[i],
            opacity_logit: p.opacity_logits[i],
            sh: &p.sh[own.clone()],
        };
        let Some(mut g) = renderer.gaussian_gradient(&gaussian, *first + i) else { continue };
        let mut d_normal = [0.0; 3];
        if let Some(eye) = eye
            && renderer.feature_gradient(*first + i, &mut d_normal)
        {
            let turn = normals::backward(&gaussian, *eye, d_normal);
            g.quaternion.iter_mut().zip(turn).for_each(|(q, t)| *q += t);
        }
        let finite = g.position.iter().chain(&g.log_scale).chain(&g.quaternion).chain(&g.color).all(|x| x.is_finite())
            && g.opacity_logit.is_finite();
        if !finite {
            left.skipped += 1;
            left.first = left.first.or(Some(*first + i));
            continue;
        }
        gradient[i] += g.screen;
        seen[i] += 1;
        let position = [&mut p.positions[i], &mut m.positions[i], &mut v.positions[i]].map(<[f32; 3]>::as_mut_slice);
        let scale = [&mut p.log_scales[i], &mut m.log_scales[i], &mut v.log_scales[i]].map(<[f32; 3]>::as_mut_slice);
        let turn = [&mut p.quaternions[i], &mut m.quaternions[i], &mut v.quaternions[i]];
        let opacity = [&mut p.opacity_logits[i], &mut m.opacity_logits[i], &mut v.opacity_logits[i]];
        left.outliers += update_all(adam, position, &g.position, rates.position)
            + update_all(adam, scale, &g.log_scale, rates.log_scale)
            + update_all(adam, turn.map(<[f32; 4]>::as_mut_slice), &g.quaternion, rates.quaternion)
            + update_all(adam, opacity.map(std::slice::from_mut), &[g.opacity_logit], rates.opacity_logit);
        // All SH coefficients in one loop, so that it is vectorized.
        let mut d_sh = [0.0; 48];
        for (d, (k, c)) in d_sh.iter_mut().zip((0..*active).flat_map(|k| (0..3).map(move |c| (k, c)))) {
            *d = g.color[c] * g.basis[k];
        }
        let own = own.start..own.start + active;
        let (p, m, v) = (&mut p.sh[own.clone()], &mut m.sh[own.clone()], &mut v.sh[own]);
        let (p, m, v) = (p.as_flattened_mut(), m.as_flattened_mut(), v.as_flattened_mut());
        let ((p0, p1), (m0, m1), (v0, v1)) = (p.split_at_mut(3), m.split_at_mut(3), v.split_at_mut(3));
        left.outliers += update_all(adam, [p0, m0, v0], &d_sh[..3], rates.sh_constant)
            + update_all(adam, [p1, m1, v1], &d_sh[3..3 * active], rates.sh_rest);
    }
    left
}
