//! Gaussians that are drawn as splats, projected eight at a time.

use super::chunk::Group;
use super::project::{CameraView, Projected, Splat, compensation, ellipse};
use crate::math::Real;
use crate::math::lanes::{LANES, Lanes};
use crate::math::number::{Eight, Number};
use crate::render::RenderSettings;

/// Projects Gaussians of these opacities; alpha below `alpha_min` does not count.
#[inline(always)]
pub(crate) fn splats<R: Real, L: Lanes<R>>(
    l: L,
    group: &Group<'_, R>,
    opacity: L::V,
    alpha_min: R,
    view: &CameraView<R>,
    settings: &RenderSettings,
) -> [Projected<R, [R; 0], [R; 1]>; LANES] {
    let zero = l.splat(R::ZERO);
    let (mut log_scale, mut quaternion) = ([Eight::new(l, zero); 3], [Eight::new(l, zero); 4]);
    for k in 0..3 {
        log_scale[k] = group.each(l, |g| g.log_scale[k]);
    }
    for k in 0..4 {
        quaternion[k] = group.each(l, |g| g.quaternion[k]);
    }
    let g = ellipse(group.relative(l), log_scale, quaternion, view);
    let mut opacity = Eight::new(l, opacity);
    if settings.antialias {
        opacity = opacity * compensation(&g);
    }
    let depth = g.local[2];
    let reach = depth.like(R::of(2.0)) * Eight::new(l, l.ln((opacity / depth.like(alpha_min)).v));
    let [xx, xy, yy] = g.covariance;
    let half = [(reach * xx).sqrt(), (reach * yy).sqrt()];
    let det = g.determinants[1];
    let conic = [yy / det, -xy / det, xx / det];
    let mut mean = [depth; 2];
    let mut seen = l.ge(opacity.v, l.splat(alpha_min));
    for axis in 0..2 {
        mean[axis] = depth.like(view.focal[axis]) * (g.local[axis] / depth) + depth.like(view.principal[axis]);
        let last = R::of(view.size[axis] as f64) - R::HALF;
        let begins = l.ge((mean[axis] + half[axis]).v, l.splat(R::HALF));
        let ends = l.ge(l.splat(last), (mean[axis] - half[axis]).v);
        seen = l.both(seen, l.both(begins, ends));
    }
    let (usable, seen) = (l.bits(l.both(finite(l, depth), finite(l, det))), l.bits(seen));
    // A covariance so wide that its inverse underflows has no usable shape.
    let positive = l.both(l.gt(conic[0].v, zero), l.gt(conic[2].v, zero));
    let shaped = l.bits(l.both(positive, l.both(finite(l, half[0]), finite(l, half[1]))));

    let (mean, half) = ([mean[0].lane(), mean[1].lane()], [half[0].lane(), half[1].lane()]);
    let conic = [conic[0].lane(), conic[1].lane(), conic[2].lane()];
    let [opacity, reach, depth] = [opacity.lane(), reach.lane(), depth.lane()];
    let mut all = [const { Projected::Outside }; LANES];
    for (i, projected) in all.iter_mut().enumerate() {
        *projected = if usable >> i & 1 == 0 {
            Projected::Degenerate
        } else if seen >> i & 1 == 0 {
            Projected::Outside
        } else if shaped >> i & 1 == 0 {
            Projected::Degenerate
        } else {
            let splat = Splat {
                mean: [mean[0][i], mean[1][i]],
                conic: [conic[0][i], conic[1][i], conic[2][i]],
                opacity: opacity[i],
                reach: reach[i],
                half: [half[0][i], half[1][i]],
                depth: depth[i],
                gaussian: 0,
            };
            Projected::Splat(splat, [], [depth[i]])
        };
    }
    all
}

/// Mask of the lanes that are finite.
#[inline(always)]
fn finite<R: Real, L: Lanes<R>>(l: L, x: Eight<R, L>) -> L::M {
    // Zero times infinity or NaN is NaN, which fails every comparison.
    let zero = l.splat(R::ZERO);
    l.ge(l.mul(x.v, zero), zero)
}
