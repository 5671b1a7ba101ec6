//! Projection of all that is drawn: in parts that threads take one after the other, eight Gaussians at a time.

use std::ops::Range;

use rayon::prelude::*;

use super::chunk::{CHUNK, Chunk, DrawInput, Group};
use super::project::{CameraView, Projected, color, dot, toward};
use super::walk::Primitive;
use crate::math::lanes::{LANES, LaneOp, Lanes};
use crate::math::{Real, sh};

/// Gaussians of a cut between fetching one and needing it.
const AHEAD: usize = 8;

/// Projects the whole cloud, in parts of [`CHUNK`] Gaussians: `P::SHAPE + channels` values per splat. Channels are
/// color, extra channels, those that depth needs, and padding zeros.
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
        let stride = P::SHAPE + channels;
        let range = c * CHUNK..((c + 1) * CHUNK).min(n);
        R::vectorize(ProjectChunk { part, scene, view, primitive, stride, range });
    });
}

struct ProjectChunk<'a, R, P> {
    part: &'a mut Chunk<R>,
    scene: DrawInput<'a, R>,
    view: &'a CameraView<R>,
    primitive: P,
    /// Values per splat.
    stride: usize,
    range: Range<usize>,
}

impl<R: Real, P: Primitive<R>> LaneOp<R> for ProjectChunk<'_, R, P> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<R>>(mut self, l: L) {
        let Self { scene, view, stride, .. } = self;
        self.part.splats.clear();
        self.part.degenerate = 0;
        // As if all were seen: so a splat's values are written where they stay, and nothing grows.
        self.part.values.resize(self.range.len() * stride, R::ZERO);
        let mut group = Group::default();
        for k in self.range.clone() {
            if let Some(cut) = scene.cut {
                cut.fetch(scene.cloud, k + AHEAD);
            }
            let (cloud, i, stands_for) = scene.of(k);
            // A cheap test first: many Gaussians of a scene are behind the camera.
            let relative = view.relative(cloud.positions[i]);
            if !(dot(view.rows[2], relative) > view.near) {
                continue;
            }
            group.push(cloud.gaussian(i), relative, stands_for);
            if group.len == LANES {
                self.add(l, &group);
                group.len = 0;
            }
        }
        if group.len > 0 {
            self.add(l, &group);
        }
        self.part.values.truncate(self.part.splats.len() * stride);
    }
}

impl<R: Real, P: Primitive<R>> ProjectChunk<'_, R, P> {
    /// Adds the splats of those that are seen.
    #[inline(always)]
    fn add<L: Lanes<R>>(&mut self, l: L, group: &Group<'_, R>) {
        let DrawInput { features, settings, cloud, .. } = self.scene;
        let opacity = sigmoid(l, group.each(l, |g| g.opacity_logit).v);
        let bright = l.bits(l.ge(opacity, l.splat(self.primitive.alpha_min())));
        let projected = self.primitive.project(l, group, opacity, self.view, settings);
        let degree = settings.sh_degree.min(cloud.sh_degree);
        let mut basis = [[R::ZERO; LANES]; 16];
        for (lane, eight) in basis.iter_mut().zip(sh::basis(degree, toward(group.relative(l)))) {
            *lane = eight.lane();
        }
        for (i, projected) in projected.into_iter().enumerate().take(group.len) {
            if bright >> i & 1 == 0 {
                continue;
            }
            let (mut splat, shape, depth) = match projected {
                Projected::Splat(splat, shape, depth) => (splat, shape, depth),
                Projected::Outside => continue,
                Projected::Degenerate => {
                    self.part.degenerate += 1;
                    continue;
                }
            };
            splat.gaussian = group.stand_for[i];
            let mut own = [R::ZERO; 16];
            for (own, lane) in own.iter_mut().zip(&basis) {
                *own = lane[i];
            }
            let written = self.part.splats.len() * self.stride;
            let values = &mut self.part.values[written..written + self.stride];
            let mut at = 0;
            let mut put = |some: &[R]| {
                for (value, new) in values[at..at + some.len()].iter_mut().zip(some) {
                    *value = *new;
                }
                at += some.len();
            };
            put(shape.as_ref());
            put(&color(group.gaussians[i].sh, &own, degree));
            let first = splat.gaussian as usize * features.channels;
            put(&features.values[first..first + features.channels]);
            if settings.depth {
                put(depth.as_ref());
            }
            values[at..].iter_mut().for_each(|value| *value = R::ZERO);
            self.part.splats.push(splat);
        }
    }
}

/// [`Real::sigmoid`].
#[inline(always)]
fn sigmoid<R: Real, L: Lanes<R>>(l: L, x: L::V) -> L::V {
    let (zero, one) = (l.splat(R::ZERO), l.splat(R::ONE));
    let e = l.exp_neg(l.min(x, l.sub(zero, x)));
    l.div(l.select(l.ge(x, zero), one, e), l.add(one, e))
}
