//! The walk over a tile: the [`Primitive`] that is drawn, its [`Reach`] over the tile's pixels, and the front-to-back
//! loop ([`TileRow::front_to_back`]) that hands weights to a [`Sink`].
//!
//! Pixels are taken in lanes of eight; lane group `g` of row `row` of a tile is its slot `g * TILE_PX + row`.

use super::bin::Tiles;
use super::chunk::{Chunk, Group};
use super::project::{CameraView, Projected, Splat};
use super::project_backward::GaussianGradient;
use super::sort::part_of;
use crate::math::Real;
use crate::math::lanes::{LANES, Lane, LaneOp, Lanes};
use crate::math::prefetch::prefetch;
use crate::render::{Frame, FrameGradient, RenderSettings, TILE_PX};
use crate::scene::Gaussian;

/// Lane groups per tile row.
pub(crate) const GROUPS: usize = TILE_PX / LANES;
/// Lane groups per tile.
pub(crate) const SLOTS: usize = TILE_PX * GROUPS;
/// Splats between two checks of the open pixels.
const CLOSED_CHECK: usize = 16;
/// Splats between fetching one and needing it.
const AHEAD: usize = 6;

/// A few values of one kind.
pub(crate) trait Values<V: Copy>: Copy + AsRef<[V]> + AsMut<[V]> {
    /// The same value everywhere.
    fn all(v: V) -> Self;
}

impl<V: Copy, const N: usize> Values<V> for [V; N] {
    #[inline(always)]
    fn all(v: V) -> Self {
        [v; N]
    }
}

/// Channel planes, and those that only this kind of primitive has.
pub(crate) type Planes<T> = [Vec<T>; 2];

/// Kind of primitive: Gaussians as splats, or surfels. Holds all that the passes over tiles do not share.
pub(crate) trait Primitive<R: Real>: Copy + Send + Sync {
    /// Numbers per splat in front of its channels.
    const SHAPE: usize;
    /// Shape of a splat, [`Self::SHAPE`] numbers.
    type Shape: AsRef<[R]>;
    /// Channels of a splat that depth asks for.
    type Depth: AsRef<[R]>;
    /// Values of a pixel besides its channels, composited where depth is asked for.
    type Extra<V: Copy>: Values<V>;
    /// Inputs of the backward pass per pixel, besides gradients of its channels.
    type State<V: Copy>: Values<V>;
    /// Sums in front of the channels in a tile entry's record.
    type Sums<V: Copy>: Values<V>;
    /// A splat's constants in vector registers.
    type Constants<L: Lanes<R>>;
    /// Contribution of a splat to eight pixels.
    type Hit<L: Lanes<R>>: Copy;

