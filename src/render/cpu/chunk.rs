//! Input and output of the projection: Gaussians in groups, splats in chunks.

use super::project::Splat;
use crate::math::Real;
use crate::math::lanes::{LANES, Lane, Lanes};
use crate::math::number::Eight;
use crate::render::lod::Cut;
use crate::render::{Features, RenderSettings};
use crate::scene::{Gaussian, GaussianCloud};

/// Gaussians that one task projects.
pub(crate) const CHUNK: usize = 2_048;

/// The splats of some consecutive Gaussians with their composited values, in the cloud's order.
#[derive(Debug, Default)]
pub(crate) struct Chunk<R> {
    /// The Gaussians that reach at least one pixel center.
    pub(crate) splats: Vec<Splat<R>>,
    /// `[splats * channels]`: color, extra channels, depth if asked for, padding zeros.
    pub(crate) values: Vec<R>,
    /// Gaussians left out because their covariance or rotation is degenerate.
    pub(crate) degenerate: usize,
}

/// Cloud to draw, with its settings.
#[derive(Clone, Copy)]
pub(crate) struct DrawInput<'a, R> {
    pub(crate) cloud: &'a GaussianCloud<R>,
    pub(crate) features: Features<'a, R>,
    pub(crate) settings: &'a RenderSettings,
    /// Cut that is drawn instead of the whole cloud.
    pub(crate) cut: Option<&'a Cut<R>>,
}

impl<'a, R: Real> DrawInput<'a, R> {
    /// Number of Gaussians to draw.
    pub(crate) fn len(&self) -> usize {
        self.cut.map_or(self.cloud.len(), Cut::len)
    }

    /// The `k`-th of them: the cloud that it is in, its place there, and the Gaussian of `cloud` that it stands for.
    #[inline(always)]
    pub(crate) fn of(&self, k: usize) -> (&'a GaussianCloud<R>, usize, u32) {
        self.cut.map_or((self.cloud, k, k as u32), |cut| cut.of(self.cloud, k))
    }
}

/// Gaussians in front of the camera, at most [`LANES`], that are projected at once.
pub(crate) struct Group<'a, R> {
    pub(crate) gaussians: [Gaussian<'a, R>; LANES],
    /// Their centers relative to the camera, world axes.
    relative: [Lane<R>; 3],
    /// The Gaussians of the cloud that they stand for.
    pub(crate) stand_for: [u32; LANES],
    pub(crate) len: usize,
}

impl<R: Real> Default for Group<'_, R> {
    fn default() -> Self {
        let zero = R::ZERO;
        let none =
            Gaussian { position: [zero; 3], log_scale: [zero; 3], quaternion: [zero; 4], opacity_logit: zero, sh: &[] };
        Self { gaussians: [none; LANES], relative: [[zero; LANES]; 3], stand_for: [0; LANES], len: 0 }
    }
}

impl<'a, R: Real> Group<'a, R> {
    #[inline(always)]
    pub(crate) fn push(&mut self, gaussian: Gaussian<'a, R>, relative: [R; 3], stands_for: u32) {
        let i = self.len;
        self.gaussians[i] = gaussian;
        for axis in 0..3 {
            self.relative[axis][i] = relative[axis];
        }
        self.stand_for[i] = stands_for;
        self.len += 1;
    }

    #[inline(always)]
    pub(crate) fn get(&self, i: usize) -> Option<&Gaussian<'a, R>> {
        self.gaussians[..self.len].get(i)
    }

    #[inline(always)]
    pub(crate) fn relative<L: Lanes<R>>(&self, l: L) -> [Eight<R, L>; 3] {
        let [x, y, z] = &self.relative;
        [Eight::new(l, l.load(x)), Eight::new(l, l.load(y)), Eight::new(l, l.load(z))]
    }

    /// One number per Gaussian. Unused lanes hold one without meaning.
    #[inline(always)]
    pub(crate) fn each<L: Lanes<R>>(&self, l: L, one: impl Fn(&Gaussian<'a, R>) -> R) -> Eight<R, L> {
        Eight::of(l, |i| one(&self.gaussians[i]))
    }
}
