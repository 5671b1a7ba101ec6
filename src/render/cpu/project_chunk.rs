//! Projection of all that is drawn, in parts that threads take one after the other.

use rayon::prelude::*;

use super::project::{CHUNK, CameraView, Chunk, DrawInput, Projected, color, direction, dot};
use super::walk::Primitive;
use crate::math::{Real, sh};

/// Gaussians of a cut between fetching one and needing it.
const AHEAD: usize = 8;

/// Projects the whole cloud, in parts of [`CHUNK`] Gaussians: `P::SHAPE + channels` values per splat, the channels
/// being color, extra channels, what depth needs, padding zeros.
pub(crate) fn project<R: Real, P: Primitive<R>>(
    parts: &mut Vec<Chunk<R>>,
    scene: DrawInput<'_, R>,
    view: &CameraView<R>,
    primitive: P,
    channels: usize,
) {
    let n = scene.len();
    parts.resize_with(n.div_ceil(CHUNK), Chunk::default);
    parts.par_iter_mut().enumerate().for_each(|(c, part)| {
        part.splats.clear();
        part.degenerate = 0;
        project_chunk(part, scene, view, primitive, channels, c * CHUNK..((c + 1) * CHUNK).min(n));
    });
}

#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
fn project_chunk<R: Real, P: Primitive<R>>(
    part: &mut Chunk<R>,
    scene: DrawInput<'_, R>,
    view: &CameraView<R>,
    primitive: P,
    channels: usize,
    range: std::ops::Range<usize>,
) {
    let DrawInput { features, settings, .. } = scene;
    // As if all were seen: so a splat's values are written where they stay, and nothing grows.
    let mut written = 0;
    let stride = P::SHAPE + channels;
    part.values.resize(range.len() * stride, R::ZERO);
    for k in range {
        if let Some(cut) = scene.cut {
            cut.fetch(scene.cloud, k + AHEAD);
        }
        let (cloud, i, stands_for) = scene.of(k);
        let degree = settings.sh_degree.min(cloud.sh_degree);
        // Cheap tests first: most Gaussians of a scene are outside the picture.
        let relative = view.relative(cloud.positions[i]);
        if !(dot(view.rows[2], relative) > view.near) {
            continue;
        }
        let opacity = cloud.opacity_logits[i].sigmoid();
        if opacity < primitive.alpha_min() {
            continue;
        }
        let gaussian = cloud.gaussian(i);
        let (mut splat, shape, depth) = match primitive.project(&gaussian, opacity, view, settings) {
            Projected::Splat(splat, shape, depth) => (splat, shape, depth),
            Projected::Outside => continue,
            Projected::Degenerate => {
                part.degenerate += 1;
                continue;
            }
        };
        splat.gaussian = stands_for;
        let basis = sh::basis(degree, direction(relative));
        let values = &mut part.values[written..written + stride];
        let mut at = 0;
        let mut put = |some: &[R]| {
            for (value, new) in values[at..at + some.len()].iter_mut().zip(some) {
                *value = *new;
            }
            at += some.len();
        };
        put(shape.as_ref());
        put(&color(gaussian.sh, &basis, degree));
        let own = stands_for as usize * features.channels;
        put(&features.values[own..own + features.channels]);
        if settings.depth {
            put(depth.as_ref());
        }
        values[at..].iter_mut().for_each(|value| *value = R::ZERO);
        written += stride;
        part.splats.push(splat);
    }
    part.values.truncate(written);
}