    /// The kind as these settings draw it.
    fn new(view: &CameraView<R>, settings: &RenderSettings) -> Self;
    /// A pixel is closed before its transmittance falls under this.
    fn least_transmittance(settings: &RenderSettings) -> f64;
    /// Number of channels: color, extra channels, and those that depth needs.
    fn channels(extra: usize, depth: bool) -> usize;
    /// The number of channels that the passes are compiled for.
    fn padded(channels: usize) -> usize;
    /// Runs a pass compiled for a padded number of channels.
    fn run<T: RowPass<R>>(channels: usize, pass: T) -> T::Output;
    /// Smallest alpha that counts.
    fn alpha_min(self) -> R;
    /// Gaussians of these opacities in the picture.
    fn project<L: Lanes<R>>(
        self,
        l: L,
        group: &Group<'_, R>,
        opacity: L::V,
        view: &CameraView<R>,
        settings: &RenderSettings,
    ) -> [Projected<R, Self::Shape, Self::Depth>; LANES];
    /// The planes of a frame that are composited, and those of [`Self::Extra`], of which `kept` is for the
    /// backward pass.
    fn planes<'a>(frame: &'a mut Frame<R>, kept: &'a mut [Vec<R>; 3], depth: bool) -> Planes<&'a mut [R]>;
    /// Makes the rest of a frame with depth.
    fn finish(frame: &mut Frame<R>, kept: &[Vec<R>; 3]);
    /// The gradients of the channels, missing or empty ones being 0, and the planes of [`Self::State`] if any
    /// counts.
    fn gradients<'a>(
        gradient: &'a FrameGradient<R>,
        kept: &'a [Vec<R>; 3],
        transmittance: &'a [R],
        extra: usize,
        depth: bool,
    ) -> Planes<&'a [R]>;
    /// From the sum of a splat's records back to the parameters.
    fn project_backward(
        gaussian: &Gaussian<'_, R>,
        splat: &Splat<R>,
        view: &CameraView<R>,
        settings: &RenderSettings,
        record: &[R],
        extra: usize,
    ) -> Option<GaussianGradient<R>>;

    /// The constants of `s`; `dx` are the horizontal offsets of each group's pixel centers from it.
    fn constants<L: Lanes<R>>(self, l: L, s: &Splat<R>, shape: &[R], dx: [L::V; GROUPS]) -> Self::Constants<L>;
    /// Contribution to the pixels of a slot.
    fn hit<L: Lanes<R>>(l: L, constants: &Self::Constants<L>, reach: &Reach<R>, slot: usize) -> Self::Hit<L>;
    /// Alpha, 0 where it does not count.
    fn alpha<L: Lanes<R>>(hit: &Self::Hit<L>) -> L::V;
    /// Adds to the extra values; in the lanes of `crossed` transmittance falls to one half, `place` is the splat's
    /// place in the tile's list, from 1.
    fn gather<L: Lanes<R>>(
        l: L,
        extra: &mut Self::Extra<L::V>,
        hit: &Self::Hit<L>,
        weight: L::V,
        crossed: L::M,
        place: L::V,
    );
    /// Adds the extra values' part to `dL/dweight`.
    fn along<L: Lanes<R>>(l: L, state: &Self::State<L::V>, hit: &Self::Hit<L>, along: L::V) -> L::V;
    /// Adds to the record's sums: `power` is `dL/dalpha` times alpha where alpha depends on anything.
    fn sum<L: Lanes<R>, const STATE: bool>(
        l: L,
        sums: &mut Self::Sums<L::V>,
        constants: &Self::Constants<L>,
        hit: &Self::Hit<L>,
        state: &Self::State<L::V>,
        light: [L::V; 3],
    );
}

/// A pass over a row of tiles, compiled for any number of channels and any vectors.
pub(crate) trait RowPass<R: Real>: Sized {
    type Output;
    fn tiles<L: Lanes<R>, const C: usize>(self, l: L) -> Self::Output;
}

/// A pass with its number of channels.
pub(crate) struct With<T, const C: usize>(pub(crate) T);

impl<R: Real, T: RowPass<R>, const C: usize> LaneOp<R> for With<T, C> {
    type Output = T::Output;
    #[inline(always)]
    fn run<L: Lanes<R>>(self, l: L) -> T::Output {
        self.0.tiles::<L, C>(l)
    }
}

/// Runs `$pass` with as many channels as `$n` is padded to: one of those listed, the last being the most.
macro_rules! with_channels {
    ($n:expr, [$($some:literal)*, $most:expr], $pass:expr) => {
        match $n {
            $($some => R::vectorize(With::<_, $some>($pass)),)*
            _ => R::vectorize(With::<_, { $most }>($pass)),
        }
    };
}
pub(super) use with_channels;

/// The lane groups of one tile that a splat can touch, and the row constants of its quadratic form.
pub(crate) struct Reach<R> {
    /// One bit per slot.
    pub(crate) slots: u32,
    /// Vertical offsets of the rows of pixel centers from the splat's center.
    pub(crate) dy: [R; TILE_PX],
    /// `2 b dy` per row.
    linear: [R; TILE_PX],
    /// `c dy²` per row.
    constant: [R; TILE_PX],
    /// Horizontal offset of the first pixel center from the splat's center.
    left: R,
}

/// Slots of the rows `0..height`.
#[inline(always)]
pub(crate) fn slots_of_rows(height: usize) -> u32 {
    let rows = (1_u32 << height) - 1;
    rows | rows << TILE_PX
}

