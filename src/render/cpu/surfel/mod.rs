//! Surfels: Gaussians without thickness, met by each pixel's ray (2D Gaussian Splatting, Huang et
//! al. 2024).
//!
//! A surfel is a Gaussian whose third scale is ignored: a disk across its first two axes. The intersection of a pixel's
//! ray with the disk's plane gives the Gaussian's value there, the depth, and so a surface that does not move with the
//! view. As in the paper, a surfel is never drawn smaller than a pixel: the squared distance is the smaller of that in
//! the plane and that in the picture.
//!
//! Own are projection ([`project`]), alpha ([`disk`]) and the way back ([`mod@project_backward`]). With
//! depth asked for, frames also hold normals and the distortion `sum over pairs (w_i w_j (1/z_i -
//! 1/z_j)²)`, in inverse depth because that is the quantity that a picture can resolve.
//!
//! Tests compare surfels with rays cast in world space, and their gradients with central differences.

pub(crate) mod disk;
pub(crate) mod project;
pub(crate) mod project_backward;

use self::disk::{Disk, SurfelHit};
use self::project::INVERSE_BLUR;
use self::project::{SHAPE, surfel};
use self::project_backward::project_backward;
use super::chunk::Group;
use super::project::{CameraView, Projected, Splat};
use super::project_backward::GaussianGradient;
use super::walk::{GROUPS, Planes, Primitive, Reach, RowPass, With, with_channels};
use crate::math::Real;
use crate::math::lanes::{LANES, Lanes};
use crate::render::{ALPHA_MIN, Frame, FrameGradient, MAX_CHANNELS, RenderSettings, TRANSMITTANCE_MIN};
use crate::scene::Gaussian;

/// Most channels of one pass: those of every renderer, and normals.
const MOST: usize = MAX_CHANNELS + 3;

/// Sums in front of the channels in a tile entry's record: `dL/dopacity` times opacity; `dL/d` of
/// the six derivatives of a splat's shape, of its depth, and of its projected center.
pub(crate) const RECORD: usize = 10;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Surfels<R> {
    near: R,
}

impl<R: Real> Primitive<R> for Surfels<R> {
    const SHAPE: usize = SHAPE;
    type Shape = [R; SHAPE];
    type Depth = [R; 3];
    /// `sum(w z)`, `sum(w / z)`, `sum(w / z²)`, median depth, place of its splat in the tile's list, from 1.
    type Extra<V: Copy> = [V; 5];
    /// Gradients of depth, distortion and median depth; `sum(w / z)`, `sum(w / z²)`, place of the median's
    /// splat, transmittance.
    type State<V: Copy> = [V; 7];
    type Sums<V: Copy> = [V; RECORD];
    type Constants<L: Lanes<R>> = Disk<R, L>;
    type Hit<L: Lanes<R>> = SurfelHit<R, L>;

    fn new(view: &CameraView<R>, _: &RenderSettings) -> Self {
        Self { near: view.near }
    }

    fn least_transmittance(_: &RenderSettings) -> f64 {
        TRANSMITTANCE_MIN
    }

    fn channels(extra: usize, depth: bool) -> usize {
        3 + extra + if depth { 3 } else { 0 }
    }

    /// Color; with normals; any.
    fn padded(channels: usize) -> usize {
        [3, 6].into_iter().find(|&c| channels <= c).unwrap_or(MOST)
    }

    fn run<T: RowPass<R>>(channels: usize, pass: T) -> T::Output {
        with_channels!(channels, [3 6, MOST], pass)
    }

    #[inline(always)]
    fn alpha_min(self) -> R {
        R::of(ALPHA_MIN)
    }

    #[inline(always)]
    fn project<L: Lanes<R>>(
        self,
        l: L,
        group: &Group<'_, R>,
        opacity: L::V,
        view: &CameraView<R>,
        _: &RenderSettings,
    ) -> [Projected<R, [R; SHAPE], [R; 3]>; LANES] {
        let opacity = l.store(opacity);
        std::array::from_fn(|i| match group.get(i) {
            Some(gaussian) => surfel(gaussian, opacity[i], self.alpha_min(), view),
            None => Projected::Outside,
        })
    }

