//! Gaussians drawn as splats: ellipses in the picture plane, each of one depth.

use super::chunk::Group;
use super::project::{CameraView, Projected, Splat};
use super::project_backward::{GaussianGradient, MOMENTS, project_backward};
use super::project_splats::splats;
use super::walk::{GROUPS, Planes, Primitive, Reach, RowPass, With, with_channels};
use crate::math::Real;
use crate::math::lanes::{LANES, Lanes};
use crate::render::{ALPHA_MAX, Frame, FrameGradient, MAX_CHANNELS, RenderSettings, TILE_PX};
use crate::scene::Gaussian;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Splats<R> {
    /// Smallest alpha that counts.
    alpha_min: R,
}

/// A splat's constants in vector registers.
pub(crate) struct Constants<R: Real, L: Lanes<R>> {
    a: L::V,
    depth: L::V,
    opacity: L::V,
    minus_half: L::V,
    largest: L::V,
    smallest: L::V,
    dx: [L::V; GROUPS],
}

/// Contribution of a splat to eight pixels.
#[derive(Clone, Copy)]
pub(crate) struct SplatHit<V> {
    offset: [V; 2],
    depth: V,
    alpha: V,
}

impl<R: Real> Primitive<R> for Splats<R> {
    const SHAPE: usize = 0;
    type Shape = [R; 0];
    type Depth = [R; 1];
    type Extra<V: Copy> = [V; 1];
    type State<V: Copy> = [V; 0];
    type Sums<V: Copy> = [V; MOMENTS];
    type Constants<L: Lanes<R>> = Constants<R, L>;
    type Hit<L: Lanes<R>> = SplatHit<L::V>;

    fn new(_: &CameraView<R>, settings: &RenderSettings) -> Self {
        Self { alpha_min: R::of(settings.cutoffs.alpha) }
    }

    fn least_transmittance(settings: &RenderSettings) -> f64 {
        settings.cutoffs.transmittance
    }

    fn channels(extra: usize, depth: bool) -> usize {
        3 + extra + usize::from(depth)
    }

    /// Color; with depth; with six codes and depth; any.
    fn padded(channels: usize) -> usize {
        [3, 4, 10].into_iter().find(|&c| channels <= c).unwrap_or(MAX_CHANNELS)
    }

    fn run<T: RowPass<R>>(channels: usize, pass: T) -> T::Output {
        with_channels!(channels, [3 4 10, MAX_CHANNELS], pass)
    }

    #[inline(always)]
    fn alpha_min(self) -> R {
        self.alpha_min
    }

    #[inline(always)]
    fn project<L: Lanes<R>>(
        self,
        l: L,
        group: &Group<'_, R>,
        opacity: L::V,
        view: &CameraView<R>,
        settings: &RenderSettings,
    ) -> [Projected<R, [R; 0], [R; 1]>; LANES] {
        splats(l, group, opacity, self.alpha_min, view, settings)
    }

    fn planes<'a>(frame: &'a mut Frame<R>, _: &'a mut [Vec<R>; 3], depth: bool) -> Planes<&'a mut [R]> {
        let channels = frame.color.iter_mut().chain(&mut frame.features).chain(depth.then_some(&mut frame.depth));
        let extra = depth.then_some(frame.median_depth.as_mut_slice());
        [channels.map(Vec::as_mut_slice).collect(), extra.into_iter().collect()]
    }

    fn finish(_: &mut Frame<R>, _: &[Vec<R>; 3]) {}

    fn gradients<'a>(
        gradient: &'a FrameGradient<R>,
        _: &'a [Vec<R>; 3],
        _: &'a [R],
        extra: usize,
        depth: bool,
    ) -> Planes<&'a [R]> {
        let mut channels: Vec<&[R]> = gradient.color.iter().chain(&gradient.features).map(Vec::as_slice).collect();
        if depth {
            channels.resize(3 + extra, &[]);
            channels.push(&gradient.depth);
        }
        [channels, Vec::new()]
    }

    #[inline(always)]
    fn project_backward(
        gaussian: &Gaussian<'_, R>,
        splat: &Splat<R>,
        view: &CameraView<R>,
        settings: &RenderSettings,
        record: &[R],
        extra: usize,
    ) -> Option<GaussianGradient<R>> {
        project_backward(gaussian, splat, view, settings, record, settings.depth.then_some(3 + extra))
    }

    #[inline(always)]
    fn constants<L: Lanes<R>>(self, l: L, s: &Splat<R>, _: &[R], dx: [L::V; GROUPS]) -> Constants<R, L> {
        Constants {
            a: l.splat(s.conic[0]),
            depth: l.splat(s.depth),
            opacity: l.splat(s.opacity),
            minus_half: l.splat(-R::HALF),
            largest: l.splat(R::of(ALPHA_MAX)),
            smallest: l.splat(self.alpha_min),
            dx,
        }
    }

    #[inline(always)]
    fn hit<L: Lanes<R>>(l: L, s: &Constants<R, L>, reach: &Reach<R>, slot: usize) -> SplatHit<L::V> {
        let (dx, row) = (s.dx[slot / TILE_PX], slot % TILE_PX);
        let [linear, constant] = reach.row(l, row);
        let q = l.mul_add(l.mul_add(s.a, dx, linear), dx, constant);
        let raw = l.mul(s.opacity, l.exp_neg(l.mul(s.minus_half, q)));
        let alpha = l.min(raw, s.largest);
        let alpha = l.keep(l.ge(alpha, s.smallest), alpha);
        SplatHit { offset: [dx, l.splat(reach.dy[row])], depth: s.depth, alpha }
    }

    #[inline(always)]
    fn alpha<L: Lanes<R>>(hit: &SplatHit<L::V>) -> L::V {
        hit.alpha
    }

    #[inline(always)]
    fn gather<L: Lanes<R>>(l: L, [median]: &mut [L::V; 1], hit: &SplatHit<L::V>, _: L::V, crossed: L::M, _: L::V) {
        *median = l.select(crossed, hit.depth, *median);
    }

    #[inline(always)]
    fn along<L: Lanes<R>>(_: L, _: &[L::V; 0], _: &SplatHit<L::V>, along: L::V) -> L::V {
        along
    }

    #[inline(always)]
    fn sum<L: Lanes<R>, const STATE: bool>(
        l: L,
        sums: &mut [L::V; MOMENTS],
        _: &Constants<R, L>,
        hit: &SplatHit<L::V>,
        _: &[L::V; 0],
        [power, ..]: [L::V; 3],
    ) {
        let [dx, dy] = hit.offset;
        let (px, py) = (l.mul(power, dx), l.mul(power, dy));
        sums[0] = l.add(sums[0], power);
        sums[1] = l.add(sums[1], px);
        sums[2] = l.add(sums[2], py);
        sums[3] = l.mul_add(px, dx, sums[3]);
        sums[4] = l.mul_add(px, dy, sums[4]);
        sums[5] = l.mul_add(py, dy, sums[5]);
    }
}