impl<R: Real> Reach<R> {
    /// The reach of `s` over the tile whose first pixel is `corner`. `ramp` is 0, 1, ... 7.
    #[inline(always)]
    pub(crate) fn new<L: Lanes<R>>(l: L, s: &Splat<R>, corner: [usize; 2], ramp: L::V) -> Self {
        let [a, b, c] = s.conic;
        let left = R::of(corner[0] as f64 + 0.5) - s.mean[0];
        let top = R::of(corner[1] as f64 + 0.5) - s.mean[1];
        let slope = -b / a;
        // A row at dy meets the ellipse for pixels within `half` of `middle`; see `Splats::hit` for the
        // form. A hundredth of a pixel of slack covers rounding: the alpha rule decides anyway.
        let (curve, inverse_a) = (l.splat(c + b * slope), l.splat(R::ONE / a));
        let slack = R::of(0.01);
        let mut reach =
            Self { slots: 0, dy: [R::ZERO; TILE_PX], linear: [R::ZERO; TILE_PX], constant: [R::ZERO; TILE_PX], left };
        for part in 0..GROUPS {
            let dy = l.add(l.splat(top + R::of((part * LANES) as f64)), ramp);
            let square = l.mul(dy, dy);
            let rest = l.sub(l.splat(s.reach), l.mul(curve, square));
            // Outside the ellipse the root is NaN and every comparison false.
            let half = l.add(l.sqrt(l.mul(rest, inverse_a)), l.splat(slack));
            let middle = l.mul_add(l.splat(slope), dy, l.splat(-left));
            let (from, to) = (l.sub(middle, half), l.add(middle, half));
            for g in 0..GROUPS {
                let first = l.splat(R::of((g * LANES) as f64));
                let last = l.splat(R::of((g * LANES + LANES - 1) as f64));
                let touched = l.both(l.ge(last, from), l.ge(to, first));
                reach.slots |= l.bits(touched) << (g * TILE_PX + part * LANES);
            }
            let rows = part * LANES..(part + 1) * LANES;
            reach.dy[rows.clone()].copy_from_slice(&l.store(dy));
            reach.linear[rows.clone()].copy_from_slice(&l.store(l.mul(l.splat(R::of(2.0) * b), dy)));
            reach.constant[rows].copy_from_slice(&l.store(l.mul(l.splat(c), square)));
        }
        reach
    }

    /// Horizontal offsets of each group's pixel centers from the splat's center.
    #[inline(always)]
    pub(crate) fn dx<L: Lanes<R>>(&self, l: L, ramp: L::V) -> [L::V; GROUPS] {
        std::array::from_fn(|g| l.add(ramp, l.splat(self.left + R::of((g * LANES) as f64))))
    }

    /// The part of the quadratic form that is constant along a row: `2 b dy`, `c dy²`.
    #[inline(always)]
    pub(crate) fn row<L: Lanes<R>>(&self, l: L, row: usize) -> [L::V; 2] {
        [l.splat(self.linear[row]), l.splat(self.constant[row])]
    }
}

/// 0, 1, ... 7.
#[inline(always)]
pub(crate) fn ramp<R: Real, L: Lanes<R>>(l: L) -> L::V {
    let lane: Lane<R> = std::array::from_fn(|i| R::of(i as f64));
    l.load(&lane)
}

/// A row of tiles of a frame.
pub(crate) struct TileRow<'a, R, P> {
    pub(crate) primitive: P,
    pub(crate) parts: &'a [Chunk<R>],
    pub(crate) tiles: &'a Tiles,
    /// Picture size in px.
    pub(crate) size: [usize; 2],
    /// Index of the row of tiles.
    pub(crate) ty: usize,
    /// A pixel is closed before its transmittance falls under this.
    pub(crate) least: R,
}

/// A tile: its first pixel, its size in px, and its part of the entries.
pub(crate) struct Tile {
    /// First pixel.
    pub(crate) corner: [usize; 2],
    /// Width and height; less than [`TILE_PX`] at the picture's edges.
    pub(crate) size: [usize; 2],
    pub(crate) entries: std::ops::Range<usize>,
}

impl Tile {
    /// Its lane groups: slot, first place in the planes of a row of tiles, and number of pixels.
    #[inline(always)]
    pub(crate) fn slots(&self, width_px: usize) -> impl Iterator<Item = (usize, usize, usize)> {
        let ([x, _], [width, height]) = (self.corner, self.size);
        (0..height).flat_map(move |row| {
            (0..width.div_ceil(LANES))
                .map(move |g| (g * TILE_PX + row, row * width_px + x + g * LANES, LANES.min(width - g * LANES)))
        })
    }
}

/// Takes the weights of a tile, front to back.
pub(crate) trait Sink<R: Real, P: Primitive<R>, L: Lanes<R>> {
    /// Values of one splat that the sink needs.
    type Own;
    /// The splat `id`, at this place of the tile's list, counted from 1.
    fn own(&self, l: L, id: u32, place: usize) -> Self::Own;
    /// Weight of the splat in the pixels of a slot, and their transmittance before and after it.
    fn add(&mut self, l: L, slot: usize, own: &Self::Own, hit: &P::Hit<L>, light: [L::V; 3]);
}