    fn planes<'a>(frame: &'a mut Frame<R>, kept: &'a mut [Vec<R>; 3], depth: bool) -> Planes<&'a mut [R]> {
        let pixels = if depth { frame.alpha.len() } else { 0 };
        kept.iter_mut().for_each(|plane| plane.resize(pixels, R::ZERO));
        frame.normals = std::array::from_fn(|_| vec![R::ZERO; pixels]);
        let mut channels: Vec<&mut [R]> =
            frame.color.iter_mut().chain(&mut frame.features).map(Vec::as_mut_slice).collect();
        if !depth {
            return [channels, Vec::new()];
        }
        channels.extend(frame.normals.iter_mut().map(Vec::as_mut_slice));
        let [first, second, place] = kept.each_mut().map(Vec::as_mut_slice);
        [channels, vec![&mut frame.depth, first, second, &mut frame.median_depth, place]]
    }

    fn finish(frame: &mut Frame<R>, [first, second, _]: &[Vec<R>; 3]) {
        let spread = |((a, m), s): ((&R, &R), &R)| (*a * *s - *m * *m).max(R::ZERO);
        frame.distortion = frame.alpha.iter().zip(first).zip(second).map(spread).collect();
    }

    fn gradients<'a>(
        gradient: &'a FrameGradient<R>,
        [first, second, place]: &'a [Vec<R>; 3],
        transmittance: &'a [R],
        extra: usize,
        depth: bool,
    ) -> Planes<&'a [R]> {
        let mut channels: Vec<&[R]> = gradient.color.iter().chain(&gradient.features).map(Vec::as_slice).collect();
        channels.resize(3 + extra, &[]);
        let own: [&[R]; 3] = [&gradient.depth, &gradient.distortion, &gradient.median_depth];
        if !depth {
            return [channels, Vec::new()];
        }
        channels.extend(gradient.normals.iter().map(Vec::as_slice));
        match own.iter().all(|plane| plane.is_empty()) {
            true => [channels, Vec::new()],
            false => [channels, [&own[..], &[first, second, place, transmittance]].concat()],
        }
    }

    #[inline(always)]
    fn project_backward(
        gaussian: &Gaussian<'_, R>,
        _: &Splat<R>,
        view: &CameraView<R>,
        settings: &RenderSettings,
        record: &[R],
        extra: usize,
    ) -> Option<GaussianGradient<R>> {
        let normal = settings.depth.then_some(RECORD + 3 + extra);
        project_backward(gaussian, view, settings, record, normal)
    }

    #[inline(always)]
    fn constants<L: Lanes<R>>(self, l: L, s: &Splat<R>, shape: &[R], dx: [L::V; GROUPS]) -> Disk<R, L> {
        Disk::new(l, s, shape, self.near, dx)
    }

    #[inline(always)]
    fn hit<L: Lanes<R>>(l: L, disk: &Disk<R, L>, reach: &Reach<R>, slot: usize) -> SurfelHit<R, L> {
        disk.hit(l, reach, slot)
    }

    #[inline(always)]
    fn alpha<L: Lanes<R>>(hit: &SurfelHit<R, L>) -> L::V {
        hit.alpha
    }

    #[inline(always)]
    fn gather<L: Lanes<R>>(
        l: L,
        [depth, first, second, median, at]: &mut [L::V; 5],
        hit: &SurfelHit<R, L>,
        weight: L::V,
        crossed: L::M,
        place: L::V,
    ) {
        let inverse = l.div(l.splat(R::ONE), hit.depth);
        let near = l.mul(weight, inverse);
        *depth = l.mul_add(weight, hit.depth, *depth);
        *first = l.add(*first, near);
        *second = l.mul_add(near, inverse, *second);
        *median = l.select(crossed, hit.depth, *median);
        *at = l.select(crossed, place, *at);
    }

    #[inline(always)]
    fn along<L: Lanes<R>>(l: L, state: &[L::V; 7], hit: &SurfelHit<R, L>, along: L::V) -> L::V {
        // Distortion A s - m² with A, m, s the sums of w, w / z and w / z².
        let [d_depth, d_distortion, _, first, second, _, transmittance] = *state;
        let alpha = l.sub(l.splat(R::ONE), transmittance);
        let near = l.div(l.splat(R::ONE), hit.depth);
        let spread = l.mul(near, l.sub(l.mul(near, alpha), l.mul(l.splat(R::of(2.0)), first)));
        l.mul_add(d_distortion, l.add(spread, second), l.mul_add(d_depth, hit.depth, along))
    }

    #[inline(always)]
    fn sum<L: Lanes<R>, const STATE: bool>(
        l: L,
        sums: &mut [L::V; RECORD],
        disk: &Disk<R, L>,
        hit: &SurfelHit<R, L>,
        state: &[L::V; 7],
        [power, weight, place]: [L::V; 3],
    ) {
        let (zero, one, two) = (l.splat(R::ZERO), l.splat(R::ONE), l.splat(R::of(2.0)));
        let mut d_depth = zero;
        if STATE {
            let [to_depth, to_distortion, to_median, first, _, at, transmittance] = *state;
            let near = l.div(one, hit.depth);
            let pull = l.mul(l.mul(near, near), l.sub(first, l.mul(near, l.sub(one, transmittance))));
            d_depth = l.mul(weight, l.mul_add(l.mul(two, pull), to_distortion, to_depth));
            let median = l.both(l.ge(at, place), l.ge(place, at));
            d_depth = l.add(d_depth, l.keep(median, to_median));
        }
        // Through the plane, where its distance counts.
        let d_through = l.keep(hit.through, d_depth);
        let ([u, v], [dx, dy]) = (hit.at, hit.offset);
        let d_u = l.sub(l.mul(d_through, disk.along[0]), l.mul(power, u));
        let d_v = l.sub(l.mul(d_through, disk.along[1]), l.mul(power, v));
        let d_w = l.sub(zero, l.mul(hit.inverse, l.mul_add(d_u, u, l.mul(d_v, v))));
        let scale = l.mul(disk.z, hit.inverse);
        let d_p = l.sub(l.mul(d_u, scale), l.mul(disk.along[0], d_w));
        let d_q = l.sub(l.mul(d_v, scale), l.mul(disk.along[1], d_w));
        let [p, q] = hit.raw;
        let d_z = l.mul_add(hit.inverse, l.mul_add(d_u, p, l.mul(d_v, q)), d_depth);
        let [[ax, ay], [bx, by]] = disk.across;
        // Through the picture, where that distance counts.
        let flat = l.mul(l.splat(R::of(INVERSE_BLUR)), l.select(hit.through, zero, power));
        let center_x = l.sub(l.mul(bx, d_q), l.mul(by, d_p));
        let center_y = l.sub(l.mul(ay, d_p), l.mul(ax, d_q));
        let terms = [
            power,
            l.mul_add(dy, d_q, l.mul(by, d_w)),
            l.sub(zero, l.mul_add(dy, d_p, l.mul(bx, d_w))),
            l.sub(zero, l.mul_add(dx, d_q, l.mul(ay, d_w))),
            l.mul_add(dx, d_p, l.mul(ax, d_w)),
            l.sub(l.mul(d_through, u), l.mul(p, d_w)),
            l.sub(l.mul(d_through, v), l.mul(q, d_w)),
            d_z,
            l.mul_add(flat, dx, center_x),
            l.mul_add(flat, dy, center_y),
        ];
        for (sum, term) in sums.iter_mut().zip(terms) {
            *sum = l.add(*sum, term);
        }
    }
}