impl<R: Real, P: Primitive<R>> TileRow<'_, R, P> {
    /// Tile `tx`.
    #[inline(always)]
    pub(crate) fn tile(&self, tx: usize) -> Tile {
        let corner = [tx * TILE_PX, self.ty * TILE_PX];
        let index = self.ty * self.tiles.grid[0] + tx;
        Tile {
            corner,
            size: [0, 1].map(|axis| TILE_PX.min(self.size[axis] - corner[axis])),
            entries: self.tiles.first[index] as usize..self.tiles.first[index + 1] as usize,
        }
    }

    /// The splat at `place`.
    #[inline(always)]
    pub(crate) fn splat(&self, place: u32) -> &Splat<R> {
        let (part, i) = part_of(place);
        &self.parts[part].splats[i]
    }

    /// Its shape and its channels.
    #[inline(always)]
    pub(crate) fn values_of<const C: usize>(&self, place: u32) -> (&[R], &[R]) {
        let (stride, (part, i)) = (P::SHAPE + C, part_of(place));
        self.parts[part].values[i * stride..][..stride].split_at(P::SHAPE)
    }

    /// Prefetches the data of splat `id`.
    #[inline(always)]
    fn fetch<const C: usize>(&self, id: u32) {
        let s = self.splat(id);
        // It may lie in two lines of the cache.
        prefetch(&s.mean);
        prefetch(&s.gaussian);
        prefetch(&self.values_of::<C>(id).1[0]);
    }

    /// Walks over a tile front to back, until every pixel is closed. Returns the transmittance that is left and
    /// the number of lane groups evaluated.
    #[inline(always)]
    pub(crate) fn front_to_back<L: Lanes<R>, S: Sink<R, P, L>, const C: usize>(
        &self,
        l: L,
        tile: &Tile,
        sink: &mut S,
    ) -> ([L::V; SLOTS], u64) {
        let (zero, one) = (l.splat(R::ZERO), l.splat(R::ONE));
        let (least, ramp) = (l.splat(self.least), ramp(l));
        // Light left at each pixel; negative once the pixel is closed, as are those beyond the picture's right
        // edge. Selecting between a new value and the one in memory would become a masked store, whose result
        // the next splat would have to wait for; hence the sign, and `min` below.
        let mut left = [one; SLOTS];
        for (slot, left) in left.iter_mut().enumerate() {
            let beyond = R::of(tile.size[0] as f64 - (slot / TILE_PX * LANES) as f64) - R::ONE;
            *left = l.select(l.ge(l.splat(beyond), ramp), one, l.splat(-R::ONE));
        }
        let all = slots_of_rows(tile.size[1]);
        let mut alive = all;
        let mut groups = 0_u64;
        for (k, entry) in tile.entries.clone().enumerate() {
            if entry + AHEAD < tile.entries.end {
                self.fetch::<C>(self.tiles.splat(entry + AHEAD));
            }
            let id = self.tiles.splat(entry);
            let s = self.splat(id);
            let reach = Reach::new(l, s, tile.corner, ramp);
            let mut slots = reach.slots & alive;
            if slots == 0 {
                continue;
            }
            groups += u64::from(slots.count_ones());
            let constants = self.primitive.constants(l, s, self.values_of::<C>(id).0, reach.dx(l, ramp));
            let own = sink.own(l, id, k + 1);
            while slots != 0 {
                let slot = slots.trailing_zeros() as usize;
                slots &= slots - 1;
                let hit = P::hit(l, &constants, &reach, slot);
                let alpha = P::alpha(&hit);
                let before = left[slot];
                // A pixel stays open while the next splat leaves it enough light.
                let still = l.ge(l.mul(before, l.sub(one, alpha)), least);
                let weight = l.keep(still, l.mul(alpha, before));
                let after = l.sub(before, weight);
                left[slot] = l.select(still, after, l.min(before, l.sub(zero, before)));
                sink.add(l, slot, &own, &hit, [weight, before, after]);
            }
            if k % CLOSED_CHECK == CLOSED_CHECK - 1 {
                alive = (0..SLOTS as u32)
                    .filter(|&slot| all >> slot & 1 == 1 && l.bits(l.ge(left[slot as usize], zero)) != 0)
                    .fold(0, |m, slot| m | 1 << slot);
                if alive == 0 {
                    break;
                }
            }
        }
        (left, groups)
    }
}
